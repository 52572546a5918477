"""The worst of a trajectory: where each derivative of each joint comes closest to a limit, or furthest beyond it.

A polynomial lies between the smallest and the largest of its Bernstein coefficients. Those are a few sums, made for
eight polynomials at once; a piece whose hull stays below the worst found so far is passed over, and few are not.
"""

import numpy as np
from numba import njit

from .extrema import EPS, chain, quintic
from .lanes import LANES, exceeds, larger, load, plus, product, scaled, smaller, step, store

#: Places this close to the maximum, relatively, are equally bad: the first of them is told.
TIE = 1e-9
#: A hull above the worst found so far by less than this, relatively, is not looked into: that is rounding.
SLACK = 1e-13
#: The ends of so many pieces, spread over all, are looked at beforehand: few pieces then stand out at their turn.
PROBES = 32
#: So many polynomials, roughly, are looked over at a time.
BLOCK = 128


@njit(cache=True, error_model="numpy")
def _weights(n, orders):  # type: ignore[no-untyped-def]
    """Return, for the coefficient of u^(m + k), its factors in derivative m and in the sums for Bernstein's."""
    plain, own = np.zeros((orders, n + 1)), np.zeros((orders, n + 1))
    for m in range(min(orders, n + 1)):
        binomial = 1.0
        for k in range(n - m + 1):
            factor = 1.0
            for j in range(k + 1, k + m + 1):
                factor *= j
            plain[m, k] = factor
            own[m, k] = factor / binomial
            binomial *= (n - m - k) / (k + 1.0)
    return plain, own


@njit(cache=True, error_model="numpy")
def _hull(c, at, row, degree, plain, own, room):  # type: ignore[no-untyped-def]
    """Return the smallest and the largest Bernstein coefficient of eight polynomials, and the size of their sums.

    The coefficient of u^k is c[at - k * row] * plain[k].
    """
    x = load(c, at)
    low = high = x = scaled(x, plain[0])
    store(room, 0, x)
    size = larger(x, scaled(x, -1.0))
    for k in range(1, degree + 1):
        x = load(c, at - k * row)
        store(room, k * LANES, scaled(x, own[k]))
        x = scaled(x, plain[k])
        size = plus(size, larger(x, scaled(x, -1.0)))
    for r in range(1, degree + 1):
        left = load(room, (r - 1) * LANES)
        for j in range(r, degree + 1):
            x = plus(load(room, j * LANES), left)
            left = load(room, j * LANES)
            store(room, j * LANES, x)
        x = load(room, r * LANES)  # by now complete
        low, high = smaller(x, low), larger(x, high)
    return low, high, size


@njit(cache=True, error_model="numpy")
def _screen(  # type: ignore[no-untyped-def]
    c, start, row, begin, end, degree, weights, room, order, rates, gains, limits, reach
):
    """Return the first of ``begin``, ``begin + LANES``, … from which on one of the next eight polynomials stands out.

    The coefficient of u^k of polynomial f is c[start + f - k * row] * weights[0][k] * rates[f] ** order; f stands out
    where gains[0, f] times its upper bound exceeds limits[0, f] or gains[1, f] times its lower bound limits[1, f].
    These products are left in ``reach``. The bounds allow for rounding, here and in ``extrema``.
    """
    plain, own = weights
    high_gain, low_gain, high_limit, low_limit = gains[0], gains[1], limits[0], limits[1]
    margin = 4.0 * (degree + 2) * EPS
    for f in range(begin, end, LANES):
        if degree == 4:
            low, high, size = _hull(c, start + f, row, 4, plain, own, room)
        elif degree == 3:
            low, high, size = _hull(c, start + f, row, 3, plain, own, room)
        elif degree == 2:
            low, high, size = _hull(c, start + f, row, 2, plain, own, room)
        else:
            low, high, size = _hull(c, start + f, row, degree, plain, own, room)
        high, low = step(size, margin, high), step(size, -margin, low)
        for _ in range(order):
            high, low = product(high, load(rates, f)), product(low, load(rates, f))
        high, low = product(high, load(high_gain, f)), product(low, load(low_gain, f))
        if exceeds(high, load(high_limit, f)) or exceeds(low, load(low_limit, f)):
            store(reach, 0, high)
            store(reach, LANES, low)
            return f
    return end


@njit(cache=True, error_model="numpy")
def _limit(most, shift, known):  # type: ignore[no-untyped-def]
    """Return the gain times value above which a badness may be worse than ``most``."""
    if shift == -np.inf:
        return np.inf
    slack = SLACK * (abs(most - shift) + abs(shift))
    return most - shift + (slack if known else -slack)


@njit(cache=True, error_model="numpy")
def _exact(coefficients, i, d, m, own, table, points, values, found):  # type: ignore[no-untyped-def]
    """Return (low, at_low, high, at_high) of derivative m of one polynomial."""
    size = len(coefficients)
    if m >= size:
        return 0.0, 0.0, 0.0, 0.0
    if size <= 6:
        for k in range(size):
            own[6 - size + k] = coefficients[k, i, d]
        return quintic(own[0], own[1], own[2], own[3], own[4], own[5], m)[m]
    for k in range(size):
        table[0, k] = coefficients[k, i, d]
    chain(table, m, points, values, found)
    return found[m, 0], found[m, 1], found[m, 2], found[m, 3]


@njit(cache=True, error_model="numpy")
def worst(coefficients, rate, row, gain, shift):  # type: ignore[no-untyped-def]
    """Return the largest badness of every derivative and joint over all pieces, and its first place.

    The badness of derivative m (in time) of joint d on piece i, with exact extrema high and low over the piece, is the
    larger of the sides ``gain[0, m, row[i], d] * high + shift[0, m, row[i], d]`` and
    ``gain[1, m, row[i], d] * low + shift[1, m, row[i], d]``.

    Parameters
    ----------
    coefficients : array (n + 1, K, D)
        Highest power first, in the local variable u in [0, 1].
    rate : array (K,)
        1 / duration of each piece.
    row : array (K,) of int64
    gain, shift : array (2, R, S, D)
        gain[0] >= 0 >= gain[1]. Where the shift is -inf, with gain 0, the side does not count.

    Returns
    -------
    badness, value, u : array (R, D)
        At the first place whose badness is the largest, or within ``TIE`` of it, relatively: the derivative's value
        there, and where on the piece.
    piece, side : array (R, D) of int64
        That place's piece; 0 where ``high`` is too high, 1 where ``low`` is too low.
    most : array (R, D)
        The largest badness itself, but for rounding; -inf where no side counts (then there is no place).
    """
    size, pieces, dims = coefficients.shape
    n, total = size - 1, pieces * dims
    orders, rows = gain.shape[1:3]
    badness, most = np.zeros((orders, dims)), np.zeros((orders, dims))
    badness[:] = most[:] = -np.inf
    value, at = np.zeros((orders, dims)), np.zeros((orders, dims))
    piece, side = np.zeros((orders, dims), np.int64), np.zeros((orders, dims), np.int64)
    counts = np.zeros(orders, np.bool_)
    for m in range(orders):
        for s in range(rows):
            for d in range(dims):
                counts[m] |= shift[0, m, s, d] > -np.inf or shift[1, m, s, d] > -np.inf
    plain, own = _weights(n, orders)
    held = LANES * max(BLOCK // (LANES * dims), 1)  # pieces in a block; that is a whole number of eights
    width = held * dims
    room, reach, rates, pad = np.zeros(size * LANES), np.zeros(2 * LANES), np.zeros(width), np.zeros(size * width)
    gains, limits = np.zeros((orders, 2, width)), np.zeros((orders, 2, width))
    held_rows = np.full(held, -1)
    c = coefficients.reshape(-1)
    scalars, table = np.zeros(6), np.zeros((size + 1, size))
    points, values, found = np.zeros(size + 2), np.zeros(size + 2), np.zeros((orders, 4))

    probes = min(PROBES, pieces // 16)
    for probe in range(probes):
        i = probe * pieces // probes
        for m in range(orders):
            for d in range(dims):
                left = right = 0.0
                for k in range(n - m, -1, -1):
                    left = coefficients[n - m - k, i, d] * plain[m, k]
                    right += left
                for k in range(2 if counts[m] else 0):
                    g, s = gain[k, m, row[i], d] * rate[i] ** m, shift[k, m, row[i], d]
                    bad = max(g * left, g * right) + s
                    # a little less, that the place itself, and an equal one before it, are still found
                    bad -= 2.0 * TIE * abs(bad) + SLACK * (abs(bad - s) + abs(s))
                    if bad > most[m, d]:  # and a number
                        most[m, d] = bad

    for begin in range(0, pieces, held):
        count = min(held, pieces - begin)
        source, start, stride = c, begin * dims, total
        if count < held:  # eights would leave the array
            source, start, stride = pad, 0, width
            for k in range(size):
                for f in range(count * dims):
                    pad[k * width + f] = c[k * total + begin * dims + f]
        for p in range(count):
            for d in range(dims):
                rates[p * dims + d] = rate[begin + p]
            if held_rows[p] != row[begin + p]:
                held_rows[p] = s = row[begin + p]
                for m in range(orders):
                    for d in range(dims):
                        for k in range(2):
                            gains[m, k, p * dims + d] = gain[k, m, s, d]
                            limits[m, k, p * dims + d] = _limit(most[m, d], shift[k, m, s, d], badness[m, d] > -np.inf)
        for m in range(orders):
            if not counts[m]:
                continue
            f = min(count, 0)  # no literal, for which Numba would compile the screening once more
            degree = n - m
            reach[:] = 0.0
            while f < count * dims:
                if degree >= 0:
                    where = start + degree * stride
                    end, weights = count * dims, (plain[m], own[m])
                    f = _screen(
                        source, where, stride, f, end, degree, weights, room, m, rates, gains[m], limits[m], reach
                    )
                eight = f
                for f in range(eight, min(eight + LANES, count * dims)):
                    r = f - eight
                    if reach[r] <= limits[m, 0, f] and reach[r + LANES] <= limits[m, 1, f]:
                        continue
                    i, d = begin + f // dims, f % dims
                    low, u1, high, u0 = _exact(coefficients, i, d, m, scalars, table, points, values, found)
                    s, scale = row[i], rate[i] ** m
                    high, low = scale * high, scale * low
                    e0, e1 = gain[0, m, s, d] * high + shift[0, m, s, d], gain[1, m, s, d] * low + shift[1, m, s, d]
                    for turn in range(2):
                        which = turn if u0 <= u1 else 1 - turn  # the side that comes first
                        bad = e0 if which == 0 else e1
                        if bad > most[m, d]:
                            most[m, d] = bad
                            if not (bad <= badness[m, d] + TIE * abs(bad)):
                                badness[m, d], value[m, d] = bad, high if which == 0 else low
                                at[m, d], piece[m, d], side[m, d] = u0 if which == 0 else u1, i, which
                            for p in range(held):
                                s = held_rows[p]
                                for k in range(2 if s >= 0 else 0):
                                    limits[m, k, p * dims + d] = _limit(bad, shift[k, m, s, d], True)
                f = eight + LANES
    return badness, value, at, piece, side, most
