"""The rows of the jerk-limited program, in passes over the intervals; see ``path_jerk`` for what they mean.

Slacks and their changes are worked out anew wherever they are needed, from the three numbers of an interval: that is
less work than fetching them. Row r's two sides are ``2 r`` (above) and ``2 r + 1``; the caps come last.
"""

import numpy as np
from numba import njit

from .lanes import LANES, added, filled, larger, load, minus, root, smaller, store
from .lanes import step as fused

#: Least part of the objective's curvature that is kept where the jolts take it away.
CONVEX = 1e-2


@njit(cache=True, error_model="numpy")
def _three(e0, e1, e2, a, b, c):  # type: ignore[no-untyped-def]
    """Return the sum of three products."""
    return fused(e2, c, fused(e1, b, e0 * a))


@njit(cache=True, error_model="numpy")
def _form(e, at, width, a, b, c):  # type: ignore[no-untyped-def]
    """Return the form whose first coefficients are at ``at``, of lanes a, b, c."""
    return _three(load(e, at), load(e, at + width), load(e, at + 2 * width), a, b, c)


@njit(cache=True, error_model="numpy")
def _most(x):  # type: ignore[no-untyped-def]
    """Return the largest of lanes."""
    room = np.empty(LANES)
    store(room, 0, x)
    return room.max()


@njit(cache=True, error_model="numpy")
def least_slack(sizes, e, inverse, over_caps, abc):  # type: ignore[no-untyped-def]
    """Return the smallest slack of all rows and caps."""
    pushes, rows, width = sizes
    one = least = filled(1.0)
    for k in range(0, width, LANES):
        a, b, c = load(abc, k), load(abc, width + k), load(abc, 2 * width + k)
        phi = 1.0 / root(a)
        least = smaller(minus(a, load(over_caps, k), one), least)
        for r in range(rows):
            value, free = _form(e, 3 * r * width + k, width, a, b, c), one if r < pushes else phi
            at = 2 * r * width + k
            least = smaller(minus(value, load(inverse, at), free), least)
            least = smaller(minus(value, load(inverse, at + width), free), least)
    return -_most(least * -1.0)


@njit(cache=True, error_model="numpy")
def begin_multipliers(sizes, e, inverse, over_caps, abc, mu, lam):  # type: ignore[no-untyped-def]
    """Fill the multipliers with mu / slack."""
    pushes, rows, width = sizes
    one, aim = filled(1.0), filled(mu)
    for k in range(0, width, LANES):
        a, b, c = load(abc, k), load(abc, width + k), load(abc, 2 * width + k)
        phi = 1.0 / root(a)
        for r in range(rows):
            value, free = _form(e, 3 * r * width + k, width, a, b, c), one if r < pushes else phi
            at = 2 * r * width + k
            store(lam, at, aim / minus(value, load(inverse, at), free))
            store(lam, at + width, aim / minus(value, load(inverse, at + width), free))
        store(lam, 2 * rows * width + k, aim / minus(a, load(over_caps, k), one))


@njit(cache=True, error_model="numpy")
def curvature(sizes, e, inverse, over_caps, abc, steps, price, lam, grad, hess):  # type: ignore[no-untyped-def]
    """Fill gradient (3 * width) of the objective and Hessian (6 * width) of the barrier program, by interval."""
    pushes, rows, width = sizes
    nothing, one = filled(0.0), filled(1.0)
    for k in range(0, width, LANES):
        a, b, c, h = load(abc, k), load(abc, width + k), load(abc, 2 * width + k), load(steps, k)
        phi = 1.0 / root(a)
        slope = phi / a * -0.5
        cost = h * fused(b * b, price[1], filled(price[0]))
        bend = h * b * phi * price[1]
        store(grad, k, cost * slope)
        store(grad, width + k, bend * 2.0)
        store(grad, 2 * width + k, nothing)
        cap = load(over_caps, k)
        aa = load(lam, 2 * rows * width + k) / minus(a, cap, one) * cap * cap
        ab, bb = bend / a * -1.0, h * phi * (2.0 * price[1])
        ac = bc = cc = nothing
        free = cost
        for r in range(rows):
            at = 3 * r * width + k
            e0, e1, e2 = load(e, at), load(e, at + width), load(e, at + 2 * width)
            value = _three(e0, e1, e2, a, b, c)
            at = 2 * r * width + k
            up, down = load(inverse, at), load(inverse, at + width)
            over, under = load(lam, at), load(lam, at + width)
            if r < pushes:
                d = over / minus(value, up, one) * up * up
                d = fused(under / minus(value, down, one) * down, down, d)
                d0, d1 = d * e0, d * e1
                aa = fused(d0, e0, aa)
            else:
                free = free - over - under
                over, under = over / minus(value, up, phi), under / minus(value, down, phi)
                s1 = fused(over, up, under * down) * slope
                d = fused(over * up, up, under * down * down)
                d0, d1 = fused(d, e0, s1 * -1.0), d * e1
                aa = fused(d0, e0, minus(s1, e0, fused((over + under) * slope, slope, aa)))
            ab, ac = fused(d0, e1, ab), fused(d0, e2, ac)
            bb, bc, cc = fused(d1, e1, bb), fused(d1, e2, bc), fused(d * e2, e2, cc)
        free = larger(free, cost * CONVEX)
        store(hess, k, fused(free * phi / (a * a), 0.75, aa))
        store(hess, width + k, ab)
        store(hess, 2 * width + k, ac)
        store(hess, 3 * width + k, bb)
        store(hess, 4 * width + k, bc)
        store(hess, 5 * width + k, cc)


@njit(cache=True, error_model="numpy")
def _cross(over, change, weight):  # type: ignore[no-untyped-def]
    """Return the product of the changes of slack (``over`` is 1 / slack) and multiplier that the affine step makes."""
    return fused(weight * change, over, weight) * change * -1.0


@njit(cache=True, error_model="numpy")
def forces(sizes, e, inverse, over_caps, abc, affine, lam, target, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` (3 * width) with the sum over the rows of (target - cross) / w times the slack's gradient."""
    pushes, rows, width = sizes
    aim, one = filled(target), filled(1.0)
    for k in range(0, width, LANES):
        a, b, c = load(abc, k), load(abc, width + k), load(abc, 2 * width + k)
        da, db, dc = load(affine, k), load(affine, width + k), load(affine, 2 * width + k)
        phi = 1.0 / root(a)
        slope = phi / a * -0.5
        fall = slope * da
        cap = load(over_caps, k)
        over = 1.0 / minus(a, cap, one)
        f0 = (aim - _cross(over, da * cap * -1.0, load(lam, 2 * rows * width + k))) * over * cap * -1.0
        f1 = f2 = filled(0.0)
        for r in range(rows):
            at = 3 * r * width + k
            e0, e1, e2 = load(e, at), load(e, at + width), load(e, at + 2 * width)
            value, change = _three(e0, e1, e2, a, b, c), _three(e0, e1, e2, da, db, dc)
            at = 2 * r * width + k
            up, down = load(inverse, at), load(inverse, at + width)
            free, rise = (one, aim * 0.0) if r < pushes else (phi, fall)
            over, under = 1.0 / minus(value, up, free), 1.0 / minus(value, down, free)
            over = (aim - _cross(over, minus(change, up, rise), load(lam, at))) * over
            under = (aim - _cross(under, minus(change, down, rise), load(lam, at + width))) * under
            pull = fused(over, up, under * down)
            if r >= pushes:
                f0 = fused(over + under, slope, f0)
            f0, f1, f2 = minus(pull, e0, f0), minus(pull, e1, f1), minus(pull, e2, f2)
        store(out, k, f0)
        store(out, width + k, f1)
        store(out, 2 * width + k, f2)


@njit(cache=True, error_model="numpy")
def reach(sizes, e, inverse, over_caps, abc, affine, step, corrects, lam, target, sums):  # type: ignore[no-untyped-def]
    """Leave in ``sums`` (4,) how far a step may go and what it does to the complementarity.

    The inverse step lengths to the bounds of slacks and of multipliers, and the coefficients of the first and second
    power of the step length in the complementarity. ``corrects``: the step is the corrected one, not the affine.
    """
    pushes, rows, width = sizes
    aim, one = filled(target), filled(1.0)
    primal = dual = linear = square = filled(0.0)
    for k in range(0, width, LANES):
        a, b, c = load(abc, k), load(abc, width + k), load(abc, 2 * width + k)
        fa, fb, fc = load(affine, k), load(affine, width + k), load(affine, 2 * width + k)
        da, db, dc = load(step, k), load(step, width + k), load(step, 2 * width + k)
        phi = 1.0 / root(a)
        slope = phi / a * -0.5
        primal = larger(da / a * (-1.0 / 0.95), primal)
        for r in range(rows + 1):
            if r < rows:
                at = 3 * r * width + k
                e0, e1, e2 = load(e, at), load(e, at + width), load(e, at + 2 * width)
                value, change = _three(e0, e1, e2, a, b, c), _three(e0, e1, e2, da, db, dc)
                before = _three(e0, e1, e2, fa, fb, fc)
                free, fall, early = (one, aim * 0.0, aim * 0.0) if r < pushes else (phi, slope * da, slope * fa)
            else:
                value, change, before, free, fall, early = a, da, fa, one, aim * 0.0, aim * 0.0
            for side in range(2 if r < rows else 1):
                at = (2 * r + side) * width + k
                bound = load(inverse, at) if r < rows else load(over_caps, k)
                slack, weight, moved = minus(value, bound, free), load(lam, at), minus(change, bound, fall)
                over = 1.0 / slack
                if corrects:
                    cross = _cross(over, minus(before, bound, early), weight)
                    grown = fused(minus(weight, moved, aim - cross), over, weight * -1.0)
                    dual = larger(grown / weight * -1.0, dual)
                else:
                    grown = minus(weight * moved, over, weight * -1.0)
                    dual = larger(fused(moved, over, one), dual)
                primal = larger(moved * over * -1.0, primal)
                linear, square = fused(slack, grown, fused(weight, moved, linear)), fused(moved, grown, square)
    sums[0], sums[1], sums[2], sums[3] = _most(primal), _most(dual), added(linear), added(square)


@njit(cache=True, error_model="numpy")
def advance(sizes, e, inverse, over_caps, abc, affine, step, lam, target, length):  # type: ignore[no-untyped-def]
    """Take the corrected step: change the multipliers and ``abc``; return the complementarity there."""
    pushes, rows, width = sizes
    aim, one = filled(target), filled(1.0)
    gap = filled(0.0)
    for k in range(0, width, LANES):
        a, b, c = load(abc, k), load(abc, width + k), load(abc, 2 * width + k)
        fa, fb, fc = load(affine, k), load(affine, width + k), load(affine, 2 * width + k)
        da, db, dc = load(step, k), load(step, width + k), load(step, 2 * width + k)
        phi = 1.0 / root(a)
        slope = phi / a * -0.5
        new = fused(da, length, a)
        later = 1.0 / root(new)
        for r in range(rows + 1):
            if r < rows:
                at = 3 * r * width + k
                e0, e1, e2 = load(e, at), load(e, at + width), load(e, at + 2 * width)
                value, change = _three(e0, e1, e2, a, b, c), _three(e0, e1, e2, da, db, dc)
                before = _three(e0, e1, e2, fa, fb, fc)
                free, fall, early = (one, aim * 0.0, aim * 0.0) if r < pushes else (phi, slope * da, slope * fa)
            else:
                value, change, before, free, fall, early = a, da, fa, one, aim * 0.0, aim * 0.0
            ahead = later if pushes <= r < rows else one
            for side in range(2 if r < rows else 1):
                at = (2 * r + side) * width + k
                bound = load(inverse, at) if r < rows else load(over_caps, k)
                slack, weight, moved = minus(value, bound, free), load(lam, at), minus(change, bound, fall)
                over = 1.0 / slack
                cross = _cross(over, minus(before, bound, early), weight)
                grown = fused(minus(weight, moved, aim - cross), over, weight * -1.0)
                weight = fused(grown, length, weight)
                store(lam, at, weight)
                gap = fused(weight, minus(fused(change, length, value), bound, ahead), gap)
        store(abc, k, new)
        store(abc, width + k, fused(db, length, b))
        store(abc, 2 * width + k, fused(dc, length, c))
    return added(gap)


@njit(cache=True, error_model="numpy")
def time_taken(steps, abc, price):  # type: ignore[no-untyped-def]
    """Return the objective, without the ends."""
    width = len(steps)
    total = filled(0.0)
    for k in range(0, width, LANES):
        b = load(abc, width + k)
        total = total + load(steps, k) * fused(b * b, price[1], filled(price[0])) / root(load(abc, k))
    return added(total)
