"""Newton's step of the waypoint program: slopes, matrix, solution, and what it means for control points and slacks.

Everything is grouped: ``given`` = (nodes, move, unit, bound, coef, start) is the program and its rows, ``place`` =
(eta, states, control) the point, ``free`` = (states, durations) what moves, ``right`` = (states, durations) a right
side that becomes the step. Slacks, duals and their like stand in one row, in the order that ``waypoint_program`` tells.
"""

import numpy as np
from numba import njit

from .waypoint_rows import condense, curvature, eliminate, fill_tangents, fold, forces, inner_step, order_of
from .waypoint_sweep import factorise
from .waypoint_sweep import solve as back_solve


@njit(cache=True)
def slopes(given, place, free, weight, prices, value, dual, tangents, force, share, room):  # type: ignore[no-untyped-def]
    """Write tangents, the Lagrangian's slopes by control points and each joint's share of a duration's.

    Return the largest slope, which is zero at a stationary point. ``room``: for the slopes by states and durations.
    """
    nodes, move, unit, bound, coef, start = given
    eta, states, control = place
    free_states, free_eta = free
    time_price, price = prices
    by_states, by_eta = room
    count, dims, rows = value.shape
    pieces, size = nodes.shape[2] - 1, 2 * dims
    n_rows = count * dims * rows * 2
    row_dual = dual[:n_rows].reshape(count, dims, rows, 2)
    largest = 0.0
    by_states[:] = 0.0
    for i in range(count):
        by_eta[i] = time_price * weight[i]
        for d in range(dims):
            v0, a0, v1, a1 = states[i, 2 * d], states[i, 2 * d + 1], states[i + 1, 2 * d], states[i + 1, 2 * d + 1]
            u, f, t = nodes[i, d], force[i, d], tangents[i, d]
            own = forces(u, coef[i, d], start[i, d], bound[i, d], row_dual[i, d], value[i, d], eta[i], price[i, d], f)
            fill_tangents(u, unit[i, d, 0], eta[i], v0, a0, v1, a1, t)
            for j in range(3, pieces):
                largest = max(largest, abs(f[j]))
            for p in range(4):
                at = p + 1 if p < 2 else pieces + p - 2
                own += t[p, 4] * f[at]
                for k in range(4):
                    by_states[i + k // 2, 2 * d + k % 2] += t[p, k] * f[at]
            share[i, d] = -own
            by_eta[i] += own
    for i in range(count + 1):
        for k in range(size):
            at = n_rows + (i * size + k) * 2
            if free_states[i, k]:
                largest = max(largest, abs(by_states[i, k] + dual[at + 1] - dual[at]))
    for i in range(count):
        at = n_rows + ((count + 1) * size + i) * 2
        if free_eta[i]:
            largest = max(largest, abs(by_eta[i] + dual[at + 1] - dual[at]))
    return largest


@njit(cache=True)
def newton(given, place, free, weight, prices, value, barrier, tangents, force, factors, local, around, held, right):  # type: ignore[no-untyped-def]
    """Write Newton's matrix over states and durations and its right side; return whether the inner parts were positive.

    ``barrier``: slacks, duals, residuals, which are present, and the barrier parameter.
    """
    nodes, move, unit, bound, coef, start = given
    eta, states, control = place
    free_states, free_eta = free
    time_price, price = prices
    slack, dual, miss, present, mu = barrier
    factor, reach = factors
    x_states, x_eta = right
    count, dims, rows = value.shape
    pieces, size = nodes.shape[2] - 1, 2 * dims
    n_rows = count * dims * rows * 2
    shape = (count, dims, rows, 2)
    row_slack, row_dual, row_miss = (
        slack[:n_rows].reshape(shape),
        dual[:n_rows].reshape(shape),
        miss[:n_rows].reshape(shape),
    )
    band, cross, side = np.empty((pieces + 3, 4)), np.empty(pieces + 3), np.empty(pieces + 3)
    ends, ends_right = np.empty((5, 6)), np.empty(5)
    good = True
    x_states[:] = 0.0
    for i in range(count):
        x_eta[i] = -time_price * weight[i]
        for d in range(dims):
            u = nodes[i, d]
            diagonal = condense(
                u, coef[i, d], start[i, d], bound[i, d], row_slack[i, d], row_dual[i, d], row_miss[i, d], value[i, d],
                eta[i], mu, price[i, d], band, cross, side,
            )  # fmt: skip
            good = good and eliminate(pieces, band, cross, side, factor[i, d], reach[i, d], ends, diagonal)
            fold(tangents[i, d], ends, local[i, d], ends_right)
            curvature(
                u, unit[i, d, 0], eta[i], states[i, 2 * d + 1], states[i + 1, 2 * d + 1], force[i, d], local[i, d]
            )
            for p in range(2):
                x_states[i, 2 * d + p] += ends_right[p]
                x_states[i + 1, 2 * d + p] += ends_right[2 + p]
            x_eta[i] += ends_right[4]
    for i in range(count + 1):
        for k in range(size):
            at = n_rows + (i * size + k) * 2
            around[i, k] = 0.0
            if not free_states[i, k]:
                x_states[i, k] = 0.0
                continue
            for s in range(2):
                if present[at + s]:
                    around[i, k] += dual[at + s] / slack[at + s]
                    x_states[i, k] += (1 - 2 * s) * (mu - dual[at + s] * miss[at + s]) / slack[at + s]
    for i in range(count):
        at = n_rows + ((count + 1) * size + i) * 2
        held[i] = 0.0
        if not free_eta[i]:
            x_eta[i] = 0.0
            continue
        for s in range(2):
            if present[at + s]:
                held[i] += dual[at + s] / slack[at + s]
                x_eta[i] += (1 - 2 * s) * (mu - dual[at + s] * miss[at + s]) / slack[at + s]
    return good


@njit(cache=True)
def solved(local, around, held, free, damping, room, right):  # type: ignore[no-untyped-def]
    """Solve in place, with as much on the diagonal as makes it positive definite; return that, -1 for a failure."""
    lower, columns, pivot, link = room
    states, durations = right
    trying = 0.0 if damping < 1e-9 else damping / 4.0
    for _ in range(40):
        if factorise(local, around, held, free, trying, lower, columns, pivot, link):
            back_solve(lower, columns, pivot, link, states, durations)
            return trying
        trying = max(1e-6, 8.0 * trying)
    return -1.0


@njit(cache=True)
def whole_kept(weight, free, off, room, right, other):  # type: ignore[no-untyped-def]
    """Change the step so that the whole duration changes by ``off``; return the multiplier of that.

    ``other``: room for a second right side.
    """
    lower, columns, pivot, link = room
    x_states, x_eta = right
    y_states, y_eta = other
    y_states[:] = 0.0
    for i in range(len(weight)):
        y_eta[i] = weight[i] if free[1][i] else 0.0
    back_solve(lower, columns, pivot, link, y_states, y_eta)
    dot, norm = 0.0, 0.0
    for i in range(len(weight)):
        dot += weight[i] * x_eta[i]
        norm += weight[i] * y_eta[i]
    part = (dot - off) / norm
    for i in range(len(weight)):
        x_eta[i] -= part * y_eta[i]
    for i in range(x_states.shape[0]):
        for k in range(x_states.shape[1]):
            x_states[i, k] -= part * y_states[i, k]
    return part


@njit(cache=True)
def steps(given, place, factors, tangents, right, value, miss, step, d_slack):  # type: ignore[no-untyped-def]
    """Write the steps of control points and slacks from those of states and durations."""
    nodes, move, unit, bound, coef, start = given
    eta = place[0]
    factor, reach = factors
    x_states, x_eta = right
    count, dims, rows = value.shape
    pieces = nodes.shape[2] - 1
    end_step = np.empty(4)
    at = 0
    for i in range(count):
        for d in range(dims):
            t, s = tangents[i, d], step[i, d]
            for p in range(4):
                end_step[p] = t[p, 4] * x_eta[i]
                for k in range(4):
                    end_step[p] += t[p, k] * x_states[i + k // 2, 2 * d + k % 2]
            inner_step(pieces, factor[i, d], reach[i, d], end_step, x_eta[i], s)
            for r in range(rows):
                j = start[i, d, r]
                g = 0.0
                for p in range(4):
                    g += coef[i, d, r, p] * s[j + p]
                m = order_of(r, pieces)
                e = m * eta[i] ** (m - 1) * x_eta[i] if m else 0.0
                d_slack[at] = (g - bound[i, d, m, 0] * e if m else g) + miss[at]
                d_slack[at + 1] = (bound[i, d, m, 1] * e - g if m else -g) + miss[at + 1]
                at += 2
    for i in range(count + 1):
        for k in range(2 * dims):
            d_slack[at] = x_states[i, k] + miss[at]
            d_slack[at + 1] = -x_states[i, k] + miss[at + 1]
            at += 2
    for i in range(count):
        d_slack[at] = x_eta[i] + miss[at]
        d_slack[at + 1] = -x_eta[i] + miss[at + 1]
        at += 2
