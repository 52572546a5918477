r"""The quintic C4 spline with both ends fixed (minimum jerk through the points), straight to its coefficients.

The same sweeps as in ``splines``, forth with the minors of the covariance and back with the corrections e, so just as
accurate for uneven steps; but in windows, so that all but input and output stays in the cache. Forth needs nothing from
later points. Back, e_i = J_i e_(i+1) + G_i new_i; the product of the J over m gaps decays geometrically with m, for
even steps as 0.43^m. Where it is negligible, e may as well start from 0: the pieces before that are written, the window
moves on by as many. Eight joints go in a vector register; more take several, in turn.
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

from .lanes import LANES, lanes, load, plus, product, scaled, step, store

#: Gaps in a window.
GAPS = 384
#: Share of a correction, in the units of either end, that changes nothing.
NEGLIGIBLE = 1e-19
#: Neighbouring steps up to this ratio leave the minors in range between the times they are made small again.
STEEPEST = 1e15

# Numbers of the gaps of a window, each in a row: the step; J, G and K as in ``splines``; the minors.
_ROW = GAPS + LANES
_J, _G, _K, _MINORS = _ROW, 5 * _ROW, 7 * _ROW, 9 * _ROW
_NODE = 3 * LANES  # of a node in a window: point, velocity, acceleration
_BLOCK = (GAPS + 1) * _NODE


@intrinsic
def _inverse(typing: Any, x: Any) -> Any:
    """Return 1 / x."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.fdiv(ir.Constant(args[0].type, [1.0] * LANES), args[0])

    return lanes(lanes), generate


@intrinsic
def _number(typing: Any, array: Any, index: Any) -> Any:
    """Return array[index], without checks."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, args[0]).data
        return builder.load(builder.gep(data, [args[1]]))

    return types.float64(array, types.intp), generate


@njit(cache=True, error_model="numpy")
def _minors(times, begin, end, c, w, at):  # type: ignore[no-untyped-def]
    """Write steps and minors of the gaps begin … end - 1 to w[at …]; c: minors, step before, extremes of the ratio.

    The minors are those at the gap's left knot in units of its step, up to a factor, which is freed of its growth now
    and then: a division at every knot would double the time.
    """
    c0, c1, c2, c3, c4, before, low, high = c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]
    good = True
    for i in range(begin, end):
        h = times[i + 1] - times[i]
        good &= 0.0 < h < np.inf
        ratio = before / h if i > 0 else 1.0
        low, high, before = min(low, ratio), max(high, ratio), h
        square = ratio * ratio
        one, p, q, r, d = c0, c1 * (9.0 * ratio * square), c2 * (36.0 * square), c3 * (192.0 * ratio), c4 * square**2
        w[at], w[at + _MINORS], w[at + _MINORS + _ROW] = h, one, p
        w[at + _MINORS + 2 * _ROW], w[at + _MINORS + 3 * _ROW], w[at + _MINORS + 4 * _ROW] = q, r, d
        at += 1
        # the short sums side by side keep the chain from knot to knot short
        c0 = step(p, 8640.0, 432.0 * one) + step(q, 8640.0, 2160.0 * r)
        c1 = step(d, 240.0, step(p, 128.0, one)) + step(q, 56.0, 8.0 * r)
        c2 = step(d, 120.0, step(p, 80.0, one)) + step(q, 42.0, 7.0 * r)
        c3 = step(d, 45.0, step(p, 45.0, one)) + step(q, 30.0, 6.0 * r)
        c4 = step(d, 432.0, step(p, 192.0, one)) + step(q, 72.0, 9.0 * r)
        if i & 3 == 3:
            scale = 1.0 / c4
            c0, c1, c2, c3, c4 = c0 * scale, c1 * scale, c2 * scale, c3 * scale, 1.0
    c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7] = c0, c1, c2, c3, c4, before, low, high
    return good


@njit(cache=True, error_model="numpy")
def _gains(begin, end, w):  # type: ignore[no-untyped-def]
    """Write the gains of a window's gaps begin … end - 1, and rubbish past them, from their minors."""
    for i in range(begin, end, LANES):
        m = i + _MINORS
        h, one, p, q = load(w, i), load(w, m), load(w, m + _ROW), load(w, m + 2 * _ROW)
        r, d = load(w, m + 3 * _ROW), load(w, m + 4 * _ROW)
        rate = _inverse(h)
        last = _inverse(step(d, 432.0, step(r, 9.0, step(q, 72.0, step(p, 192.0, one)))))
        left_v, left_a = step(q, 0.5, p), step(r, 0.5, q)
        first = product(rate, _inverse(step(left_a, 0.5, step(one, 0.05, left_v))))
        second = product(first, rate)
        store(w, i + _J, product(step(d, 27.0, step(p, 7.0, q)), scaled(last, -24.0)))
        store(w, i + _J + _ROW, product(step(d, 36.0, step(p, 8.0, q)), scaled(product(last, h), 3.0)))
        down = step(q, -7.0, scaled(r, -1.0))
        store(w, i + _J + 2 * _ROW, product(step(d, 60.0, down), scaled(product(last, rate), 24.0)))
        store(w, i + _J + 3 * _ROW, product(step(d, -96.0, step(q, 8.0, r)), scaled(last, 3.0)))
        store(w, i + _G, product(left_v, first))
        store(w, i + _G + _ROW, product(left_a, second))
        store(w, i + _K, product(step(one, 0.125, plus(left_v, left_a)), first))
        store(w, i + _K + _ROW, product(step(one, 1.0 / 6.0, left_a), second))


@njit(cache=True, error_model="numpy")
def _new(h, x0, v, a, x1):  # type: ignore[no-untyped-def]
    """Return what a point differs from its prediction."""
    return plus(x1, step(step(a, 0.5 * h, v), -h, scaled(x0, -1.0)))


@njit(cache=True, error_model="numpy")
def _forth(x, at, dims, begin, end, w, s, block):  # type: ignore[no-untyped-def]
    """Carry the estimates over a window's gaps begin … end - 1; the point after the first of them is x[at …]."""
    k = block + begin * _NODE
    x0, v, a = load(s, k), load(s, k + LANES), load(s, k + 2 * LANES)
    for i in range(begin, end):
        h = _number(w, i)
        x1 = load(x, at)
        at += dims
        k += _NODE
        new = _new(h, x0, v, a, x1)
        v = step(new, _number(w, i + _K), step(a, h, v))
        a = step(new, _number(w, i + _K + _ROW), a)
        x0 = x1
        store(s, k, x1)
        store(s, k + LANES, v)
        store(s, k + 2 * LANES, a)


@njit(cache=True, error_model="numpy")
def _before(i, w, s, k, x1, ev, ea):  # type: ignore[no-untyped-def]
    """Return a gap's left point and estimates, and the corrections there from those at its right."""
    x0, v, a = load(s, k), load(s, k + LANES), load(s, k + 2 * LANES)
    new = _new(_number(w, i), x0, v, a, x1)
    from_v = step(ev, _number(w, i + _J), scaled(new, _number(w, i + _G)))
    from_a = step(ev, _number(w, i + _J + 2 * _ROW), scaled(new, _number(w, i + _G + _ROW)))
    return x0, v, a, step(ea, _number(w, i + _J + _ROW), from_v), step(ea, _number(w, i + _J + 3 * _ROW), from_a)


@njit(cache=True, error_model="numpy")
def _back(goal, end, w, s, block, e, kept, place):  # type: ignore[no-untyped-def]
    """Add the corrections at the nodes 0 … goal, those at node ``end`` being e; keep the estimates at node goal."""
    k = block + end * _NODE
    x1, v, a = load(s, k), load(s, k + LANES), load(s, k + 2 * LANES)
    ev, ea = load(e, place), load(e, place + LANES)
    for i in range(end - 1, goal - 1, -1):
        k -= _NODE
        x1, v, a, ev, ea = _before(i, w, s, k, x1, ev, ea)
    store(kept, place, v)
    store(kept, place + LANES, a)
    store(s, k + LANES, plus(v, ev))
    store(s, k + 2 * LANES, plus(a, ea))
    for i in range(goal - 1, -1, -1):
        k -= _NODE
        x1, v, a, ev, ea = _before(i, w, s, k, x1, ev, ea)
        store(s, k + LANES, plus(v, ev))
        store(s, k + 2 * LANES, plus(a, ea))


@njit(cache=True, error_model="numpy")
def _write(begin, end, dims, w, s, out, at, plane):  # type: ignore[no-untyped-def]
    """Write a window's pieces begin … end - 1 to out[at …], and rubbish past them, which the next pieces overwrite."""
    for i in range(begin, end):
        h = _number(w, i)
        half = 0.5 * h * h
        for d in range(0, dims, LANES):
            k, o = d // LANES * _BLOCK + i * _NODE, at + d
            x0, v0, a0 = load(s, k), scaled(load(s, k + LANES), h), scaled(load(s, k + 2 * LANES), half)
            v1, a1 = load(s, k + LANES + _NODE), load(s, k + 2 * LANES + _NODE)
            x = plus(load(s, k + _NODE), scaled(plus(x0, plus(v0, a0)), -1.0))
            v = step(v1, h, step(a0, -2.0, scaled(v0, -1.0)))
            a = step(a1, half, scaled(a0, -1.0))
            store(out, o, step(x, 6.0, step(v, -3.0, a)))
            store(out, o + plane, step(x, -15.0, step(v, 7.0, scaled(a, -2.0))))
            store(out, o + 2 * plane, step(x, 10.0, step(v, -4.0, a)))
            store(out, o + 3 * plane, a0)
            store(out, o + 4 * plane, v0)
            store(out, o + 5 * plane, x0)
        at += dims


@njit(cache=True, error_model="numpy")
def _settled(end, w):  # type: ignore[no-untyped-def]
    """Return the last node on which corrections at a window's node ``end`` have no influence, or 0."""
    j0, j1, j2, j3 = 1.0, 0.0, 0.0, 1.0
    unit = w[end - 1]
    for i in range(end - 1, 0, -1):
        g0, g1, g2, g3 = w[i + _J], w[i + _J + _ROW], w[i + _J + 2 * _ROW], w[i + _J + 3 * _ROW]
        j0, j1, j2, j3 = g0 * j0 + g1 * j2, g0 * j1 + g1 * j3, g2 * j0 + g3 * j2, g2 * j1 + g3 * j3
        longer = max(w[i] / unit, 1.0)
        if max(max(abs(j0), abs(j1) / unit), max(abs(j2) * unit, abs(j3))) * longer**2 < NEGLIGIBLE:
            return i
    return 0


@njit(cache=True, error_model="numpy")
def _shift(w, s, kept, goal, left, blocks):  # type: ignore[no-untyped-def]
    """Move what a window knows of its last ``left`` gaps to its start."""
    for r in range(0, _MINORS, _ROW):
        for i in range(r, r + left, LANES):
            store(w, i, load(w, i + goal))
    for b in range(blocks):
        for k in range(b * _BLOCK, b * _BLOCK + (left + 1) * _NODE, LANES):
            store(s, k, load(s, k + goal * _NODE))
        store(s, b * _BLOCK + LANES, load(kept, 2 * b * LANES))
        store(s, b * _BLOCK + 2 * LANES, load(kept, (2 * b + 1) * LANES))


@njit(cache=True, error_model="numpy")
def quintic_pieces(times, points, ends, out):  # type: ignore[no-untyped-def]
    """Write the pieces of the quintic C4 spline through the points.

    Parameters
    ----------
    times : array (N,)
    points : array (N, D)
        N >= 2, D >= 1.
    ends : array (2, 2, D)
        Velocity and acceleration at the start, then at the end.
    out : array (6, N - 1, D)
        Overwritten: coefficients, highest power first, in the local variable u in [0, 1].

    Returns
    -------
    solved : bool
        False if a step is not positive and finite, or the steps are so uneven that a window is too short for the
        corrections to decay or the minors leave their range; ``out`` is then of no use.
    uneven : float
        Largest ratio of neighbouring steps.
    """
    dims, gaps = points.shape[1], len(times) - 1
    blocks, plane = (dims + LANES - 1) // LANES, gaps * dims
    x, flat = points.reshape(-1), out.reshape(-1)
    tail = min(gaps, (LANES + dims - 1) // dims)  # the last gaps: past them a register could leave the arrays
    room = tail * dims + LANES
    ending, spare = np.zeros(room), np.empty(6 * room)
    ending[: tail * dims] = x[(gaps + 1 - tail) * dims :]
    w, s = np.empty(14 * _ROW), np.empty(blocks * _BLOCK)
    e, kept = np.zeros(2 * LANES * blocks), np.empty(2 * LANES * blocks)
    c = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0])
    for b in range(blocks):
        for d in range(LANES):
            k, j = b * _BLOCK + d, b * LANES + d
            here = j < dims
            s[k], s[k + LANES] = x[j] if here else 0.0, ends[0, 0, j] if here else 0.0
            s[k + 2 * LANES] = ends[0, 1, j] if here else 0.0
    first = known = 0  # the window's first gap; how many of its gaps have been gone over
    while first < gaps:
        end = min(GAPS, gaps - first)
        last = first + end == gaps
        good = _minors(times, first + known, first + end, c, w, known)
        if not (good and 1.0 / STEEPEST < c[6] and c[7] < STEEPEST):
            return False, max(1.0 / c[6], c[7])
        _gains(known, end, w)
        goal = end if last else _settled(end, w)
        if goal == 0:
            return False, max(1.0 / c[6], c[7])
        safe = gaps - tail - first
        split = max(known, min(end, safe))
        for b in range(blocks):
            block, d = b * _BLOCK, b * LANES
            _forth(x, (first + known + 1) * dims + d, dims, known, split, w, s, block)
            _forth(ending, (split - safe) * dims + d, dims, split, end, w, s, block)
            for j in range(min(LANES, dims - d) if last else 0):
                k = block + end * _NODE + j
                e[2 * d + j] = ends[1, 0, d + j] - s[k + LANES]
                e[2 * d + LANES + j] = ends[1, 1, d + j] - s[k + 2 * LANES]
            _back(goal, end, w, s, block, e, kept, 2 * d)
        split = max(0, min(goal, safe))
        _write(0, split, dims, w, s, flat, first * dims, plane)
        _write(split, goal, dims, w, s, spare, (split - safe) * dims, room)
        _shift(w, s, kept, goal, end - goal, blocks)
        first, known = first + goal, end - goal
    for r in range(6):
        for k in range(tail * dims):
            flat[(r + 1) * plane - tail * dims + k] = spare[r * room + k]
    return True, max(1.0 / c[6], c[7])
