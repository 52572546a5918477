"""What a line says."""

from dataclasses import dataclass
from typing import Any

from planner import Certificate, Plan


@dataclass(frozen=True)
class Line:
    """One line: an entry on a problem, or a ``figure`` of ours that has a goal of its own.

    ``ratio`` is, for a peer, its time over ours, median over the rounds of both; the ``goal`` is the least it should
    be, for a figure the most. ``over`` is the duration over that of our first entry, in the part on quality over the
    best known, less one; ``over_pro`` over Ruckig Pro's, ``gap`` over the lower bound that is proved; ``stops`` the
    duration with stops at all waypoints. ``beyond`` is how far a limit is exceeded, relative to it, ``strict`` the
    duration when slowed until none is; ``missed`` the distance from the farthest waypoint to the motion when it is to
    pass it, ``deviation`` that of the motion from the polyline.
    """

    part: str
    problem: str
    joints: int
    waypoints: int
    entry: str
    ms: float | None = None
    ratio: float | None = None
    goal: float | None = None
    figure: bool = False
    duration: float | None = None
    strict: float | None = None
    over: float | None = None
    stops: float | None = None
    over_pro: float | None = None
    gap: float | None = None
    beyond: float | None = None
    missed: float | None = None
    deviation: float | None = None
    iterations: int | None = None
    told: str = ""
    rounds: int = 0

    @property
    def over_stops(self) -> float | None:
        """The duration over that with stops, less one."""
        return None if self.duration is None or self.stops is None else self.duration / self.stops - 1.0

    @property
    def met(self) -> bool | None:
        """Whether the goal is reached; None without a goal."""
        if self.goal is None or self.ratio is None:
            return None
        return self.ratio <= self.goal if self.figure else self.ratio >= self.goal


def of_plan(done: Plan) -> dict[str, Any]:
    """Return what a line says of a plan of ours."""
    judged = done.certificate
    return {
        "duration": done.trajectory.duration,
        "gap": judged.objective.gap if judged.objective else None,
        "beyond": excess(judged),
        "missed": judged.waypoint_error,
        "deviation": judged.path_deviation,
        "iterations": done.stats.iterations,
    }


def excess(judged: Certificate) -> float:
    """Return how far the most exceeded limit is exceeded, relative to it; below zero if none is."""
    return max((c.ratio for c in judged.checks if c.ratio is not None), default=0.0) - 1.0


def remarks(done: Plan, usual: str = "interior_point") -> str:
    """Return in a few words what is unusual about a plan of ours."""
    kept = [] if done.certificate.holds else ["**does not hold**"]
    return "; ".join([*([] if done.stats.name == usual else [done.stats.name]), *(n.code for n in done.notes), *kept])
