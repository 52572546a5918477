"""Evaluation of a piecewise polynomial and its derivatives at many times, in one pass.

The piece is found by marching where times increase and by bisection where they do not; its coefficients, with those of
the derivatives asked for, are gathered once per visit.
"""

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def evaluate(breaks, coefficients, times, first, out):  # type: ignore[no-untyped-def]
    """Write the derivatives of order ``first`` … ``first + R - 1`` at the times into ``out``.

    Parameters
    ----------
    breaks : array (K + 1,)
    coefficients : array (n + 1, K, D)
        Highest power first, in the local variable u = (t - breaks[i]) / (breaks[i + 1] - breaks[i]).
    times : array (M,)
        Within the breaks; at a break the piece to its right counts, at the end the last one.
    first : int
    out : array (R, M, D)
        Overwritten.
    """
    size, pieces, dims = coefficients.shape
    n = size - 1
    orders, count, _ = out.shape
    local = np.zeros((orders, size, dims))  # the derivatives of the current piece, highest power first
    current = -1
    left = rate = 0.0
    for k in range(count):
        t = times[k]
        i = max(current, 0)
        if t < breaks[i]:
            i = 0
        if i + 8 < pieces and t >= breaks[i + 8]:
            low, high = i, pieces
            while high - low > 1:
                middle = (low + high) // 2
                if t >= breaks[middle]:
                    low = middle
                else:
                    high = middle
            i = low
        while i + 1 < pieces and t >= breaks[i + 1]:
            i += 1
        if i != current:
            current, left = i, breaks[i]
            width = breaks[i + 1] - left
            rate = 1.0 / width if width > 0.0 else 0.0
            scale = 1.0
            for _ in range(first):
                scale *= rate
            for r in range(orders):
                m = first + r
                for p in range(n, m - 1, -1):
                    factor = scale
                    for q in range(m):
                        factor *= p - q
                    for d in range(dims):
                        local[r, n - p, d] = coefficients[n - p, i, d] * factor
                scale *= rate
        u = min(max((t - left) * rate, 0.0), 1.0)
        for r in range(orders):
            degree = n - first - r
            for d in range(dims):
                value = local[r, 0, d] if degree >= 0 else 0.0
                for p in range(1, degree + 1):
                    value = value * u + local[r, p, d]
                out[r, k, d] = value
