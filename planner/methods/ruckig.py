"""Method ``ruckig``."""

import numpy as np
from numpy.typing import NDArray

from problems.rest_to_rest import double_integrator, triple_integrator

from ..deadline import Deadline
from ..errors import SolverFailed, Unsupported
from ..method import Capabilities, Method, Reference
from ..options import Options
from ..timing.state_to_state import Legs
from ..timing.stop_plan import stop_plan, two_sided_jerk
from ..timing.stops import stops_bound
from ..types import Bound, Note, PlanRequest, Solution, Stats

Array = NDArray[np.float64]


class RuckigOptions(Options):
    """The ruckig library has no options here: time-synchronised, position control."""


def solve(request: PlanRequest, options: RuckigOptions) -> Solution:
    """Return time-optimal segments from waypoint to waypoint, at rest in between."""
    try:
        made = stop_plan(request, Deadline(request.timeout))
    except SolverFailed as error:  # mixes of scales that ruckig does not take
        raise Unsupported("ruckig", "limits", ["trapezoidal", "time_optimal_nlp"], str(error)) from None
    notes: tuple[Note, ...] = ()
    if two_sided_jerk(request):
        notes = (Note("jerk_symmetric", "ruckig takes one jerk limit per joint: the smaller side was used for both"),)
    return Solution(made.trajectory, made.times, Stats("ruckig"), bound=_bound(made.legs, request), notes=notes)


def _bound(legs: Legs, request: PlanRequest) -> Bound | None:
    """Return the closed-form bound for stops at all waypoints, where the limits are symmetric and the ends at rest."""
    symmetric = all((limit.lower == -limit.upper).all() for limit in (legs.velocity, legs.acceleration))
    if not symmetric or not legs.rests.all() or two_sided_jerk(request):
        return None
    move, v, a, j = np.abs(legs.p1 - legs.p0), legs.velocity.upper, legs.acceleration.upper, legs.jerk
    limited = np.isfinite(j)
    jerk_limited = triple_integrator(move, v, a, np.where(limited, j, 1.0))
    return stops_bound(np.where(limited, jerk_limited, double_integrator(move, v, a, a)), request)


RUCKIG = Method(
    id="ruckig",
    title="Ruckig",
    solve=solve,
    options=RuckigOptions,
    family="time_optimal",
    summary="Jerk-limited time-optimal motion by the ruckig library, with a stop at every waypoint.",
    formula="min T  s.t.  |v| <= v_max, |a| <= a_max, |j| <= j_max, per joint; all joints arrive together",
    reference=Reference(
        "L. Berscheid and T. Kröger",
        "Jerk-limited real-time trajectory generation with arbitrary target states",
        2021,
        "https://doi.org/10.15607/RSS.2021.XVII.015",
    ),
    capabilities=lambda options: Capabilities(
        "chosen",
        1,
        requires=frozenset({"velocity", "acceleration"}),
        honours=frozenset({"velocity", "acceleration", "jerk", "segment_limits", "segment_durations", "duration"}),
        start=frozenset({"velocity", "acceleration"}),
        end=frozenset({"velocity", "acceleration"}),
        with_jerk=frozenset({"acceleration"}),
    ),
    objective="duration",
)
