"""Primal-dual interior point for the free path through waypoints: problems/waypoint_timing.py says what is solved.

Newton's matrix needs no sparse algebra: each joint's rows on a segment are condensed to its two end states and the
segment's duration (waypoint_rows), and these are eliminated along the waypoints (waypoint_sweep). The program is not
convex (accelerations scale with eta^2): where the matrix is not positive definite its diagonal is raised. Steps are
shortened by nothing but the nearest bound: what they leave of residuals, the next ones take away (with a merit
function that watched them the same problems took two to five times as many steps).
"""

import numpy as np
from numba import njit

from .waypoint_newton import newton, slopes, solved, steps, whole_kept
from .waypoint_rows import fill_ends, fill_rows, order_of, rows_count

#: What a call comes to.
SOLVED, ITERATIONS, NOT_FINITE = 0, 1, 2
#: Largest part of the way to the nearest bound.
BOUNDARY = 0.995
#: No duration falls below this part of its value in one step.
SHRINK = 0.3
#: How many times the tolerance is enough where the iterations run out: rounding may hold it there.
LATE = 100.0
#: A slack becomes what it stands for where that is at least this part of what was foreseen.
NEAR = 0.3


@njit(cache=True)
def _rooms(given, place, states_bound, eta_bound, value, room):  # type: ignore[no-untyped-def]
    """Write the end control points, the rows' values, and what everything leaves to its bounds, in one row.

    First the rows (S, D, R, 2), then the waypoint states (S + 1, 2 D, 2), then the durations (S, 2).
    """
    nodes, move, unit, bound, coef, start = given
    eta, states, control = place
    count, dims, rows = value.shape
    pieces = nodes.shape[2] - 1
    at = 0
    for i in range(count):
        for d in range(dims):
            c = control[i, d]
            v0, a0, v1, a1 = states[i, 2 * d], states[i, 2 * d + 1], states[i + 1, 2 * d], states[i + 1, 2 * d + 1]
            fill_ends(nodes[i, d], move[i, d], unit[i, d, 0], eta[i], v0, a0, v1, a1, c)
            for r in range(rows):
                j = start[i, d, r]
                g = 0.0
                for p in range(4):
                    g += coef[i, d, r, p] * c[j + p]
                m = order_of(r, pieces)
                power = eta[i] ** m
                value[i, d, r] = g
                room[at] = g - bound[i, d, m, 0] * power
                room[at + 1] = bound[i, d, m, 1] * power - g
                at += 2
    for i in range(count + 1):
        for k in range(2 * dims):
            room[at] = states[i, k] - states_bound[i, k, 0]
            room[at + 1] = states_bound[i, k, 1] - states[i, k]
            at += 2
    for i in range(count):
        room[at] = eta[i] - eta_bound[i, 0]
        room[at + 1] = eta_bound[i, 1] - eta[i]
        at += 2


@njit(cache=True)
def _present(given, states_bound, eta_bound, free, value, present):  # type: ignore[no-untyped-def]
    """Write which bounds there are, in the order of ``_rooms``; return their number."""
    bound = given[3]
    free_states, free_eta = free
    count, dims, rows = value.shape
    pieces = given[0].shape[2] - 1
    at, number = 0, 0
    for i in range(count):
        for d in range(dims):
            for r in range(rows):
                m = order_of(r, pieces)
                for side in range(2):
                    present[at] = abs(bound[i, d, m, side]) < 1e300
                    at += 1
    for i in range(count + 1):
        for k in range(2 * dims):
            for side in range(2):
                present[at] = free_states[i, k] and abs(states_bound[i, k, side]) < 1e300
                at += 1
    for i in range(count):
        for side in range(2):
            present[at] = free_eta[i] and eta_bound[i, side] < 1e300
            at += 1
    for k in range(at):
        number += 1 if present[k] else 0
    return number


@njit(cache=True)
def _roughness(pieces, nodes, value, eta, price):  # type: ignore[no-untyped-def]
    """Return the sum of  price du (jerk row)^2 eta^-5."""
    total = 0.0
    for i in range(value.shape[0]):
        fifth = eta[i] ** -5
        for d in range(value.shape[1]):
            for k in range(pieces):
                g = value[i, d, 2 * pieces - 1 + k]
                total += price[i, d] * (nodes[i, d, k + 1] - nodes[i, d, k]) * g * g * fifth
    return total


@njit(cache=True)
def _lengths(slack, dual, present, mu, d_slack, d_dual, eta, x_eta):  # type: ignore[no-untyped-def]
    """Write the duals' steps; return how much of its step the point may go, and how much the duals."""
    primal, far = 1.0, 1.0
    for k in range(slack.shape[0]):
        if present[k]:
            d_dual[k] = mu / slack[k] - dual[k] - dual[k] / slack[k] * d_slack[k]
            if primal * d_slack[k] < -BOUNDARY * slack[k]:
                primal = -BOUNDARY * slack[k] / d_slack[k]
            if far * d_dual[k] < -BOUNDARY * dual[k]:
                far = -BOUNDARY * dual[k] / d_dual[k]
    for i in range(eta.shape[0]):
        if primal * x_eta[i] < -(1.0 - SHRINK) * eta[i]:
            primal = -(1.0 - SHRINK) * eta[i] / x_eta[i]
    return primal, far


@njit(cache=True)
def interior_point(  # type: ignore[no-untyped-def]
    nodes, move, unit, bound, states_bound, free_states, eta_bound, free_eta, weight, total, time_price, price,
    positions, eta, states, control, share, tolerance, most, report,
):  # fmt: skip
    """Solve; ``eta``, ``states`` and ``control`` hold the start and then the answer. Return one of the words above.

    Parameters
    ----------
    nodes : (S, D, K + 1)
        Where each joint's pieces end, in [0, 1].
    move : (S, D)
        The way of each joint in units v h0.
    unit : (S, D, 2)
        a h0 / v and j h0^2 / v.
    bound : (S, D, 4, 2)
        Lower and upper limits of position (relative to the segment's start), velocity, acceleration and jerk.
    states_bound : (S + 1, 2 D, 2), free_states : (S + 1, 2 D) bool
        Bounds of waypoint states (v_1, a_1, v_2, a_2 …), and which of them are unknown.
    eta_bound : (S, 2), free_eta : (S,) bool
    weight : (S,)
        h0 of each segment, in the unit of time of the objective.
    total : float
        Exact value of sum weight eta; 0 for none.
    time_price : float, price : (S, D)
        The objective: time_price sum weight eta + sum price du (jerk row)^2 eta^-5.
    positions : bool
        Whether positions are limited.
    eta : (S,), states : (S + 1, 2 D), control : (S, D, K + 3)
    share : (S, D)
        Filled with each joint's part of the multipliers of a duration: they add up to its weight.
    tolerance : float
        Of the barrier parameter, relative to the objective.
    most : int
        Number of iterations.
    report : (4,)
        Filled with iterations, largest residual, barrier parameter, stationarity.
    """
    count, dims = move.shape
    pieces = nodes.shape[2] - 1
    rows, size = rows_count(pieces, positions), 2 * dims
    coef, start = np.empty((count, dims, rows, 4)), np.empty((count, dims, rows), np.int64)
    for i in range(count):
        for d in range(dims):
            fill_rows(nodes[i, d], 1.0 / unit[i, d, 0], 1.0 / unit[i, d, 1], coef[i, d], start[i, d])
    given = (nodes, move, unit, bound, coef, start)
    place = (eta, states, control)
    free = (free_states, free_eta)
    prices = (time_price, price)
    n = 2 * (count * dims * rows + (count + 1) * size + count)
    value, present = np.empty((count, dims, rows)), np.zeros(n, np.bool_)
    slack, dual, miss, room = np.ones(n), np.zeros(n), np.zeros(n), np.empty(n)
    d_slack, d_dual = np.zeros(n), np.zeros(n)
    tangents, force = np.zeros((count, dims, 4, 5)), np.zeros((count, dims, pieces + 3))
    step = np.zeros((count, dims, pieces + 3))
    factors = (np.zeros((count, dims, max(pieces - 3, 1), 4)), np.zeros((count, dims, max(pieces - 3, 1), 6)))
    local, around, held = np.zeros((count, dims, 5, 5)), np.zeros((count + 1, size)), np.zeros(count)
    blocks = (
        np.zeros((count + 1, size, size)), np.zeros((count + 1, size, size + 1)),
        np.zeros(count), np.zeros((count, size)),
    )  # fmt: skip
    right, other = (np.zeros((count + 1, size)), np.zeros(count)), (np.zeros((count + 1, size)), np.zeros(count))

    asked = max(_present(given, states_bound, eta_bound, free, value, present), 1)
    _rooms(given, place, states_bound, eta_bound, value, room)
    least = weight.sum()
    mu = 0.3 * least / asked
    least *= tolerance / asked
    for k in range(n):
        if present[k]:
            slack[k] = max(room[k], 0.1)
            dual[k] = mu / slack[k]
    damping, multiplier, status = 0.0, 0.0, ITERATIONS
    for iteration in range(most + 1):
        gap, worst = 0.0, 0.0
        for k in range(n):
            if present[k]:
                miss[k] = room[k] - slack[k]
                worst = max(worst, abs(miss[k]))
                gap += slack[k] * dual[k]
        off = 0.0
        if total > 0.0:
            off = total - (weight * eta).sum()
        if time_price == 0.0:  # the tolerance is of the objective, which durations change by their fifth power
            least = tolerance / asked * _roughness(pieces, nodes, value, eta, price)
        slope_of_time = (time_price + multiplier, price)
        still = slopes(given, place, free, weight, slope_of_time, value, dual, tangents, force, share, other)
        report[0], report[1], report[2], report[3] = iteration, max(worst, abs(off)), gap / asked, still
        enough = 2.0 if iteration < most else LATE
        if gap <= enough * asked * least and worst <= 1e-9 and abs(off) <= 1e-10 * max(total, 1.0):
            status = SOLVED
            break
        if iteration == most:
            break
        while iteration > 0 and mu > 0.2 * least:  # the barrier parameter falls once the point agrees with it
            farthest = max(still, worst)
            for k in range(n):
                if present[k]:
                    farthest = max(farthest, abs(slack[k] * dual[k] - mu))
            if farthest > 10.0 * mu:
                break
            mu = max(0.2 * mu, 0.2 * least)
        barrier = (slack, dual, miss, present, mu)
        good = newton(
            given, place, free, weight, prices, value, barrier, tangents, force, factors, local, around, held, right
        )
        if good:
            damping = solved(local, around, held, free, damping, blocks, right)
        if not good or damping < 0.0:
            status = NOT_FINITE
            break
        if total > 0.0:
            multiplier = whole_kept(weight, free, off, blocks, right, other)
        steps(given, place, factors, tangents, right, value, miss, step, d_slack)
        primal, far = _lengths(slack, dual, present, mu, d_slack, d_dual, eta, right[1])
        for i in range(count):
            eta[i] += primal * right[1][i]
            for d in range(dims):
                for j in range(3, pieces):
                    control[i, d, j] += primal * step[i, d, j]
        for i in range(count + 1):
            for k in range(size):
                states[i, k] += primal * right[0][i, k]
        _rooms(given, place, states_bound, eta_bound, value, room)
        for k in range(n):
            if present[k]:
                slack[k] += primal * d_slack[k]
                if room[k] > NEAR * slack[k]:
                    slack[k] = room[k]
                dual[k] += far * d_dual[k]
    return status
