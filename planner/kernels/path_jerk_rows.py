"""The rows of the jerk-limited program, in passes over the intervals; see ``path_jerk`` for what they mean.

Slacks and their changes are worked out anew wherever they are needed, from the three numbers of an interval: that is
less work than fetching them. Row r's two sides are ``2 r`` (above) and ``2 r + 1``; the caps come last.
"""

import numpy as np
from numba import njit

from .lanes import LANES, filled, larger, load, root, smaller, store

#: Least part of the objective's curvature that is kept where the jolts take it away.
CONVEX = 1e-2


@njit(cache=True, error_model="numpy")
def _form(e, at, width, a, b, c):  # type: ignore[no-untyped-def]
    """Return the form whose first coefficients are at ``at``, of lanes a, b, c."""
    return load(e, at) * a + load(e, at + width) * b + load(e, at + 2 * width) * c


@njit(cache=True, error_model="numpy")
def _total(x):  # type: ignore[no-untyped-def]
    """Return the sum of lanes."""
    room = np.empty(LANES)
    store(room, 0, x)
    return room.sum()


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
        least = smaller(one - a * load(over_caps, k), least)
        for r in range(rows):
            value, free = _form(e, 3 * r * width + k, width, a, b, c), one if r < pushes else phi
            at = 2 * r * width + k
            least = smaller(free - value * load(inverse, at), least)
            least = smaller(free - value * load(inverse, at + width), least)
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
            store(lam, at, aim / (free - value * load(inverse, at)))
            store(lam, at + width, aim / (free - value * load(inverse, at + width)))
        store(lam, 2 * rows * width + k, aim / (one - a * load(over_caps, k)))


@njit(cache=True, error_model="numpy")
def curvature(sizes, e, inverse, over_caps, abc, steps, price, lam, grad, hess):  # type: ignore[no-untyped-def]
    """Fill gradient (3 * width) of the objective and Hessian (6 * width) of the barrier program, by interval."""
    pushes, rows, width = sizes
    nothing, one = filled(0.0), filled(1.0)
    for k in range(0, width, LANES):
        a, b, c, h = load(abc, k), load(abc, width + k), load(abc, 2 * width + k), load(steps, k)
        phi = 1.0 / root(a)
        slope = phi / a * -0.5
        cost = h * (b * b * price[1] + price[0])
        bend = h * b * phi * price[1]
        store(grad, k, cost * slope)
        store(grad, width + k, bend * 2.0)
        store(grad, 2 * width + k, nothing)
        cap = load(over_caps, k)
        aa = load(lam, 2 * rows * width + k) / (one - a * cap) * cap * cap
        ab, bb = bend / a * -1.0, h * phi * (2.0 * price[1])
        ac = bc = cc = nothing
        free = cost
        for r in range(rows):
            at = 3 * r * width + k
            e0, e1, e2 = load(e, at), load(e, at + width), load(e, at + 2 * width)
            value = e0 * a + e1 * b + e2 * c
            at = 2 * r * width + k
            up, down = load(inverse, at), load(inverse, at + width)
            over, under = load(lam, at), load(lam, at + width)
            if r < pushes:
                d = over / (one - value * up) * up * up + under / (one - value * down) * down * down
                d0, d1 = d * e0, d * e1
                aa = aa + d0 * e0
            else:
                free = free - over - under
                over, under = over / (phi - value * up), under / (phi - value * down)
                s1 = (over * up + under * down) * slope
                d = over * up * up + under * down * down
                d0, d1 = d * e0 - s1, d * e1
                aa = aa + (over + under) * slope * slope - s1 * e0 + d0 * e0
            ab, ac = ab + d0 * e1, ac + d0 * e2
            bb, bc, cc = bb + d1 * e1, bc + d1 * e2, cc + d * e2 * e2
        free = larger(free, cost * CONVEX)
        store(hess, k, aa + free * phi / (a * a) * 0.75)
        store(hess, width + k, ab)
        store(hess, 2 * width + k, ac)
        store(hess, 3 * width + k, bb)
        store(hess, 4 * width + k, bc)
        store(hess, 5 * width + k, cc)


@njit(cache=True, error_model="numpy")
def _cross(over, change, weight):  # type: ignore[no-untyped-def]
    """Return the product of the changes of slack (``over`` is 1 / slack) and multiplier that the affine step makes."""
    return (weight * change * over + weight) * change * -1.0


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
        over = 1.0 / (one - a * cap)
        f0 = (aim - _cross(over, da * cap * -1.0, load(lam, 2 * rows * width + k))) * over * cap * -1.0
        f1 = f2 = filled(0.0)
        for r in range(rows):
            at = 3 * r * width + k
            e0, e1, e2 = load(e, at), load(e, at + width), load(e, at + 2 * width)
            value, change = e0 * a + e1 * b + e2 * c, e0 * da + e1 * db + e2 * dc
            at = 2 * r * width + k
            up, down = load(inverse, at), load(inverse, at + width)
            free, rise = (one, aim * 0.0) if r < pushes else (phi, fall)
            over, under = 1.0 / (free - value * up), 1.0 / (free - value * down)
            over = (aim - _cross(over, rise - change * up, load(lam, at))) * over
            under = (aim - _cross(under, rise - change * down, load(lam, at + width))) * under
            pull = over * up + under * down
            if r >= pushes:
                f0 = f0 + (over + under) * slope
            f0, f1, f2 = f0 - pull * e0, f1 - pull * e1, f2 - pull * e2
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
                value, change = e0 * a + e1 * b + e2 * c, e0 * da + e1 * db + e2 * dc
                before = e0 * fa + e1 * fb + e2 * fc
                free, fall, early = (one, aim * 0.0, aim * 0.0) if r < pushes else (phi, slope * da, slope * fa)
            else:
                value, change, before, free, fall, early = a, da, fa, one, aim * 0.0, aim * 0.0
            for side in range(2 if r < rows else 1):
                at = (2 * r + side) * width + k
                bound = load(inverse, at) if r < rows else load(over_caps, k)
                slack, weight, moved = free - value * bound, load(lam, at), fall - change * bound
                over = 1.0 / slack
                if corrects:
                    grown = (aim - _cross(over, early - before * bound, weight) - weight * moved) * over - weight
                    dual = larger(grown / weight * -1.0, dual)
                else:
                    grown = weight * moved * over * -1.0 - weight
                    dual = larger(moved * over + 1.0, dual)
                primal = larger(moved * over * -1.0, primal)
                linear, square = linear + weight * moved + slack * grown, square + moved * grown
    sums[0], sums[1], sums[2], sums[3] = _most(primal), _most(dual), _total(linear), _total(square)


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
        new = a + da * length
        later = 1.0 / root(new)
        for r in range(rows + 1):
            if r < rows:
                at = 3 * r * width + k
                e0, e1, e2 = load(e, at), load(e, at + width), load(e, at + 2 * width)
                value, change = e0 * a + e1 * b + e2 * c, e0 * da + e1 * db + e2 * dc
                before = e0 * fa + e1 * fb + e2 * fc
                free, fall, early = (one, aim * 0.0, aim * 0.0) if r < pushes else (phi, slope * da, slope * fa)
            else:
                value, change, before, free, fall, early = a, da, fa, one, aim * 0.0, aim * 0.0
            ahead = later if pushes <= r < rows else one
            for side in range(2 if r < rows else 1):
                at = (2 * r + side) * width + k
                bound = load(inverse, at) if r < rows else load(over_caps, k)
                slack, weight, moved = free - value * bound, load(lam, at), fall - change * bound
                over = 1.0 / slack
                grown = (aim - _cross(over, early - before * bound, weight) - weight * moved) * over - weight
                weight = weight + grown * length
                store(lam, at, weight)
                gap = gap + weight * (ahead - (value + change * length) * bound)
        store(abc, k, new)
        store(abc, width + k, b + db * length)
        store(abc, 2 * width + k, c + dc * length)
    return _total(gap)


@njit(cache=True, error_model="numpy")
def time_taken(steps, abc, price):  # type: ignore[no-untyped-def]
    """Return the objective, without the ends."""
    width = len(steps)
    total = filled(0.0)
    for k in range(0, width, LANES):
        b = load(abc, width + k)
        total = total + load(steps, k) * (b * b * price[1] + price[0]) / root(load(abc, k))
    return _total(total)
