"""Method ``ruckig``."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from problems.rest_to_rest import double_integrator, triple_integrator

from ..deadline import Deadline
from ..errors import Infeasible, SolverFailed, Unsupported
from ..limits import Boundary, Limit, segment_bounds
from ..method import Capabilities, Method, Reference
from ..options import Options
from ..timing.state_to_state import Segment, refuse_overshoot, time_optimal
from ..timing.stops import refuse_longer, segment_durations, stops_bound
from ..trajectory import Trajectory
from ..types import Bound, Note, PlanRequest, Solution, Stats

Array = NDArray[np.float64]


class RuckigOptions(Options):
    """The ruckig library has no options here: time-synchronised, position control."""


def solve(request: PlanRequest, options: RuckigOptions) -> Solution:
    """Return time-optimal segments from waypoint to waypoint, at rest in between."""
    segments, deadline, parts = _segments(request), Deadline(request.timeout), []
    for i, segment in enumerate(segments):
        deadline.left()
        parts.append(_shortest(segment, i))
    durations = segment_durations(np.array([p.duration for p in parts]), request)
    for i, (segment, part, duration) in enumerate(zip(segments, parts, durations, strict=True)):
        if duration <= part.duration * (1.0 + 1e-12):
            continue
        if _still(segment):
            parts[i] = Trajectory.hold(segment.p0, 0.0, duration)
        elif segment.rests:
            parts[i] = part.scaled(duration / part.duration)
        else:
            parts[i] = _shortest(replace(segment, least=duration), i)
    refuse_longer(np.array([p.duration for p in parts]), durations, request)
    times = np.concatenate([[0.0], np.cumsum([p.duration for p in parts])])
    kept = [p.shifted(t) for p, t in zip(parts, times, strict=False) if p.duration > 0]
    trajectory = Trajectory.concatenate(kept)
    for i, (segment, part) in enumerate(zip(segments, parts, strict=True)):
        refuse_overshoot(segment, part, i)
    notes: tuple[Note, ...] = ()
    if _two_sided_jerk(request):
        notes = (Note("jerk_symmetric", "ruckig takes one jerk limit per joint: the smaller side was used for both"),)
    return Solution(trajectory, times, Stats("ruckig"), bound=_bound(segments, request), notes=notes)


def _segments(request: PlanRequest) -> list[Segment]:
    count, dims = request.count - 1, request.dims
    limits = [segment_bounds(request.limits, request.segment_limits, m, count, dims) for m in (1, 2, 3)]
    jerk = np.minimum(limits[2].upper, -limits[2].lower)
    loose = [Limit(np.nan_to_num(b.lower, neginf=-1e9), np.nan_to_num(b.upper, posinf=1e9)) for b in limits[:2]]
    zero = np.zeros(dims)

    def state(boundary: Boundary, name: str) -> Array:
        value = getattr(boundary, name)
        return zero if value is None else np.nan_to_num(value)

    return [
        Segment(
            p0=request.waypoints[i],
            v0=state(request.start, "velocity") if i == 0 else zero,
            a0=state(request.start, "acceleration") if i == 0 else zero,
            p1=request.waypoints[i + 1],
            v1=state(request.end, "velocity") if i == count - 1 else zero,
            a1=state(request.end, "acceleration") if i == count - 1 else zero,
            velocity=Limit(loose[0].lower[i], loose[0].upper[i]),
            acceleration=Limit(loose[1].lower[i], loose[1].upper[i]),
            jerk=jerk[i],
        )
        for i in range(count)
    ]


def _two_sided_jerk(request: PlanRequest) -> bool:
    jerk = segment_bounds(request.limits, request.segment_limits, 3, request.count - 1, request.dims)
    return bool((jerk.lower != -jerk.upper).any())


def _still(segment: Segment) -> bool:
    return segment.rests and not (segment.p1 - segment.p0).any()


def _shortest(segment: Segment, index: int) -> Trajectory:
    if _still(segment):
        return Trajectory.hold(segment.p0, 0.0, 0.0)
    try:
        return time_optimal(segment)
    except SolverFailed as error:
        if segment.rests:  # mixes of scales that ruckig does not take
            reason = f"ruckig finds no motion on segment {index}: {error.status}"
            raise Unsupported("ruckig", "limits", ["trapezoidal", "time_optimal_nlp"], reason) from None
        raise Infeasible(
            f"ruckig finds no motion within the limits from or to the state asked at the end of segment {index}",
            segment=index,
        ) from None


def _bound(segments: list[Segment], request: PlanRequest) -> Bound | None:
    """Return the closed-form bound for stops at all waypoints, where the limits are symmetric and the ends at rest."""
    symmetric = all(
        (s.velocity.lower == -s.velocity.upper).all() and (s.acceleration.lower == -s.acceleration.upper).all()
        for s in segments
    )
    if not symmetric or not all(s.rests for s in segments) or _two_sided_jerk(request):
        return None
    move = np.stack([np.abs(s.p1 - s.p0) for s in segments])
    v, a = np.stack([s.velocity.upper for s in segments]), np.stack([s.acceleration.upper for s in segments])
    j = np.stack([s.jerk for s in segments])
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
