"""What a request may ask a trajectory to keep: limits, durations, states at the ends and at waypoints."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import reading
from .errors import InvalidRequest
from .options import MAX_TIME

Array = NDArray[np.float64]

#: Derivatives with limits of their own; the index is the order.
QUANTITIES = ("position", "velocity", "acceleration", "jerk")


def magnitude(lower: Array, upper: Array) -> Array:
    """Return max(|lower|, |upper|) over the finite sides, else 1: what errors of a limit are relative to."""
    sides = np.stack([np.abs(lower), np.abs(upper)])
    largest = np.where(np.isfinite(sides), sides, 0.0).max(axis=0)
    return np.where(largest > 0, largest, 1.0)


@dataclass(frozen=True, eq=False)
class Limit:
    """Bounds of one quantity for each joint, shape (D,); infinite where there is none."""

    lower: Array
    upper: Array

    @classmethod
    def of(cls, value: Any, dims: int, field: str, signed: bool) -> "Limit | None":
        """Read a limit of the HTTP contract: a per-joint value, or ``lower`` and ``upper``.

        ``signed``: the bounds may lie on one side of zero, as positions do; then both must be named. None if no joint
        is bounded.

        Raises
        ------
        InvalidRequest
            ``bad_limits`` if lower < upper (positions) or lower < 0 < upper (rates) does not hold.
        """
        if isinstance(value, Limit):
            return value
        if isinstance(value, Mapping):
            reading.fields(value, field, ("lower", "upper"))
            if not value:
                raise InvalidRequest.of(field, "missing", "needs lower, upper or both")
            lower = reading.per_joint(_or(value.get("lower"), [None] * dims), f"{field}/lower", dims, -np.inf)
            upper = reading.per_joint(_or(value.get("upper"), [None] * dims), f"{field}/upper", dims, np.inf)
        elif signed:
            raise InvalidRequest.of(field, "wrong_type", "position limits need lower and upper")
        else:
            upper = reading.per_joint(value, field, dims, np.inf)
            lower = -upper
        bad = lower >= upper if signed else (lower >= 0) | (upper <= 0)
        if bad.any():
            rule = "lower < upper" if signed else "lower < 0 < upper (a single value must be > 0)"
            joint = int(np.argmax(bad))
            raise InvalidRequest.of(field, "bad_limits", f"joint {joint}: {rule} must hold")
        for array in (lower, upper):
            array.setflags(write=False)
        return cls(lower, upper) if np.isfinite(lower).any() or np.isfinite(upper).any() else None

    def scale(self) -> Array:
        """Return what errors of this limit are relative to."""
        return magnitude(self.lower, self.upper)


@dataclass(frozen=True, eq=False)
class Limits:
    """The limits of a request or of a segment; ``None`` where there is none."""

    position: Limit | None = None
    velocity: Limit | None = None
    acceleration: Limit | None = None
    jerk: Limit | None = None
    torque: Limit | None = None
    velocity_norm: float | None = None
    tip_speed: float | None = None
    tip_acceleration: float | None = None

    @classmethod
    def of(cls, value: Any, dims: int, field: str = "/limits") -> "Limits":
        """Read limits from a mapping with this class' field names; see ``Limit.of`` for the values."""
        if isinstance(value, Limits):
            return value
        names = [f.name for f in fields(cls)]
        reading.fields(value, field, names)
        findings = reading.Findings()
        read: dict[str, Any] = {}
        for name in names:
            if value.get(name) is None:
                continue
            where = f"{field}/{name}"
            if name in ("velocity_norm", "tip_speed", "tip_acceleration"):
                read[name] = findings.take(positive, value[name], where)
            else:
                read[name] = findings.take(Limit.of, value[name], dims, where, name == "position")
        findings.close()
        return cls(**read)

    def given(self) -> tuple[str, ...]:
        """Return the names of the limits that are there."""
        return tuple(name for name, value in vars(self).items() if value is not None)

    def bounds(self, order: int, dims: int) -> Limit:
        """Return the limit of the derivative of the given order, infinite where there is none."""
        limit = getattr(self, QUANTITIES[order])
        return limit if limit is not None else _unlimited(dims)


@cache
def _unlimited(dims: int) -> Limit:
    limit = Limit(np.full(dims, -np.inf), np.full(dims, np.inf))
    for array in (limit.lower, limit.upper):  # shared by all that ask
        array.setflags(write=False)
    return limit


def is_limited(whole: Limits, segments: Sequence[Limits | None] | None, name: str) -> bool:
    """Return whether a request or one of its segments limits that quantity."""
    return getattr(whole, name) is not None or any(
        own is not None and getattr(own, name) is not None for own in segments or ()
    )


def segment_bounds(whole: Limits, segments: Sequence[Limits | None] | None, order: int, count: int, dims: int) -> Limit:
    """Return the bounds of a derivative on every segment, each side (count, D): of request and segment, the tighter."""
    limit = whole.bounds(order, dims)
    lower, upper = np.empty((count, dims)), np.empty((count, dims))
    lower[:], upper[:] = limit.lower, limit.upper
    for i, own in enumerate(segments or ()):
        if own is not None:
            here = own.bounds(order, dims)
            lower[i], upper[i] = np.maximum(lower[i], here.lower), np.minimum(upper[i], here.upper)
    return Limit(lower, upper)


def norm_bounds(whole: Limits, segments: Sequence[Limits | None] | None, count: int) -> Array:
    """Return the bound of the velocity's norm on every segment, (count,): the tighter one, infinite where none is."""
    bounds = np.full(count, np.inf if whole.velocity_norm is None else whole.velocity_norm)
    for i, own in enumerate(segments or ()):
        if own is not None and own.velocity_norm is not None:
            bounds[i] = min(bounds[i], own.velocity_norm)
    return bounds


@dataclass(frozen=True)
class DurationBounds:
    """Bounds of a duration in s."""

    min: float = 0.0
    max: float = float("inf")

    @classmethod
    def of(cls, value: Any, field: str) -> "DurationBounds | None":
        """Read ``{"min"?, "max"?}``; None if nothing is bounded."""
        if isinstance(value, DurationBounds):
            return value
        reading.fields(value, field, ("min", "max"))
        low, high = value.get("min"), value.get("max")
        bounds = cls(
            0.0 if low is None else reading.number(low, f"{field}/min", 0.0, MAX_TIME),
            float("inf") if high is None else reading.number(high, f"{field}/max", 0.0, MAX_TIME),
        )
        if bounds.min > bounds.max:
            raise InvalidRequest.of(field, "bad_duration", "min must not be larger than max")
        return bounds if bounds.min > 0 or np.isfinite(bounds.max) else None

    def nearest(self, value: float) -> float:
        """Return the duration within the bounds that is nearest to ``value``."""
        return min(max(value, self.min), self.max)

    @property
    def exact(self) -> bool:
        """Whether both bounds are the same."""
        return self.min == self.max


@dataclass(frozen=True, eq=False)
class Boundary:
    """The state asked for at an end; (D,) each, None (or NaN for a joint) where it is left to the method."""

    velocity: Array | None = None
    acceleration: Array | None = None
    jerk: Array | None = None

    @classmethod
    def of(cls, value: Any, dims: int, field: str) -> "Boundary":
        """Read ``{"velocity"?, "acceleration"?, "jerk"?}``, D numbers each."""
        if isinstance(value, Boundary):
            return value
        names = [f.name for f in fields(cls)]
        reading.fields(value, field, names)
        findings = reading.Findings()
        read = {
            n: findings.take(reading.vector, value[n], f"{field}/{n}", dims) for n in names if value.get(n) is not None
        }
        findings.close()
        return cls(**read)

    def given(self) -> tuple[str, ...]:
        """Return the names of the derivatives that are pinned."""
        return tuple(name for name, value in vars(self).items() if value is not None)


@dataclass(frozen=True, eq=False)
class WaypointStates:
    """Velocities and accelerations at waypoints, (N, D) each, NaN where free."""

    velocity: Array
    acceleration: Array

    @classmethod
    def of(cls, value: Any, count: int, dims: int, field: str) -> "WaypointStates | None":
        """Read N entries, each ``null`` or ``{"velocity"?, "acceleration"?}`` with ``null`` per joint for free."""
        if isinstance(value, WaypointStates):
            return value
        rows = entries(value, count, field)
        states = cls(np.full((count, dims), np.nan), np.full((count, dims), np.nan))
        for i, row in enumerate(rows):
            if row is None:
                continue
            reading.fields(row, f"{field}/{i}", ("velocity", "acceleration"))
            for name in ("velocity", "acceleration"):
                if row.get(name) is not None:
                    cells = entries(row[name], dims, f"{field}/{i}/{name}")
                    getattr(states, name)[i] = reading.per_joint(cells, f"{field}/{i}/{name}", dims, np.nan)
        free = np.isnan(states.velocity).all() and np.isnan(states.acceleration).all()
        return None if free else states


def _or(value: Any, default: Any) -> Any:
    return default if value is None else value


def positive(value: Any, field: str) -> float:
    """Return a finite number > 0."""
    read = reading.number(value, field)
    if read <= 0:
        raise InvalidRequest.of(field, "bad_limits" if "limits/" in field else "out_of_range", "must be > 0")
    return read


def entries(value: Any, count: int, field: str) -> Sequence[Any]:
    """Return a list of the given length."""
    if isinstance(value, (str, Mapping)) or not isinstance(value, Sequence | np.ndarray):
        raise InvalidRequest.of(field, "wrong_type", "must be a list")
    if len(value) != count:
        raise InvalidRequest.of(field, "shape_mismatch", f"needs {count} entries, has {len(value)}")
    return value  # type: ignore[return-value]
