"""Minimum jerk through points that come one after the other: the sweeps of ``splines``, continued, and measured."""

import numpy as np
from numba import njit

from .splines import _step3

# Largest values of u (1-u)^3 (1+3u) and u^2 (1-u)^3 / 2, by which the states at its ends enter a piece, and of their
# first two derivatives; rounded up.
_OF_VELOCITY = np.array([0.19754, 1.0, 3.94024])
_OF_ACCELERATION = np.array([0.01729, 0.06779, 1.0])


@njit(cache=True, error_model="numpy")
def estimate(times, points, known, c, m, gains, spread):  # type: ignore[no-untyped-def]
    """Carry the estimates from node ``known`` to the last.

    Parameters
    ----------
    times : array (N,)
    points : array (N, D)
    known : int
    c : array (5,)
        Minors at node ``known``, in units of the step before it; left as those at the last node.
    m : array (2, N, D)
        Velocities and accelerations.
    gains : array (N - 1, 8)
        J by rows, G, K.
    spread : array (N, 3)
        The estimates' covariance C: vv, va, aa. A correction e costs e' C^-1 e, in squared jerk.
    """
    for i in range(known, len(times) - 1):
        h = times[i + 1] - times[i]
        _step3((times[i] - times[i - 1]) / h if i > 0 else 1.0, h, c, gains, i)
        for d in range(points.shape[1]):
            v, a = m[0, i, d], m[1, i, d]
            new = points[i + 1, d] - points[i, d] - h * (v + 0.5 * h * a)
            m[0, i + 1, d], m[1, i + 1, d] = v + h * a + gains[i, 6] * new, a + gains[i, 7] * new
        spread[i + 1, 0], spread[i + 1, 1], spread[i + 1, 2] = c[1] * h**3 / c[0], c[2] * h**2 / c[0], c[3] * h / c[0]


@njit(cache=True, error_model="numpy")
def correct(times, points, gains, m, e, states):  # type: ignore[no-untyped-def]
    """Write the states (2, N, D) that the estimates become when those at the last node are corrected by e (2, D)."""
    last = len(times) - 1
    for d in range(points.shape[1]):
        ev, ea = e[0, d], e[1, d]
        states[0, last, d], states[1, last, d] = m[0, last, d] + ev, m[1, last, d] + ea
        for i in range(last - 1, -1, -1):
            h, v, a, g = times[i + 1] - times[i], m[0, i, d], m[1, i, d], gains[i]
            new = points[i + 1, d] - points[i, d] - h * (v + 0.5 * h * a)
            ev, ea = g[0] * ev + g[1] * ea + g[4] * new, g[2] * ev + g[3] * ea + g[5] * new
            states[0, i, d], states[1, i, d] = v + ev, a + ea


@njit(cache=True, error_model="numpy")
def influence(gains, spread, node, share):  # type: ignore[no-untyped-def]
    """Write, for every node up to ``node``, the largest share of a correction there that arrives here.

    As a ratio of roots of the costs e' C^-1 e: less than 1, and falling from node to node, however uneven the steps.
    It is 0 where C is, at a knot whose state is fixed.
    """
    j0, j1, j2, j3 = 1.0, 0.0, 0.0, 1.0
    vv, va, aa = spread[node]
    share[node] = 1.0
    for i in range(node - 1, -1, -1):
        g0, g1, g2, g3 = gains[i, 0], gains[i, 1], gains[i, 2], gains[i, 3]
        j0, j1, j2, j3 = g0 * j0 + g1 * j2, g0 * j1 + g1 * j3, g2 * j0 + g3 * j2, g2 * j1 + g3 * j3
        # C_i^-1 P C P', whose larger eigenvalue is the squared share
        pvv = j0 * j0 * vv + 2.0 * j0 * j1 * va + j1 * j1 * aa
        pva = j0 * j2 * vv + (j0 * j3 + j1 * j2) * va + j1 * j3 * aa
        paa = j2 * j2 * vv + 2.0 * j2 * j3 * va + j3 * j3 * aa
        det = spread[i, 0] * spread[i, 2] - spread[i, 1] ** 2
        if not det > 0.0:
            share[i] = 0.0
            continue
        half = 0.5 * (spread[i, 2] * pvv - 2.0 * spread[i, 1] * pva + spread[i, 0] * paa) / det
        rest = max(half * half - max(pvv * paa - pva * pva, 0.0) / det, 0.0)
        share[i] = np.sqrt(half + np.sqrt(rest))


@njit(cache=True, error_model="numpy")
def _cost(spread, states, full, i, d):  # type: ignore[no-untyped-def]
    """Return the root of e' C^-1 e for the difference e of two states of a joint at node i."""
    ev, ea = full[0, i, d] - states[0, i, d], full[1, i, d] - states[1, i, d]
    vv, va, aa = spread[i]
    det = vv * aa - va * va
    return np.sqrt(max(aa * ev * ev - 2.0 * va * ev * ea + vv * ea * ea, 0.0) / det) if det > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def measure(times, points, estimates, states, full, spread, count, most):  # type: ignore[no-untyped-def]
    """Raise ``most`` to what is found on the first ``count`` pieces and at their nodes.

    Parameters
    ----------
    times, points, estimates, spread
        As for ``estimate``.
    states, full : array (2, m, D), array (2, N, D)
        States of the first m nodes, and all states of another spline.
    most : array (11, D)
        Bounds for the derivatives of order 0, 1, 2 of the two splines' difference, which has no states from node m on;
        for those of the splines; for those of one whose states cost 1; then the root of the difference's cost at a
        node, and at node m - 1.
    """
    known = states.shape[1]
    for i in range(count):
        h = times[i + 1] - times[i]
        for r in range(3):
            of_v, of_a, rate = _OF_VELOCITY[r] * h ** (1 - r), _OF_ACCELERATION[r] * h ** (2 - r), h ** (-r)
            root = of_v * (np.sqrt(spread[i, 0]) + np.sqrt(spread[i + 1, 0]))
            root += of_a * (np.sqrt(spread[i, 2]) + np.sqrt(spread[i + 1, 2]))
            for d in range(points.shape[1]):
                moved, size = 0.0, 6.0 * rate * abs(points[i + 1, d] - points[i, d])
                for j in range(i, i + 2):
                    v, a = max(abs(estimates[0, j, d]), abs(full[0, j, d])), abs(estimates[1, j, d])
                    size += of_v * v + of_a * max(a, abs(full[1, j, d]))
                    if j < known:
                        moved += of_v * abs(full[0, j, d] - states[0, j, d])
                        moved += of_a * abs(full[1, j, d] - states[1, j, d])
                most[r, d] = max(most[r, d], moved)
                most[3 + r, d] = max(most[3 + r, d], size + abs(points[i + 1, d]) if r == 0 else size)
                most[6 + r, d] = max(most[6 + r, d], root)
    for d in range(points.shape[1]):
        for i in range(min(count + 1, known)):
            most[9, d] = max(most[9, d], _cost(spread, states, full, i, d))
        most[10, d] = max(most[10, d], _cost(spread, states, full, known - 1, d))
