r"""Best durations of a spline's gaps: the energy as a function of the durations alone, its gradient, and the descent.

With E*(h) the smallest integral of the squared k-th derivative at durations h, the node states being free, the
derivative of E* is that of the gap's own energy at fixed node states (envelope): minus the Hamiltonian of the gap,

.. math::

    \partial E^* / \partial h_i = -(q^{(k)2} - 2 q^{(k-1)} q^{(k+1)} + 2 q^{(k-2)} q^{(k+2)} - \dots)

at any place of it. So value and gradient take one sweep forth and back. J = E* + rho T is minimised over log h by
L-BFGS with a projection: durations may be bounded, and their sum given.
"""

import numpy as np
from numba import njit

from .elimination import jerk_states
from .free_times_energy import energy2, energy3, energy4
from .lanes import LANES, added, load, step
from .splines import hermite_states

MEMORY = 8
EPS = 2.220446049250313e-16
#: Largest step in log h.
LEAP = 2.0
#: Outcomes of ``descend``.
CONVERGED, STUCK, EXHAUSTED, COLLAPSED, ENDLESS = 0, 1, 2, 3, 4


@njit(cache=True, error_model="numpy")
def best_energy(h, groups, points, ends, fixed, states, slope, noise):  # type: ignore[no-untyped-def]
    """Return E*(h) (infinite if it cannot be had), with the node states, its derivatives by log h and their rounding.

    Joints with the same derivatives fixed at the ends form a group; the arrays of all groups lie one after another.

    Parameters
    ----------
    h : array (M,)
    groups : array (G + 1,) of int64
        The joints of group g are groups[g] … groups[g + 1] - 1.
    points, ends, states : flat arrays
        Of each group (N, D_g), (2, k - 1, D_g) and, overwritten, (k - 1, N, D_g).
    fixed : array (G, 2, k - 1) of bool
    slope, noise : array (M,)
        Overwritten.
    """
    n, b = len(h) + 1, fixed.shape[2]
    slope[:] = 0.0
    noise[:] = 0.0
    total = 0.0
    for g in range(len(fixed)):
        first, last = groups[g], groups[g + 1]
        own = points[n * first : n * last].reshape((n, last - first))
        given = ends[2 * b * first : 2 * b * last].reshape((2, b, last - first))
        nodes = states[b * n * first : b * n * last].reshape((b, n, last - first))
        quick = b == 2 and fixed[g].all() and jerk_states(h, own, given, np.empty((n, 4)), nodes)
        if not quick and not hermite_states(h, own, given, fixed[g], nodes):
            return np.inf
        if b == 1:
            total += energy2(h, own, nodes, slope, noise)
        elif b == 2:
            total += energy3(h, own, nodes, slope, noise)
        else:
            total += energy4(h, own, nodes, slope, noise)
    return total if total < np.inf else np.inf


@njit(cache=True, error_model="numpy")
def _place(x, free, total, low, high, h):  # type: ignore[no-untyped-def]
    """Write the durations of log h = x into ``h``, put between the bounds and, with ``total``, to that sum.

    Only free gaps change. Return whether a bound was met.
    """
    count = len(x)
    rest, top = total, -np.inf
    for i in range(count):
        if free[i]:
            top = max(top, x[i])
        else:
            rest -= h[i]
    met = False
    factor = 1.0
    if total > 0.0:  # a root of an increasing, piecewise linear function
        factor, left, right = 1.0, 0.0, np.inf
        for _ in range(200):
            mass = moving = 0.0
            for i in range(count):
                if free[i]:
                    want = factor * np.exp(x[i] - top)
                    mass += min(max(want, low[i]), high[i])
                    if low[i] < want < high[i]:
                        moving += want
            if mass > rest:
                right = factor
            else:
                left = factor
            nearer = factor * (1.0 + (rest - mass) / moving) if moving > 0.0 else -1.0
            if not left < nearer < right:
                nearer = 0.5 * (left + right) if right < np.inf else 2.0 * max(factor, 1e-300)
            if abs(nearer - factor) <= EPS * factor:
                break
            factor = nearer
    else:
        top = 0.0
    for i in range(count):
        if free[i]:
            want = factor * np.exp(x[i] - top)
            h[i] = min(max(want, low[i]), high[i])
            met |= h[i] != want
    return met


@njit(cache=True, error_model="numpy")
def _stationarity(h, slope, noise, value, rho, total, low, high, free, gradient):  # type: ignore[no-untyped-def]
    """Write which gaps are free to move, and the gradient by log h over them (0 elsewhere).

    Return its largest entry, relative to the value, and whether all are within the tolerance or rounding.
    """
    count = len(h)
    price = rho
    if total > 0.0:
        up = down = 0.0
        least, most = np.inf, -np.inf
        for i in range(count):
            if low[i] < h[i] < high[i]:
                up, down = up + slope[i], down + h[i]
            elif low[i] < high[i]:
                if h[i] <= low[i]:
                    most = max(most, -slope[i] / h[i])
                else:
                    least = min(least, -slope[i] / h[i])
        if down > 0.0:
            price = -up / down
        elif least < np.inf and most > -np.inf:
            price = 0.5 * (least + most)
        else:
            price = least if least < np.inf else (most if most > -np.inf else 0.0)
    for i in range(count):
        entry = slope[i] + price * h[i]
        free[i] = low[i] < high[i] and not (h[i] <= low[i] and entry >= 0.0) and not (h[i] >= high[i] and entry <= 0.0)
    if total > 0.0:  # those let go share the price
        up = down = 0.0
        for i in range(count):
            if free[i]:
                up, down = up + slope[i], down + h[i]
        price = -up / down if down > 0.0 else price
    worst, good = 0.0, True
    for i in range(count):
        gradient[i] = slope[i] + price * h[i] if free[i] else 0.0
        worst = max(worst, abs(gradient[i]))
    size = abs(value)
    blurred = 1e-4 * rho * h.sum() if total == 0.0 and rho > 0.0 else np.inf
    for i in range(count):
        good &= abs(gradient[i]) <= 1e-9 * size or abs(gradient[i]) <= min(noise[i], blurred)
    return worst / size if size > 0.0 else worst, good


@njit(cache=True, error_model="numpy")
def _dot(a, b, weight):  # type: ignore[no-untyped-def]
    """Return the sum of the products, in eight sums side by side: the terms of one would wait for each other."""
    count = len(a)
    whole = count & -LANES
    total = 0.0
    if whole:
        x = load(a, 0) * load(b, 0) * load(weight, 0)
        for i in range(LANES, whole, LANES):
            x = step(load(a, i) * load(b, i), load(weight, i), x)
        total = added(x)
    for i in range(whole, count):
        total = step(a[i] * b[i], weight[i], total)
    return total


@njit(cache=True, error_model="numpy")
def _direction(gradient, inner, h, s, y, stored, newest, p, weights):  # type: ignore[no-untyped-def]
    """Write minus the gradient times L-BFGS's inverse Hessian into ``p``; False if nothing is known of it.

    ``inner`` is 1 at free gaps, else 0. The Hessian begins as a multiple of h: at the optimum of a gap alone it is.
    """
    count = len(gradient)
    for i in range(count):
        p[i] = -gradient[i]
    scale = 0.0
    for back in range(stored):
        r = (newest - back) % MEMORY
        sy = _dot(s[r], y[r], inner)
        weights[0, r] = 0.0
        if not sy > 0.0:
            continue
        weights[0, r], weights[1, r] = 1.0 / sy, _dot(s[r], p, inner) / sy
        if not scale > 0.0:
            for i in range(count):
                scale += inner[i] * y[r, i] * y[r, i] / h[i]
            scale = sy / scale
        factor = weights[1, r]
        for i in range(count):
            p[i] -= factor * y[r, i]
    if not scale > 0.0:
        return False
    for i in range(count):
        p[i] *= scale * inner[i] / h[i]
    for back in range(stored - 1, -1, -1):
        r = (newest - back) % MEMORY
        if weights[0, r] > 0.0:
            factor = weights[1, r] - weights[0, r] * _dot(y[r], p, inner)
            for i in range(count):
                p[i] += factor * s[r, i]
    for i in range(count):
        p[i] *= inner[i]
    return True


@njit(cache=True, error_model="numpy")
def descend(h, rho, total, low, high, groups, points, ends, fixed, states, limit):  # type: ignore[no-untyped-def]
    """Minimise E*(h) + rho T over low <= h <= high and, if ``total`` > 0, with the sum of h being that.

    Parameters
    ----------
    h : array (M,)
        The start, overwritten with the answer.
    groups, points, ends, fixed, states
        As ``best_energy``; ``states`` are those of the answer.
    limit : int
        Most evaluations.

    Returns
    -------
    outcome, evaluations, value, residual
        CONVERGED: the gradient by log h is <= 1e-9 of the value, or rounding, or what it promises is.
        STUCK: no descent is found. EXHAUSTED.
        COLLAPSED, ENDLESS: the sum of the durations fell or rose by a factor of more than 1e14.
    """
    count = len(h)
    slope, noise, gradient, gradient_new = np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(count)
    h_new, x, x_new, p = np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(count)
    free, free_new = np.ones(count, np.bool_), np.ones(count, np.bool_)
    s, y, weights = np.zeros((MEMORY, count)), np.zeros((MEMORY, count)), np.zeros((3, MEMORY))
    for i in range(count):
        x[i] = np.log(h[i])
    _place(x, free, total, low, high, h)
    x[:] = np.log(h)
    begin = h.sum()
    value = best_energy(h, groups, points, ends, fixed, states, slope, noise) + rho * h.sum()
    residual, good = _stationarity(h, slope, noise, value, rho, total, low, high, free, gradient)
    evaluations, stored, newest = 1, 0, -1
    if not value < np.inf:
        return STUCK, evaluations, value, residual
    inner = np.ones(count)
    while not good:
        for i in range(count):
            inner[i] = 1.0 if free[i] else 0.0
        if evaluations >= limit:
            return EXHAUSTED, evaluations, value, residual
        curved = _direction(gradient, inner, h, s, y, stored, newest, p, weights)
        slope0 = largest = 0.0
        for i in range(count):
            slope0, largest = slope0 + gradient[i] * p[i], max(largest, abs(p[i]))
        if curved and not slope0 < 0.0:
            curved, stored = False, 0
        if not curved:
            p[:] = -gradient
            slope0, largest = -(gradient * gradient).sum(), np.abs(gradient).max()
        if not largest > 0.0:
            return STUCK, evaluations, value, residual
        alpha = LEAP / largest if largest > LEAP else 1.0
        if not curved:
            alpha = min(alpha, 0.3 / largest)
        left, right, accepted = 0.0, np.inf, False
        for _ in range(40):
            for i in range(count):
                x_new[i] = x[i] + alpha * p[i]
                h_new[i] = h[i]
            met = _place(x_new, free, total, low, high, h_new)
            spent = h_new.sum()
            value_new = best_energy(h_new, groups, points, ends, fixed, states, slope, noise) + rho * spent
            evaluations += 1
            residual_new, good = _stationarity(
                h_new, slope, noise, value_new, rho, total, low, high, free_new, gradient_new
            )
            slope1 = promised = 0.0
            for i in range(count):
                x_new[i] = np.log(h_new[i])
                slope1, promised = slope1 + gradient_new[i] * p[i], promised + gradient[i] * (x_new[i] - x[i])
            small = value_new <= value + 1e-12 * abs(value) and abs(slope1) <= 0.9 * abs(slope0)
            if good and value_new <= value + 1e-9 * abs(value):
                accepted = True
                break
            if not (value_new <= value + 1e-4 * promised or small):
                right = alpha
                bend = value_new - value - slope0 * alpha
                guess = -0.5 * slope0 * alpha * alpha / bend if bend < np.inf else 0.25 * alpha
                alpha = min(max(guess, left + 0.1 * (right - left)), left + 0.6 * (right - left))
            elif slope1 < 0.9 * slope0 and not met and alpha * largest < LEAP:
                left = alpha
                alpha = min(2.5 * alpha, LEAP / largest) if right == np.inf else 0.5 * (left + right)
            else:
                accepted = True
                break
        if not accepted:
            if curved and -slope0 <= 1e-11 * abs(value):  # what could be gained is rounding
                best_energy(h, groups, points, ends, fixed, states, slope, noise)
                return CONVERGED, evaluations, value, residual
            if not curved or stored == 0:
                best_energy(h, groups, points, ends, fixed, states, slope, noise)
                return STUCK, evaluations, value, residual
            stored = 0
            good = False
            continue
        newest = (newest + 1) % MEMORY
        for i in range(count):
            s[newest, i], y[newest, i] = x_new[i] - x[i], gradient_new[i] - gradient[i]
        stored = min(stored + 1, MEMORY)
        x[:], h[:], gradient[:], free[:] = x_new, h_new, gradient_new, free_new
        value, residual = value_new, residual_new
        if spent < 1e-14 * begin:
            return COLLAPSED, evaluations, value, residual
        if spent > 1e14 * begin:
            return ENDLESS, evaluations, value, residual
    return CONVERGED, evaluations, value, residual
