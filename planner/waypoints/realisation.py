"""From the program's answer to an exact motion: each segment by ruckig where that is as short, else its own pieces."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from problems.waypoint_timing import Spline

from ..deadline import Deadline
from ..limits import Limit, magnitude, segment_bounds
from ..timing.state_to_state import Legs, joined, profiles
from ..timing.stops import segment_bounds_of
from ..trajectory import Trajectory
from ..types import PlanRequest
from .mending import MISSED, mended, missed
from .transcription import Case

Array = NDArray[np.float64]

#: A segment by ruckig may take this much longer, relatively, than the program's: rounding at a duration that is asked.
ROUNDING = 1e-9
#: What it may exceed a velocity, acceleration or jerk limit by, and what a position limit, relative to the limit.
BEYOND, OUTSIDE = 1e-12, 1e-9


@dataclass(frozen=True, eq=False)
class Motion:
    """An exact motion from time 0, when it passes the waypoints (N,), and how many segments ruckig timed."""

    trajectory: Trajectory
    times: Array
    by_ruckig: int


def realise(request: PlanRequest, case: Case, nodes: Array, spline: Spline, own: bool, deadline: Deadline) -> Motion:
    """Return the motion through the states that the program found.

    Each segment is timed again by ruckig, in closed form: as short as its end states allow. Where that takes longer
    (they lie at the end of what is feasible), leaves position limits or misses the state, the spline's own pieces stay
    if they keep the limits, which next to states asked they may break by a little.

    Parameters
    ----------
    nodes : (S, D', K + 1)
        Of the spline of the D' moving joints.
    own : bool
        Whether all segments are the spline's own.
    """
    durations, phases = spline.durations, _all_joints(request, case, spline, nodes)
    kept = np.zeros(len(durations), dtype=bool)
    if not own:
        count, dims = request.count - 1, request.dims
        limits = [segment_bounds(request.limits, request.segment_limits, m, count, dims) for m in range(4)]
        legs = _legs(request, case, spline, limits)
        fast, by_ruckig = mended(legs, *profiles(legs, deadline), deadline)
        with np.errstate(invalid="ignore"):  # without an answer, NaN
            shorter = (fast <= durations * (1.0 + ROUNDING)) | ~_within(limits, legs, phases)
            kept = shorter & (missed(legs, by_ruckig) <= MISSED) & _within(limits, legs, by_ruckig)
        size = max(phases.shape[2], by_ruckig.shape[2])
        durations = np.where(kept, fast, durations)
        phases = np.where(kept[:, None, None, None], _padded(by_ruckig, size), _padded(phases, size))
    trajectory, times = joined(durations, phases, request.waypoints[:-1])
    return Motion(trajectory, times, int(kept.sum()))


def _all_joints(request: PlanRequest, case: Case, spline: Spline, nodes: Array) -> Array:
    """Return the pieces of all joints, (S, D, K + 1, 5): those that do not move rest."""
    moving = spline.phases(nodes)
    whole = np.zeros((len(moving), request.dims, *moving.shape[2:]))
    whole[:, :, 0, 0] = spline.durations[:, None]
    whole[:, case.joints] = moving
    return whole


def _padded(phases: Array, size: int) -> Array:
    """Return so many phases of each joint: more of the last, without duration."""
    out = np.empty((*phases.shape[:2], size, 5))
    out[:, :, : phases.shape[2]], out[:, :, phases.shape[2] :] = phases, phases[:, :, -1:]
    return out


def _legs(request: PlanRequest, case: Case, spline: Spline, limits: list[Limit]) -> Legs:
    _, v, a, j = limits
    big = 1e9
    states = np.zeros((2, request.count, request.dims))
    states[0][:, case.joints], states[1][:, case.joints] = spline.velocity, spline.acceleration
    return Legs(
        p0=request.waypoints[:-1],
        v0=states[0, :-1],
        a0=states[1, :-1],
        p1=request.waypoints[1:],
        v1=states[0, 1:],
        a1=states[1, 1:],
        velocity=Limit(np.maximum(v.lower, -big), np.minimum(v.upper, big)),
        acceleration=Limit(np.maximum(a.lower, -big), np.minimum(a.upper, big)),
        jerk=np.minimum(-j.lower, j.upper),
        least=segment_bounds_of(request)[0],
    )


def _within(limits: list[Limit], legs: Legs, phases: Array) -> NDArray[np.bool_]:
    """Return where the limits are kept, (S,)."""
    from ..kernels.phases import extremes

    lower, upper = (np.stack([getattr(x, side) for x in limits]) for side in ("lower", "upper"))
    low, high = extremes(phases)
    low[0] += legs.p0
    high[0] += legs.p0
    room = magnitude(lower, upper) * np.array([OUTSIDE, BEYOND, BEYOND, BEYOND])[:, None, None]
    return np.asarray(((low >= lower - room) & (high <= upper + room)).all(axis=(0, 2)))
