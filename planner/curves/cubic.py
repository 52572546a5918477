"""The C2 cubic spline in every boundary variant, O(N) in the number of points."""

from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Discriminator, Field, Tag
from scipy.linalg import solve_banded

from ..errors import InvalidRequest
from ..kernels.splines import hermite_states
from ..options import MAX_TIME, MAX_VALUE
from ..reading import increasing, matrix, vector
from ..trajectory import Trajectory
from .options import Spaced, checked

Array = NDArray[np.float64]

End = Literal["clamped", "second_derivative", "natural", "not_a_knot"]
Kind = Literal["clamped", "second_derivative", "natural", "not_a_knot", "periodic", "start_conditions"]


def _form(value: Any) -> str:
    return "#pair" if isinstance(value, (list, tuple)) else "#kind"


BoundaryOption = Annotated[
    Annotated[Kind, Tag("#kind")] | Annotated[list[End], Field(min_length=2, max_length=2), Tag("#pair")],
    Discriminator(_form),
]


class CubicSplineOptions(Spaced):
    """Options of the cubic spline."""

    boundary: BoundaryOption = Field(
        default="clamped",
        description="What closes the spline: clamped takes the end velocities, second_derivative the end accelerations "
        "(zero unless sent), natural has zero end accelerations, periodic repeats, not_a_knot joins the outer two "
        "pieces, start_conditions takes velocity and acceleration at the start; or a pair [start, end].",
    )

    @property
    def closed(self) -> bool:
        """Whether the boundary is periodic."""
        return self.boundary == "periodic"

    def check(self, points: Array) -> None:
        """Raise InvalidRequest where the boundary needs more points."""
        cubic_spline(np.arange(len(points)), points, self.boundary)


def ends_of(boundary: Any) -> tuple[str, str]:
    """Return the boundary kind at the start and at the end."""
    return (boundary, boundary) if isinstance(boundary, str) else (boundary[0], boundary[1])


def cubic_spline(
    times: ArrayLike,
    points: ArrayLike,
    boundary: Any = "clamped",
    start: ArrayLike = 0.0,
    end: ArrayLike = 0.0,
    start_acceleration: ArrayLike = 0.0,
) -> Trajectory:
    r"""Return the C2 cubic spline through the points.

    With h_k = t_{k+1} - t_k and d_k = (x_{k+1} - x_k) / h_k the knot slopes s_k satisfy

    .. math:: h_k s_{k-1} + 2 (h_{k-1} + h_k) s_k + h_{k-1} s_{k+1} = 3 (h_k d_{k-1} + h_{k-1} d_k).

    Parameters
    ----------
    times : (N,), increasing
    points : (N, D)
    boundary
        A kind, or a pair [start, end] of kinds; see ``CubicSplineOptions``.
    start, end : (D,)
        The value that the kind takes at that end: a velocity (clamped, start_conditions) or an acceleration
        (second_derivative).
    start_acceleration : (D,)
        For start_conditions, beside the velocity ``start``.

    Raises
    ------
    InvalidRequest
        ``not_periodic`` if first and last point differ by more than 1e-9 of the range; ``too_few_points`` for a
        periodic spline of two points; ``bad_boundary`` if start conditions make the curve grow beyond 1e9.

    References
    ----------
    C. de Boor, A Practical Guide to Splines, Springer, 1978, chapter IV.
    """
    t, x = checked(times, points)
    kinds = ends_of(boundary)
    if set(kinds) <= {"clamped", "natural"}:
        return _least_bent(t, x, kinds, start, end)
    h = np.diff(t)[:, None]
    d = np.diff(x, axis=0) / h
    if boundary == "periodic":
        slopes = _periodic(x, h, d)
    elif boundary == "start_conditions":
        slopes = _from_start(x, h, d, np.asarray(start), np.asarray(start_acceleration))
    else:
        slopes = _two_ends(h, d, kinds, np.asarray(start), np.asarray(end))
    return Trajectory.from_hermite(t, x, slopes)


def move(*pairs: Any) -> Trajectory:
    """Return the motion of ``move(t1, x1, t2, x2, …)``: the cubic spline through x_k at t_k, at rest at both ends.

    Each x_k holds one number or the D numbers of all axes, which share the knots.

    Raises
    ------
    InvalidRequest
        ``too_few_points``, ``shape_mismatch``, ``not_increasing`` or ``not_finite``.
    """
    times, points = pairs[0::2], pairs[1::2]
    if len(times) != len(points):
        raise InvalidRequest.of("/times", "shape_mismatch", "needs a point for every time")
    if len(times) < 2:
        raise InvalidRequest.of("/waypoints", "too_few_points", "needs at least two waypoints")
    t = increasing(vector(list(times), "/times", largest=MAX_TIME), "/times")
    return cubic_spline(t, matrix([np.atleast_1d(x).tolist() for x in points], "/waypoints"))


def _least_bent(t: Array, x: Array, kinds: tuple[str, str], start: ArrayLike, end: ArrayLike) -> Trajectory:
    """Return the spline that minimises the integral of the squared acceleration, each end's velocity given or free."""
    ends, states = np.zeros((2, 1, x.shape[1])), np.empty((1, *x.shape))
    ends[0, 0], ends[1, 0] = start, end
    fixed = np.array([[kind == "clamped"] for kind in kinds])
    if not hermite_states(np.diff(t), x, ends, fixed, states):
        raise OverflowError("the spline's slopes leave the range of floating point")
    return Trajectory.from_states(t, x, states)


def _two_ends(h: Array, d: Array, kinds: tuple[str, str], start: Array, end: Array) -> Array:
    """Solve the tridiagonal system; row 0 and row N-1 close it, the right one being the left one mirrored."""
    n, dims = len(h) + 1, d.shape[1]
    not_a_knot = [k == "not_a_knot" for k in kinds]
    if n == 2 and any(not_a_knot):
        return _line_or_parabola(h, d, kinds, start, end)
    if n == 3 and all(not_a_knot):  # both ends ask for one and the same thing: a single parabola
        a = (d[1] - d[0]) / (h[0] + h[1])
        return np.stack([d[0] - a * h[0], d[0] + a * h[0], d[1] + a * h[1]])
    bands, right = np.zeros((5, n)), np.zeros((n, dims))  # bands[2 + i - j, j] = A[i, j]
    bands[2, 1:-1] = 2 * (h[:-1] + h[1:])[:, 0]
    bands[3, :-2] = h[1:, 0]
    bands[1, 2:] = h[:-1, 0]
    right[1:-1] = 3 * (h[1:] * d[:-1] + h[:-1] * d[1:])
    first, value = _end_row(kinds[0], h, d, start, 1.0)
    bands[2, 0], bands[1, 1], bands[0, 2 if n > 2 else 0] = first if n > 2 else (first[0], first[1], 0.0)
    right[0] = value
    last, value = _end_row(kinds[1], h[::-1], d[::-1], end, -1.0)
    bands[2, n - 1], bands[3, n - 2] = last[0], last[1]
    if n > 2:
        bands[4, n - 3] = last[2]
    right[-1] = value
    return np.asarray(solve_banded((2, 2), bands, right))


def _end_row(kind: str, h: Array, d: Array, value: Array, sign: float) -> tuple[tuple[float, float, float], Array]:
    """Return the row of an end (its own slope, the next, the one after) and its right-hand side."""
    if kind == "clamped":
        return (1.0, 0.0, 0.0), value
    if kind == "not_a_knot":  # the third derivative is continuous at the neighbouring knot
        h0, h1 = float(h[0, 0]), float(h[1, 0])
        right = 2 * (h1**2 * d[0] - h0**2 * d[1])
        return (h1**2, h1**2 - h0**2, -(h0**2)), right
    acceleration = value if kind == "second_derivative" else 0.0
    return (2.0, 1.0, 0.0), 3 * d[0] - sign * acceleration * h[0] / 2


def _line_or_parabola(h: Array, d: Array, kinds: tuple[str, str], start: Array, end: Array) -> Array:
    """Two points with not-a-knot: the lowest degree that meets the other end's condition."""
    slopes = np.concatenate([d, d])
    if kinds[0] == "clamped":
        slopes = np.stack([start + 0 * d[0], 2 * d[0] - start])
    elif kinds[1] == "clamped":
        slopes = np.stack([2 * d[0] - end, end + 0 * d[0]])
    elif kinds[0] == "second_derivative":
        slopes = np.stack([d[0] - start * h[0] / 2, d[0] + start * h[0] / 2])
    elif kinds[1] == "second_derivative":
        slopes = np.stack([d[0] - end * h[0] / 2, d[0] + end * h[0] / 2])
    return slopes


def _periodic(x: Array, h: Array, d: Array) -> Array:
    """Solve the cyclic tridiagonal system by the Sherman-Morrison formula."""
    if len(x) < 3:
        raise InvalidRequest.of("/waypoints", "too_few_points", "a periodic spline needs at least three points")
    gap = np.abs(x[-1] - x[0])
    if (gap > 1e-9 * np.maximum(np.ptp(x, axis=0), 1e-300)).any():
        joint = int(np.argmax(gap))
        raise InvalidRequest.of("/waypoints", "not_periodic", f"joint {joint}: first and last waypoint must be equal")
    n = len(h)  # unknown slopes 0 … n-1; slope n is slope 0
    before, after = np.roll(h, 1, axis=0), h
    right = 3 * (after * np.roll(d, 1, axis=0) + before * d)
    diagonal, lower, upper = 2 * (before + after)[:, 0], after[:, 0], before[:, 0]
    if n == 2:
        matrix = np.array([[diagonal[0], lower[0] + upper[0]], [lower[1] + upper[1], diagonal[1]]])
        s = np.linalg.solve(matrix, right)
        return np.concatenate([s, s[:1]])
    corner_top, corner_bottom = lower[0], upper[-1]
    gamma = -diagonal[0]
    bands = np.zeros((3, n))
    bands[0, 1:], bands[1], bands[2, :-1] = upper[:-1], diagonal, lower[1:]
    bands[1, 0] -= gamma
    bands[1, -1] -= corner_top * corner_bottom / gamma
    u = np.zeros((n, 1))
    u[0], u[-1] = gamma, corner_bottom
    both = solve_banded((1, 1), bands, np.concatenate([right, u], axis=1))
    y, z = both[:, :-1], both[:, -1:]
    weight = (y[0] + corner_top / gamma * y[-1]) / (1.0 + z[0] + corner_top / gamma * z[-1])
    s = y - z * weight
    return np.concatenate([s, s[:1]])


def _from_start(x: Array, h: Array, d: Array, velocity: Array, acceleration: Array) -> Array:
    """Recur from velocity and acceleration at the first knot; errors grow by about 3.7 at every knot."""
    slopes = np.zeros_like(x)
    slopes[0] = velocity
    with np.errstate(over="ignore", invalid="ignore"):
        slopes[1] = 3 * d[0] - 2 * slopes[0] - acceleration * h[0] / 2
        for k in range(1, len(h)):
            right = 3 * (h[k] * d[k - 1] + h[k - 1] * d[k])
            slopes[k + 1] = (right - h[k] * slopes[k - 1] - 2 * (h[k - 1] + h[k]) * slopes[k]) / h[k - 1]
        worst = np.abs(slopes[:-1] * h).max()
    if not worst <= MAX_VALUE:
        raise InvalidRequest.of(
            "/options/boundary", "bad_boundary", "start conditions make the curve grow beyond 1e9: use another boundary"
        )
    return slopes
