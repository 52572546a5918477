"""Rational pieces x = A / W: derivatives by the quotient rule, and certified enclosures of their extrema.

A quotient of polynomials lies between the least and the largest quotient of their Bernstein coefficients as long as
those of the denominator are positive; halving an interval makes these bounds four times as tight.
"""

from math import comb, perm, prod

import numpy as np
from numpy.typing import NDArray

from .pieces import differentiated, halved, product, raised, to_bernstein, value
from .quadrature import integral

Array = NDArray[np.float64]

#: Relative width of the enclosures of the largest and the smallest value of each derivative and joint.
TIGHT = 1e-10
#: Pieces are first halved until their denominator varies by no more than this factor.
EVEN, MOST_HALVINGS = 2.0, 12
MOST_LEVELS, MOST_INTERVALS = 40, 1 << 15
#: Numbers held at a time, about.
BLOCK = 1 << 20


def quotient(numerator: Array, denominator: Array) -> Array:
    """Return the derivatives of A / W from those of A (R, …, D) and W (R, …), orders 0 … R-1.

    x^(m) = (A^(m) - sum_{j=1..m} C(m, j) W^(j) x^(m-j)) / W.
    """
    out = np.empty_like(numerator)
    for m in range(len(numerator)):
        rest = numerator[m].copy()
        for j in range(1, m + 1):
            rest -= comb(m, j) * denominator[j][..., None] * out[m - j]
        out[m] = rest / denominator[0][..., None]
    return out


def positive(w: Array) -> bool:
    """Return whether the denominators (Bernstein coefficients (n + 1, K)) are certainly positive on their pieces."""
    for _ in range(20):
        if not ((w[0] > 0) & (w[-1] > 0)).all():
            return False
        w = np.concatenate(halved(w[:, ~(w > 0).all(axis=0)]), axis=1)
        if not w.size:
            return True
    return False


def derivative(a: Array, w: Array, order: int) -> tuple[Array, Array]:
    """Return numerator and denominator W^(order + 1) of the u-derivative of A / W, as monomial coefficients.

    N_0 = A, N_m = N_(m-1)' W - m N_(m-1) W'.
    """
    slope, bottom = differentiated(w, 1), w
    for m in range(1, order + 1):
        a = product(differentiated(a, 1), w) - m * product(a, slope)
        bottom = product(bottom[:, :, None], w)[:, :, 0]
    return raised(a, len(bottom) - 1), bottom


def enclosures(whole: Array, scale: Array, group: NDArray[np.int64] | None = None) -> tuple[Array, Array, Array, Array]:
    """Return bounds of the derivatives of A / W on every piece, and where they are (almost) taken.

    Parameters
    ----------
    whole : (n + 1, K, D + 1)
        Monomial coefficients, highest power first; the last joint is the denominator, which is positive.
    scale : (R, K)
        Factor of each order's u-derivative: 1 / duration^m.
    group : (K,)
        Which pieces are judged together; by default all.

    Returns
    -------
    low, at_low, high, at_high : (R, K, D)
        No value lies outside; over each group's pieces the largest and the smallest are tight to 1e-10 of the larger
        magnitude, or to what rounding of the coefficients leaves of them. The places are values of u.
    """
    size, pieces, dims = whole.shape
    group = np.zeros(pieces, dtype=np.int64) if group is None else group
    best = np.full((2, len(scale), int(group.max()) + 1, dims - 1), np.inf)  # of the least and of minus the largest
    rows = [differentiated(whole, m) for m in range(len(scale))]
    for at in (np.stack([r[-1] for r in rows]), np.stack([r.sum(axis=0) for r in rows])):
        ends = quotient(at[..., :-1], at[..., -1]) * scale[:, :, None]
        for m in range(len(scale)):
            np.minimum.at(best[0, m], group, ends[m])
            np.minimum.at(best[1, m], group, -ends[m])
    step = max(1, BLOCK // (4 * size * dims))
    parts = [
        _block(whole[:, k : k + step], scale[:, k : k + step], group[k : k + step], best)
        for k in range(0, pieces, step)
    ]
    low, at_low, high, at_high = (np.concatenate(x, axis=1) for x in zip(*parts, strict=True))
    return low, at_low, high, at_high


def _block(whole: Array, scale: Array, group: NDArray[np.int64], best: Array) -> tuple[Array, Array, Array, Array]:
    pieces, coarse = whole.shape[1], np.abs(whole).sum(axis=0)
    bernstein = to_bernstein(whole)
    a, w = bernstein[..., :-1], bernstein[..., -1]
    piece, left, width = np.arange(pieces), np.zeros(pieces), np.ones(pieces)
    for _ in range(MOST_HALVINGS):
        uneven = (w.max(axis=0) > EVEN * w.min(axis=0)) | (w.min(axis=0) <= 0)
        if not uneven.any():
            break
        a, w = _split(a, uneven), _split(w, uneven)
        piece, left, width = _split_places(piece, left, width, uneven)
    anchor = a[0] / w[0][:, None]
    numerator, bottom = a - anchor * w[:, :, None], w
    reach = np.abs(a / w[:, :, None]).max(axis=0)
    rounding = 2 * np.finfo(float).eps * (coarse[piece, :-1] + reach * coarse[piece, -1:]) / w.min(axis=0)[:, None]
    noises, out = _noises(rounding, w, width, len(scale)), []
    for m, factor in enumerate(scale[:, piece]):
        if m > 0:  # (N / W^m)' = (N' W - m N W') / W^(m+1), kept near zero by the anchor
            numerator = _times(_derivative(numerator), w) - m * _times(numerator, _derivative(w))
            bottom = _times(bottom[:, :, None], w)[:, :, 0]
        top = _elevated(numerator, len(bottom) - 1) * (factor / width**m)[:, None]
        shift = anchor if m == 0 else np.zeros_like(anchor)
        out.append(_enclosed(top, bottom, shift, noises[m] * factor[:, None], (piece, left, width), group, best[:, m]))
    low, at_low, high, at_high = (np.stack(x) for x in zip(*out, strict=True))
    return low, at_low, high, at_high


def squared_integral(whole: Array, rate: Array, order: int) -> float:
    """Return the integral of the squared Euclidean norm of a derivative, by quadrature to about 1e-7.

    Parameters
    ----------
    whole : (n + 1, K, D + 1)
        Monomial coefficients, highest power first, the denominator's last.
    rate : (K,)
        1 / duration of each piece.
    """
    if not rate.any():
        return 0.0
    rows = [differentiated(whole, m) for m in range(order + 1)]

    def squared(piece: NDArray[np.int64], u: Array) -> Array:
        found = np.stack([value(c[:, piece, None], u[..., None]) for c in rows])
        norm = (quotient(found[..., :-1], found[..., -1])[order] ** 2).sum(axis=-1)
        return np.asarray(norm * rate[piece, None] ** (2 * order - 1))

    pieces = np.arange(whole.shape[1])
    typical = np.sqrt(squared(pieces, np.broadcast_to(np.linspace(0, 1, 17), (len(pieces), 17))).mean(axis=1))
    off = noise_of(whole, order) * rate ** (order - 0.5)
    return integral(squared, whole.shape[1], 2 * typical * off + off**2, 1 << 13)


def noise_of(whole: Array, order: int) -> Array:
    """Return about how much rounding moves a u-derivative on each piece, (K,): no bound, but where to stop refining."""
    n, size = len(whole) - 1, np.abs(whole).sum(axis=0)
    most = size[:, :-1].max(axis=1) / np.maximum(whole[-1, :, -1], whole[:, :, -1].sum(axis=0))
    return np.asarray(_markov(n, order) * np.finfo(float).eps * most)


def _noises(rounding: Array, w: Array, width: Array, orders: int) -> list[Array]:
    """Return how far an error e = E / W of size ``rounding`` (I, D) may move the u-derivatives of a quotient.

    E is a polynomial on the whole piece, so Markov's inequality bounds its derivatives; then
    |e^(m)| <= |E^(m)| / W + sum_j C(m, j) |W^(j)| / W |e^(m-j)|, with W^(j) from the Bernstein coefficients (n + 1, I).
    """
    n, spread = len(w) - 1, (w.max(axis=0) - w.min(axis=0)) / w.min(axis=0)
    out = [rounding]
    for m in range(1, orders):
        worst = _markov(n, m) * rounding
        for j in range(1, min(m, n) + 1):
            slope = perm(n, j) * 2.0 ** (j - 1) * spread / width**j
            worst = worst + comb(m, j) * slope[:, None] * out[m - j]
        out.append(worst)
    return out


def _markov(n: int, order: int) -> float:
    """Return the largest derivative on [0, 1] of a polynomial of degree n that stays within ±1 there."""
    return prod(2.0 * (n * n - j * j) / (2 * j + 1) for j in range(order)) if order <= n else 0.0


Places = tuple[NDArray[np.int64], Array, Array]


def _enclosed(
    top: Array, bottom: Array, shift: Array, noise: Array, places: Places, group: NDArray[np.int64], best: Array
) -> tuple[Array, Array, Array, Array]:
    """Return low, at_low, high, at_high (K, D) of shift + top / bottom, by halving where the largest may be.

    ``noise`` (I, D) is added on both sides; ``best`` (2, G, D), the least and minus the largest value known to be
    taken in each group, is kept up to date.
    """
    piece, left, width = places
    noise = noise + 16 * np.finfo(float).eps * len(top) * np.abs(top).max(axis=0) / bottom.min(axis=0)[:, None]
    pieces, found = len(group), []
    for level in range(MOST_LEVELS):
        ratio = top / bottom[:, :, None]
        least, most = ratio.min(axis=0) + shift - noise, ratio.max(axis=0) + shift + noise
        ends = ratio[[0, -1]] + shift  # values that are taken
        mine = group[piece]
        np.minimum.at(best[0], mine, ends.min(axis=0))
        np.minimum.at(best[1], mine, -ends.max(axis=0))
        slack = TIGHT * np.abs(best).max(axis=0)[mine] + 4 * noise
        wide = ((most > slack - best[1][mine]) | (least < best[0][mine] - slack)).any(axis=1)
        if level == MOST_LEVELS - 1 or wide.sum() > MOST_INTERVALS:  # what is known holds, only less tightly
            wide[:] = False
        found.append((piece[~wide], left[~wide], (left + width)[~wide], least[~wide], most[~wide], *ends[:, ~wide]))
        if not wide.any():
            break
        top, bottom = (np.concatenate(halved(x[:, wide]), axis=1) for x in (top, bottom))
        noise, shift = np.tile(noise[wide], (2, 1)), np.tile(shift[wide], (2, 1))
        half = 0.5 * width[wide]
        left = np.concatenate([left[wide], left[wide] + half])
        piece, width = np.tile(piece[wide], 2), np.tile(half, 2)
    owner = np.concatenate([f[0] for f in found])
    least, most = (np.concatenate([f[k] for f in found]) for k in (3, 4))
    high, low = _largest(owner, most, pieces), -_largest(owner, -least, pieces)
    where = np.concatenate([f[k] for k in (1, 2) for f in found])
    taken = np.concatenate([f[k] for k in (5, 6) for f in found])
    latest = np.argsort(-where, kind="stable")  # the last first, so that of equals the earliest is written last
    owner, where, taken = np.tile(owner, 2)[latest], where[latest], taken[latest]
    return low, _where_largest(owner, where, -taken, pieces), high, _where_largest(owner, where, taken, pieces)


def _largest(piece: NDArray[np.int64], values: Array, pieces: int) -> Array:
    """Return the largest of the values (I, D) on each piece, (K, D)."""
    out = np.full((pieces, values.shape[1]), -np.inf)
    np.maximum.at(out, piece, values)
    return out


def _where_largest(piece: NDArray[np.int64], at: Array, values: Array, pieces: int) -> Array:
    """Return the place of the largest of the values (I, D) on each piece, the last of equal ones in their order."""
    largest, where = _largest(piece, values, pieces), np.zeros((pieces, values.shape[1]))
    for joint in range(values.shape[1]):
        row = np.flatnonzero(values[:, joint] == largest[piece, joint])
        where[piece[row], joint] = at[row]
    return where


def _split(b: Array, where: NDArray[np.bool_]) -> Array:
    return np.concatenate([b[:, ~where], *halved(b[:, where])], axis=1)


def _split_places(
    piece: NDArray[np.int64], left: Array, width: Array, where: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], Array, Array]:
    half = 0.5 * width[where]
    return (
        np.concatenate([piece[~where], piece[where], piece[where]]),
        np.concatenate([left[~where], left[where], left[where] + half]),
        np.concatenate([width[~where], half, half]),
    )


def _derivative(b: Array) -> Array:
    """Return the derivative's Bernstein coefficients, n (b_{i+1} - b_i); zero for a constant."""
    return (len(b) - 1) * np.diff(b, axis=0) if len(b) > 1 else np.zeros_like(b)


def _times(b: Array, w: Array) -> Array:
    """Return the product of b (n + 1, K, D) and w (m + 1, K), in Bernstein coefficients of degree n + m."""
    n, m = len(b) - 1, len(w) - 1
    out = np.zeros((n + m + 1, *b.shape[1:]))
    for j in range(m + 1):
        for i in range(n + 1):
            out[i + j] += comb(n, i) * comb(m, j) / comb(n + m, i + j) * b[i] * w[j][:, None]
    return out


def _elevated(b: Array, degree: int) -> Array:
    """Return the coefficients at a higher degree; the polynomial is the same."""
    for n in range(len(b), degree + 1):
        i = (np.arange(n + 1) / n).reshape(-1, *[1] * (b.ndim - 1))
        padded = np.concatenate([b[:1], b, b[-1:]])
        b = i * padded[:-1] + (1.0 - i) * padded[1:]
    return b
