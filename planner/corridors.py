"""What a trajectory keeps of corridors: the norm of its velocity, boxes around waypoints, a tube around their polyline.

Each row is decided by exact extrema: of the squared norm, which is a polynomial, and of linear combinations of the
joints. Whatever cannot be established counts as broken. Knows no method, no path builder, no solver.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .errors import InvalidRequest
from .limits import norm_bounds
from .pieces import differentiated, product, to_bernstein
from .rational import derivative as rational_derivative
from .trajectory import Trajectory
from .types import TOLERANCE, Check, Demands
from .worst import TIE, worst

Array = NDArray[np.float64]

#: Numbers held at a time, about.
BLOCK = 1 << 20
#: Coefficients beyond this are not judged: products and sums of them would leave the range of floating point.
LARGEST = 1e140
#: The largest distance from the polyline is told so closely, relatively.
CLOSE = 1e-8


def norm_row(trajectory: Trajectory, demands: Demands, segment: NDArray[np.int64], jumps: Array) -> Check | None:
    """Return the worst of the velocity's Euclidean norm, or None where it is not limited.

    Parameters
    ----------
    segment : (K,)
        The segment each piece belongs to.
    jumps : (K - 1, D) of bool
        At which breaks the position jumps, so that the velocity is unbounded.
    """
    count = 1 if demands.segment_limits is None else len(demands.segment_limits)
    bounds = norm_bounds(demands.limits, demands.segment_limits, count)
    row = np.minimum(segment, count - 1)
    limited = np.isfinite(bounds[row])
    if not limited.any():
        return None
    infinite = np.flatnonzero(jumps.any(axis=1) & limited[:-1] & limited[1:])
    if len(infinite):
        piece = int(infinite[0])
        where = int(segment[piece]), float(trajectory.breaks[piece + 1])
        return Check("velocity_norm", None, *where, None, float(bounds[row[piece]]), None, False)
    try:
        squared, size = _squared_speed(trajectory)
    except InvalidRequest:
        return _unknown("velocity_norm")
    most = float(np.min(bounds))  # ratios of squares overflow no earlier than the squares themselves
    gain = np.zeros((2, 1, count, 1))
    gain[0, 0, :, 0] = np.where(np.isfinite(bounds), (most / bounds) ** 2, 0.0)
    shift = np.full_like(gain, -np.inf)
    shift[0, 0, np.isfinite(bounds)] = 0.0
    found = worst(squared, gain, shift, row)
    piece, value = int(found.piece[0, 0]), size * np.sqrt(max(float(found.value[0, 0]), 0.0))
    largest = size * np.sqrt(max(float(found.most[0, 0]), 0.0)) / most
    if not (np.isfinite(largest) and np.isfinite(value)):
        return _unknown("velocity_norm")
    bound = float(bounds[row[piece]])
    holds = bool(largest <= 1.0 + TOLERANCE)
    time, at = min(float(found.time[0, 0]), float(trajectory.breaks[piece + 1])), int(segment[piece])
    return Check("velocity_norm", None, at, time, float(value), bound, float(value / bound), holds)


def highest_speeds(trajectory: Trajectory) -> Array:
    """Return the largest Euclidean norm of the velocity on every piece, (K,), from the exact extrema of its square.

    Raises
    ------
    OverflowError
        The squares leave the range of floating point.
    """
    try:
        squared, size = _squared_speed(trajectory)
    except InvalidRequest as error:
        raise OverflowError("the velocities are too large to be squared") from error
    return np.asarray(size * np.sqrt(np.maximum(squared.extrema(1).high[0, :, 0], 0.0)))


def _squared_speed(trajectory: Trajectory) -> tuple[Trajectory, float]:
    """Return the squared norm of the velocity over the square of a size, as a trajectory of one joint; and the size.

    Raises
    ------
    InvalidRequest
        It leaves the range of floating point, or the denominator cannot be shown to be positive.
    """
    rates = trajectory.rates[:, None]
    if trajectory.weights is None or not trajectory.rational:
        slope, below = differentiated(trajectory.coefficients, 1) * rates, None
    else:  # the velocity of A / W is that of (A - a W) / W, whose numerator is small
        w = trajectory.weights
        near = trajectory.coefficients - (trajectory.coefficients[-1] / w[-1][:, None]) * w[:, :, None]
        slope, square = rational_derivative(near, w, 1)
        slope = slope * rates
        below = product(square[:, :, None], square)[:, :, 0]
    size = float(np.abs(slope).max())
    if not size < LARGEST:
        raise InvalidRequest.of("", "not_finite", "beyond floating point")
    size = size if size > 0 else 1.0
    squares = sum(product(slope[:, :, d : d + 1] / size, slope[:, :, d] / size) for d in range(trajectory.dims))
    return Trajectory(trajectory.breaks, np.asarray(squares), below), size


def tolerance_row(missed: Array | None, demands: Demands, at: Array | None, span: float) -> Check | None:
    """Return the interior waypoint and joint that use up most of the tolerance (or break it by most), if one is asked.

    Parameters
    ----------
    missed : (N, D)
        Distances from the waypoints at their times ``at``; None where those are not known.
    span : float
        What errors of positions are relative to.
    """
    allowed = demands.waypoint_tolerance
    if allowed is None:
        return None
    if missed is None or at is None or not np.isfinite(missed).all():
        return _unknown("waypoint_tolerance")
    inner = missed[1:-1]
    if not inner.size:  # both are ends, which stay exact: nothing can use the tolerance
        return Check("waypoint_tolerance", None, None, None, 0.0, float(allowed.min()), None, True)
    excess = inner - allowed
    holds = bool(excess.max() <= TOLERANCE * span)
    wide = np.broadcast_to(allowed > 0, inner.shape)
    judged = excess
    if holds and wide.any():
        judged = np.divide(inner, allowed, out=np.full(inner.shape, -np.inf), where=wide)
    i, joint = (int(k) for k in np.unravel_index(int(np.argmax(judged)), inner.shape))
    value, bound = float(inner[i, joint]), float(allowed[joint])
    ratio = value / bound if bound > 0 else None
    return Check("waypoint_tolerance", joint, i + 1, float(at[i + 1]), value, bound, ratio, holds)


#: How conditions are measured.
Kind = Literal["excess", "rigid", "factor"]


@dataclass(frozen=True, eq=False)
class _Conditions:
    """Linear conditions on the offset x = q - P_i from the start of a segment, one a column: arrays (S, E).

    Column e is |first x_j - second x_k| between ``low`` and ``high`` sides that widen by ``width`` when the tube
    does by its own width, and by ``reach`` when every joint's does by one unit. Those not ``asked`` say nothing.
    """

    first: Array
    second: Array
    low: Array
    high: Array
    width: Array
    reach: Array
    asked: NDArray[np.bool_]

    def measures(self, kind: Kind) -> tuple[Array, Array]:
        """Return gain and shift (2, 1, S, E): by the excess in units of position, or by the factor of the width.

        ``rigid``: by the excess of the conditions that have no width.
        """
        counts = self.asked & {"excess": self.width >= 0, "rigid": self.width == 0, "factor": self.width > 0}[kind]
        unit = np.where(counts, self.width if kind == "factor" else self.reach, 1.0)
        widened = 0.0 if kind == "factor" else self.width
        gain = np.where(counts, np.stack([1.0 / unit, -1.0 / unit]), 0.0)
        shift = np.where(counts, np.stack([-(self.high + widened), self.low - widened]) / unit, -np.inf)
        return gain[:, None], shift[:, None]


def tube_row(trajectory: Trajectory, demands: Demands, segment: NDArray[np.int64], span: float) -> Check | None:
    """Return where a trajectory comes closest to the side of the tube, or furthest beyond it, if one is asked.

    On segment i a position lies in the tube if some s in [0, 1] has |q_d - P_d - s Delta_d| <= tube_d for every
    joint. Each joint leaves an interval of s, and intervals have a point in common if every two of them do (Helly):
    min(0, Delta_d) - tube_d <= q_d - P_d <= max(0, Delta_d) + tube_d for every joint, and for every two joints
    |Delta_e (q_d - P_d) - Delta_d (q_e - P_e)| <= tube_d |Delta_e| + tube_e |Delta_d|.

    The ratio is the smallest factor by which the tube, times it, holds all positions; the value is that many widths
    of the joint told. Where no factor would do, as the width is 0: the excess in units of position, and no ratio.
    What is judged is the excess, by which every joint's width would have to grow.

    Parameters
    ----------
    segment : (K,)
        The segment each piece belongs to.
    span : float
        What errors of positions are relative to.
    """
    if demands.tube is None:
        return None
    assert demands.waypoints is not None
    size = float(np.abs(trajectory.coefficients).max())
    if not max(size, float(np.abs(demands.waypoints).max())) < LARGEST:
        return _unknown("tube")
    pairs = np.triu_indices(trajectory.dims, 1)
    try:
        found = _worst_condition(trajectory, demands, segment, pairs, "excess")
        allowed = TOLERANCE * span
        holds = bool(found.badness <= allowed)
        rigid = None if holds else _worst_condition(trajectory, demands, segment, pairs, "rigid")
        if rigid is not None and rigid.badness > allowed:
            found = rigid
        else:
            by_factor = _worst_condition(trajectory, demands, segment, pairs, "factor")
            found = by_factor if np.isfinite(by_factor.badness) else found
    except InvalidRequest:
        return _unknown("tube")
    tube, factor = demands.tube, found.factor
    joint = found.joint(pairs, tube)
    value, ratio = max(found.badness, 0.0), None
    if factor is not None:
        ratio = max(factor, 0.0)
        value = ratio * float(tube[joint])
    return Check("tube", joint, int(segment[found.piece]), found.time, value, float(tube[joint]), ratio, holds)


@dataclass(frozen=True, eq=False)
class _Broken:
    """The worst condition: how bad, by which factor the tube would have to be widened (None: by none), and where."""

    badness: float
    factor: float | None
    time: float
    piece: int
    column: int
    first: float
    second: float

    def joint(self, pairs: tuple[NDArray[np.int64], NDArray[np.int64]], tube: Array) -> int:
        """Return the joint to be told: of two the one that moves less, unless the tube has no width there."""
        dims = len(tube)
        if self.column < dims:
            return self.column
        d, e = (int(k[self.column - dims]) for k in pairs)
        less, more = (d, e) if abs(self.first) >= abs(self.second) else (e, d)
        return more if tube[less] == 0 and tube[more] > 0 else less


def _conditions(
    waypoints: Array,
    tube: Array,
    segments: NDArray[np.int64],
    pairs: tuple[NDArray[np.int64], NDArray[np.int64]],
) -> _Conditions:
    """Return the conditions on some segments (S,): of every joint, then of every two."""
    step = waypoints[segments + 1] - waypoints[segments]
    largest = np.abs(step).max(axis=1, keepdims=True)
    unit = np.divide(step, largest, out=np.zeros_like(step), where=largest > 0)
    d, e = pairs
    one, zero = np.ones_like(step), np.zeros_like(step)
    along, across = unit[:, e], unit[:, d]  # factors of x_d and of x_e
    none = np.zeros_like(along)
    return _Conditions(
        np.hstack([one, along]),
        np.hstack([zero, across]),
        np.hstack([np.minimum(step, 0.0), none]),
        np.hstack([np.maximum(step, 0.0), none]),
        np.hstack([one * tube, tube[d] * np.abs(along) + tube[e] * np.abs(across)]),
        np.hstack([one, np.abs(along) + np.abs(across)]),
        np.hstack([one > 0, (along != 0) & (across != 0)]),  # one that stands still: its own condition says as much
    )


def _worst_condition(
    trajectory: Trajectory,
    demands: Demands,
    segment: NDArray[np.int64],
    pairs: tuple[NDArray[np.int64], NDArray[np.int64]],
    kind: Kind,
) -> _Broken:
    assert demands.waypoints is not None and demands.tube is not None
    dims, found = trajectory.dims, []
    j = np.concatenate([np.arange(dims), pairs[0]])
    k = np.concatenate([np.arange(dims), pairs[1]])
    held = max(1, BLOCK // (len(trajectory.coefficients) * len(j)))
    for begin in range(0, trajectory.pieces, held):
        part = trajectory.part(begin, min(begin + held, trajectory.pieces))
        own = segment[begin : begin + held]
        segments, row = np.unique(own, return_inverse=True)
        conditions = _conditions(demands.waypoints, demands.tube, segments, pairs)
        c = part.coefficients.copy()
        if part.weights is None:
            c[-1] -= demands.waypoints[own]
        else:
            c -= demands.waypoints[own] * part.weights[:, :, None]
        combined = conditions.first[row] * c[:, :, j] - conditions.second[row] * c[:, :, k]
        x = Trajectory(part.breaks, combined, part.weights)
        at = worst(x, *conditions.measures(kind), row)
        most = float(at.most[0].max())
        column = int(np.argmin(np.where(at.badness[0] >= most - TIE * abs(most), at.time[0], np.inf)))
        piece = int(at.piece[0, column])
        s, width = row[piece], float(conditions.width[row[piece], column])
        factor = most
        if kind == "excess" and width > 0:
            factor = 1.0 + most * float(conditions.reach[s, column]) / width
        first_factor, second_factor = float(conditions.first[s, column]), float(conditions.second[s, column])
        time = min(float(at.time[0, column]), float(part.breaks[piece + 1]))  # rounding must not leave the clock
        told = factor if width > 0 else None
        found.append(_Broken(most, told, time, begin + piece, column, first_factor, second_factor))
    return max(found, key=lambda b: b.badness)  # of equals the first


def polyline_distance(trajectory: Trajectory, waypoints: Array, segment: NDArray[np.int64]) -> float:
    """Return the largest Euclidean distance of a position from the straight line of its segment, which has ends.

    An upper bound that no position exceeds, attained to 1e-8 relative and to rounding; infinite where the numbers are
    too large to be squared.

    Parameters
    ----------
    segment : (K,)
        The segment each piece belongs to.
    """
    from .kernels.polyline_distance import largest_distance

    weighted, c = trajectory.rational, trajectory.coefficients
    if weighted:
        assert trajectory.weights is not None
        c = np.concatenate([c, trajectory.weights[:, :, None]], axis=2)
    control = to_bernstein(c)
    positions = control[:, :, : trajectory.dims]
    size = max(float(np.abs(positions).max()), float(np.abs(waypoints).max()))
    if not size < LARGEST:
        return float("inf")
    if size == 0.0:
        return 0.0
    unit = 2.0 ** math.frexp(size)[1]  # a power of two: no digit is lost
    positions /= unit
    by_piece = np.ascontiguousarray(control.transpose(1, 0, 2))
    tolerances = CLOSE, 64 * float(np.finfo(float).eps)
    return unit * float(largest_distance(by_piece, weighted, waypoints / unit, segment, *tolerances))


def _unknown(quantity: str) -> Check:
    """Return the row of what cannot be established, so that nothing is held."""
    return Check(quantity, None, None, None, None, None, None, False)
