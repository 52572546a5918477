"""How far a piecewise polynomial is from a curve run through by a law, at given places of every piece."""

import numpy as np
from numba import njit

from .lanes import LANES, load, plus, product, scaled, step, store


@njit(cache=True, error_model="numpy")
def _piece(breaks, i, t):  # type: ignore[no-untyped-def]
    """Return the piece of t, looked for from piece i on; before the first break the first, past the last the last."""
    while i > 0 and t < breaks[i]:
        i -= 1
    while i < len(breaks) - 2 and t >= breaks[i + 1]:
        i += 1
    return i


@njit(cache=True, error_model="numpy")
def _powers(u, size, room):  # type: ignore[no-untyped-def]
    """Write the powers of the u: the k-th from room[k * len(u)] on."""
    count = len(u)
    for f in range(0, count, LANES):
        power = x = load(u, f)
        for k in range(1, size):
            store(room, k * count + f, power)
            power = product(power, x)


@njit(cache=True, error_model="numpy")
def _distances(coefficients, i, powers, curve, p, curve_powers, out):  # type: ignore[no-untyped-def]
    """Write the squared distances of piece i from the curve's piece p, at places of either."""
    size, _, dims = coefficients.shape
    curve_size, count = len(curve), len(out)
    for f in range(0, count, LANES):
        zero = total = scaled(load(powers, f), 0.0)
        for d in range(dims):
            x = plus(zero, scaled(load(powers, f), coefficients[size - 1, i, d] - curve[curve_size - 1, p, d]))
            for k in range(1, size):
                x = step(load(powers, k * count + f), coefficients[size - 1 - k, i, d], x)
            for k in range(1, curve_size):
                x = step(load(curve_powers, k * count + f), -curve[curve_size - 1 - k, p, d], x)
            total = plus(total, product(x, x))
        store(out, f, total)


@njit(cache=True, error_model="numpy")
def largest_deviation(breaks, coefficients, law_breaks, law, curve_breaks, curve, places):  # type: ignore[no-untyped-def]
    """Return the largest Euclidean distance of q(t) from curve(law(t)); not a number where it cannot be told.

    Looked at are ``places`` of every piece that lies between neighbouring breaks of the trajectory and the law. Times
    and parameter values outside what is defined count as its ends.

    Parameters
    ----------
    breaks, law_breaks, curve_breaks : array (K + 1,), (L + 1,), (P + 1,)
    coefficients, law, curve : array (n + 1, K, D), (m + 1, L, 1), (p + 1, P, D)
        Highest power first, in the local variable in [0, 1].
    places : array (M,)
        In [0, 1].
    """
    pieces, count = len(breaks) - 1, len(places)
    padded = (count + LANES - 1) // LANES * LANES
    u, s, v, out = np.zeros(padded), np.zeros(padded), np.zeros(padded), np.zeros(padded)
    powers, curve_powers = np.ones(len(coefficients) * padded), np.ones(len(curve) * padded)
    on = np.zeros(count, np.int64)
    first, last = max(breaks[0], law_breaks[0]), min(breaks[pieces], law_breaks[-1])
    low, high = curve_breaks[0], curve_breaks[-1]
    i = j = p = 0
    largest, left = 0.0, breaks[0]
    while left < breaks[pieces]:
        i, j = _piece(breaks, i, left), _piece(law_breaks, j, left)
        right = breaks[i + 1]
        if left < law_breaks[0]:
            right = min(right, law_breaks[0])
        elif left < law_breaks[j + 1]:
            right = min(right, law_breaks[j + 1])
        begin, rate = breaks[i], 1.0 / (breaks[i + 1] - breaks[i])
        law_begin, law_rate = law_breaks[j], 1.0 / (law_breaks[j + 1] - law_breaks[j])
        for m in range(count):
            t = min(max(left + (right - left) * places[m], first), last)
            u[m] = min(max((t - begin) * rate, 0.0), 1.0)
            v[m] = min(max((t - law_begin) * law_rate, 0.0), 1.0)
            s[m] = law[0, j, 0]
        for k in range(1, len(law)):
            c = law[k, j, 0]
            for m in range(count):
                s[m] = s[m] * v[m] + c
        for m in range(count):
            at = min(max(s[m], low), high)
            p = _piece(curve_breaks, p, at)
            on[m], v[m] = p, (at - curve_breaks[p]) / (curve_breaks[p + 1] - curve_breaks[p])
        _powers(u, len(coefficients), powers)
        _powers(v, len(curve), curve_powers)
        m = 0
        while m < count:
            p = on[m]
            _distances(coefficients, i, powers, curve, p, curve_powers, out)
            while m < count and on[m] == p:
                if not out[m] <= largest:
                    largest = out[m]
                    if not largest < np.inf:
                        return largest
                m += 1
        left = right
    return np.sqrt(largest)
