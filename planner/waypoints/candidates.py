"""Candidates: exact motions that keep everything asked, from the program's answer or with stops."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from problems.waypoint_timing import WaypointTiming

from ..deadline import Deadline
from ..errors import Infeasible, SolverFailed
from ..limits import magnitude, segment_bounds
from ..timing.stop_plan import stop_plan
from ..timing.stops import segment_bounds_of
from ..trajectory import Trajectory
from ..types import Note, PlanRequest, Stats
from .program import Found
from .realisation import realise
from .transcription import Case, asked_states

Array = NDArray[np.float64]

#: Limits are kept to this, relatively, or a motion is no candidate.
KEPT = 1e-9


@dataclass(frozen=True, eq=False)
class Answer:
    """An exact motion that keeps everything asked, when it passes the waypoints (N,), and what found it.

    ``program``: the one that the shortest motion came from; None where stops were as short.
    """

    trajectory: Trajectory
    times: Array
    stats: Stats
    program: "Program | None" = None
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True, eq=False)
class Program:
    """A program and its answer."""

    problem: WaypointTiming
    found: Found


def exact(
    request: PlanRequest, case: Case, problem: WaypointTiming, found: Found, deadline: Deadline, own: bool = False
) -> Answer | None:
    """Return the exact motion behind a program's answer, None if even its own pieces do not keep what is asked."""
    if not np.isfinite(found.spline.control).all():
        return None
    for as_it_is in (True,) if own else (False, True):
        motion = realise(request, case, problem.nodes, found.spline, as_it_is, deadline)
        if keeps(request, motion.trajectory, motion.times):
            return Answer(motion.trajectory, motion.times, Stats("interior_point", iterations=found.iterations))
    return None


def stopping(request: PlanRequest, deadline: Deadline) -> Answer | None:
    """Return the plan that stops at every waypoint, None where there is none or it does not keep what is asked."""
    try:
        made = stop_plan(replace(request, duration=None), deadline)
    except (Infeasible, SolverFailed):
        return None
    if not keeps(request, made.trajectory, made.times):
        return None
    for order, asked in enumerate(asked_states(request), 1):
        off = np.abs(made.trajectory(made.times, order) - asked)[1:-1]
        if (np.nan_to_num(off) > KEPT * np.maximum(1.0, np.abs(np.nan_to_num(asked[1:-1])))).any():
            return None
    return Answer(made.trajectory, made.times, Stats("stop_plan"))


def keeps(request: PlanRequest, trajectory: Trajectory, times: Array) -> bool:
    """Return whether the motion is smooth, and limits on all segments and bounds of their durations are kept."""
    least, most = segment_bounds_of(request)
    steps = np.diff(times)
    if (steps < least * (1.0 - KEPT)).any() or (steps > most * (1.0 + KEPT)).any():
        return False
    count, dims = request.count - 1, request.dims
    segment = np.clip(np.searchsorted(times, trajectory.breaks[:-1], side="right") - 1, 0, count - 1)
    found = trajectory.extrema(4)
    for order in range(4):
        if order == 0 and request.limits.position is None and request.segment_limits is None:
            continue
        limit = segment_bounds(request.limits, request.segment_limits, order, count, dims)
        low, high = limit.lower[segment], limit.upper[segment]
        over = np.maximum(found.high[order] - high, low - found.low[order])
        if not (over <= KEPT * magnitude(low, high)).all():
            return False
        if order in (1, 2) and not (np.abs(trajectory.jumps(order)) <= KEPT * found.peak(order)).all():
            return False  # segments so short that the program's positions cannot tell accelerations
    return True
