"""Method ``time_optimal_path``."""

from pydantic import Field

from ..deadline import Deadline
from ..method import Capabilities, Method, Reference
from ..paths import PathOptions, build_path
from ..timing import second_order
from ..timing.ends import path_state
from ..timing.fastest import best_law
from ..timing.following import cut_at_corners, follow
from ..types import PlanRequest, Solution


class TimeOptimalPathOptions(PathOptions):
    """Options of the time-optimal law on a path."""

    stations: int | None = Field(
        default=None,
        ge=10,
        le=1_000_000,
        description="fixed number of stations (default: as many as are needed to lose less than 0.1 %)",
    )


def solve(request: PlanRequest, options: TimeOptimalPathOptions) -> Solution:
    """Return the path run through as fast as the limits allow."""
    deadline = Deadline(request.timeout)
    path = build_path(options.path, request.waypoints)
    start, end = (path_state(path.curve, getattr(request, side), side) for side in ("start", "end"))
    courses = cut_at_corners(path, request, start, end)
    answers = [best_law(c, options.stations, 0.0, deadline) if c.moves else None for c in courses]
    return follow(path, request, courses, [a and a.timed for a in answers], "passes")


TIME_OPTIMAL_PATH = Method(
    id="time_optimal_path",
    title="Time-optimal path timing",
    solve=solve,
    options=TimeOptimalPathOptions,
    family="time_optimal",
    summary="The fastest law along a fixed path under velocity, acceleration and jerk limits, kept at all times.",
    formula="min ∫ ds/ṡ  s.t.  |q' ṡ| <= v,  |q'' ṡ² + q' s̈| <= a,  |q''' ṡ³ + 3 q'' ṡ s̈ + q' s⃛| <= j",
    reference=Reference(
        "D. Verscheure, B. Demeulenaere, J. Swevers, J. De Schutter and M. Diehl",
        "Time-optimal path tracking for robots: a convex optimization approach",
        2009,
        "https://doi.org/10.1109/TAC.2009.2028959",
    ),
    capabilities=lambda options: Capabilities(
        "chosen",
        1,
        requires=frozenset({"acceleration"}),
        honours=frozenset({"position", "velocity", "acceleration", "jerk", "velocity_norm", "segment_limits", "duration"}),
        start=frozenset({"velocity", "acceleration"}),
        end=frozenset({"velocity", "acceleration"}),
        with_jerk=frozenset({"acceleration"}),
    ),
    path="fixed",
    objective="duration",
)
