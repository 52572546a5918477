"""B-splines: the basis at many times, and the Bézier points of every span."""

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def basis(knots, degree, span, times, out):  # type: ignore[no-untyped-def]
    """Write the values of B_{j-p} … B_j at the times, j the span of each, into ``out`` (M, p + 1).

    Cox-de Boor, from degree to degree: none of the values is a difference.
    """
    for k in range(len(times)):
        j, t = span[k], times[k]
        out[k, 0] = 1.0
        for p in range(1, degree + 1):
            carried = 0.0
            for i in range(p):
                left, right = knots[j - p + 1 + i], knots[j + 1 + i]
                share = out[k, i] / (right - left)
                out[k, i] = carried + share * (right - t)
                carried = share * (t - left)
            out[k, p] = carried


@njit(cache=True, error_model="numpy")
def bezier_points(knots, points, degree, span, out):  # type: ignore[no-untyped-def]
    """Write the Bézier points of the spans j into ``out`` (p + 1, K, D).

    Point i is the polar form of the span's polynomial at i times its right and p - i times its left end: de Boor's
    algorithm with these arguments, of convex combinations only.
    """
    dims = points.shape[1]
    d = np.empty((degree + 1, dims))
    shares = np.empty((2, degree + 1, degree + 1))  # at the left and the right end, by level and point
    for k in range(len(span)):
        j = span[k]
        a, b = knots[j], knots[j + 1]
        for level in range(1, degree + 1):
            for m in range(level, degree + 1):
                left = knots[j - degree + m]
                rate = 1.0 / (knots[j + 1 + m - level] - left)
                shares[0, level, m], shares[1, level, m] = (a - left) * rate, (b - left) * rate
        for i in range(degree + 1):
            for m in range(degree + 1):
                for x in range(dims):
                    d[m, x] = points[j - degree + m, x]
            for level in range(1, degree + 1):
                for m in range(degree, level - 1, -1):
                    share = shares[1 if level <= i else 0, level, m]
                    for x in range(dims):
                        d[m, x] = d[m - 1, x] + share * (d[m, x] - d[m - 1, x])
            for x in range(dims):
                out[i, k, x] = d[degree, x]
