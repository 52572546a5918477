"""Which jumps of a derivative are more than rounding: the rule behind ``planner.jumps``, joint by joint and break."""

import numpy as np
from numba import njit

from .extrema import EPS


@njit(cache=True, error_model="numpy")
def _size(c, i, d, factors, step):  # type: ignore[no-untyped-def]
    """Return, of one piece, its rounding, that of where it stands, and the sum of its terms."""
    n = len(c) - 1
    size = own = 0.0
    for k in range(n):
        x = abs(c[k, i, d])
        size = max(size, x)
        own += x * factors[k]
    place = abs(c[n, i, d])
    own = (own + place * factors[n]) / step
    return 64.0 * EPS * max(size / step, own), EPS * place / step, own


@njit(cache=True, error_model="numpy")
def judge(c, breaks, h, order, ends, rates, values, peak, tolerance, growth, counted):  # type: ignore[no-untyped-def]
    """Write which jumps of a derivative of order 1 or more count; return whether one of them does by the lenient rule.

    A jump counts above ``tolerance`` of the peak and the rounding of values and of the clock. By the lenient rule it
    must also exceed 64 eps growth^order / h^order times the largest position, with h the longer neighbour.

    Parameters
    ----------
    c : array (n + 1, K, D)
        Coefficients, highest power first, over the smaller end of the denominator where there is one.
    breaks, h : array (K + 1,), (K,)
        The breaks and the gaps between them.
    order : int
    ends, rates, values : array (2, K, D)
        The derivative of that order, the next one and the position, at the left and right ends of the pieces.
    peak : array (D,)
        The derivative's largest magnitude.
    tolerance, growth : float
    counted : array (K - 1, D) of bool
        Overwritten.
    """
    size, pieces, dims = c.shape
    factors = np.ones(size)  # of the powers in the derivative
    for k in range(size):
        for j in range(order):
            factors[k] *= size - 1 - k - j
    known, still, largest = np.zeros(dims, np.bool_), np.zeros(dims, np.bool_), np.zeros(dims)
    latest, sizes = np.zeros(dims, np.int64), np.zeros((dims, 2))  # of the piece looked at last, by number plus one
    lost = False
    for i in range(pieces - 1):
        after = h[i + 1] ** order
        for d in range(dims):
            counted[i, d] = False
            jump = abs(ends[0, i + 1, d] - ends[1, i, d])
            if not jump > tolerance * peak[d]:
                continue
            if not known[d]:
                known[d] = still[d] = True
                for j in range(pieces):
                    largest[d] = max(largest[d], abs(values[0, j, d]), abs(values[1, j, d]))
                    if still[d]:  # but for rounding of where it stands
                        _, place, own = _size(c, j, d, factors, h[j] ** order)
                        still[d] = own <= 1e3 * place
            if latest[d] != i + 1:
                sizes[d, 0], sizes[d, 1], _ = _size(c, i, d, factors, h[i] ** order)
            left, left_place = sizes[d, 0], sizes[d, 1]
            right, right_place, _ = _size(c, i + 1, d, factors, after)
            latest[d], sizes[d, 0], sizes[d, 1] = i + 2, right, right_place
            if still[d]:
                left, right = max(left, 1e3 * left_place), max(right, 1e3 * right_place)
            tick = EPS * abs(breaks[i + 1])  # what the clock cannot tell moves a break, and scales pieces
            rate = max(abs(rates[0, i + 1, d]), abs(rates[1, i, d]))
            value = max(abs(ends[0, i + 1, d]), abs(ends[1, i, d]))
            clock = tick * rate + order * tick / min(h[i], h[i + 1]) * value
            stand = 8.0 * max(left_place, right_place)  # where it stands is rounded too; that may hide no large jump
            allowed = max(left, right) + min(clock, 1e-2 * peak[d]) + min(stand, 1e-3 * peak[d])
            counted[i, d] = jump > tolerance * peak[d] + allowed
            if counted[i, d] and not lost:
                lost = jump > 64.0 * EPS * growth**order * largest[d] / max(h[i], h[i + 1]) ** order
    return lost
