"""Method ``toppra``."""

import time

import numpy as np
from pydantic import Field

from ..deadline import Deadline
from ..errors import SolverFailed, Unsupported
from ..limits import Limits
from ..method import Capabilities, Method, Reference
from ..paths import PathOptions, build_path
from ..timing.following import Timed, Units, cut_at_corners, follow, in_a_row, split, time_each
from ..timing.grids import constant_acceleration_law, initial_grid, refined
from ..timing.scaling import local_factors
from ..timing.toppra_speeds import toppra_speeds
from ..trajectory import Trajectory
from ..types import Note, PlanRequest, Solution

#: Refinement ends when slowing by this much is all that is left to do, or at so many stations.
GOOD = 1.001
MOST = 6000
ROUNDS = 5


class ToppraOptions(PathOptions):
    """Options of TOPP-RA on a path."""

    stations: int | None = Field(
        default=None,
        ge=10,
        le=20_000,
        description="fixed number of stations (default: about 300, refined where needed)",
    )


def solve(request: PlanRequest, options: ToppraOptions) -> Solution:
    """Return the path at TOPP-RA's speeds, as exact pieces, slowed until the exact extrema keep the limits."""
    deadline = Deadline(request.timeout)
    path = build_path(options.path, request.waypoints)

    def timed(stretch: Trajectory) -> Timed:
        try:
            return _refined(stretch, Units.of(stretch, request.limits), request.limits, options.stations, deadline)
        except SolverFailed as error:
            if stretch.pieces == 1:
                reason = f"the toppra library fails on this path: {error.status}"
                raise Unsupported("toppra", "path", ["time_optimal_nlp", "trapezoidal"], reason) from None
        shortest = int(np.argmin(np.diff(stretch.breaks)))  # where it is, speeds differ most from those elsewhere
        parts = split(stretch, stretch.breaks[1:-1][[k in (shortest - 1, shortest) for k in range(stretch.pieces - 1)]])
        each = [timed(part) for part in parts]
        message = "toppra fails on the path as a whole: the motion stops at both ends of its shortest piece"
        return Timed(in_a_row([e.law for e in each]), sum(e.seconds for e in each), (Note("stops_added", message),))

    each = cut_at_corners(path, request)
    return follow(path, request, each, time_each(each, lambda course: timed(course.curve)), "toppra")


def _refined(stretch: Trajectory, units: Units, limits: Limits, stations: int | None, deadline: Deadline) -> Timed:
    """Return the law on a grid that is halved where the limits are broken between the stations."""
    grid = initial_grid(stretch, stations or max(300, 20 * stretch.pieces))
    law, failure, spent = None, None, 0.0
    for _ in range(1 if stations else ROUNDS):
        deadline.left()
        started = time.perf_counter()
        try:
            law = constant_acceleration_law(grid, toppra_speeds(stretch, limits, units, grid))
        except SolverFailed as error:  # other stations often help
            failure = error
            grid = refined(grid, np.ones(len(grid) - 1, dtype=bool))
            continue
        finally:
            spent += time.perf_counter() - started
        factors = local_factors(stretch.compose(law), limits)
        if factors.max() <= GOOD or len(grid) > MOST or len(factors) != len(grid) - 1:
            break
        grid = refined(grid, factors > 1.0 + 0.25 * (GOOD - 1.0))
    if law is None:
        raise failure or SolverFailed("toppra", "no parameterisation found")
    return Timed(law, spent)


TOPPRA = Method(
    id="toppra",
    title="TOPP-RA",
    solve=solve,
    options=ToppraOptions,
    family="time_optimal",
    summary="The toppra library's speeds along a fixed path, as exact pieces instead of its spline refit.",
    formula="max sdot(s)  s.t.  lower <= q' sdot <= upper,  lower <= q'' sdot² + q' sddot <= upper",
    reference=Reference(
        "H. Pham and Q.-C. Pham",
        "A new approach to time-optimal path parameterization based on reachability analysis",
        2018,
        "https://doi.org/10.1109/TRO.2018.2819195",
    ),
    capabilities=lambda options: Capabilities(
        "chosen",
        1,
        requires=frozenset({"acceleration"}),
        honours=frozenset({"position", "velocity", "acceleration", "duration"}),
        rests=frozenset({"velocity"}),
    ),
    path="fixed",
    objective="duration",
)
