"""Evaluation of a piecewise polynomial and its derivatives at many times, in one pass over the output.

Eight joints are computed at once, in a vector register: a block of eight is read straight from the coefficients and
written straight to the output. Where D is no multiple of eight, the last block reads and writes past the joints, which
does no harm: what it writes there belongs to the next time, which comes later and overwrites it. Only where that would
leave the arrays do blocks take a detour over small padded ones.
"""

import numpy as np
from numba import njit

from .lanes import LANES, load, scaled, step, store


@njit(cache=True, error_model="numpy")
def _taylor(c, at, row, size, u):  # type: ignore[no-untyped-def]
    """Return p(u), p'(u), p''(u) / 2, p'''(u) / 6 by repeated division; the coefficients are c[at + k * row]."""
    p0 = load(c, at)
    p1 = p2 = p3 = scaled(p0, 0.0)
    for k in range(1, size):
        at += row
        # a level is started, not stepped, by its first coefficient: 14 products instead of 20 for quintics
        p3 = step(p3, u, p2) if k > 3 else p2 if k == 3 else p3
        p2 = step(p2, u, p1) if k > 2 else p1 if k == 2 else p2
        p1 = step(p1, u, p0) if k > 1 else p0
        p0 = step(p0, u, load(c, at))
    return p0, p1, p2, p3


@njit(cache=True, error_model="numpy")
def _value(c, at, row, size, u):  # type: ignore[no-untyped-def]
    """Return p(u)."""
    p = load(c, at)
    for _ in range(1, size):
        at += row
        p = step(p, u, load(c, at))
    return p


@njit(cache=True, error_model="numpy")
def _piece(breaks, i, t):  # type: ignore[no-untyped-def]
    """Return the piece of time t: one of the next few after piece i, or else found by bisection."""
    low, count = 0, i
    if t >= breaks[i]:
        last = min(i + 4, len(breaks) - 2)
        while i < last:
            if t < breaks[i + 1]:
                return i
            i += 1
        low, count = i, len(breaks) - 1 - i
    while count > 1:
        half = count >> 1
        low = low + half if t >= breaks[low + half] else low  # a conditional move: a branch would be guessed wrong
        count -= half
    return low


@njit(cache=True, error_model="numpy")
def _run(c, start, row, size, times, begin, end, origin, rate, scales, orders, out, to, plane, dims):  # type: ignore[no-untyped-def]
    """Write what the times begin … end - 1 have on one piece, whose coefficients are c[start + k * row + d]."""
    s0, s1, s2, s3 = scales
    for k in range(begin, end):
        u = (times[k] - origin) * rate
        u = 0.0 if u < 0.0 else 1.0 if u > 1.0 else u
        for d in range(0, dims, LANES):
            at = to + k * dims + d
            if orders == 1:
                store(out, at, scaled(_value(c, start + d, row, size, u), s0))
                continue
            if size == 6:
                p0, p1, p2, p3 = _taylor(c, start + d, row, 6, u)
            else:
                p0, p1, p2, p3 = _taylor(c, start + d, row, size, u)
            store(out, at, scaled(p0, s0))
            store(out, at + plane, scaled(p1, s1))
            if orders > 2:
                store(out, at + 2 * plane, scaled(p2, s2))
            if orders > 3:
                store(out, at + 3 * plane, scaled(p3, s3))


@njit(cache=True, error_model="numpy")
def _march(breaks, coefficients, times, begin, end, order, orders, out, to, plane):  # type: ignore[no-untyped-def]
    """Write the derivatives of order ``order`` … ``order + orders - 1`` (at most four) at the times begin … end - 1.

    That of order ``order + r`` at time k is written to out[to + r * plane + k * D + d], and rubbish past it.
    """
    pieces, dims = coefficients.shape[1:]
    size = len(coefficients) - order
    wide = (dims + LANES - 1) // LANES * LANES
    c = coefficients.reshape(-1)
    own = np.zeros(size * wide)  # the piece's coefficients where they cannot be read in place
    i = 0
    while begin < end:
        i = _piece(breaks, i, times[begin])
        origin, right = breaks[i], breaks[i + 1]
        rate = 1.0 / (right - origin) if right > origin else 0.0
        left = origin if i > 0 else -np.inf
        right = right if i < pieces - 1 else np.inf
        stop = begin + 1
        while stop < end and left <= times[stop] < right:
            stop += 1
        s0 = rate**order if order > 0 else 1.0
        s1 = s0 * rate if size > 1 else 0.0  # zero, as infinity times zero would not be
        s2 = s1 * rate * 2.0 if size > 2 else 0.0
        s3 = s2 * rate * 3.0 if size > 3 else 0.0
        scales = (s0, s1, s2, s3)
        if order == 0 and i * dims + wide <= pieces * dims:
            row = pieces * dims
            _run(c, i * dims, row, size, times, begin, stop, origin, rate, scales, orders, out, to, plane, dims)
        else:
            for p in range(size):
                factor = 1.0
                for q in range(order):
                    factor *= size - 1 - p + order - q
                for d in range(dims):
                    own[p * wide + d] = coefficients[p, i, d] * factor
            _run(own, np.int64(0), wide, size, times, begin, stop, origin, rate, scales, orders, out, to, plane, dims)
        begin = stop


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
    orders, count, dims = out.shape
    plane = count * dims
    tail = min(count, (LANES + dims - 1) // dims)  # the last times, of which a block could leave the plane
    room = tail * dims + LANES  # in the spare planes, where the tail is put first
    flat, spare = out.reshape(-1), np.empty(4 * room)
    for r in range(0, orders, 4):
        if first + r >= len(coefficients):
            out[r:] = 0.0
            break
        part = min(orders - r, 4)
        target, to, gap, end = flat, r * plane, plane, count - tail
        for last in range(2):
            _march(breaks, coefficients, times, last * end, end + last * tail, first + r, part, target, to, gap)
            target, to, gap = spare, -end * dims, room
        for j in range(part):
            for d in range(tail * dims):
                flat[(r + j + 1) * plane - tail * dims + d] = spare[j * room + d]
