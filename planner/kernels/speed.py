"""The Euclidean norm of a polynomial vector's slope under two quadrature rules: what a length is integrated from."""

import numpy as np
from numba import njit

from .extrema import EPS
from .lanes import LANES, larger, load, plus, product, scaled, smaller, step, store


@njit(cache=True, error_model="numpy")
def speeds(coefficients, piece, left, width, nodes, weights, out):  # type: ignore[no-untyped-def]
    """Write what the two rules find on intervals of pieces.

    Parameters
    ----------
    coefficients : array (n + 1, K, D), n >= 1
        Highest power first, in the local variable u.
    piece : array (I,) of int64
    left, width : array (I,)
        The intervals of u.
    nodes : array (32,)
        In [0, 1]: 8 of the coarse rule, 16 of the fine one, which also looks at both ends, and these: 0, then ones.
    weights : array (24,)
        Of the two rules.
    out : array (6, I)
        Overwritten: the means by both rules; the smallest value, the smaller one at an end, and the largest, of those
        that the fine rule looks at; and the rounding of a value.
    """
    size, _, dims = coefficients.shape
    u, values, room = np.zeros(4 * LANES), np.zeros(4 * LANES), np.zeros(4 * LANES)
    powers = np.zeros(size * 4 * LANES)  # factors of the coefficients: k u^(k - 1) at every node
    begin, extent = -1.0, -1.0
    for q in range(len(piece)):
        i = piece[q]
        if left[q] != begin or width[q] != extent:
            begin, extent = left[q], width[q]
            for m in range(4 * LANES):
                u[m] = begin + extent * nodes[m]
                power = 1.0
                for k in range(1, size):
                    powers[(k * 4) * LANES + m] = k * power
                    power *= u[m]
        x0 = scaled(load(u, 0), 0.0)
        t0 = t1 = t2 = t3 = x0
        noise = 0.0
        for d in range(dims):
            c = coefficients[size - 2, i, d]
            v0 = v1 = v2 = v3 = scaled(load(powers, 4 * LANES), c)
            rounding = abs(c)
            for k in range(2, size):
                c = coefficients[size - 1 - k, i, d]
                rounding += k * abs(c)
                v0 = step(load(powers, (4 * k) * LANES), c, v0)
                v1 = step(load(powers, (4 * k + 1) * LANES), c, v1)
                v2 = step(load(powers, (4 * k + 2) * LANES), c, v2)
                v3 = step(load(powers, (4 * k + 3) * LANES), c, v3)
            t0, t1 = plus(product(v0, v0), t0), plus(product(v1, v1), t1)
            t2, t3 = plus(product(v2, v2), t2), plus(product(v3, v3), t3)
            noise += rounding * rounding
        store(values, 0, t0)
        store(values, LANES, t1)
        store(values, 2 * LANES, t2)
        store(values, 3 * LANES, t3)
        for m in range(4 * LANES):
            values[m] = np.sqrt(values[m])
        x, y, z = load(values, LANES), load(values, 2 * LANES), load(values, 3 * LANES)
        store(room, 0, product(load(values, 0), load(weights, 0)))
        store(room, LANES, plus(product(x, load(weights, LANES)), product(y, load(weights, 2 * LANES))))
        store(room, 2 * LANES, smaller(smaller(x, y), z))
        store(room, 3 * LANES, larger(larger(x, y), z))
        coarse = fine = 0.0
        lowest, highest = room[2 * LANES], room[3 * LANES]
        for m in range(LANES):
            coarse += room[m]
            fine += room[LANES + m]
            lowest, highest = min(lowest, room[2 * LANES + m]), max(highest, room[3 * LANES + m])
        out[0, q], out[1, q], out[2, q], out[4, q] = coarse, fine, lowest, highest
        out[3, q] = min(values[3 * LANES], values[3 * LANES + 1])
        out[5, q] = 64.0 * EPS * np.sqrt(noise)


@njit(cache=True, error_model="numpy")
def length(coefficients, nodes, weights, low, most_pieces, most):  # type: ignore[no-untyped-def]
    """Return the integral of the norm over all pieces, halving intervals where ``planner.quadrature.integral`` would.

    Parameters
    ----------
    coefficients, nodes, weights
        As above.
    low : float
        Where the norm falls to this part of its largest value inside an interval it may have a kink.
    most_pieces, most : int
        Intervals looked at together, and in all.
    """
    pieces = coefficients.shape[1]
    piece, left, width = np.arange(pieces), np.zeros(pieces), np.ones(pieces)
    total, seen = 0.0, 0
    for level in range(48):
        count, found = len(piece), np.empty((6, len(piece)))
        speeds(coefficients, piece, left, width, nodes, weights, found)
        whole = 0.0
        for q in range(count):
            whole += found[1, q] * width[q]
        floor = 1e-11 * max(total + whole, 1e-300) / np.sqrt(count)
        rough, again, smooth = np.zeros(count, np.bool_), 0, 0.0
        for q in range(count):
            coarse, fine, highest = found[0, q], found[1, q], found[4, q]
            allowed = max(floor, found[5, q] * width[q])
            kink = found[2, q] < low * highest and found[3, q] > 1e-9 * highest and width[q] * highest > 10.0 * allowed
            if abs(coarse * width[q] - fine * width[q]) > allowed or kink:
                rough[q] = True
                again += 1
            else:
                smooth += fine * width[q]
        seen += count
        if again == 0 or level == 47 or again > most_pieces or seen > most:
            return total + whole
        total += smooth
        halves, begins, extents = np.empty(2 * again, np.int64), np.empty(2 * again), np.empty(2 * again)
        k = 0
        for q in range(count):
            if rough[q]:
                half = 0.5 * width[q]
                halves[k] = halves[again + k] = piece[q]  # alike next to alike: what their nodes need is found once
                extents[k] = extents[again + k] = half
                begins[k], begins[again + k] = left[q], left[q] + half
                k += 1
        piece, left, width = halves, begins, extents
    return total
