"""The interpolating polynomial: barycentric evaluation, Chebyshev nodes, and how well conditioned a set of nodes is."""

from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, ValidationInfo, field_validator

from ..errors import InvalidRequest
from ..options import MAX_TIME, Conflict
from ..trajectory import Trajectory
from .newton import newton_trajectory
from .options import Spaced, checked

Array = NDArray[np.float64]

#: More nodes than this need a small Lebesgue constant; no nodes may have a larger one than the last.
MOST_NODES, SMALL, LARGEST = 50, 1e4, 1e13
#: By how much rounding may keep it from a point, relative to max(1, their range).
MISSED = 1e-7
#: More would take long, and tell nothing that a spline does not.
MOST_DEGREE = 400

Time = Annotated[float, Field(ge=-MAX_TIME, le=MAX_TIME, allow_inf_nan=False)]


class PolynomialOptions(Spaced):
    """Options of the interpolating polynomial."""

    nodes: Literal["given", "chebyshev"] = Field(
        default="given", description="the times sent, or chebyshev: computed in the interval (then send no times)"
    )
    interval: Annotated[list[Time], Field(min_length=2, max_length=2)] | None = Field(
        default=None,
        description="[a, b] in s, for chebyshev: the whole motion; the nodes lie inside",
        json_schema_extra={"unit": "s"},
    )

    @field_validator("interval")
    @classmethod
    def _belongs(cls, interval: Any, info: ValidationInfo) -> Any:
        if interval is not None and info.data.get("nodes") == "given":
            raise Conflict("belongs to nodes chebyshev: the times are given")
        return interval

    @property
    def fixes_knots(self) -> bool:
        """Whether every waypoint has a node of its own."""
        return self.nodes == "chebyshev"

    @property
    def moves_by_itself(self) -> bool:
        """Whether the clock is the options'."""
        return self.nodes == "chebyshev"


def chebyshev_nodes(count: int, start: float = -1.0, end: float = 1.0) -> Array:
    """Return the Chebyshev nodes of the first kind in (start, end), increasing, shape (count,).

    t_k = (a + b) / 2 + (b - a) / 2 cos((2 k + 1) pi / (2 count)).
    """
    angle = (2 * np.arange(count)[::-1] + 1) * np.pi / (2 * count)
    return np.asarray(0.5 * (start + end) + 0.5 * (end - start) * np.cos(angle))


def barycentric_weights(nodes: ArrayLike) -> Array:
    """Return w_i = 1 / prod_{j != i} (t_i - t_j), scaled so that the largest magnitude is 1.

    Only ratios of the weights count; products are formed on an interval of length 4, as sums of logarithms.
    """
    t = np.asarray(nodes, dtype=np.float64)
    if len(t) < 2:
        return np.ones(len(t))
    gaps = 4.0 * (t[:, None] - t[None, :]) / np.ptp(t)
    np.fill_diagonal(gaps, 1.0)
    size = -np.log(np.abs(gaps)).sum(axis=1)
    return np.asarray(np.prod(np.sign(gaps), axis=1) * np.exp(size - size.max()))


def barycentric(nodes: ArrayLike, points: ArrayLike, times: ArrayLike) -> Array:
    r"""Return the interpolating polynomial at ``times``; exactly the point where a time is a node.

    .. math:: p(t) = \sum_i \frac{w_i x_i}{t - t_i} \Big/ \sum_i \frac{w_i}{t - t_i}

    Parameters
    ----------
    nodes : (N,), distinct, in any order
    points : (N, D)
    times : scalar or (M,)

    Returns
    -------
    (D,) or (M, D)

    References
    ----------
    J.-P. Berrut and L. N. Trefethen, Barycentric Lagrange interpolation, SIAM Review 46(3), 2004.
    """
    t, x = np.asarray(nodes, dtype=np.float64), np.asarray(points, dtype=np.float64)
    if len(np.unique(t)) < len(t):
        raise InvalidRequest.of("/times", "not_increasing", "nodes must differ from one another")
    basis = lagrange_basis(t, times)
    return np.asarray(basis @ x)


def lagrange_basis(nodes: ArrayLike, times: ArrayLike) -> Array:
    """Return the values l_i(t) of the Lagrange polynomials, shape (…, N); their sum is 1."""
    t, at = np.asarray(nodes, dtype=np.float64), np.asarray(times, dtype=np.float64)
    gaps = at[..., None] - t
    hit = gaps == 0.0
    terms = barycentric_weights(t) / np.where(hit, 1.0, gaps)
    found = hit.any(axis=-1, keepdims=True)
    terms = np.where(found, hit.astype(np.float64), terms)
    return np.asarray(terms / terms.sum(axis=-1, keepdims=True))


def lebesgue_constant(nodes: ArrayLike, start: float, end: float) -> float:
    """Return max over [start, end] of sum_i |l_i(t)|: by how much errors of the points are magnified.

    It is the condition number of the interpolation; sampled at 16 places between neighbouring nodes.
    """
    t = np.sort(np.asarray(nodes, dtype=np.float64))
    edges = np.unique(np.concatenate([[start], t, [end]]))
    inner = edges[:-1, None] + np.diff(edges)[:, None] * (np.arange(16) + 0.5) / 16
    at = np.concatenate([inner.reshape(-1), [start, end]])
    return float(np.abs(lagrange_basis(t, at)).sum(axis=-1).max())


def polynomial(times: ArrayLike, points: ArrayLike, start: float | None = None, end: float | None = None) -> Trajectory:
    """Return the polynomial of degree N - 1 or less through the points.

    Parameters
    ----------
    times : (N,), increasing
    points : (N, D)
    start, end : float
        The interval it is wanted on; by default from the first time to the last.

    Raises
    ------
    InvalidRequest
        ``bad_degree`` where the nodes are too ill conditioned to be of use, with the Lebesgue constant.

    References
    ----------
    N. J. Higham, The numerical stability of barycentric Lagrange interpolation, IMA J. Numer. Anal. 24, 2004.
    """
    t, x = checked(times, points, fewest=1)
    if len(t) == 1 and start is None and end is None:
        return Trajectory.hold(x[0], float(t[0]), float(t[0]))
    start, end = float(t[0]) if start is None else start, float(t[-1]) if end is None else end
    refuse_ill_conditioned(t, start, end, "cubic_spline", "polynomial with nodes chebyshev")
    curve = newton_trajectory(t, x, None, start, end)
    refuse_missed(curve, t, x, "cubic_spline")
    return curve


def refuse_ill_conditioned(nodes: Array, start: float, end: float, *instead: str, twice: bool = False) -> None:
    """Raise ``bad_degree`` for nodes through which one polynomial makes no sense, with the condition number.

    ``twice``: slopes are given as well, which squares the condition.
    """
    count = len(nodes) * (2 if twice else 1)
    others = " or ".join(instead)
    if count > MOST_DEGREE:
        raise InvalidRequest.of(
            "/waypoints", "bad_degree", f"degree {count - 1} is over {MOST_DEGREE - 1}: use {others}"
        )
    condition = lebesgue_constant(nodes, start, end) ** (2 if twice else 1)
    if condition > (SMALL if count > MOST_NODES else LARGEST):
        reason = f"one polynomial of degree {count - 1} through these nodes has the condition number {condition:.3g} "
        raise InvalidRequest.of("/waypoints", "bad_degree", f"{reason}(Lebesgue constant): use {others}")


def refuse_missed(curve: Trajectory, nodes: Array, points: Array, instead: str) -> None:
    """Raise ``bad_degree`` where rounding keeps the polynomial from the points it should pass."""
    miss = float(np.abs(curve(np.clip(nodes, curve.start, curve.end)) - points).max())
    if not miss <= MISSED * max(1.0, float(np.ptp(points, axis=0).max())):
        reason = f"one polynomial through these points is lost to rounding (it misses one by {miss:.3g}): use {instead}"
        raise InvalidRequest.of("/waypoints", "bad_degree", reason)
