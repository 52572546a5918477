"""Method ``time_optimal_waypoints``."""

from typing import Any, Literal

from pydantic import Field

from ..deadline import Deadline
from ..method import Capabilities, Method, Reference
from ..options import Options
from ..types import PlanRequest, Solution
from ..waypoints.admissible import refuse_inadmissible
from ..waypoints.duration_bound import closer, duration_bound, floor_of
from ..waypoints.fastest import fastest
from ..waypoints.lagrangian import priced
from ..waypoints.straight import along_lines

#: Pieces of constant jerk a segment: more come closer to the optimum, and take longer.
PIECES = {"fast": (8,), "default": (12,), "best": (12, 32)}


class TimeOptimalWaypointsOptions(Options):
    """Options of the fastest motion through waypoints."""

    effort: Literal["fast", "default", "best"] = Field(
        default="default",
        description="how close to the optimum: mostly within 0.1 %, 0.03 % and 0.01 %, at 0.7, 1 and 3 times the work",
    )
    smoothness: float = Field(
        default=0.0,
        ge=0,
        le=10,
        allow_inf_nan=False,
        description="share of the shortest duration that is added and spent on the least squared jerk, each joint's "
        "relative to its limit",
    )
    straight: bool = Field(
        default=False,
        description="keep to the straight lines between the waypoints, exactly: slower, with a stop at each corner",
    )


def solve(request: PlanRequest, options: TimeOptimalWaypointsOptions) -> Solution:
    """Return the fastest motion through the waypoints, the path between them free."""
    deadline = Deadline(request.timeout)
    refuse_inadmissible(request)
    pieces = PIECES[options.effort]
    if options.straight:
        return along_lines(request, pieces, options.smoothness, deadline)
    answer = fastest(request, pieces, options.smoothness, deadline)
    bound = duration_bound(request)
    if request.bound and answer.program is not None:
        bound = closer(
            bound,
            priced(answer.program.problem, answer.program.found, floor_of(request), deadline),
            answer.trajectory.duration,
        )
    return Solution(answer.trajectory, answer.times, answer.stats, bound=bound, notes=answer.notes, polyline=True)


def _capabilities(options: Any) -> Capabilities:
    limits = {"position", "velocity", "acceleration", "jerk", "segment_limits", "segment_durations", "duration"}
    return Capabilities(
        "chosen",
        2,
        requires=frozenset({"velocity", "acceleration", "jerk"}),
        honours=frozenset(limits if options.straight else limits | {"waypoint_states"}),
        start=frozenset({"velocity", "acceleration"}),
        end=frozenset({"velocity", "acceleration"}),
    )


TIME_OPTIMAL_WAYPOINTS = Method(
    id="time_optimal_waypoints",
    title="Time-optimal through waypoints",
    solve=solve,
    options=TimeOptimalWaypointsOptions,
    family="time_optimal",
    summary="The fastest jerk-limited motion through the waypoints without stopping; the path between them is free.",
    formula="min T  s.t.  q(t_i) = q_i,  v- <= q' <= v+,  a- <= q'' <= a+,  j- <= q''' <= j+,  p- <= q <= p+",
    reference=Reference(
        "L. Berscheid and T. Kröger",
        "Jerk-limited real-time trajectory generation with arbitrary target states",
        2021,
        "https://doi.org/10.15607/RSS.2021.XVII.015",
    ),
    capabilities=_capabilities,
    objective="duration",
    variants=({"straight": True},),
)
