r"""Durations and node states within limits: a primal-dual barrier method on the blocks that a spline has.

The variables are the node states and the logarithms of the durations. A limit at a place of a gap is a row that needs
this gap's duration and the states at its ends only, so the Newton matrix is block-tridiagonal. A row c >= 0 may be
broken at a price: c + s >= 0, with cost price * s and logarithmic barriers for both, and the best s in closed form.
The function that is minimised is therefore defined everywhere, and no feasible start is needed.

Layout: ``x`` (N, B), B = (k - 1) D + 1: at every node the derivatives 1 … k-1, joint by joint in each order, and the
logarithm of the duration of the gap to the right (none at the last node).
"""

import numpy as np
from numba import njit

from .blocks import factorise, solve


@njit(cache=True, error_model="numpy")
def _penalty(c, mu, price):  # type: ignore[no-untyped-def]
    """Return the least of price s - mu log s - mu log(c + s), its multiplier, s, and c + s."""
    root = np.sqrt(price * price * c * c + 4.0 * mu * mu)
    if c >= 0.0:
        t = (2.0 * mu + price * c + root) / (2.0 * price)
        s = mu * t / (price * t - mu)
    else:
        s = (2.0 * mu - price * c + root) / (2.0 * price)
        t = mu * s / (price * s - mu)
    return price * s - mu * np.log(s * t), mu / t, s, t


@njit(cache=True, error_model="numpy")
def set_places(basis, where, weights):  # type: ignore[no-untyped-def]
    """Write what each entry of a gap counts in the derivatives at the places.

    Parameters
    ----------
    basis : array (2k, 2k - 1)
        Coefficients of 1, u, … from (rise, left states, right states).
    where : array (M, D, 4, P)
        Places in [0, 1]; negative ones are not used.
    weights : array (M, D, 4, P, 2k - 1)
        Overwritten.
    """
    gaps, dims, orders, places = where.shape
    size, entries = basis.shape
    power = np.zeros(size)
    for i in range(gaps):
        for d in range(dims):
            for m in range(orders):
                for p in range(places):
                    u = where[i, d, m, p]
                    if u < 0.0:
                        continue
                    raised = 1.0
                    for n in range(size):
                        power[n] = 0.0
                        if n >= m:
                            factor = 1.0
                            for j in range(n - m + 1, n + 1):
                                factor *= j
                            power[n] = factor * raised
                            raised *= u
                    for r in range(entries):
                        total = 0.0
                        for n in range(size):
                            total += basis[n, r] * power[n]
                        weights[i, d, m, p, r] = total


@njit(cache=True, error_model="numpy")
def _entries(x, points, i, d, b, y):  # type: ignore[no-untyped-def]
    """Write (rise, left states, right states) of a joint in a gap."""
    dims = points.shape[1]
    y[0] = points[i + 1, d] - points[i, d]
    for r in range(b):
        y[1 + r] = x[i, r * dims + d]
        y[1 + b + r] = x[i + 1, r * dims + d]


@njit(cache=True, error_model="numpy")
def _powers(logarithm, power):  # type: ignore[no-untyped-def]
    """Write h^-7 … h^7 into ``power``."""
    h = np.exp(logarithm)
    power[7] = 1.0
    for n in range(1, 8):
        power[7 + n] = power[6 + n] * h
        power[7 - n] = power[8 - n] / h
    return h


@njit(cache=True, error_model="numpy")
def merit(x, points, weights, where, gain, offset, low, high, cost, quad, mu, price):  # type: ignore[no-untyped-def]
    """Return the objective plus all penalties; arguments as ``newton``."""
    gaps, dims, orders, places = where.shape
    entries = weights.shape[4]
    b = (entries - 1) // 2
    y, power, total = np.zeros(entries), np.zeros(15), 0.0
    for i in range(gaps):
        h = _powers(x[i, b * dims], power)
        total += cost[dims] * h
        if low[i] > 0.0:
            total += _penalty(h / low[i] - 1.0, mu, price)[0]
        if high[i] < np.inf:
            total += _penalty(1.0 - h / high[i], mu, price)[0]
        for d in range(dims):
            _entries(x, points, i, d, b, y)
            if cost[d] > 0.0:
                energy = 0.0
                for r in range(entries):
                    nr = r if r <= b else r - b
                    for s in range(entries):
                        ns = s if s <= b else s - b
                        energy += quad[r, s] * y[r] * y[s] * power[7 + nr + ns - 2 * b - 1]
                total += cost[d] * energy
            for m in range(orders):
                if gain[0, i, d, m] == 0.0 and gain[1, i, d, m] == 0.0:
                    continue
                for p in range(places):
                    if where[i, d, m, p] < 0.0:
                        continue
                    q = points[i, d] if m == 0 else 0.0
                    for r in range(entries):
                        nr = r if r <= b else r - b
                        q += weights[i, d, m, p, r] * power[7 + nr - m] * y[r]
                    for side in range(2):
                        g = gain[side, i, d, m]
                        if g != 0.0:
                            total += _penalty(offset[side, i, d, m] + g * q, mu, price)[0]
    return total


@njit(cache=True, error_model="numpy")
def _assemble(  # type: ignore[no-untyped-def]
    x, points, weights, where, gain, offset, low, high, cost, quad, mu, price, z, zh, grad, diag, off
):
    """Write gradient (N, B), diagonal blocks (N, B, B), and those to the right of them, of the Newton system."""
    gaps, dims, orders, places = where.shape
    entries = weights.shape[4]
    b = (entries - 1) // 2
    last = b * dims
    y, power, loc = np.zeros(entries), np.zeros(15), np.zeros(entries)
    own, matrix, index = np.zeros(entries), np.zeros((entries, entries)), np.zeros(entries, np.int64)
    grad[:], diag[:], off[:] = 0.0, 0.0, 0.0
    for i in range(gaps):
        h = _powers(x[i, last], power)
        grad[i, last] += cost[dims] * h
        diag[i, last, last] += cost[dims] * h
        for side in range(2):
            bound = low[i] if side == 0 else high[i]
            if 0.0 < bound < np.inf:
                slope = (1.0 if side == 0 else -1.0) * h / bound
                _, zp, s, t = _penalty(slope - (1.0 if side == 0 else -1.0), mu, price)
                weight = 1.0 / (t / zh[side, i] + s / (price - zh[side, i]))
                grad[i, last] -= zp * slope
                diag[i, last, last] += weight * slope * slope + max(-zh[side, i] * slope, 0.0)
        for d in range(dims):
            _entries(x, points, i, d, b, y)
            own[:], matrix[:] = 0.0, 0.0
            if cost[d] > 0.0:
                for r in range(entries):
                    nr = r if r <= b else r - b
                    for s in range(entries):
                        ns = s if s <= b else s - b
                        e = nr + ns - 2 * b - 1
                        a = cost[d] * quad[r, s] * power[7 + e]
                        both = a * y[r] * y[s]
                        own[0] += e * both
                        matrix[0, 0] += e * e * both
                        if r > 0:
                            own[r] += 2.0 * a * y[s]
                            matrix[r, 0] += 2.0 * e * a * y[s]
                            if s > 0:
                                matrix[r, s] += 2.0 * a
            for m in range(orders):
                if gain[0, i, d, m] == 0.0 and gain[1, i, d, m] == 0.0:
                    continue
                for p in range(places):
                    if where[i, d, m, p] < 0.0:
                        continue
                    q = points[i, d] if m == 0 else 0.0
                    first = second = 0.0
                    for r in range(entries):
                        e = (r if r <= b else r - b) - m
                        loc[r] = weights[i, d, m, p, r] * power[7 + e]
                        value = loc[r] * y[r]
                        q, first, second = q + value, first + e * value, second + e * e * value
                    push = bend = weight = 0.0
                    for side in range(2):
                        g = gain[side, i, d, m]
                        if g != 0.0:
                            own_z = z[side, i, d, m, p]
                            _, zp, s, t = _penalty(offset[side, i, d, m] + g * q, mu, price)
                            push -= zp * g
                            bend -= own_z * g
                            weight += g * g / (t / own_z + s / (price - own_z))
                    own[0] += push * first
                    matrix[0, 0] += weight * first * first + bend * second
                    for r in range(1, entries):
                        e = (r if r <= b else r - b) - m
                        own[r] += push * loc[r]
                        matrix[r, 0] += (weight * first + bend * e) * loc[r]
                        factor = weight * loc[r]
                        for s in range(1, r + 1):
                            matrix[r, s] += factor * loc[s]
            index[0] = last
            for r in range(b):
                index[1 + r] = index[1 + b + r] = r * dims + d
            for r in range(entries):
                row = index[r]
                if r > b:
                    grad[i + 1, row] += own[r]
                else:
                    grad[i, row] += own[r]
                for s in range(r + 1):
                    value, column = matrix[r, s], index[s]
                    if r <= b:
                        diag[i, row, column] += value
                        if r != s:
                            diag[i, column, row] += value
                    elif s > b:
                        diag[i + 1, row, column] += value
                        if r != s:
                            diag[i + 1, column, row] += value
                    else:
                        off[i, column, row] += value


@njit(cache=True, error_model="numpy")
def _kept(z, target, price):  # type: ignore[no-untyped-def]
    """Return a multiplier not too far from what the penalty has."""
    return min(max(z, 0.01 * target), 100.0 * target, 0.5 * (price + target))


@njit(cache=True, error_model="numpy")
def _multipliers(  # type: ignore[no-untyped-def]
    x, step, alpha, points, weights, where, gain, offset, low, high, mu, price, z, zh
):
    """Move the multipliers along with a step from x (alpha = 0: set them to the penalty's)."""
    gaps, dims, orders, places = where.shape
    entries = weights.shape[4]
    b = (entries - 1) // 2
    last = b * dims
    y, power, dy = np.zeros(entries), np.zeros(15), np.zeros(entries)
    for i in range(gaps):
        h = _powers(x[i, last], power)
        dx = step[i, last]
        for side in range(2):
            bound = low[i] if side == 0 else high[i]
            if 0.0 < bound < np.inf:
                sign = 1.0 if side == 0 else -1.0
                slope = sign * h / bound
                c = slope - sign
                _, zp, s, t = _penalty(c, mu, price)
                old = zh[side, i] if alpha > 0.0 else zp
                change = (mu / old - mu / (price - old) - c - slope * dx) / (t / old + s / (price - old))
                after = _penalty(c + alpha * slope * dx, mu, price)[1]
                zh[side, i] = _kept(old + alpha * change, after, price) if alpha > 0.0 else zp
        for d in range(dims):
            _entries(x, points, i, d, b, y)
            _entries(step, points, i, d, b, dy)
            for m in range(orders):
                if gain[0, i, d, m] == 0.0 and gain[1, i, d, m] == 0.0:
                    continue
                for p in range(places):
                    if where[i, d, m, p] < 0.0:
                        continue
                    q = points[i, d] if m == 0 else 0.0
                    moved = 0.0
                    for r in range(entries):
                        e = (r if r <= b else r - b) - m
                        a = weights[i, d, m, p, r] * power[7 + e]
                        q += a * y[r]
                        moved += e * a * y[r] * dx + (a * dy[r] if r > 0 else 0.0)
                    for side in range(2):
                        g = gain[side, i, d, m]
                        if g != 0.0:
                            c = offset[side, i, d, m] + g * q
                            _, zp, s, t = _penalty(c, mu, price)
                            if not alpha > 0.0:
                                z[side, i, d, m, p] = zp
                                continue
                            old = z[side, i, d, m, p]
                            change = mu / old - mu / (price - old) - c - g * moved
                            change /= t / old + s / (price - old)
                            after = _penalty(c + alpha * g * moved, mu, price)[1]
                            z[side, i, d, m, p] = _kept(old + alpha * change, after, price)


@njit(cache=True, error_model="numpy")
def newton(  # type: ignore[no-untyped-def]
    x, pinned, points, weights, where, gain, offset, low, high, cost, quad, total, mu, price, z, zh, limit, fresh
):
    """Minimise the objective plus penalties by Newton steps, to what the barrier is worth.

    Parameters
    ----------
    x : array (N, B)
        Start, overwritten with the answer.
    pinned : array (N, B) of bool
        Entries that stay.
    points : array (N, D)
    weights, where
        As ``set_places``.
    gain, offset : array (2, M, D, 4)
        Rows c = offset + gain q^(m) for upper and lower limits; gain 0 where there is none.
    low, high : array (M,)
        Bounds of the durations; 0 and inf for none.
    cost : array (D + 1,)
        What a unit of each joint's energy costs, and of time.
    quad : array (2k - 1, 2k - 1)
        The energy of a gap of duration one, from its entries.
    total : float
        The sum of the durations if that is given, else 0.
    mu, price : float
        Barrier parameter; cost of breaking a row by one.
    z : array (2, M, D, 4, P), zh : array (2, M)
        Multipliers; overwritten. ``fresh``: set first.
    limit : int
        Most steps.

    Returns
    -------
    steps, decrement
        The last squared Newton decrement, -1 where no step was found.
    """
    n, size = x.shape
    grad, step, trial = np.zeros((n, size)), np.zeros((n, size)), np.zeros((n, size))
    diag, off = np.zeros((n, size, size)), np.zeros((n, size, size))
    lower, across = np.zeros((n, size, size)), np.zeros((n, size, size))
    normal, lift = np.zeros((n, size)), np.zeros((n, size))
    if fresh:
        _multipliers(x, step, 0.0, points, weights, where, gain, offset, low, high, mu, price, z, zh)
    decrement, shift = np.inf, 0.0
    for count in range(limit):
        _assemble(x, points, weights, where, gain, offset, low, high, cost, quad, mu, price, z, zh, grad, diag, off)
        for j in range(n):
            for r in range(size):
                if pinned[j, r]:
                    grad[j, r] = 0.0
                    diag[j, r, :] = 0.0
                    diag[j, :, r] = 0.0
                    diag[j, r, r] = 1.0
                    off[j, r, :] = 0.0
                    if j > 0:
                        off[j - 1, :, r] = 0.0
        shift = 0.0 if shift < 1e-7 else 0.1 * shift
        while not factorise(diag, off, shift, lower, across):
            shift = max(4.0 * shift, 1e-6)
            if shift > 1e8:
                return count, -1.0
        solve(lower, across, -grad, step)
        if total > 0.0:
            spent = 0.0
            for j in range(n - 1):
                normal[j, size - 1] = 0.0
                if not pinned[j, size - 1]:
                    normal[j, size - 1] = np.exp(x[j, size - 1])
                spent += np.exp(x[j, size - 1])
            solve(lower, across, normal, lift)
            step += lift * ((total - spent - (normal * step).sum()) / (normal * lift).sum())
        slope = (grad * step).sum()
        decrement = -slope
        largest = np.abs(step[:, size - 1]).max()
        alpha = min(1.0, 1.0 / largest) if largest > 0.0 else 1.0
        before = merit(x, points, weights, where, gain, offset, low, high, cost, quad, mu, price)
        taken = False
        for _ in range(30):
            trial[:] = x + alpha * step
            after = merit(trial, points, weights, where, gain, offset, low, high, cost, quad, mu, price)
            if after <= before + 1e-4 * alpha * min(slope, 0.0) + 1e-13 * abs(before) or (total > 0.0 and slope >= 0.0):
                taken = True
                break
            alpha *= 0.4
        if not taken:
            return count, (-1.0 if decrement > mu else decrement)
        _multipliers(x, step, alpha, points, weights, where, gain, offset, low, high, mu, price, z, zh)
        x[:] = trial
        if decrement <= 0.3 * mu and alpha == 1.0 and shift < 1e-3:
            return count + 1, decrement
    return limit, decrement
