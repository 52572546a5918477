"""Block elimination along the waypoints: their velocities and accelerations, and the segments' durations.

Unknowns in order: eta_0, x_1, eta_1, x_2, … eta_(S-1), with x_i the 2 D velocities and accelerations at waypoint i;
the ends are given. Segment i couples x_i and x_(i+1) joint by joint, and both to eta_i.
"""

import numpy as np
from numba import njit


@njit(cache=True)
def factorise(local, around, held, free, damping, lower, reach, pivot, link):  # type: ignore[no-untyped-def]
    """Factorise; return whether the matrix, with ``damping`` added to its diagonal, is positive definite.

    Parameters
    ----------
    local : (S, D, 5, 5)
        Segments' matrices over (v0, a0, v1, a1, eta), joint by joint.
    around : (S + 1, 2 D) and held : (S,)
        What comes to the diagonals from bounds of waypoint states and of durations.
    free : (S + 1, 2 D) and (S,) bool, in one tuple
        Which unknowns move; the ends do not.
    lower, reach, pivot, link
        Room for the factors: (S + 1, 2 D, 2 D), (S + 1, 2 D, 2 D + 1), (S,), (S, 2 D).
    """
    count, dims = local.shape[0], local.shape[1]
    size = 2 * dims
    states, durations = free
    block = np.zeros((size, size))
    here, there = 0.0, np.zeros(size)
    for i in range(count):
        # what segment i adds to eta_i and to its coupling with the next waypoint
        diagonal = held[i] + damping
        for d in range(dims):
            diagonal += local[i, d, 4, 4]
        for k in range(size):
            there[k] = local[i, k // 2, 4, 2 + k % 2] if states[i + 1, k] else 0.0
        if i > 0:
            # waypoint i: block holds what came from the left
            for d in range(dims):
                for p in range(2):
                    for q in range(2):
                        block[2 * d + p, 2 * d + q] += local[i, d, p, q]
            for k in range(size):
                block[k, k] += around[i, k] + damping
            for k in range(size):
                if not states[i, k]:
                    for n in range(size):
                        block[k, n] = 0.0
                        block[n, k] = 0.0
                    block[k, k] = 1.0
            factor, out = lower[i], reach[i]
            for k in range(size):
                for n in range(k + 1):
                    x = block[k, n]
                    for m in range(n):
                        x -= factor[k, m] * factor[n, m]
                    if n < k:
                        factor[k, n] = x / factor[n, n]
                    elif x > 0.0:
                        factor[k, k] = x**0.5
                    else:
                        return False
            # columns: the next waypoint's states, then eta_i
            for k in range(size):
                d = k // 2
                for n in range(size):
                    coupled = n // 2 == d and states[i, k] and states[i + 1, n]
                    out[k, n] = local[i, d, k % 2, 2 + n % 2] if coupled else 0.0
                out[k, size] = local[i, d, k % 2, 4] if states[i, k] and durations[i] else 0.0
            for k in range(size):
                for n in range(size + 1):
                    x = out[k, n]
                    for m in range(k):
                        x -= factor[k, m] * out[m, n]
                    out[k, n] = x / factor[k, k]
            here = 0.0
            for m in range(size):
                here += out[m, size] ** 2
            diagonal -= here
            for k in range(size):
                x = 0.0
                for m in range(size):
                    x += out[m, k] * out[m, size]
                there[k] -= x
            for k in range(size):
                for n in range(k + 1):
                    x = 0.0
                    for m in range(size):
                        x += out[m, k] * out[m, n]
                    block[k, n] = -x
                    block[n, k] = -x
        else:
            block[:] = 0.0
        if not durations[i]:
            diagonal = 1.0
            there[:] = 0.0
        if not diagonal > 0.0:
            return False
        pivot[i] = diagonal
        for k in range(size):
            link[i, k] = there[k]
        if i + 1 < count:
            for k in range(size):
                for n in range(size):
                    block[k, n] -= there[k] * there[n] / diagonal
            for d in range(dims):
                for p in range(2):
                    for q in range(2):
                        block[2 * d + p, 2 * d + q] += local[i, d, 2 + p, 2 + q]
    return True


@njit(cache=True)
def solve(lower, reach, pivot, link, states, durations):  # type: ignore[no-untyped-def]
    """Solve in place for right-hand sides ``states`` (S + 1, 2 D) and ``durations`` (S,); the ends stay untouched.

    Entries of what does not move must be zero.
    """
    count, size = pivot.shape[0], link.shape[1]
    for i in range(count):
        if i > 0:
            factor, out = lower[i], reach[i]
            for k in range(size):
                x = states[i, k]
                for m in range(k):
                    x -= factor[k, m] * states[i, m]
                states[i, k] = x / factor[k, k]
            for m in range(size):
                durations[i] -= out[m, size] * states[i, m]
            if i + 1 < count:
                for m in range(size):
                    for k in range(size):
                        states[i + 1, k] -= out[m, k] * states[i, m]
        if i + 1 < count:
            for k in range(size):
                states[i + 1, k] -= link[i, k] * durations[i] / pivot[i]
    for i in range(count - 1, -1, -1):
        x = durations[i]
        if i + 1 < count:
            for k in range(size):
                x -= link[i, k] * states[i + 1, k]
        durations[i] = x / pivot[i]
        if i > 0:
            factor, out = lower[i], reach[i]
            for k in range(size):
                x = states[i, k] - out[k, size] * durations[i]
                if i + 1 < count:
                    for n in range(size):
                        x -= out[k, n] * states[i + 1, n]
                states[i, k] = x
            for k in range(size - 1, -1, -1):
                x = states[i, k]
                for m in range(k + 1, size):
                    x -= factor[m, k] * states[i, m]
                states[i, k] = x / factor[k, k]
