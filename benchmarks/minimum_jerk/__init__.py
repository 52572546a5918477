"""Minimum jerk beside its peers: without limits, within limits, with free times; and how time grows with the waypoints.

``rounds`` is the common measure; a part is a file with ``measure(quick)``; ``growth`` draws.
"""

from .rounds import Standing


def measure(quick: bool = False, only: str = "") -> list[Standing]:
    """Return all standings; ``only`` of the parts with this in their name."""
    from . import free_times, unlimited, within_limits

    parts = {"minimum_jerk": unlimited, "minimum_jerk, limits": within_limits, "minimum_jerk, times": free_times}
    return [row for name, part in parts.items() if only in name for row in part.measure(quick)]
