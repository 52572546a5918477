"""Exact extrema of polynomials on [0, 1], all derivatives at once.

Between two neighbouring roots of the next derivative a polynomial is monotone, so each of its own roots is bracketed:
starting from the (linear) highest derivative, every level is found by safeguarded Newton steps inside known brackets.
No closed formulas for cubics or quartics, no complex arithmetic, no trouble with vanishing leading coefficients.
"""

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def _horner(c, degree, u):  # type: ignore[no-untyped-def]
    value = c[0]
    for k in range(1, degree + 1):
        value = value * u + c[k]
    return value


@njit(cache=True, error_model="numpy")
def _root(c, degree, slope, left, right, at_left):  # type: ignore[no-untyped-def]
    """Return the root of ``c`` in (left, right), where it changes sign; Newton, or bisection where that would leave."""
    lo, hi = left, right
    u = 0.5 * (lo + hi)
    for _ in range(200):
        value = _horner(c, degree, u)
        if value == 0.0:
            return u
        if (value > 0.0) == (at_left > 0.0):
            lo = u
        else:
            hi = u
        rate = _horner(slope, degree - 1, u)
        step = u - value / rate if rate != 0.0 else lo - 1.0
        if not (lo < step < hi):
            step = 0.5 * (lo + hi)
        if abs(step - u) <= 1e-16 or step == lo or step == hi:
            return step
        u = step
    return u


@njit(cache=True, error_model="numpy")
def extrema(coefficients, orders):  # type: ignore[no-untyped-def]
    """Return the extrema over u in [0, 1] of the derivatives of order 0 … orders-1 of every polynomial.

    Parameters
    ----------
    coefficients : array (n + 1, K, D)
        Highest power first, as SciPy's PPoly, in the local variable u.
    orders : int
        How many derivatives, the polynomial itself included.

    Returns
    -------
    array (4, orders, K, D)
        Smallest value, where it is taken, largest value, where it is taken; derivatives are with respect to u.
    """
    size, pieces, dims = coefficients.shape
    n = size - 1
    out = np.zeros((4, orders, pieces, dims))
    table = np.zeros((n + 2, n + 1))  # table[m] = coefficients of the m-th derivative, highest power first
    points = np.zeros(n + 3)
    fresh = np.zeros(n + 3)
    for i in range(pieces):
        for d in range(dims):
            for k in range(n + 1):
                table[0, k] = coefficients[k, i, d]
            for m in range(1, n + 1):
                for k in range(n - m + 1):
                    table[m, k] = table[m - 1, k] * (n - m + 1 - k)
            count = 2  # the roots of derivative m + 1, between the ends 0 and 1
            points[0], points[1] = 0.0, 1.0
            for m in range(n, -1, -1):
                degree = n - m
                if m < orders:
                    low = table[m, degree]
                    high = low
                    where_low = where_high = 0.0
                    for k in range(1, count):
                        value = _horner(table[m], degree, points[k])
                        if value < low:
                            low, where_low = value, points[k]
                        if value > high:
                            high, where_high = value, points[k]
                    out[0, m, i, d], out[1, m, i, d] = low, where_low
                    out[2, m, i, d], out[3, m, i, d] = high, where_high
                if m == 0 or degree == 0:
                    continue
                found = 0
                for k in range(count - 1):
                    left, right = points[k], points[k + 1]
                    a = _horner(table[m], degree, left)
                    b = _horner(table[m], degree, right)
                    if a == 0.0 and left > 0.0:
                        found += 1
                        fresh[found] = left
                    elif a != 0.0 and b != 0.0 and (a < 0.0) != (b < 0.0):
                        found += 1
                        fresh[found] = _root(table[m], degree, table[m + 1], left, right, a)
                for k in range(1, found + 1):
                    points[k] = fresh[k]
                points[0] = 0.0
                points[found + 1] = 1.0
                count = found + 2
    return out
