r"""The jerk-limited profile of a fixed path: a primal-dual interior point on a banded, convexified program.

a(s) = sdot² is a C1 quadratic spline on the stations, by its B-spline coefficients y. On interval k, with step h, count
its mean A, its slope b = sddot at the middle B, and c = b' (constant) C: three linear forms of three coefficients,
``maps[k]``. With phi(A) = A^(-1/2), in time over the interval h phi, the program is

.. math::

    \min \sum_k h_k (p + g B_k^2) \varphi(A_k) \quad\text{s.t.}\quad A_k \le cap_k, \; y \ge 0, \;
    \underline r \le e \cdot (A, B, C) \le \overline r \;\text{(pushes)}, \quad
    \underline j \varphi(A) \le e \cdot (A, B, C) \le \overline j \varphi(A) \;\text{(jolts)}

Pushes are the joints' accelerations at the ends of the interval, jolts their jerks at its middle, each divided by
sdot: linear forms of the path's derivatives there. The jolts' rows are not convex (phi is, on the wrong side): each
iteration takes phi at its tangent, which lies below it, so that a step that keeps the linear rows keeps the true ones.
Where the multipliers of an interval's jolts do not add up to more than h (their curvature is then no more than that of
the objective) the point found is the optimum of the convex relaxation "rows <= j t, t >= phi(A), min sum h t" too.

The passes over the rows are in ``path_jerk_rows``. Arrays over intervals have the interval last, in a number that is a
multiple of LANES: the loops over them run in lanes. Intervals that only fill up have step, forms and inverse limits 0,
A = 1 and an infinite cap.
"""

import numpy as np
from numba import njit

from .lanes import minus
from .lanes import step as fused
from .path_jerk_rows import advance, begin_multipliers, curvature, forces, least_slack, reach, time_taken

#: Part of the way to the nearest bound that a step goes.
FRACTION = 0.995


@njit(cache=True, error_model="numpy")
def spline_maps(nodes, ratios, maps):  # type: ignore[no-untyped-def]
    """Fill ``maps`` (m, 3, 3): mean, slope b at the middle and curvature c of a quadratic spline by its coefficients.

    ``nodes`` (m + 1,), of multiplicity three at both ends; ``ratios`` (2,): a first (last) coefficient that is this
    multiple of its neighbour is folded into it; 0: it stands for itself.
    """
    m = len(nodes) - 1
    for k in range(m):
        left, right = nodes[k], nodes[k + 1]
        before = nodes[k - 1] if k > 0 else left
        after = nodes[k + 2] if k < m - 1 else right
        h, wide, next_wide = right - left, right - before, after - left
        a0, a1 = h / wide, (left - before) / wide
        l0, l1, r1, r2 = -1.0 / wide, 1.0 / wide, -1.0 / next_wide, 1.0 / next_wide
        maps[k, 0, 0] = a0 + h * (2.0 * l0) / 3.0
        maps[k, 0, 1] = a1 + h * (2.0 * l1 + r1) / 3.0
        maps[k, 0, 2] = h * r2 / 3.0
        maps[k, 1, 0], maps[k, 1, 1], maps[k, 1, 2] = 0.5 * l0, 0.5 * (l1 + r1), 0.5 * r2
        maps[k, 2, 0], maps[k, 2, 1], maps[k, 2, 2] = -l0 / h, (r1 - l1) / h, r2 / h
    for r in range(3):
        if ratios[0] > 0.0:
            maps[0, r, 1] += ratios[0] * maps[0, r, 0]
            maps[0, r, 0] = 0.0
        if ratios[1] > 0.0:
            maps[m - 1, r, 1] += ratios[1] * maps[m - 1, r, 2]
            maps[m - 1, r, 2] = 0.0


@njit(cache=True, error_model="numpy")
def _forms(maps, y, width, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` (3 * width): mean, slope and curvature of every interval."""
    for k in range(len(maps)):
        y0, y1, y2 = y[k], y[k + 1], y[k + 2]
        for r in range(3):
            out[r * width + k] = fused(maps[k, r, 2], y2, fused(maps[k, r, 1], y1, maps[k, r, 0] * y0))


@njit(cache=True, error_model="numpy")
def _factorise(h0, h1, h2):  # type: ignore[no-untyped-def]
    """Overwrite a pentadiagonal matrix with its L D L' factors; the diagonal holds 1 / D."""
    # o = l D and f = l D of the first and second diagonal, of the row before, and of that before it (f, l2 only)
    o = l1 = f1 = l12 = f2 = l22 = 0.0
    for i in range(len(h0)):
        d = minus(l1, o, minus(l22, f2, h0[i]))
        o = minus(l12, o, h1[i])
        over = 1.0 / d
        l22, f2, f1 = l12, f1, h2[i]
        l1, l12 = o * over, f1 * over
        h0[i], h1[i], h2[i] = over, l1, l12


@njit(cache=True, error_model="numpy")
def _solve(h0, h1, h2, x):  # type: ignore[no-untyped-def]
    """Overwrite x by the solution of the factorised system."""
    n = len(x)
    one = two = near = far = farther = 0.0
    for i in range(n):
        t = minus(near, one, minus(farther, two, x[i]))
        near, far, farther = h1[i], h2[i], far
        one, two = t, one
        x[i] = t
    one = two = 0.0
    for i in range(n - 1, -1, -1):
        t = minus(h1[i], one, minus(h2[i], two, x[i] * h0[i]))
        one, two = t, one
        x[i] = t


@njit(cache=True, error_model="numpy")
def _gathered(maps, by_interval, width, out):  # type: ignore[no-untyped-def]
    """Add forms by interval (3 * width) to a vector over the coefficients."""
    m = len(maps)
    x0 = x1 = 0.0  # what the intervals before leave for coefficients k and k + 1
    for k in range(m):
        f0, f1, f2 = by_interval[k], by_interval[width + k], by_interval[2 * width + k]
        out[k] += fused(maps[k, 0, 0], f0, fused(maps[k, 1, 0], f1, fused(maps[k, 2, 0], f2, x0)))
        x0 = fused(maps[k, 0, 1], f0, fused(maps[k, 1, 1], f1, fused(maps[k, 2, 1], f2, x1)))
        x1 = fused(maps[k, 0, 2], f0, fused(maps[k, 1, 2], f1, maps[k, 2, 2] * f2))
    out[m] += x0
    out[m + 1] += x1


@njit(cache=True, error_model="numpy")
def _times(a0, a1, a2, b0, b1, b2):  # type: ignore[no-untyped-def]
    """Return the sum of three products."""
    return fused(a2, b2, fused(a1, b1, a0 * b0))


@njit(cache=True, error_model="numpy")
def _assembled(maps, hess, width, h0, h1, h2):  # type: ignore[no-untyped-def]
    """Add M' H M of every interval to the bands."""
    m = len(maps)
    x0 = x1 = z0 = 0.0  # what the intervals before leave for h0[k], h0[k + 1] and h1[k]
    for k in range(m):
        aa, ab, ac = hess[k], hess[width + k], hess[2 * width + k]
        bb, bc, cc = hess[3 * width + k], hess[4 * width + k], hess[5 * width + k]
        a, b, c = maps[k, 0, 0], maps[k, 1, 0], maps[k, 2, 0]
        a1, b1, c1 = maps[k, 0, 1], maps[k, 1, 1], maps[k, 2, 1]
        a2, b2, c2 = maps[k, 0, 2], maps[k, 1, 2], maps[k, 2, 2]
        ra, rb, rc = _times(aa, ab, ac, a, b, c), _times(ab, bb, bc, a, b, c), _times(ac, bc, cc, a, b, c)
        h0[k] += x0 + _times(ra, rb, rc, a, b, c)
        h1[k] += z0 + _times(ra, rb, rc, a1, b1, c1)
        h2[k] += _times(ra, rb, rc, a2, b2, c2)
        ra, rb, rc = _times(aa, ab, ac, a1, b1, c1), _times(ab, bb, bc, a1, b1, c1), _times(ac, bc, cc, a1, b1, c1)
        x0 = x1 + _times(ra, rb, rc, a1, b1, c1)
        z0 = _times(ra, rb, rc, a2, b2, c2)
        ra, rb, rc = _times(aa, ab, ac, a2, b2, c2), _times(ab, bb, bc, a2, b2, c2), _times(ac, bc, cc, a2, b2, c2)
        x1 = _times(ra, rb, rc, a2, b2, c2)
    h0[m] += x0
    h0[m + 1] += x1
    h1[m] += z0


@njit(cache=True, error_model="numpy")
def _single(counts, ends, y, v):  # type: ignore[no-untyped-def]
    """Fill the slacks of the bounds on single values: the two end caps, and y >= 0."""
    m = len(y) - 2
    for i in range(2):
        if counts[i]:
            v[i] = 1.0 - ends[i, 0] * y[1 if i == 0 else m] / ends[i, 2]
    for i in range(len(y)):
        if counts[2 + i]:
            v[2 + i] = y[i]


@njit(cache=True, error_model="numpy")
def _value(steps, abc, price, ends, y):  # type: ignore[no-untyped-def]
    """Return the objective."""
    value = time_taken(steps, abc, price)
    for side in range(2):
        if ends[side, 0] > 0.0:
            a = ends[side, 0] * y[1 if side == 0 else len(y) - 2]
            value += price[0] * ends[side, 1] / np.sqrt(a) + price[1] * ends[side, 3] * a * np.sqrt(a)
    return value


@njit(cache=True, error_model="numpy")
def solve_profile(  # type: ignore[no-untyped-def]
    sizes, steps, maps, fixed, e, inverse, over_caps, ends, price, y, lam, single, start, centring, tolerance, most
):
    """Improve a strictly feasible profile to the optimum.

    Parameters
    ----------
    sizes : (int, int, int)
        Pushes, pushes and jolts, and the width W >= m, a multiple of LANES.
    steps : (W,)
    maps : (m, 3, 3)
    fixed : (m + 2,) of bool
        Coefficients that stay as they are.
    e : (rows * 3 * W,)
        The rows' forms.
    inverse : (rows * 2 * W,)
        1 / limit above, 1 / limit below; 0 where there is none.
    over_caps : (W,)
        1 / upper bound of A.
    ends : (2, 4)
        Of a rest at the first and last station: the multiple k of the outermost free coefficient that a has at the
        station next to it (0: no rest), the time e in e / sqrt(k y), the upper bound of k y, and the squared path
        acceleration's integral f in f (k y)^(3/2).
    price : (2,)
        p and g: the price of time, and that of squared path acceleration.
    y : (m + 2,)
        Strictly feasible on entry; the optimum on exit.
    lam, single : ((2 * rows + 1) * W,), (2 + m + 2,)
        On exit the multipliers of rows and caps; of the end caps and y >= 0.
    start : float
        The complementarity to begin with, as a share of the objective by row.
    centring : float
        The least share of the complementarity that an iteration aims at; 1: the iterates go to the centre.
    tolerance : float
        Of the gap and the stationarity, relative to the objective.

    Returns
    -------
    iterations, gap : int, float
        -1 iterations: the point is not strictly feasible. The gap is the sum of the complementarities.
    """
    pushes, rows, width = sizes
    m = len(maps)
    size = m + 2
    abc, step, affine = np.ones(3 * width), np.zeros(3 * width), np.zeros(3 * width)
    grad, pull, hess = np.empty(3 * width), np.empty(3 * width), np.empty(6 * width)
    v, dv, grown, between = np.ones(size + 2), np.zeros(size + 2), np.zeros(size + 2), np.zeros(size + 2)
    h0, h1, h2, gradient, dy = np.empty(size), np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    sums = np.zeros(4)
    counts = np.zeros(size + 2, np.bool_)  # which of the single bounds there are
    for i in range(size):
        counts[2 + i] = not fixed[i]
    last = (1, m)  # the outermost free coefficients at rests
    for side in range(2):
        counts[side] = ends[side, 0] > 0.0
    total = (2 * rows + 1) * width + counts.sum()

    _forms(maps, y, width, abc)
    least = abc[:m].min()
    if not least > 0.0:
        return -1, 0.0
    least = least_slack(sizes, e, inverse, over_caps, abc)
    _single(counts, ends, y, v)
    if not (least > 0.0 and v.min() > 0.0):
        return -1, 0.0
    value = _value(steps, abc, price, ends, y)
    mu = start * value / total
    begin_multipliers(sizes, e, inverse, over_caps, abc, mu, lam)
    for i in range(size + 2):
        single[i] = mu / v[i] if counts[i] else 0.0
    gap = mu * total
    for iteration in range(most):
        curvature(sizes, e, inverse, over_caps, abc, steps, price, lam, grad, hess)
        h0[:], h1[:], h2[:], gradient[:] = 0.0, 0.0, 0.0, 0.0
        _assembled(maps, hess, width, h0, h1, h2)
        _gathered(maps, grad, width, gradient)
        for side in range(2):
            if counts[side]:
                i = last[side]
                time = price[0] * ends[side, 1] / np.sqrt(ends[side, 0] * y[i])
                effort = price[1] * ends[side, 3] * (ends[side, 0] * y[i]) ** 1.5
                gradient[i] += (1.5 * effort - 0.5 * time) / y[i]
                h0[i] += 0.75 * effort / (y[i] * y[i])
                h0[i] += 0.75 * time / (y[i] * y[i]) + single[side] / v[side] * (ends[side, 0] / ends[side, 2]) ** 2
        for i in range(size):
            if fixed[i]:
                h0[i] = 1.0
                h1[i] = h2[i] = 0.0
                if i >= 1:
                    h1[i - 1] = 0.0
                if i >= 2:
                    h2[i - 2] = 0.0
            else:
                h0[i] += single[2 + i] / v[2 + i]
        _factorise(h0, h1, h2)
        mu = gap / total
        target = length = 0.0
        for phase in range(2):
            for i in range(size + 2):
                between[i] = dv[i] * grown[i] if phase == 1 else 0.0
            for i in range(size):
                dy[i] = -gradient[i]
            if phase == 1:
                affine[:] = step
                forces(sizes, e, inverse, over_caps, abc, affine, lam, target, pull)
                _gathered(maps, pull, width, dy)
                for i in range(size + 2):
                    if counts[i]:
                        push = (target - between[i]) / v[i]
                        if i >= 2:
                            dy[i - 2] += push
                        else:
                            dy[last[i]] -= push * ends[i, 0] / ends[i, 2]
            for i in range(size):
                if fixed[i]:
                    dy[i] = 0.0
            _solve(h0, h1, h2, dy)
            _forms(maps, dy, width, step)
            reach(sizes, e, inverse, over_caps, abc, affine, step, phase == 1, lam, target, sums)
            for i in range(size + 2):
                if counts[i]:
                    dv[i] = dy[i - 2] if i >= 2 else -ends[i, 0] * dy[last[i]] / ends[i, 2]
                    grown[i] = (target - between[i] - single[i] * dv[i]) / v[i] - single[i]
                    sums[0] = max(sums[0], -dv[i] / v[i])
                    sums[1] = max(sums[1], -grown[i] / single[i])
                    sums[2] += single[i] * dv[i] + v[i] * grown[i]
                    sums[3] += dv[i] * grown[i]
            part = 1.0 if phase == 0 else FRACTION
            length = min(1.0, part / max(max(sums[0], sums[1]), 1e-300))
            if phase == 0:
                left = (gap + length * (sums[2] + length * sums[3])) / gap
                target = max(min(max(left, 0.0) ** 3, 0.8), centring) * mu
        before_gap = gap
        gap = advance(sizes, e, inverse, over_caps, abc, affine, step, lam, target, length)
        for i in range(size):
            y[i] += length * dy[i]
        _single(counts, ends, y, v)
        for i in range(size + 2):
            single[i] += length * grown[i]
            gap += single[i] * v[i]
        before, value = value, _value(steps, abc, price, ends, y)
        if before_gap * (1.2 - length) < tolerance * value and abs(before - value) < tolerance * value:
            return iteration + 1, gap
    return most, gap
