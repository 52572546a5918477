"""From a request at given times to statements: one for each joint, or one for all.

That is where a tube or the norm of the velocity binds them, or where nothing is limited. All of it in units in which
the median gap and the largest range of the statement's joints are one, with positions counted from the first waypoint.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from problems.minimum_derivative import MinimumDerivative

from ..limits import QUANTITIES, norm_bounds
from ..trajectory import Trajectory
from ..types import PlanRequest
from .linear import LinearLimits, Scale, linear_limits

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Posed:
    """A statement with its limits; ``joints`` are the caller's, ``times`` (M + 1,) and ``segment`` (M,) of the nodes.

    ``second`` s and ``unit`` undo the scaling; ``origin`` (D,) is where positions count from; ``norm`` (M,) bounds the
    Euclidean norm of the velocity; ``rounding`` is how well positions are known.
    """

    statement: MinimumDerivative
    limits: LinearLimits
    joints: tuple[int, ...]
    times: Array
    segment: NDArray[np.int64]
    second: float
    unit: float
    origin: Array
    rounding: float
    norm: Array | None = None

    @property
    def weight(self) -> float:
        """What a cost in scaled units is worth in the caller's."""
        return float(self.unit**2 / self.second ** (2 * self.statement.order - 1))

    @cached_property
    def limited(self) -> bool:
        """Whether there is any limit."""
        return bool(np.isfinite(self.limits.lower).any() or np.isfinite(self.limits.upper).any()) or bool(
            self.norm is not None and np.isfinite(self.norm).any()
        )

    def rebased(self, y: Array) -> "Posed":
        """Return the same with unknowns that count from these."""
        return replace(self, statement=self.statement.rebased(y))

    def motion(self, y: Array) -> Trajectory:
        """Return the motion for unknowns y, scaled, from time 0."""
        states = self.statement.filled(y)
        breaks = np.concatenate([[0.0], np.cumsum(self.statement.h)])
        return Trajectory.from_states(breaks, self.statement.reference + states[0], np.ascontiguousarray(states[1:]))

    def physical(self, limit: int, value: float) -> float:
        """Return a value of a limited quantity in the caller's units."""
        order = int(self.limits.orders[limit])
        offset = 0.0
        if order == 0:
            along = self.limits.directions[limit, 0]
            offset = float(along @ self.origin)
        return float(value * self.unit / self.second**order + offset)

    def clock(self, gap: int, u: float) -> float:
        """Return the caller's time at a place in [0, 1] on a gap."""
        return float(self.times[gap] + u * (self.times[gap + 1] - self.times[gap]))


def pose(request: PlanRequest, order: int, ends: str, parts: int) -> tuple[Posed, ...]:
    """Return the statements of a request with times, with ``parts`` pieces between waypoints.

    ``ends``: ``fixed`` takes the request's end states (a NaN or a missing one is free), ``free`` none, ``periodic``
    makes the last derivatives the first.
    """
    assert request.times is not None
    bound = request.tube is not None or _norms(request) is not None
    whole = bound or not _limited(request)
    groups = [tuple(range(request.dims))] if whole else [(d,) for d in range(request.dims)]
    span = np.ptp(request.waypoints, axis=0)
    if request.waypoint_tolerance is not None:
        span = np.maximum(span, request.waypoint_tolerance)
    span = np.where(span > 0, span, max(float(span.max()), 1.0))
    return tuple(
        _group(request, order, ends, parts, joints, float(span[list(joints)].max()), bound) for joints in groups
    )


def _limited(request: PlanRequest) -> bool:
    own = any(s is not None and s.given() for s in request.segment_limits or ())
    boxes = request.waypoint_tolerance is not None and bool((request.waypoint_tolerance > 0).any())
    return own or boxes or bool(request.limits.given())


def nodes(request: PlanRequest, parts: int) -> tuple[Array, Array]:
    """Return the nodes' times (M + 1,) and reference positions (M + 1, D): between waypoints on the straight line."""
    assert request.times is not None
    if parts == 1:
        return request.times, request.waypoints
    at = np.arange(parts) / parts
    split = [
        np.concatenate(
            [(x[:-1, None] + np.diff(x, axis=0)[:, None] * at.reshape(-1, *[1] * (x.ndim - 1))), x[1:, None]], 1
        )
        for x in (request.times, request.waypoints)
    ]
    return tuple(np.concatenate([s[:, :-1].reshape(-1, *s.shape[2:]), s[-1:, -1]]) for s in split)  # type: ignore[return-value]


def _group(
    request: PlanRequest, order: int, ends: str, parts: int, joints: tuple[int, ...], unit: float, bound: bool
) -> Posed:
    times, reference = nodes(request, parts)
    assert request.times is not None
    second = float(np.median(np.diff(request.times)))
    chosen = list(joints)
    origin = request.waypoints[0, chosen]
    states = given_states(request, order, ends, parts)[:, :, chosen]
    scale = second ** np.arange(order) / unit
    states = states * scale[:, None, None]
    reference = (reference[:, chosen] - origin) / unit
    statement = MinimumDerivative(np.diff(times) / second, reference, states, ends == "periodic", bound)
    segment = np.repeat(np.arange(request.count - 1), parts)
    rounding = 8 * np.finfo(float).eps * float(np.abs(request.waypoints).max()) / unit
    norm = _norms(request)
    norm = None if norm is None else norm[segment] * second / unit
    units = Scale(joints, segment, parts, second, unit, rounding)
    limits = linear_limits(request, order, units, norm if len(joints) == 1 else None)
    norm = None if len(joints) == 1 else norm
    return Posed(statement, limits, joints, times, segment, second, unit, origin, rounding, norm)


def given_states(request: PlanRequest, order: int, ends: str, parts: int) -> Array:
    """Return what is given at the nodes, (k, M + 1, D): displacements, derivatives; NaN where free."""
    count = request.count
    states = np.full((order, (count - 1) * parts + 1, request.dims), np.nan)
    states[0, ::parts] = 0.0
    if request.waypoint_tolerance is not None and count > 2:
        states[0, parts:-1:parts] = np.where(request.waypoint_tolerance > 0, np.nan, 0.0)
    if request.waypoint_states is not None:
        for r, asked in ((1, request.waypoint_states.velocity), (2, request.waypoint_states.acceleration)):
            if r < order:
                states[r, ::parts] = asked
    if ends == "fixed":
        for node, side in ((0, request.start), (-1, request.end)):
            for r in range(1, order):
                value = getattr(side, QUANTITIES[r])
                if value is not None:
                    states[r, node] = np.where(np.isnan(value), states[r, node], value)
    if ends == "periodic":
        first = np.where(np.isnan(states[1:, 0]), states[1:, -1], states[1:, 0])
        states[1:, 0] = states[1:, -1] = first
    return states


def _norms(request: PlanRequest) -> Array | None:
    """Return the bound of the velocity's norm on every segment, or None if there is none."""
    bounds = norm_bounds(request.limits, request.segment_limits, request.count - 1)
    return bounds if np.isfinite(bounds).any() else None


def joined(posed: Sequence[Posed], points: Sequence[Array], request: PlanRequest, parts: int) -> Trajectory:
    """Return the statements' unknowns as one trajectory in the caller's units."""
    times, reference = nodes(request, parts)
    order = posed[0].statement.order
    states = np.empty((order - 1, *reference.shape))
    positions = reference.copy()
    for one, y in zip(posed, points, strict=True):
        filled = one.statement.filled(y) * (one.unit / one.second ** np.arange(order))[:, None, None]
        chosen = list(one.joints)
        positions[:, chosen] += filled[0]
        states[:, :, chosen] = filled[1:]
    return Trajectory.from_states(times, positions, states)
