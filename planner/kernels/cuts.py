"""Which limits a curve touches or breaks between its nodes, and the rows over node states that forbid it.

A row says that a derivative at one place keeps its bound. The extremum whose place it is moves with the curve; to
second order, the extremum's value is the row's plus half the square of the slope there over the curvature. Rows with
that term need few rounds where plain ones need many.
"""

import numpy as np
from numba import njit

from .worst import _exact

#: Extrema flatter than this, in sizes of the bound a gap squared, have no second-order term.
FLAT = 1e-3


@njit(cache=True, error_model="numpy")
def _hull(poly, degree, order, own):  # type: ignore[no-untyped-def]
    """Return the smallest and the largest Bernstein coefficient of a derivative on [0, 1]; highest power first."""
    left = degree - order
    factor = 1.0
    for j in range(2, order + 1):
        factor *= j
    binomial = 1.0
    for j in range(left + 1):
        own[j] = poly[degree - order - j, 0, 0] * factor / binomial
        factor *= (order + j + 1.0) / (j + 1.0)
        binomial *= (left - j) / (j + 1.0)
    low = high = own[0]
    for r in range(1, left + 1):
        for j in range(left, r - 1, -1):
            own[j] += own[j - 1]
        low, high = min(low, own[r]), max(high, own[r])
    return low, high


@njit(cache=True, error_model="numpy")
def _weights(basis, m, u, weights):  # type: ignore[no-untyped-def]
    """Let weights be those of a gap's scaled states in the derivative in u of order m, at u."""
    size = len(basis)
    weights[:] = 0.0
    power = 1.0
    for j in range(2, m + 1):
        power *= j
    for j in range(m, size):  # the derivative of u^j
        for a in range(size):
            weights[a] += power * basis[j, a]
        power *= u * (j + 1.0) / (j + 1.0 - m)


@njit(cache=True, error_model="numpy")
def _row(weights, factor, i, direction, shape, columns, values):  # type: ignore[no-untyped-def]
    """Write a row: entries of y and their values; return its constant without the reference."""
    h, local, given = shape[0][i], shape[1], shape[2]
    size, _, dims = local.shape
    half = size // 2
    constant, filled = 0.0, 0
    for d in range(dims):
        if direction[d] == 0.0:
            continue
        scale = factor * direction[d]
        for a in range(size):
            if a == half:
                scale = factor * direction[d]
            value = scale * weights[a]
            scale *= h
            constant += value * given[a, i, d]
            if local[a, i, d] >= 0:
                columns[filled], values[filled] = local[a, i, d], value
                filled += 1
    return constant


@njit(cache=True, error_model="numpy")
def cuts(coefficients, shape, basis, limits, bounds, near, curved, wide):  # type: ignore[no-untyped-def]
    """Return the rows of all places where a limit is nearly touched or broken: at most one a gap, limit and side.

    Limit c on gap i bounds the derivative ``orders[c]`` of ``directions[c, i] @ q``, at the gap's left end alone or
    everywhere. Rows are divided by the limit's size.

    Parameters
    ----------
    coefficients : array (2k, M, D)
        Of the curve, highest power first, in the local variable u in [0, 1].
    shape : tuple of h (M,), local (2k, M, D) of int64, given (2k, M, D), origin (M, D)
        Durations; where in y the states of a gap are (-1: given) and what is given; the reference at its left.
    basis : array (2k, 2k)
        From the scaled states of a gap to its coefficients, lowest power first.
    limits : tuple of orders (C,) of int64, directions (C, M, D), sizes (C, M), everywhere (C,) of bool
    bounds : array (4, C, M)
        Lower and upper bounds to be imposed; and those from which on a limit counts as broken.
    near : float
        Limits closer than this to being broken, in their sizes, count as touched.
    curved : bool
        Whether rows get a second-order term.
    wide : int
        Entries of a row at most.

    Returns
    -------
    place : array (3, R) of int64
        Gap, limit, side (1 above, -1 below).
    u : array (R,)
    columns : array (R, wide) of int64
        -1 for none.
    values, bends : arrays (R, wide)
    upper, offsets, kappa : arrays (R,)
        See ``interior_point``.
    worst : float
        By how much, in its size, the most broken limit is broken; -inf if nothing is touched.
    """
    size, pieces, dims = coefficients.shape
    h, origin = shape[0], shape[3]
    orders, directions, sizes, everywhere = limits
    count = len(orders)
    most = 2 * count * pieces
    place, u = np.empty((3, most), np.int64), np.empty(most)
    poly, own = np.empty((size, 1, 1)), np.empty(size)
    scalars, table = np.zeros(6), np.zeros((size + 1, size))
    points, values, extremes = np.zeros(size + 2), np.zeros(size + 2), np.zeros((4, 4))
    total, worst = 0, -np.inf
    for c in range(count):
        m = orders[c]
        for i in range(pieces):
            room = near * sizes[c, i]
            low, high = bounds[2, c, i] + room, bounds[3, c, i] - room
            if low == -np.inf and high == np.inf:
                continue
            for k in range(size):
                x = 0.0
                for d in range(dims):
                    x += directions[c, i, d] * coefficients[k, i, d]
                poly[k, 0, 0] = x
            scale = 1.0 / h[i] ** m
            at_low = at_high = 0.0
            if everywhere[c]:
                smallest, largest = _hull(poly, size - 1, m, own)
                if smallest * scale >= low and largest * scale <= high:
                    continue
                smallest, at_low, largest, at_high = _exact(poly, 0, 0, m, scalars, table, points, values, extremes)
            else:
                smallest = largest = poly[size - 1 - m, 0, 0]
                for j in range(2, m + 1):
                    smallest *= j
                    largest *= j
            if not largest * scale <= high:
                place[0, total], place[1, total], place[2, total], u[total] = i, c, 1, at_high
                worst = max(worst, (largest * scale - bounds[3, c, i]) / sizes[c, i])
                total += 1
            if not smallest * scale >= low:
                place[0, total], place[1, total], place[2, total], u[total] = i, c, -1, at_low
                worst = max(worst, (bounds[2, c, i] - smallest * scale) / sizes[c, i])
                total += 1

    columns, lines, bends = np.full((total, wide), -1), np.zeros((total, wide)), np.zeros((total, wide))
    upper, offsets, kappa = np.zeros(total), np.zeros(total), np.zeros(total)
    weights = np.empty(size)
    for r in range(total):
        i, c, side = place[0, r], place[1, r], place[2, r]
        m, along = orders[c], directions[c, i]
        factor = side / (sizes[c, i] * h[i] ** m)
        bound = bounds[1, c, i] if side > 0 else bounds[0, c, i]
        _weights(basis, m, u[r], weights)
        constant = _row(weights, factor, i, along, shape, columns[r], lines[r])
        if m == 0:
            for d in range(dims):
                constant += factor * along[d] * origin[i, d]
        upper[r] = side * bound / sizes[c, i] - constant
        if not curved or not everywhere[c] or not 0.0 < u[r] < 1.0 or m + 2 >= size:
            continue
        bend = 0.0  # the second derivative in u
        for j in range(size - 1, m + 1, -1):
            x = 0.0
            for d in range(dims):
                x += along[d] * coefficients[size - 1 - j, i, d]
            for p in range(m + 2):
                x *= j - p
            bend = bend * u[r] + x
        bend *= factor
        if bend < -FLAT:
            kappa[r] = -1.0 / bend
            _weights(basis, m + 1, u[r], weights)
            offsets[r] = _row(weights, factor, i, along, shape, columns[r], bends[r])
    return place[:, :total].copy(), u[:total].copy(), columns, lines, bends, upper, offsets, kappa, worst
