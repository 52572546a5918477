"""What a motion does: its derivatives at the ends of pieces, its peaks, which of its jumps count, and its cost."""

import numpy as np
from numba import njit

from .jumps import judge
from .worst import _exact


@njit(cache=True, error_model="numpy")
def end_states(coefficients, rate, first, last):  # type: ignore[no-untyped-def]
    """Return the derivatives of order first … last - 1 at both ends of every piece, (last - first, 2, K, D).

    Parameters
    ----------
    coefficients : array (n + 1, K, D)
        Highest power first, in the local variable u in [0, 1].
    rate : array (K,)
        1 / duration of each piece.
    """
    size, pieces, dims = coefficients.shape
    out = np.zeros((last - first, 2, pieces, dims))
    for m in range(first, min(last, size)):
        left, right = out[m - first, 0], out[m - first, 1]
        for k in range(size - m):
            factor = 1.0
            for j in range(m):
                factor *= size - 1 - k - j
            for i in range(pieces):
                for d in range(dims):
                    right[i, d] += factor * coefficients[k, i, d]
                    if k == size - 1 - m:
                        left[i, d] = factor * coefficients[k, i, d]
        for i in range(pieces if m > 0 else 0):
            scale = rate[i] ** m
            for d in range(dims):
                left[i, d] *= scale
                right[i, d] *= scale
    return out


@njit(cache=True, error_model="numpy")
def highest(coefficients, rate, ends):  # type: ignore[no-untyped-def]
    """Return the largest magnitudes of the derivatives of order 0 … R - 1 over all pieces, (R, D).

    Few pieces rise, between their ends, above what is reached at ends: only of those are the extrema found.

    Parameters
    ----------
    coefficients, rate
        As above.
    ends : array (R, 2, K, D)
    """
    size, pieces, dims = coefficients.shape
    orders, total = len(ends), pieces * dims
    c, flat = coefficients.reshape((size, total)), ends.reshape((orders, 2, total))
    most, reach, sums, top = np.zeros((orders, dims)), np.zeros(total), np.zeros(total), np.zeros(dims, np.int64)
    own, table, points, values = np.zeros(6), np.zeros((size + 1, size)), np.zeros(size + 2), np.zeros(size + 2)
    found = np.zeros((orders, 4))
    for m in range(orders):
        degree = size - 1 - m
        for f in range(total):
            reach[f] = max(abs(flat[m, 0, f]), abs(flat[m, 1, f]))
        for i in range(pieces):
            for d in range(dims):
                if reach[i * dims + d] > most[m, d]:
                    most[m, d] = reach[i * dims + d]
        if degree < 2:  # a line is highest at an end
            continue
        reach[:] = 0.0
        for j in range(1, degree):  # Bernstein's coefficients but those at the ends, in u
            weight = 1.0  # that of c[k]: binomial(j, k) / binomial(degree, k) (k + 1) … (k + m)
            for k in range(1, m + 1):
                weight *= k
            for k in range(j + 1):
                row = c[degree - k]
                if k == 0:
                    for f in range(total):
                        sums[f] = weight * row[f]
                else:
                    for f in range(total):
                        sums[f] += weight * row[f]
                weight *= (j - k) * (k + 1 + m) / ((degree - k) * (k + 1.0))
            for f in range(total):
                reach[f] = max(reach[f], abs(sums[f]))
        top[:] = 0
        for i in range(pieces):
            scale = rate[i] ** m
            for d in range(dims):
                f = i * dims + d
                reach[f] *= scale
                if reach[f] > reach[top[d] * dims + d]:
                    top[d] = i
        for turn in range(pieces + 1):  # the one that may reach furthest comes first: few are left then
            for d in range(dims):
                i = turn - 1 if turn > 0 else top[d]
                if reach[i * dims + d] > most[m, d]:
                    low, _, high, _ = _exact(coefficients, i, d, m, own, table, points, values, found)
                    x = rate[i] ** m * max(high, -low)
                    if x > most[m, d]:
                        most[m, d] = x
                    reach[i * dims + d] = 0.0
    return most


@njit(cache=True, error_model="numpy")
def survey(breaks, coefficients, rate, span, tolerance, growth):  # type: ignore[no-untyped-def]
    """Return what a motion does, up to its jerk.

    Parameters
    ----------
    breaks, coefficients, rate
        As above, and the K + 1 breaks.
    span : float
        What errors of positions are relative to.
    tolerance, growth : float
        See ``judge``.

    Returns
    -------
    ends : array (5, 2, K, D)
    peaks : array (4, D)
        The largest magnitudes of the derivatives of order 0 … 3.
    jumps : array (4, K - 1, D) of bool
        At which breaks a lower derivative jumps.
    unbounded : array (4, D) of bool
        Whether one does so anywhere.
    lost : array (4,) of bool
        Whether the derivative jumps by more than rounding explains; nothing is said beyond the first that does, from
        order 3 on.
    """
    size, pieces, dims = coefficients.shape
    ends = end_states(coefficients, rate, 0, 5)
    peaks = highest(coefficients, rate, ends[:4])
    h = np.empty(pieces)
    for i in range(pieces):
        h[i] = breaks[i + 1] - breaks[i]
    jumps, counted = np.zeros((4, pieces - 1, dims), np.bool_), np.zeros((pieces - 1, dims), np.bool_)
    unbounded, lost = np.zeros((4, dims), np.bool_), np.zeros(4, np.bool_)
    for m in range(4):
        most = peaks[m]
        if m == 3 and (size < 4 or lost[0] or lost[1] or lost[2]):
            break
        for i in range(pieces - 1):
            for d in range(dims):
                jump = abs(ends[m, 0, i + 1, d] - ends[m, 1, i, d])
                counted[i, d] = jump > (tolerance * span if m == 0 else tolerance * most[d])
                lost[m] |= counted[i, d]
        if m > 0 and lost[m]:  # most often nothing is near to a jump
            lost[m] = judge(coefficients, breaks, h, m, ends[m], ends[m + 1], ends[0], most, tolerance, growth, counted)
        if m < 3:
            for i in range(pieces - 1):
                for d in range(dims):
                    jumps[m + 1, i, d] = jumps[m, i, d] or counted[i, d]
                    unbounded[m + 1, d] |= jumps[m + 1, i, d]
    return ends, peaks, jumps, unbounded, lost


@njit(cache=True, error_model="numpy")
def squared_integral(coefficients, rate, order):  # type: ignore[no-untyped-def]
    """Return the integral of the squared Euclidean norm of a derivative; arguments as above."""
    size, pieces, dims = coefficients.shape
    count = size - order
    factors, gram = np.ones(count), np.empty((count, count))
    for k in range(count):
        for j in range(order):
            factors[k] *= size - 1 - k - j
    for k in range(count):
        for q in range(count):
            gram[k, q] = factors[k] * factors[q] / (2 * count - 1 - k - q)
    total = 0.0
    for i in range(pieces):
        squares = 0.0
        for d in range(dims):
            for k in range(count):
                inner = 0.0
                for q in range(count):
                    inner += gram[k, q] * coefficients[q, i, d]
                squares += coefficients[k, i, d] * inner
        total += squares * rate[i] ** (2 * order - 1)
    return total
