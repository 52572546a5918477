"""Exact extrema of polynomials on [0, 1], all derivatives at once.

Between two neighbouring roots of the next derivative a polynomial is monotone, so each of its own roots is bracketed:
starting from the (linear) highest derivative, every level is found by safeguarded Halley steps inside known brackets.
No closed formulas for cubics or quartics, no complex arithmetic, no trouble with vanishing leading coefficients.

Up to quintics all of it happens in scalars: no loops over powers, and no arrays handed on, which Numba would count.
"""

import numpy as np
from numba import njit

#: A Halley step below this ends the search: the error left is its cube, times a moderate factor.
CLOSE = 1e-6
EPS = 2.220446049250313e-16


@njit(cache=True, error_model="numpy")
def _quartic(c0, c1, c2, c3, c4, u):  # type: ignore[no-untyped-def]
    return (((c0 * u + c1) * u + c2) * u + c3) * u + c4


@njit(cache=True, error_model="numpy")
def _next(lo, hi, u, value, slope, bend, rising, trial):  # type: ignore[no-untyped-def]
    """Return the narrowed bracket, the next guess, and whether that is the root."""
    if (value < 0.0) == rising:
        lo = u
    else:
        hi = u
    step = value * slope / (slope * slope - value * bend)
    u -= step
    if abs(step) < CLOSE and lo <= u <= hi:
        return lo, hi, u, True
    if not (lo < u < hi) or trial > 20:
        u = 0.5 * (lo + hi)
    return lo, hi, u, u == lo or u == hi


@njit(cache=True, error_model="numpy")
def _first(lo, hi, at_lo, at_hi):  # type: ignore[no-untyped-def]
    """Return the first guess: the secant's, but not too near an end, where the slope is often zero."""
    u = lo + (hi - lo) * min(max(at_lo / (at_lo - at_hi), 0.1), 0.9)
    return u if lo < u < hi else 0.5 * (lo + hi)


@njit(cache=True, error_model="numpy")
def _changes(a, b):  # type: ignore[no-untyped-def]
    return (a < 0.0 < b) or (b < 0.0 < a)


@njit(cache=True, error_model="numpy")
def _root(c0, c1, c2, c3, c4, lo, hi, at_lo, at_hi):  # type: ignore[no-untyped-def]
    """Return the root of a quartic that is monotone on [lo, hi], or hi without a change of sign.

    A root is taken as found where the value is rounding: the primitive, whose extremes it is for, moves no further.
    """
    if not _changes(at_lo, at_hi):
        return hi
    noise = EPS * (abs(c0) + abs(c1) + abs(c2) + abs(c3) + abs(c4))
    rising = at_hi > at_lo
    u = _first(lo, hi, at_lo, at_hi)
    for trial in range(100):
        p1 = c0 * u + c1
        p2 = p1 * u + c2
        p3 = p2 * u + c3
        value = p3 * u + c4
        q1 = c0 * u + p1
        q2 = q1 * u + p2
        slope = q2 * u + p3
        bend = ((c0 * u + q1) * u) + q2  # half the second derivative
        if abs(value) <= noise:
            break
        lo, hi, u, done = _next(lo, hi, u, value, slope, bend, rising, trial)
        if done:
            break
    return u


@njit(cache=True, error_model="numpy")
def _root_of_quadratic(a, b, c, lo, hi, at_lo, at_hi):  # type: ignore[no-untyped-def]
    """Return the root of a quadratic that is monotone on [lo, hi], or hi without a change of sign."""
    if not _changes(at_lo, at_hi):
        return hi
    square = b * b - 4.0 * a * c
    if 1e-250 < square < np.inf:
        q = -0.5 * (b + np.copysign(np.sqrt(square), b))
        u = c / q
        if lo <= u <= hi:
            return u
        u = q / a
        if lo <= u <= hi:
            return u
    return _root(0.0, 0.0, a, b, c, lo, hi, at_lo, at_hi)  # a double root, or squares that over- or underflow


@njit(cache=True, error_model="numpy")
def _including(extremes, u, value):  # type: ignore[no-untyped-def]
    low, at_low, high, at_high = extremes
    if value < low:
        low, at_low = value, u
    if value > high:
        high, at_high = value, u
    return low, at_low, high, at_high


@njit(cache=True, error_model="numpy")
def quintic(c0, c1, c2, c3, c4, c5, lowest):  # type: ignore[no-untyped-def]
    """Return (low, at_low, high, at_high) of the derivatives of order 0 … 5; those below ``lowest`` are not found.

    A bracket without a root passes on its right end in place of a root: a bracket split once more is no harm.
    """
    none = (0.0, 0.0, 0.0, 0.0)
    e0 = e1 = e2 = e3 = none
    v0, v1, v2, v3 = 5.0 * c0, 4.0 * c1, 3.0 * c2, 2.0 * c3
    a0, a1, a2 = 4.0 * v0, 3.0 * v1, 2.0 * v2
    j0, j1 = 3.0 * a0, 2.0 * a1
    s0 = 2.0 * j0
    e5 = (s0, 0.0, s0, 0.0)

    left, right = j1, s0 + j1
    e4 = _including((left, 0.0, left, 0.0), 1.0, right)
    if lowest < 4:
        x1 = min(max(-j1 / s0, 0.0), 1.0) if _changes(left, right) else 1.0
        f0, f1, f2 = a2, _quartic(0.0, 0.0, j0, j1, a2, x1), j0 + j1 + a2
        e3 = _including(_including((f0, 0.0, f0, 0.0), x1, f1), 1.0, f2)
        if lowest < 3:
            x2 = _root_of_quadratic(j0, j1, a2, x1, 1.0, f1, f2)
            x1 = _root_of_quadratic(j0, j1, a2, 0.0, x1, f0, f1)
            f0, f1, f2 = v3, _quartic(0.0, a0, a1, a2, v3, x1), _quartic(0.0, a0, a1, a2, v3, x2)
            f3 = _quartic(0.0, a0, a1, a2, v3, 1.0)
            e2 = _including(_including(_including((f0, 0.0, f0, 0.0), x1, f1), x2, f2), 1.0, f3)
            if lowest < 2:
                x3 = _root(0.0, a0, a1, a2, v3, x2, 1.0, f2, f3)
                x2 = _root(0.0, a0, a1, a2, v3, x1, x2, f1, f2)
                x1 = _root(0.0, a0, a1, a2, v3, 0.0, x1, f0, f1)
                f0, f1, f2 = c4, _quartic(v0, v1, v2, v3, c4, x1), _quartic(v0, v1, v2, v3, c4, x2)
                f3, f4 = _quartic(v0, v1, v2, v3, c4, x3), _quartic(v0, v1, v2, v3, c4, 1.0)
                e1 = _including(_including(_including((f0, 0.0, f0, 0.0), x1, f1), x2, f2), x3, f3)
                e1 = _including(e1, 1.0, f4)
                if lowest < 1:
                    x4 = _root(v0, v1, v2, v3, c4, x3, 1.0, f3, f4)
                    x3 = _root(v0, v1, v2, v3, c4, x2, x3, f2, f3)
                    x2 = _root(v0, v1, v2, v3, c4, x1, x2, f1, f2)
                    x1 = _root(v0, v1, v2, v3, c4, 0.0, x1, f0, f1)
                    e0 = _including((c5, 0.0, c5, 0.0), x1, _quartic(c0, c1, c2, c3, c4, x1) * x1 + c5)
                    e0 = _including(e0, x2, _quartic(c0, c1, c2, c3, c4, x2) * x2 + c5)
                    e0 = _including(e0, x3, _quartic(c0, c1, c2, c3, c4, x3) * x3 + c5)
                    e0 = _including(e0, x4, _quartic(c0, c1, c2, c3, c4, x4) * x4 + c5)
                    e0 = _including(e0, 1.0, _quartic(c0, c1, c2, c3, c4, 1.0) + c5)
    return e0, e1, e2, e3, e4, e5


@njit(cache=True, error_model="numpy")
def chain(table, lowest, points, values, found):  # type: ignore[no-untyped-def]
    """Write the extrema of the derivatives of order ``lowest`` … R - 1 of one polynomial of any degree.

    Parameters
    ----------
    table : array (n + 2, n + 1)
        Room for the derivatives; the first row holds the coefficients.
    lowest : int
    points, values : array (n + 3,)
        Room.
    found : array (R, 4)
        Smallest value, where it is taken, largest value, where it is taken.
    """
    n = len(table) - 2
    orders = len(found)
    for m in range(1, n + 1):
        for k in range(n - m + 1):
            table[m, k] = table[m - 1, k] * (n - m + 1 - k)
    found[n + 1 :] = 0.0
    count = 2  # the roots of derivative m + 1, between the ends 0 and 1
    points[0], points[1] = 0.0, 1.0
    for m in range(n, lowest - 1, -1):
        degree = n - m
        noise = 0.0
        for k in range(degree + 1):
            noise += abs(table[m, k])
        noise *= EPS
        extremes = (table[m, degree], 0.0, table[m, degree], 0.0)
        for k in range(count):
            value = table[m, 0]
            for p in range(1, degree + 1):
                value = value * points[k] + table[m, p]
            values[k] = value
            extremes = _including(extremes, points[k], value)
        if m < orders:
            for k in range(4):
                found[m, k] = extremes[k]
        if m == lowest:
            break
        here = 0.0
        kept = 0
        for k in range(1, count):
            lo, hi = here, points[k]
            here = hi
            if _changes(values[k - 1], values[k]):
                rising = values[k] > values[k - 1]
                u = _first(lo, hi, values[k - 1], values[k])
                for trial in range(100):
                    value, slope, bend = table[m, 0], 0.0, 0.0
                    for p in range(1, degree + 1):
                        bend = bend * u + slope
                        slope = slope * u + value
                        value = value * u + table[m, p]
                    if abs(value) <= noise:
                        break
                    lo, hi, u, done = _next(lo, hi, u, value, slope, bend, rising, trial)
                    if done:
                        break
                kept += 1
                points[kept] = u
            if values[k] == 0.0 and k < count - 1:
                kept += 1
                points[kept] = here
        points[kept + 1] = 1.0
        count = kept + 2


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
    out = np.zeros((4, orders, pieces, dims))
    own = np.zeros(6)
    lowest = np.int64(0)  # no literal, for which Numba would compile all of it once more
    table = np.zeros((size + 1, size))
    points, values, found = np.zeros(size + 2), np.zeros(size + 2), np.zeros((orders, 4))
    for i in range(pieces):
        for d in range(dims):
            if size > 6:
                for k in range(size):
                    table[0, k] = coefficients[k, i, d]
                chain(table, lowest, points, values, found)
                for m in range(orders):
                    for k in range(4):
                        out[k, m, i, d] = found[m, k]
                continue
            for k in range(size):
                own[6 - size + k] = coefficients[k, i, d]
            extremes = quintic(own[0], own[1], own[2], own[3], own[4], own[5], lowest)
            for m in range(min(orders, 6)):
                e = extremes[m]
                for k in range(4):
                    out[k, m, i, d] = e[k]
    return out
