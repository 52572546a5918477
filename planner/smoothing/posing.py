"""From a request at given times to statements, for all of its joints or some.

All of it in units in which the median gap and each joint's range are one, with positions counted from the first
waypoint; where a tube or the norm of the velocity binds the joints, their largest range is the unit of all.
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

    ``second`` s and ``unit`` (D,) undo the scaling; ``origin`` (D,) is where positions count from; ``norm`` (M,) bounds
    the Euclidean norm of the velocity.
    """

    statement: MinimumDerivative
    limits: LinearLimits
    joints: tuple[int, ...]
    times: Array
    segment: NDArray[np.int64]
    second: float
    unit: Array
    origin: Array
    norm: Array | None = None

    @property
    def weights(self) -> Array:
        """What a cost in scaled units is worth in the caller's, (D,)."""
        return np.asarray(self.unit**2 / self.second ** (2 * self.statement.order - 1))

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
        order, joint = int(self.limits.orders[limit]), self.limits.joints[limit]
        unit = self.unit[self.joints.index(joint) if joint >= 0 else 0]
        offset = self.limits.directions[limit, 0] @ self.origin if order == 0 else 0.0
        return digits(value * unit / self.second**order + offset)

    def clock(self, gap: int, u: float) -> float:
        """Return the caller's time at a place in [0, 1] on a gap."""
        return float(self.times[gap] + u * (self.times[gap + 1] - self.times[gap]))


def digits(value: float) -> float:
    """Return a number without the last digits, which scaling forth and back leaves to rounding."""
    return float(f"{float(value):.15g}")


def pose(
    request: PlanRequest, order: int, ends: str, parts: int, joints: Sequence[int] | None = None, alike: bool = False
) -> Posed:
    """Return the statement of a request with times, with ``parts`` pieces between waypoints.

    ``ends``: ``fixed`` takes the request's end states (a NaN or a missing one is free), ``free`` none, ``periodic``
    makes the last derivatives the first. ``joints`` are those wanted, by default all; ``alike``: in the same unit.
    """
    assert request.times is not None
    chosen = list(range(request.dims)) if joints is None else list(joints)
    norm = _norms(request)
    bound = len(chosen) > 1 and (request.tube is not None or norm is not None)
    times, reference = nodes(request, parts)
    segment = np.repeat(np.arange(request.count - 1), parts)
    second = float(np.median(np.diff(request.times)))
    unit = _ranges(request)[chosen]
    if alike or bound:
        unit = np.full(len(chosen), unit.max())
    states = given_states(request, order, ends, parts)[:, :, chosen]
    states = states * (second ** np.arange(order)[:, None] / unit)[:, None]
    origin = request.waypoints[0, chosen]
    placed = (reference[:, chosen] - origin) / unit
    statement = MinimumDerivative(np.diff(times) / second, placed, states, ends == "periodic", bound)
    speed = None if norm is None else norm[segment] * second / unit[0]
    limits = linear_limits(request, order, Scale(tuple(chosen), segment, parts, second, unit), None if bound else speed)
    own = speed if bound else None
    return Posed(statement, limits, tuple(chosen), times, segment, second, unit, origin, own)


def _ranges(request: PlanRequest) -> Array:
    """Return what each joint's positions are scaled by, (D,): their range, or what they may be off."""
    span = np.ptp(request.waypoints, axis=0)
    if request.waypoint_tolerance is not None:
        span = np.maximum(span, request.waypoint_tolerance)
    return np.asarray(np.where(span > 0, span, span.max() if span.max() > 0 else 1.0))


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
        filled = one.statement.filled(y) * (one.unit / one.second ** np.arange(order)[:, None])[:, None]
        chosen = list(one.joints)
        positions[:, chosen] += filled[0]
        states[:, :, chosen] = filled[1:]
    return Trajectory.from_states(times, positions, states)
