"""Arithmetic on the coefficients of piecewise polynomials: arrays in, arrays out.

Coefficients have shape (n + 1, K, …): power (highest first) of the local variable u in [0, 1], piece, then joints or
nothing. Bernstein coefficients have the same shape, the first belonging to u = 0.
"""

from functools import cache
from math import comb, factorial, isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InvalidRequest

Array = NDArray[np.float64]


def owned(values: ArrayLike) -> Array:
    """Return a copy that nobody else can change; an array that owns its numbers and is read-only needs none."""
    if isinstance(values, np.ndarray) and values.dtype == np.float64 and values.flags.c_contiguous:
        if values.flags.owndata and not values.flags.writeable:
            return values
    return np.array(values, dtype=np.float64, order="C")


def frozen(values: Array) -> Array:
    """Return the array itself, from now on read-only: a trajectory keeps such a one without a copy."""
    values.setflags(write=False)
    return values


def finite(values: Array) -> bool:
    """Return whether all are finite; their sum costs no memory, but may overflow."""
    return isfinite(values.sum()) or bool(np.isfinite(values).all())


def differentiated(c: Array, order: int) -> Array:
    """Return the u-derivative; at least one (zero) row."""
    n = len(c) - 1
    if order > n:
        return np.zeros_like(c[:1])
    factors = [factorial(k) // factorial(k - order) for k in range(n, order - 1, -1)]
    return np.asarray(c[: n + 1 - order] * _along(np.array(factors, dtype=np.float64), c))


def raised(c: Array, degree: int) -> Array:
    """Return the coefficients with zero rows in front, up to ``degree``."""
    return np.concatenate([np.zeros((degree + 1 - len(c), *c.shape[1:])), c])


def restricted(c: Array, u0: Array, width: Array) -> Array:
    """Return the coefficients in x of c(u0 + width x), piece by piece (u0, width: (K,); width may be negative)."""
    n = len(c) - 1
    low, tail = c[::-1], (slice(None), *[None] * (c.ndim - 2))
    shifted = np.zeros_like(low)
    for k in range(n + 1):  # Taylor shift: the new coefficient k is sum_m C(m, k) u0^(m-k) c_m
        for m in range(k, n + 1):
            shifted[k] += comb(m, k) * (u0 ** (m - k))[tail] * low[m]
    powers = width ** np.arange(n + 1)[:, None]
    return np.asarray((shifted * powers[(slice(None), *tail)])[::-1])


def product(p: Array, w: Array) -> Array:
    """Return the product of vector polynomials p (a, K, D) and scalar ones w (b, K)."""
    out = np.zeros((len(p) + len(w) - 1, *p.shape[1:]))
    for k in range(len(w)):
        out[k : k + len(p)] += p * w[k][:, None]
    return out


def value(c: Array, u: Array) -> Array:
    """Return each piece's value at its own u (K, …): shape (K, …) broadcast with the joints'."""
    result: Array = np.broadcast_to(c[0], np.broadcast_shapes(c[0].shape, u.shape))
    for row in c[1:]:
        result = result * u + row
    return result


@cache
def _bernstein_matrix(n: int) -> Array:
    """Return M with b = M c: Bernstein coefficients from monomial ones, lowest power first."""
    return np.array([[comb(i, k) / comb(n, k) if k <= i else 0.0 for k in range(n + 1)] for i in range(n + 1)])


def to_bernstein(c: Array) -> Array:
    """Return the Bernstein coefficients: sum_i C(n, i) u^i (1 - u)^(n - i) b_i is the same polynomial."""
    return np.tensordot(_bernstein_matrix(len(c) - 1), c[::-1], axes=1)


def from_bernstein(b: Array) -> Array:
    """Return the monomial coefficients, highest power first; their conditioning grows like 3^n.

    c_k = C(n, k) times the k-th forward difference of b at 0, so that what is constant stays exactly so.
    """
    n, rows = len(b) - 1, []
    for k in range(n + 1):
        rows.append(comb(n, k) * b[0])
        b = np.diff(b, axis=0)
    return np.ascontiguousarray(np.stack(rows[::-1]))


def halved(b: Array) -> tuple[Array, Array]:
    """Return the Bernstein coefficients on the left and on the right half (de Casteljau)."""
    return divided(b, 0.5)


def divided(b: Array, at: float | Array) -> tuple[Array, Array]:
    """Return the Bernstein coefficients left and right of u = ``at`` (de Casteljau)."""
    left, right = np.empty_like(b), np.empty_like(b)
    row = b
    for k in range(len(b)):
        left[k], right[len(b) - 1 - k] = row[0], row[-1]
        row = (1.0 - at) * row[:-1] + at * row[1:]
    return left, right


def trimmed(c: Array) -> Array:
    """Return the coefficients without highest powers that are too small to change any value on [0, 1]."""
    size = np.abs(c).max(axis=tuple(range(1, c.ndim)))
    keep = np.flatnonzero(size > 1e-22 * size.max(initial=0.0))
    return c[keep[0] :] if len(keep) else c[-1:]


def cut(breaks: Array, c: Array, times: Array) -> tuple[Array, Array]:
    """Return breaks and coefficients with further breaks at ``times``, which lie strictly inside."""
    extended = np.sort(np.concatenate([breaks, times]))
    piece = np.searchsorted(breaks, extended[:-1], side="right") - 1
    h = np.diff(breaks)[piece]
    return extended, restricted(c[:, piece], (extended[:-1] - breaks[piece]) / h, np.diff(extended) / h)


def composed(breaks: Array, c: Array, law_breaks: Array, law: Array) -> tuple[Array, Array]:
    """Return breaks and coefficients of c(law(t)), for a non-decreasing scalar law (m + 1, L), exactly.

    The law's pieces are cut where they cross a break of the curve; then both are polynomials on each piece.

    Raises
    ------
    InvalidRequest
        ``out_of_range`` where the law leaves the curve, ``not_increasing`` where it runs backwards.
    """
    from .kernels.composition import compose

    _refuse_law(breaks, law)
    inner = crossings(law_breaks, law, breaks)
    if len(inner):
        inner = np.unique(inner[inner < law_breaks[-1]])
        inner = inner[law_breaks[np.searchsorted(law_breaks, inner)] != inner]
        law_breaks, law = cut(law_breaks, law, inner)
    middle = 0.5 * (law[-1] + law.sum(axis=0))
    piece = np.searchsorted(breaks[1:-1], middle, side="right")
    out = np.empty(((len(c) - 1) * (len(law) - 1) + 1, len(piece), c.shape[2]))
    compose(c, np.array(law), piece, breaks[piece], np.diff(breaks)[piece], out)
    return law_breaks, frozen(out)


def _refuse_law(breaks: Array, law: Array) -> None:
    from .kernels.extrema import extrema

    (low, slowest), _, (high, _), _ = (x[:, :, 0] for x in extrema(np.ascontiguousarray(law[:, :, None]), 2))
    slack = 1e-9 * max(float(np.abs(breaks).max()), 1e-300)
    if not (low.min() >= breaks[0] - slack and high.max() <= breaks[-1] + slack):
        raise InvalidRequest.of("law", "out_of_range", "the time law leaves the path's parameter range")
    left, right = law[-1], law.sum(axis=0)
    falls = slowest < -slack  # with respect to u: no piece falls by more than that
    if falls.any() or (left[1:] < right[:-1] - slack).any():
        raise InvalidRequest.of("law", "not_increasing", "the time law runs backwards")


def crossings(breaks: Array, c: Array, values: Array) -> Array:
    """Return the times at which a non-decreasing scalar law (n + 1, K) passes the values strictly inside its pieces."""
    left, right = c[-1], c.sum(axis=0)
    slack = 1e-13 * max(float(np.abs(values).max()), 1e-300)
    first = np.searchsorted(values, left + slack, side="right")
    last = np.searchsorted(values, right - slack, side="left")
    count = np.maximum(last - first, 0)
    if not count.any():
        return np.empty(0)
    piece = np.repeat(np.arange(len(left)), count)
    target = np.concatenate([values[a : a + n] for a, n in zip(first, count, strict=True)])
    chosen = c[:, piece]
    lo, hi = np.zeros(len(piece)), np.ones(len(piece))
    for _ in range(60):  # monotone: plain bisection to the last bit
        u = 0.5 * (lo + hi)
        below = value(chosen, u) < target
        lo, hi = np.where(below, u, lo), np.where(below, hi, u)
    return np.asarray(breaks[piece] + 0.5 * (lo + hi) * np.diff(breaks)[piece])


def _along(factors: Array, c: Array) -> Array:
    return factors.reshape(-1, *[1] * (c.ndim - 1))
