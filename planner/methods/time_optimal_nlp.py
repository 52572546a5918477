"""Method ``time_optimal_nlp``."""

from dataclasses import replace

from pydantic import Field

from ..deadline import Deadline
from ..errors import SolverFailed, Unsupported
from ..method import Capabilities, Method, Reference
from ..paths import PathOptions, build_path
from ..timing.course import Course
from ..timing.following import Timed, Units, cut_at_corners, follow, time_each
from ..timing.grids import initial_grid, refined
from ..timing.nlp_law import nlp_law
from ..timing.scaling import local_factors
from ..types import PlanRequest, Solution

#: Refinement ends when slowing by this much is all that is left to do, or at so many stations.
GOOD = 1.002
MOST = 1000
ROUNDS = 5


class TimeOptimalNlpOptions(PathOptions):
    """Options of the time-optimal nonlinear program."""

    stations: int | None = Field(
        default=None,
        ge=10,
        le=2000,
        description="fixed number of stations (default: about 200, with jerk 100, refined)",
    )


def solve(request: PlanRequest, options: TimeOptimalNlpOptions) -> Solution:
    """Return the path with the law that CasADi and IPOPT find, slowed until the exact extrema keep the limits."""
    deadline = Deadline(request.timeout)
    path = build_path(options.path, request.waypoints)

    def timed(course: Course) -> Timed:
        stretch, units = course.curve, Units.of(course.curve, request.limits)
        first = 200 if request.limits.jerk is None else 100
        grid = initial_grid(stretch, options.stations or max(first, 12 * stretch.pieces))
        best = nlp_law(stretch, request.limits, units, grid, deadline.left())
        for _ in range(0 if options.stations else ROUNDS - 1):
            factors = local_factors(stretch.compose(best.law), request.limits)
            if factors.max() <= GOOD or len(grid) > MOST or len(factors) != len(grid) - 1:
                break
            grid = refined(grid, factors > 1.0 + 0.25 * (GOOD - 1.0))
            again = nlp_law(stretch, request.limits, units, grid, deadline.left())
            best = replace(again, seconds=best.seconds + again.seconds)
        return best

    try:
        each = cut_at_corners(path, request)
        return follow(path, request, each, time_each(each, timed), "ipopt")
    except SolverFailed as error:
        reason = f"the nonlinear program has no usable answer on this path: {error}"
        raise Unsupported("time_optimal_nlp", "path", ["toppra", "trapezoidal"], reason) from None


TIME_OPTIMAL_NLP = Method(
    id="time_optimal_nlp",
    title="Time-optimal path timing as a nonlinear program",
    solve=solve,
    options=TimeOptimalNlpOptions,
    family="time_optimal",
    summary="Path timing under velocity, acceleration and jerk limits by CasADi and IPOPT: a slow reference.",
    formula="min Σ Δt_i  s.t.  |q' ṡ| <= v,  |q'' ṡ² + q' s̈| <= a,  |q''' ṡ³ + 3 q'' ṡ s̈ + q' s⃛| <= j",
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
        honours=frozenset({"position", "velocity", "acceleration", "jerk", "duration"}),
        rests=frozenset({"velocity", "acceleration"}),
        with_jerk=frozenset({"acceleration"}),
    ),
    path="fixed",
    objective="duration",
)
