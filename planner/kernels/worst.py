"""The worst of a trajectory: where each derivative of each joint comes closest to a limit, or furthest beyond it.

Bounds of eight polynomials at once, from sums of their coefficients, and what they are at their ends leave few pieces
that may be the worst. Of those the smallest and the largest Bernstein coefficients are bounds that are tighter, and
exact where they belong to an end; what then remains has its extrema found.
"""

import numpy as np
from numba import njit

from .extrema import EPS, chain, quintic
from .lanes import LANES, exceeds, larger, load, plus, product, scaled, smaller, step, store

#: Places this close to the maximum, relatively, are equally bad: the first of them is told.
TIE = 1e-9
#: A hull above the worst found so far by less than this, relatively, is not looked into: that is rounding.
SLACK = 1e-13
#: Room below the largest number, and below zero.
LARGEST, TINY = 1.79e308, 1e-300
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
    """Write bounds of eight polynomials to ``room``: the largest and the smallest Bernstein coefficient, and both ends.

    The coefficient of u^k is c[at - k * row] * plain[k]. The bounds allow for rounding, here and in ``extrema``.
    """
    x = load(c, at)
    low = high = first = x = scaled(x, plain[0])
    work = 4 * LANES
    store(room, work, x)
    size = larger(x, scaled(x, -1.0))
    for k in range(1, degree + 1):
        x = load(c, at - k * row)
        store(room, work + k * LANES, scaled(x, own[k]))
        x = scaled(x, plain[k])
        size = plus(size, larger(x, scaled(x, -1.0)))
    for r in range(1, degree + 1):
        left = load(room, work + (r - 1) * LANES)
        for j in range(r, degree + 1):
            x = plus(load(room, work + j * LANES), left)
            left = load(room, work + j * LANES)
            store(room, work + j * LANES, x)
        x = load(room, work + r * LANES)  # by now complete
        low, high = smaller(x, low), larger(x, high)
    margin = 4.0 * (degree + 2) * EPS
    store(room, 0, step(size, margin, high))
    store(room, LANES, step(size, -margin, low))
    # x is the last coefficient, and with the first one the only values of the polynomial among them
    store(room, 2 * LANES, step(size, margin, larger(first, x)))
    store(room, 3 * LANES, step(size, -margin, smaller(first, x)))


@njit(cache=True, error_model="numpy")
def _bounds(c, start, row, end, degree, plain, order, rates, sides, reach, to, best):  # type: ignore[no-untyped-def]
    """Write how bad polynomials can be, at most, on either side, and raise ``best`` to how bad their ends are.

    p(u) lies between c_0 plus the sum of the negative and of the positive further coefficients. The coefficient of u^k
    of polynomial f is c[start + f - k * row] * plain[k] * rates[f] ** order. The bounds allow for rounding.
    """
    margin = 4.0 * (degree + 2) * EPS
    high_gain, high_shift, low_gain, low_shift = sides[0], sides[1], sides[2], sides[3]
    high_reach, low_reach = reach[0], reach[1]
    for f in range(0, end, LANES):
        at = start + f
        first = scaled(load(c, at), plain[0])
        size = rest = scaled(first, 0.0)
        for k in range(1, degree + 1):
            at -= row
            x = scaled(load(c, at), plain[k])
            rest = plus(rest, x)
            size = plus(size, larger(x, scaled(x, -1.0)))
        last = plus(first, rest)
        middle = step(rest, 0.5, first)
        size = plus(scaled(size, 0.5 + margin), scaled(larger(first, scaled(first, -1.0)), margin))
        high, low = plus(middle, size), plus(middle, scaled(size, -1.0))
        most, least = larger(first, last), smaller(first, last)
        scale = load(rates, f)
        for _ in range(order):
            high, low, most, least = (
                product(high, scale),
                product(low, scale),
                product(most, scale),
                product(least, scale),
            )
        gain, shift = load(high_gain, f), load(high_shift, f)
        store(high_reach, to + f, plus(product(high, gain), shift))
        bad = plus(product(most, gain), shift)
        gain, shift = load(low_gain, f), load(low_shift, f)
        store(low_reach, to + f, plus(product(low, gain), shift))
        bad = larger(plus(product(least, gain), shift), bad)
        store(best, f, larger(bad, load(best, f)))


@njit(cache=True, error_model="numpy")
def _next(high, low, begin, end, limits, turn):  # type: ignore[no-untyped-def]
    """Return the first of ``begin``, ``begin + LANES``, … from which on one of eight exceeds its limit, or ``end``.

    Limits come again after ``len(limits)``; those of ``begin`` start at ``turn``.
    """
    for f in range(begin, end, LANES):
        above = load(limits, turn)
        if exceeds(load(high, f), above) or exceeds(load(low, f), above):
            return f
        turn += LANES
        if turn == len(limits):
            turn = 0
    return end


@njit(cache=True, error_model="numpy")
def _limit(most):  # type: ignore[no-untyped-def]
    """Return the badness above which a bound says that a place may be worse than ``most``."""
    return most + SLACK * abs(most) if abs(most) < np.inf else most


@njit(cache=True, error_model="numpy")
def _at_ends(coefficients, i, d, degree, plain):  # type: ignore[no-untyped-def]
    """Return (low, at_low, high, at_high) of a derivative whose extremes are at the ends of the piece."""
    left, right = coefficients[degree, i, d] * plain[0], 0.0
    for k in range(degree + 1):
        right += coefficients[k, i, d] * plain[degree - k]
    low, at_low = (left, 0.0) if left <= right else (right, 1.0)
    high, at_high = (left, 0.0) if left >= right else (right, 1.0)
    return low, at_low, high, at_high


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
    if size - m <= 6:  # the derivative itself is a quintic at most
        own[:] = 0.0
        for k in range(size - m):
            x = coefficients[k, i, d]
            for j in range(m):
                x *= size - 1 - k - j
            own[6 - size + m + k] = x
        lowest = min(m, 0)  # no literal, for which Numba would compile it once more
        return quintic(own[0], own[1], own[2], own[3], own[4], own[5], lowest)[0]
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
    padded = (pieces + held - 1) // held * width
    room, rates, pad = np.zeros((size + 4) * LANES), np.zeros(width), np.zeros(size * width)
    reach, best = np.empty((orders, 2, padded)), np.zeros((orders, width))
    best[:] = -np.inf
    sides = np.zeros((orders, 4, width))  # gain and shift of what is too high, and of what is too low
    held_rows = np.full(held, -1)
    c = coefficients.reshape(-1)
    scalars, table = np.zeros(6), np.zeros((size + 1, size))
    points, values, found = np.zeros(size + 2), np.zeros(size + 2), np.zeros((orders, 4))

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
                            sides[m, 2 * k, p * dims + d] = gain[k, m, s, d]
                            sides[m, 2 * k + 1, p * dims + d] = shift[k, m, s, d] - SLACK * abs(shift[k, m, s, d])
        for p in range(count, held):  # what fills up the last block counts for nothing
            for m in range(orders):
                for f in range(p * dims, (p + 1) * dims):
                    sides[m, 0, f] = sides[m, 2, f] = 0.0
                    sides[m, 1, f] = sides[m, 3, f] = -np.inf
        for m in range(orders):
            degree = max(n - m, 0)
            where, end = start + degree * stride, count * dims if counts[m] else 0
            _bounds(source, where, stride, end, degree, plain[m], m, rates, sides[m], reach[m], begin * dims, best[m])

    least = np.zeros((orders, dims))  # what the badness of a place next to a limit's own value may be wrong by
    for m in range(orders):
        for d in range(dims):
            for k in range(2):
                for s in range(shift.shape[2]):
                    if shift[k, m, s, d] > -np.inf:
                        least[m, d] = max(least[m, d], SLACK * abs(shift[k, m, s, d]))
    limits = best  # from here on: above which badness a side may be worse than the worst found so far
    for m in range(orders):
        if not counts[m]:
            continue
        for d in range(dims):
            for p in range(held):
                most[m, d] = max(most[m, d], best[m, p * dims + d])
            if most[m, d] > -np.inf:
                # a little less, that the place itself, and an equal one before it, are still found
                most[m, d] = min(most[m, d], LARGEST) - 2.0 * TIE * abs(most[m, d]) - TINY - least[m, d]
            for p in range(held):
                limits[m, p * dims + d] = _limit(most[m, d])
        degree = max(n - m, 0)
        eight = min(m, 0)  # no literal, as above
        while True:
            eight = _next(reach[m, 0], reach[m, 1], eight, total, limits[m], eight % width)
            if eight >= total:
                break
            if eight + LANES <= total:
                _hull(c, eight + degree * total, total, degree, plain[m], own[m], room)
            else:
                for k in range(degree + 1):
                    for f in range(eight, total):
                        pad[(degree - k) * LANES + f - eight] = c[(degree - k) * total + f]
                _hull(pad, degree * LANES, LANES, degree, plain[m], own[m], room)
            for f in range(eight, min(eight + LANES, total)):
                r, i, d = f - eight, f // dims, f % dims
                s, scale, limit = row[i], rate[i] ** m, limits[m, d]
                g0, g1, s0, s1 = gain[0, m, s, d], gain[1, m, s, d], shift[0, m, s, d], shift[1, m, s, d]
                is_high = not g0 * scale * room[r] + (s0 - SLACK * abs(s0)) <= limit
                is_low = not g1 * scale * room[r + LANES] + (s1 - SLACK * abs(s1)) <= limit
                if not (is_high or is_low):
                    continue
                if (not is_high or room[r] <= room[r + 2 * LANES]) and (
                    not is_low or room[r + LANES] >= room[r + 3 * LANES]
                ):
                    low, u1, high, u0 = _at_ends(coefficients, i, d, degree, plain[m])
                else:
                    low, u1, high, u0 = _exact(coefficients, i, d, m, scalars, table, points, values, found)
                high, low = scale * high, scale * low
                e0, e1 = g0 * high + s0, g1 * low + s1
                for first in range(2):
                    which = first if u0 <= u1 else 1 - first  # the side that comes first
                    bad = e0 if which == 0 else e1
                    if bad > most[m, d]:
                        most[m, d] = bad
                        if not (bad <= badness[m, d] + TIE * abs(bad)):
                            badness[m, d], value[m, d] = bad, high if which == 0 else low
                            at[m, d], piece[m, d], side[m, d] = u0 if which == 0 else u1, i, which
                        for p in range(held):
                            limits[m, p * dims + d] = _limit(bad)
            eight += LANES
    return badness, value, at, piece, side, most
