"""Everything linear that a request limits: derivatives of joints, boxes around waypoints, the tube between them."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..limits import QUANTITIES, magnitude, segment_bounds
from ..types import PlanRequest

Array = NDArray[np.float64]

#: What the caller gives by its half-width.
WIDTHS = ("tube", "waypoint_tolerance")
#: A tube narrower than this, relative to what errors of positions are, leaves no room for rounding: it is widened.
NARROWEST = 2e-7


@dataclass(frozen=True, eq=False)
class LinearLimits:
    """Limit c bounds the derivative ``orders[c]`` of ``directions[c, i] @ q`` on every gap i, scaled.

    ``lower`` and ``upper`` (C, M); ``sizes`` (C, M) is what errors are relative to; ``everywhere`` (C,): on the whole
    gap, or at its left end alone. ``rounding`` (C,) is how well the quantity is known. ``names`` (C,) and ``joints``
    (C,), the caller's, or -1 for several, say what it is.
    """

    orders: NDArray[np.int64]
    directions: Array
    lower: Array
    upper: Array
    sizes: Array
    everywhere: NDArray[np.bool_]
    rounding: Array
    names: tuple[str, ...]
    joints: tuple[int, ...]

    def widened(self, below: Array, above: Array) -> "LinearLimits":
        """Return the limits, their lower and upper sides given by so many of their sizes, (C,) each."""
        low, high = below[:, None] * self.sizes, above[:, None] * self.sizes
        return replace(self, lower=self.lower - low, upper=self.upper + high)

    def alike(self, limit: int, side: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return which lower and upper sides, (C,) each, the caller names by the same number as this one's.

        That is one side of a quantity and joint; both where they are symmetric, or a width; of a tube all joints.
        """
        name, joint = self.names[limit], self.joints[limit]
        wide = name in WIDTHS
        same = [n == name and (j == joint or name == "tube") for n, j in zip(self.names, self.joints, strict=True)]
        which = np.array(same, dtype=bool)
        both = wide or bool((self.lower[limit] == -self.upper[limit]).all() and self.orders[limit] > 0)
        return which & (both or side < 0), which & (both or side > 0)

    def slowed(self, factor: float) -> "LinearLimits":
        """Return what the limits become, at the same times, for a motion that takes ``factor`` times as long."""
        scale = factor ** self.orders[:, None].astype(np.float64)
        return replace(self, lower=self.lower * scale, upper=self.upper * scale, sizes=self.sizes * scale)


@dataclass(frozen=True, eq=False)
class Scale:
    """How a statement relates to its request.

    Its ``joints``; every gap's ``segment`` (M,) and the ``parts`` that a segment has; the units ``second`` s and
    ``unit`` (D,).
    """

    joints: tuple[int, ...]
    segment: NDArray[np.int64]
    parts: int
    second: float
    unit: Array

    def rounding(self, request: PlanRequest) -> Array:
        """Return how well positions are known, scaled, (D,)."""
        far = np.abs(request.waypoints[:, list(self.joints)]).max(axis=0)
        return np.asarray(8 * np.finfo(float).eps * far / self.unit)


@dataclass(frozen=True, eq=False)
class _Limit:
    """One of them: direction (D,) or (M, D), sides and size (M,)."""

    order: int
    direction: Array
    lower: Array
    upper: Array
    size: Array
    name: str
    joint: int
    rounding: float = 0.0
    everywhere: bool = True


def linear_limits(request: PlanRequest, order: int, scale: Scale, speed: Array | None) -> LinearLimits:
    """Return the limits of a request on a statement that minimises the derivative of an order.

    ``speed`` (M,): further bounds of the velocity's magnitude, scaled, where there is one joint.
    """
    found = list(_rates(request, order, scale))
    if speed is not None:
        found.append(_Limit(1, np.ones(1), -speed, speed, speed, "velocity_norm", scale.joints[0]))
    if request.waypoint_tolerance is not None and request.count > 2:
        found += _boxes(request, request.waypoint_tolerance, scale)
    if request.tube is not None:
        found += _tube(request, request.tube, scale)
    gaps, dims = len(scale.segment), len(scale.joints)
    none = np.zeros((0, gaps))
    return LinearLimits(
        np.array([f.order for f in found], dtype=np.int64),
        np.stack([np.broadcast_to(f.direction, (gaps, dims)) for f in found]) if found else np.zeros((0, gaps, dims)),
        np.stack([f.lower for f in found]) if found else none,
        np.stack([f.upper for f in found]) if found else none,
        np.stack([np.where(np.isfinite(f.size), f.size, 1.0) for f in found]) if found else none,
        np.array([f.everywhere for f in found], dtype=bool),
        np.array([f.rounding for f in found]),
        tuple(f.name for f in found),
        tuple(f.joint for f in found),
    )


def _rates(request: PlanRequest, order: int, scale: Scale) -> Iterator[_Limit]:
    count, eye, rounding = request.count - 1, np.eye(len(scale.joints)), scale.rounding(request)
    for m in range(min(4, 2 * order)):
        limit = segment_bounds(request.limits, request.segment_limits, m, count, request.dims)
        for d, joint in enumerate(scale.joints):
            offset = request.waypoints[0, joint] if m == 0 else 0.0
            factor = scale.second**m / scale.unit[d]
            lower, upper = ((x[:, joint] - offset)[scale.segment] * factor for x in (limit.lower, limit.upper))
            if not (np.isfinite(lower).any() or np.isfinite(upper).any()):
                continue
            size = _half_width(lower, upper, rounding[d]) if m == 0 else magnitude(lower, upper)
            yield _Limit(m, eye[d], lower, upper, size, QUANTITIES[m], joint, float(rounding[d]) if m == 0 else 0.0)


def _boxes(request: PlanRequest, tolerance: Array, scale: Scale) -> Iterator[_Limit]:
    """Yield the boxes around interior waypoints: limits at the left ends of their gaps."""
    eye, gaps, rounding = np.eye(len(scale.joints)), len(scale.segment), scale.rounding(request)
    here = np.arange(gaps) % scale.parts == 0
    here[0] = False
    for d, joint in enumerate(scale.joints):
        width = float(tolerance[joint]) / float(scale.unit[d])
        if width > 0:
            middle = (request.waypoints[:-1, joint] - request.waypoints[0, joint])[scale.segment] / scale.unit[d]
            lower, upper = np.where(here, middle - width, -np.inf), np.where(here, middle + width, np.inf)
            size = np.full(gaps, max(width, rounding[d]))
            yield _Limit(0, eye[d], lower, upper, size, "waypoint_tolerance", joint, float(rounding[d]), False)


def _tube(request: PlanRequest, tube: Array, scale: Scale) -> Iterator[_Limit]:
    """Yield the tube: each joint between its waypoints give or take the width, and each pair of joints near the line.

    q is within the box around some point of the line exactly if every two joints are for some common point of it.
    """
    chosen, segment, unit = list(scale.joints), scale.segment, float(scale.unit[0])  # that of all joints
    eye, rounding = np.eye(len(chosen)), float(scale.rounding(request).max())
    points = (request.waypoints[:, chosen] - request.waypoints[0, chosen]) / unit
    widths = np.maximum(tube[chosen] / unit, NARROWEST * max(1.0, 1.0 / unit))
    steps = np.diff(points, axis=0)
    for d, joint in enumerate(scale.joints):
        low = np.minimum(points[:-1, d], points[1:, d]) - widths[d]
        high = np.maximum(points[:-1, d], points[1:, d]) + widths[d]
        size = np.full(len(segment), widths[d])
        yield _Limit(0, eye[d], low[segment], high[segment], size, "tube", joint, rounding)
    for a, b in combinations(range(len(chosen)), 2):
        along = steps[:, b, None] * eye[a] - steps[:, a, None] * eye[b]
        length = np.abs(along).max(axis=1)
        moves = length > 0
        along = along / np.where(moves, length, 1.0)[:, None]
        width = (np.abs(along) * widths).sum(axis=1)
        middle = (along * points[:-1]).sum(axis=1)
        lower, upper = np.where(moves, middle - width, -np.inf), np.where(moves, middle + width, np.inf)
        size = np.where(moves, width, 1.0)
        yield _Limit(0, along[segment], lower[segment], upper[segment], size[segment], "tube", -1, 2 * rounding)


def _half_width(lower: Array, upper: Array, rounding: float) -> Array:
    width = 0.5 * (upper - lower)
    return np.asarray(np.where(np.isfinite(width), np.clip(width, max(rounding, 1e-9), 1.0), 1.0))
