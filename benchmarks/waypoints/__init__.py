"""``time_optimal_waypoints``: how good, how fast beside copp-py, toppra and IPOPT, how it grows, on random problems.

``rows`` is what a line says, ``problems`` what is asked, ``peers`` how toppra and copp-py are called; a part is a file
with ``measure(quick)``; ``tables`` is the section of the report.
"""

from .rows import Line


def measure(quick: bool = False, only: str = "") -> list[Line]:
    """Return all lines; ``only`` of the parts with this in their name."""
    from . import growth, program, quality, random_problems, speed

    parts = {"quality": quality, "speed": speed, "program": program, "growth": growth, "random": random_problems}
    return [row for name, part in parts.items() if only in f"waypoints, {name}" for row in part.measure(quick)]
