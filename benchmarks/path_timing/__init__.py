"""``time_optimal_path`` beside toppra, copp-py and IPOPT: on given stations, from a request to samples, with jerk.

``rows`` is what a line says, ``problems`` what is solved, ``peers`` how toppra and copp-py are called; a part is a file
with ``measure(quick)``; ``tables`` is the section of the report.
"""

from .rows import Timing


def measure(quick: bool = False, only: str = "") -> list[Timing]:
    """Return all lines; ``only`` of the parts with this in their name."""
    from . import end_to_end, first_call, given_stations, quality, with_jerk

    parts = {"stations": given_stations, "samples": end_to_end, "jerk": with_jerk, "start": first_call}
    parts["quality"] = quality
    return [row for name, part in parts.items() if only in f"path timing, {name}" for row in part.measure(quick)]
