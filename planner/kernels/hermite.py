"""Hermite pieces: from values and derivatives at the knots to coefficients, and how well neighbours agree."""

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def hermite_pieces(h, points, states, out):  # type: ignore[no-untyped-def]
    """Write the pieces that take the points and, in ``states`` (k - 1, N, D), their derivatives of order 1 … k-1.

    Parameters
    ----------
    h : array (N - 1,)
    points : array (N, D)
    states : array (k - 1, N, D), k = 1 (lines), 2, 3 or 4
    out : array (2k, N - 1, D)
        Overwritten: coefficients, highest power first, in the local variable u in [0, 1].
    """
    k = len(states) + 1
    _, gaps, dims = out.shape
    for i in range(gaps):
        step = h[i]
        half = 0.5 * step * step
        sixth = half * step * (1.0 / 3.0)
        for d in range(dims):
            x0 = points[i, d]
            rise = points[i + 1, d] - x0
            if k == 1:
                out[0, i, d], out[1, i, d] = rise, x0
                continue
            v0 = step * states[0, i, d]
            x, v = rise - v0, step * states[0, i + 1, d] - v0
            if k == 2:
                out[0, i, d], out[1, i, d], out[2, i, d], out[3, i, d] = v - 2.0 * x, 3.0 * x - v, v0, x0
                continue
            a0 = half * states[1, i, d]
            x, v, a = x - a0, v - 2.0 * a0, half * states[1, i + 1, d] - a0
            if k == 3:
                out[0, i, d] = 6.0 * x - 3.0 * v + a
                out[1, i, d] = 7.0 * v - 15.0 * x - 2.0 * a
                out[2, i, d] = 10.0 * x - 4.0 * v + a
                out[3, i, d], out[4, i, d], out[5, i, d] = a0, v0, x0
                continue
            j0 = sixth * states[2, i, d]
            x, v, a, j = x - j0, v - 3.0 * j0, a - 3.0 * j0, sixth * states[2, i + 1, d] - j0
            out[0, i, d] = 10.0 * v - 20.0 * x - 4.0 * a + j
            out[1, i, d] = 70.0 * x - 34.0 * v + 13.0 * a - 3.0 * j
            out[2, i, d] = 39.0 * v - 84.0 * x - 14.0 * a + 3.0 * j
            out[3, i, d] = 35.0 * x - 15.0 * v + 5.0 * a - j
            out[4, i, d], out[5, i, d], out[6, i, d], out[7, i, d] = j0, a0, v0, x0


@njit(cache=True, error_model="numpy")
def hermite_jumps(h, pieces, worst):  # type: ignore[no-untyped-def]
    """Write the worst relative jump of the derivatives of order k, k + 1, … at the interior knots into ``worst``.

    ``worst`` has at most k - 1 entries; beyond order 2k - 2 the spline does jump.
    Relative to what the derivative may be in the longer of the two pieces: the sum of its coefficients' sizes, each
    times the number it takes in that derivative, by the step to the power of the order; NaN if a coefficient is. In a
    gap r times shorter than its neighbour, states of precision eps give the m-th derivative but to about eps r^(m-1).
    """
    size, gaps, dims = pieces.shape
    k = size // 2
    weight = np.ones(
        (len(worst), size)
    )  # [row, q]: u^q in the derivative of order k + row at u = 1; 1 below that order
    for row in range(len(worst)):
        for q in range(k + row, size):
            for s in range(k + row):
                weight[row, q] *= q - s
    for row in range(len(worst)):
        m = k + row
        worst[row] = 0.0
        for i in range(1, gaps):
            long = i if h[i] > h[i - 1] else i - 1
            lift = (h[i] / h[i - 1]) ** m  # both sides times h[i]^m
            share = 1.0 if long == i else lift
            for d in range(dims):
                before = scale = 0.0
                for q in range(1, size):
                    scale += weight[row, q] * abs(pieces[size - 1 - q, long, d])
                for q in range(m, size):
                    before += weight[row, q] * pieces[size - 1 - q, i - 1, d]
                jump = abs(weight[row, m] * pieces[size - 1 - m, i, d] - lift * before)
                if jump != 0.0 and not jump <= worst[row] * share * scale:
                    worst[row] = jump / (share * scale)
