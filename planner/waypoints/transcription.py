"""From a request to the program's data: the joints that move, their limits on every segment, the states asked."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from problems.waypoint_timing import WaypointTiming

from ..limits import magnitude, segment_bounds
from ..timing.stops import segment_bounds_of
from ..types import PlanRequest
from .first_guess import nodes_of

Array = NDArray[np.float64]

#: A waypoint this near a position limit, relative to it, is on it; limits are widened by as much.
TOUCHING = 1e-10
#: No joint needs a velocity, acceleration or jerk this many times the largest that stops at all waypoints would take
#: on average; looser limits are cut down to that, for the sake of units.
USEFUL = 1e4


@dataclass(frozen=True, eq=False)
class Case:
    """A request's moving joints (indices) and everything asked of them; ``ramps`` (2, D): see ``nodes_of``."""

    joints: NDArray[np.int64]
    problem: WaypointTiming
    ramps: Array

    def with_pieces(self, pieces: int, durations: Array) -> WaypointTiming:
        """Return the program with so many pieces a segment, for durations (S,) about these, s."""
        return replace(self.problem, nodes=nodes_of(pieces, durations, self.ramps))


def transcribe(request: PlanRequest, stops: Array, eased: float = 0.0) -> Case:
    """Return the program's data; ``stops`` (S,): about how long the segments take with stops, s.

    ``eased``: by how much, relatively, limits next to states asked that move are loosened: these may use them up.
    """
    count, dims = request.count - 1, request.dims
    velocity, acceleration = asked_states(request)
    moving = np.ptp(request.waypoints, axis=0) > 0
    for asked in (velocity, acceleration):
        moving |= (np.nan_to_num(asked) != 0.0).any(axis=0)
    joints = np.flatnonzero(moving)
    limits = [segment_bounds(request.limits, request.segment_limits, m, count, dims) for m in range(4)]
    lower, upper = (np.stack([getattr(x, side)[:, joints] for x in limits]) for side in ("lower", "upper"))
    points, velocity, acceleration = request.waypoints[:, joints], velocity[:, joints], acceleration[:, joints]
    least, most = segment_bounds_of(request)
    shortest = stops[stops > 0].min() if (stops > 0).any() else 1.0
    rate = (np.abs(np.diff(points, axis=0)) / np.where(stops > 0, stops, shortest)[:, None]).max(axis=0)
    rate = np.maximum(rate, np.nan_to_num(np.abs(velocity)).max(axis=0))
    for order in (1, 2, 3):
        push = 0.0 if order == 1 else np.nan_to_num(np.abs(acceleration)).max(axis=0) / shortest ** (order - 2)
        cap = USEFUL * np.maximum(rate / shortest ** (order - 1), push)
        lower[order], upper[order] = np.maximum(lower[order], -cap), np.minimum(upper[order], cap)
    _widen(points, lower[0], upper[0], velocity)
    _pass_peaks(lower, upper, velocity, acceleration)
    if eased:
        _ease(lower, upper, velocity, acceleration, eased)
    jerk = np.minimum(-lower[3], upper[3])
    ramps = np.full((2, len(joints)), np.nan)
    for k, index in ((0, 0), (1, -1)):
        moves = (velocity[index] != 0.0) | (acceleration[index] != 0.0)
        ramps[k, moves] = np.abs(acceleration[index, moves]) / jerk[index, moves]
    problem = WaypointTiming(
        points, np.empty((count, len(joints), 0)), lower, upper, velocity, acceleration, least, most
    )
    return Case(joints, problem, ramps)


def _widen(points: Array, lower: Array, upper: Array, velocity: Array) -> None:
    """Give position limits that waypoints touch the room that an interior point needs, in place.

    A joint passes a waypoint on its limit at rest: elsewhere nothing would be left between the limit and the motion.
    """
    at_lower, at_upper = (np.zeros((2, *points.shape), dtype=bool) for _ in range(2))
    room = TOUCHING * magnitude(lower, upper)
    for k, rows in enumerate((slice(None, -1), slice(1, None))):
        at_lower[k, rows], at_upper[k, rows] = points[rows] <= lower + room, points[rows] >= upper - room
    rest = (at_lower.all(axis=0) | at_upper.all(axis=0)) & np.isnan(velocity)
    velocity[rest] = 0.0
    lower -= room
    upper += room


def _pass_peaks(lower: Array, upper: Array, velocity: Array, acceleration: Array) -> None:
    """Let free accelerations be zero where the velocity asked is at its limit: it can only be passing its peak."""
    with np.errstate(invalid="ignore"):
        for rows in (slice(None, -1), slice(1, None)):
            v = velocity[rows]
            peak = (v >= upper[1] * (1.0 - TOUCHING)) | (v <= lower[1] * (1.0 - TOUCHING))
            acceleration[rows] = np.where(peak & np.isnan(acceleration[rows]), 0.0, acceleration[rows])


def _ease(lower: Array, upper: Array, velocity: Array, acceleration: Array, eased: float) -> None:
    """Loosen limits next to states asked that move, in place; motions are checked exactly."""
    asked = (np.nan_to_num(velocity) != 0.0) | (np.nan_to_num(acceleration) != 0.0)
    factor = 1.0 + eased * (asked[:-1] | asked[1:])
    lower[1:] *= factor
    upper[1:] *= factor


def asked_states(request: PlanRequest) -> tuple[Array, Array]:
    """Return velocities and accelerations asked at the waypoints, (N, D) each: NaN where free, zero at the ends."""
    found = []
    for name in ("velocity", "acceleration"):
        asked = np.full(request.waypoints.shape, np.nan)
        if request.waypoint_states is not None:
            asked[:] = getattr(request.waypoint_states, name)
        for side, index in ((request.start, 0), (request.end, -1)):
            given = getattr(side, name)
            asked[index] = 0.0 if given is None else np.nan_to_num(given)
        found.append(asked)
    return found[0], found[1]
