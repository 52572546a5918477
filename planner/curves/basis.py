"""B-splines: basis, de Boor's algorithm, knot insertion, curves by control points and through waypoints."""

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field
from scipy.linalg import LinAlgError, solve_banded

from ..errors import InvalidRequest
from ..kernels import bspline as kernel
from ..limits import DurationBounds
from ..trajectory import Trajectory
from .options import Number, Spaced, checked, clock, refuse_other_span

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Highest degree: beyond, the pieces' coefficients lose too many digits.
MOST_DEGREE = 10

Knots = Annotated[list[Number], Field(min_length=2, fail_fast=True)]


class BsplineOptions(Spaced):
    """Options of B-splines."""

    degree: int = Field(default=3, description=f"degree of the pieces, 1 to {MOST_DEGREE}, below N")
    interpolate: bool = Field(
        default=True, description="true: the waypoints lie on the curve, at their times; false: they are control points"
    )
    knots: Knots | None = Field(
        default=None,
        description="the full vector, N + degree + 1 (default for control points: clamped and even, on [0, 1] or "
        "[0, duration]; through waypoints: clamped and at waypoints, without those next to the ends)",
        json_schema_extra={"unit": "s"},
    )

    @property
    def moves_by_itself(self) -> bool:
        """Whether the clock is the options'."""
        return self.control_points and self.knots is not None

    def check(self, points: Array) -> None:
        """Raise InvalidRequest where degree or knots do not fit the points."""
        if self.interpolate:
            check_degree(len(points), self.degree)
            if self.knots is not None:
                checked_knots(self.knots, len(points), self.degree)
        else:
            by_control_points(self, points, None)

    @property
    def control_points(self) -> bool:
        """Whether the waypoints are control points."""
        return not self.interpolate


def clamped_knots(count: int, degree: int, start: float = 0.0, end: float = 1.0) -> Array:
    """Return ``degree`` + 1 equal knots at each end and even ones between, for ``count`` control points."""
    inner = np.linspace(start, end, count - degree + 1)
    return np.concatenate([np.full(degree, start), inner, np.full(degree, end)])


def checked_knots(knots: ArrayLike, count: int, degree: int) -> Array:
    """Return the knots if they fit ``count`` control points.

    Raises
    ------
    InvalidRequest
        ``bad_degree``, ``too_few_points``, or ``bad_knots``: a wrong number of knots, falling ones, more than
        degree + 1 equal ones, or an empty valid span.
    """
    check_degree(count, degree)
    t = np.asarray(knots, dtype=np.float64)
    where = "/options/knots"
    if len(t) != count + degree + 1:
        raise InvalidRequest.of(where, "bad_knots", f"needs N + degree + 1 = {count + degree + 1}, has {len(t)}")
    if (np.diff(t) < 0).any():
        i = int(np.argmax(np.diff(t) < 0)) + 1
        raise InvalidRequest.of(f"{where}/{i}", "bad_knots", "must not fall below the knot before it")
    if len(t) > degree + 1 and (t[degree + 1 :] == t[: -degree - 1]).any():
        raise InvalidRequest.of(
            where, "bad_knots", f"no knot may be repeated more than degree + 1 = {degree + 1} times"
        )
    if not t[degree] < t[count]:
        raise InvalidRequest.of(where, "bad_knots", "the valid span, from knot degree to knot N, is empty")
    return t


def check_degree(count: int, degree: int) -> None:
    """Raise ``bad_degree`` or ``too_few_points`` where a B-spline of that degree cannot be made."""
    if not 1 <= degree <= MOST_DEGREE:
        raise InvalidRequest.of("/options/degree", "bad_degree", f"must be 1 to {MOST_DEGREE}")
    if count < degree + 1:
        reason = f"degree {degree} needs at least {degree + 1} waypoints, there are {count}: take a lower degree"
        raise InvalidRequest.of("/waypoints", "too_few_points", reason)


def smoothness(knots: Array, degree: int) -> int:
    """Return the class C^(p - mu) that the interior knots' largest multiplicity mu leaves; p without any."""
    if len(knots) < 2 * degree + 2:  # refused elsewhere
        return degree - 1
    inner = knots[(knots > knots[degree]) & (knots < knots[len(knots) - degree - 1])]
    multiplicity = int(np.unique(inner, return_counts=True)[1].max()) if len(inner) else 0
    return degree - multiplicity


def spans(knots: Array, degree: int, times: Array) -> Indices:
    """Return j with knots[j] <= t < knots[j + 1]; the last non-empty span is closed.

    Raises
    ------
    InvalidRequest
        A time outside the valid span [knots[degree], knots[N]].
    """
    last = len(knots) - degree - 1
    if not ((times >= knots[degree]) & (times <= knots[last])).all():
        reason = f"must lie in the valid span [{knots[degree]!r}, {knots[last]!r}]"
        raise InvalidRequest.of("/times", "out_of_range", reason)
    closed = int(np.searchsorted(knots, knots[last], side="left")) - 1
    return np.minimum(np.searchsorted(knots, times, side="right") - 1, closed)


def basis_values(knots: Array, degree: int, times: Array) -> tuple[Indices, Array]:
    """Return the span j of each time and the values of B_{j-p} … B_j there, (M, p + 1): none negative, of sum 1.

    B_i^p = (t - t_i) / (t_{i+p} - t_i) B_i^{p-1} + (t_{i+p+1} - t) / (t_{i+p+1} - t_{i+1}) B_{i+1}^{p-1}, 0/0 = 0.
    """
    j = spans(knots, degree, times)
    values = np.empty((len(times), degree + 1))
    kernel.basis(knots, degree, j, times, values)
    return j, values


def de_boor(knots: ArrayLike, points: ArrayLike, degree: int, time: float) -> Array:
    """Return the curve's point at a time in the valid span, by repeated interpolation of the active control points."""
    t, x = np.asarray(knots, dtype=np.float64), np.asarray(points, dtype=np.float64)
    j = int(spans(t, degree, np.array([time]))[0])
    d = x[j - degree : j + 1]
    for level in range(1, degree + 1):
        left, right = t[j - degree + level : j + 1], t[j + 1 : j + 1 + degree + 1 - level]
        share = ((time - left) / (right - left))[:, None]
        d = (1.0 - share) * d[:-1] + share * d[1:]
    return np.asarray(d[0])


def inserted(knots: ArrayLike, points: ArrayLike, degree: int, time: float) -> tuple[Array, Array]:
    """Return knots and control points of the same curve with one more knot at ``time`` (Boehm's algorithm)."""
    t, x = np.asarray(knots, dtype=np.float64), np.asarray(points, dtype=np.float64)
    j = int(spans(t, degree, np.array([time]))[0])
    i = np.arange(j - degree + 1, j + 1)
    share = ((time - t[i]) / (t[i + degree] - t[i]))[:, None]
    new = (1.0 - share) * x[i - 1] + share * x[i]
    return np.insert(t, j + 1, time), np.concatenate([x[: j - degree + 1], new, x[j:]])


def bspline(points: ArrayLike, knots: ArrayLike, degree: int = 3) -> Trajectory:
    r"""Return the B-spline curve \sum_i x_i B_i^p(t) on its valid span [t_p, t_N].

    Parameters
    ----------
    points : (N, D)
        Control points.
    knots : (N + degree + 1,), not falling
    degree : int

    Raises
    ------
    InvalidRequest
        As ``checked_knots``.

    References
    ----------
    C. de Boor, A Practical Guide to Splines, Springer, 1978, chapters IX and X.
    """
    x = np.ascontiguousarray(points, dtype=np.float64)
    breaks, bernstein = bezier_pieces(checked_knots(knots, len(x), degree), x, degree)
    return Trajectory.from_bernstein(breaks, bernstein)


def bezier_pieces(knots: Array, points: Array, degree: int) -> tuple[Array, Array]:
    """Return the breaks (K + 1,) and the Bézier control points (p + 1, K, D) of the non-empty spans."""
    j = np.arange(degree, len(points))
    j = j[knots[j] < knots[j + 1]]
    pieces = np.empty((degree + 1, len(j), points.shape[1]))
    kernel.bezier_points(knots, points, degree, j, pieces)
    return np.append(knots[j], knots[j[-1] + 1]), pieces


def interpolation_knots(times: Array, degree: int) -> Array:
    """Return clamped knots at the waypoints, or half way between for even degrees, with as many left out as needed.

    For degree 3 the spline is the not-a-knot one.
    """
    half = (degree + 1) // 2
    inner = times if degree % 2 else 0.5 * (times[1:] + times[:-1])
    inner = inner[half : len(inner) - half]
    return np.concatenate([np.full(degree + 1, times[0]), inner, np.full(degree + 1, times[-1])])


def interpolating_points(times: ArrayLike, points: ArrayLike, knots: ArrayLike, degree: int = 3) -> Array:
    """Return the control points (N, D) of the B-spline that passes the points at the times: a banded system.

    Raises
    ------
    InvalidRequest
        ``bad_knots`` where a waypoint lies outside its basis function (Schoenberg-Whitney), or where they do not span
        the times.
    """
    t, x = checked(times, points)
    u = checked_knots(knots, len(x), degree)
    where = "/options/knots"
    if u[degree] != t[0] or u[len(x)] != t[-1]:
        raise InvalidRequest.of(where, "bad_knots", "the valid span must be from the first to the last time")
    inside = (u[: len(x)] < t) & (t < u[degree + 1 :])
    inside[0] |= u[degree] == t[0] and u[0] == t[0]
    inside[-1] |= u[len(x)] == u[-1]
    if not inside.all():
        i = int(np.argmin(inside))
        reason = f"time {i} does not lie inside the support of its basis function (Schoenberg-Whitney): no such curve"
        raise InvalidRequest.of(where, "bad_knots", reason)
    j, values = basis_values(u, degree, t)
    bands = np.zeros((2 * degree + 1, len(x)))
    rows = np.arange(len(x))
    for k in range(degree + 1):
        column = j - degree + k
        near = np.abs(rows - column) <= degree
        bands[degree + rows[near] - column[near], column[near]] = values[near, k]
    try:
        return np.asarray(x[0] + solve_banded((degree, degree), bands, x - x[0]))  # a joint at rest stays exactly so
    except (LinAlgError, ValueError):
        raise InvalidRequest.of(
            where, "bad_knots", "the interpolation conditions are singular with these knots"
        ) from None


def through_waypoints(options: BsplineOptions, times: Array, points: Array, knots: Knots | None) -> Trajectory:
    """Return the B-spline that passes the points at the times."""
    check_degree(len(points), options.degree)
    vector = interpolation_knots(times, options.degree) if knots is None else np.array(knots)
    return bspline(interpolating_points(times, points, vector, options.degree), vector, options.degree)


def by_control_points(options: BsplineOptions, points: Array, duration: DurationBounds | None) -> Trajectory:
    """Return the B-spline with these control points, over its knots or the duration."""
    if options.spacing != "centripetal":
        raise InvalidRequest.of("/options/spacing", "conflict", "control points are not spread: give knots instead")
    curve = bspline(points, parameter_knots(options.knots, len(points), options.degree, duration), options.degree)
    refuse_other_span(curve, duration)
    return curve


def parameter_knots(knots: Knots | None, count: int, degree: int, duration: DurationBounds | None) -> Array:
    """Return the knots given, or clamped even ones on [0, 1] or [0, duration]."""
    check_degree(count, degree)
    return clamped_knots(count, degree, 0.0, clock(duration)) if knots is None else np.array(knots)
