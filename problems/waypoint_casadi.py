"""The fastest motion through waypoints as a program for CasADi's nlpsol: the interior point's variables and scaling.

x = (h_i / h0_i; velocities and accelerations v_1, a_1, v_2, a_2 … at each inner waypoint in ``WaypointTiming.units``;
control points 3 … K - 1 of each segment and joint in units v h0, from the segment's first waypoint). Rows of each
segment and joint, in this order: velocity's control points 1 … K, accelerations at the inner nodes, jerks of the
pieces, and where positions are limited control points 1 … K + 1; first g - upper eta^m <= 0 of all that have an upper
limit, then g - lower eta^m >= 0 of all that have a lower one, then the sum of the durations where that is given.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .waypoint_timing import Spline, WaypointTiming

Array = NDArray[np.float64]

#: Durations are at least this part of the start's: what a spline is divided by.
SHORTEST = 1e-6


def orders(problem: WaypointTiming) -> NDArray[np.int64]:
    """Return the derivative that each row limits, (R,)."""
    k = problem.pieces
    return np.repeat([1, 2, 3, 0], [k, k - 1, k, k + 1 if problem.positions else 0])


def row_maps(problem: WaypointTiming, h0: Array) -> Array:
    """Return the rows over the control points in units v h0, (S, D, R, K + 3), each in its joint's unit."""
    k, knots, units = problem.pieces, problem.knots(), problem.units()
    c = np.broadcast_to(np.eye(k + 3), (*knots.shape[:2], k + 3, k + 3))
    v = 3.0 * np.diff(c, axis=2) / (knots[:, :, 4 : k + 6] - knots[:, :, 1 : k + 3])[..., None]
    a = 2.0 * np.diff(v, axis=2) / (knots[:, :, 4 : k + 5] - knots[:, :, 2 : k + 3])[..., None]
    j = np.diff(a, axis=2) / np.diff(problem.nodes, axis=2)[..., None]
    per_a = units[0] / (units[1] * h0[:, None])
    per_j = units[0] / (units[2] * h0[:, None] ** 2)
    parts = [v[:, :, 1:-1], a[:, :, 1:-1] * per_a[..., None, None], j * per_j[..., None, None]]
    return np.concatenate([*parts, c[:, :, 1:-1]] if problem.positions else parts, axis=2)


def row_bounds(problem: WaypointTiming, h0: Array) -> tuple[Array, Array]:
    """Return the limits by order in the rows' units, (4, S, D) each."""
    units = problem.units()[:, None, :]
    way = (units[0] * h0[:, None])[None]
    lower, upper = (
        np.concatenate([(x[:1] - problem.waypoints[:-1]) / way, x[1:] / units]) for x in (problem.lower, problem.upper)
    )
    return lower, upper


def end_points(u: Any, move: Any, unit: Any, eta: Any, first: Any, last: Any) -> tuple[list[Any], list[Any]]:
    """Return the first and last three control points from states ``first`` and ``last``, (v, a) each.

    ``unit`` = a h0 / v; nodes come first in ``u``.
    """
    square = eta * eta * unit
    w1, w2 = 1.0 - u[-2], 1.0 - u[-3]
    head = [
        0.0 * move,
        eta * first[0] * u[1] / 3.0,
        eta * first[0] * (u[1] + u[2]) / 3.0 + square * first[1] * u[1] * u[2] / 6.0,
    ]
    tail = [
        move - eta * last[0] * (w1 + w2) / 3.0 + square * last[1] * w1 * w2 / 6.0,
        move - eta * last[0] * w1 / 3.0,
        move,
    ]
    return head, tail


def _states(problem: WaypointTiming) -> Array:
    """Return the states asked in units, NaN where free, (S + 1, D, 2)."""
    units = problem.units()
    return np.stack([problem.velocity / units[0], problem.acceleration / units[1]], axis=2)


def _bounds(problem: WaypointTiming, h0: Array, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Return bounds of x."""
    inner = _states(problem)[1:-1].reshape(-1)
    low, high = (
        np.stack([f(b[m, :-1], b[m, 1:]) for m in (1, 2)], axis=2).reshape(-1)
        for f, b in ((np.maximum, lower), (np.minimum, upper))
    )
    given = np.isfinite(inner)
    points = np.full(problem.lower[0].size * (problem.pieces - 3), np.inf)
    least = np.maximum(problem.least / h0, SHORTEST)
    return (
        np.concatenate([least, np.where(given, inner, low), -points]),
        np.concatenate([np.maximum(problem.most / h0, least), np.where(given, inner, high), points]),
    )


def to_casadi(problem: WaypointTiming, start: Spline) -> dict[str, Any]:
    """Return ``x, f, g`` (CasADi SX) with ``lbx, ubx, lbg, ubg, x0`` (arrays), scaled by the durations of ``start``.

    The objective is the duration in units of their mean, T; with ``total`` the integral of the squared jerk, each joint
    in its unit, over D T.
    """
    import casadi as ca

    h0, units, k = start.durations, problem.units(), problem.pieces
    count, dims = problem.lower.shape[1:]
    x0 = _pack(problem, start)
    x = ca.SX.sym("x", len(x0))
    maps, (lower, upper), row_orders = row_maps(problem, h0), row_bounds(problem, h0), orders(problem)
    move = np.diff(problem.waypoints, axis=0) / (units[0] * h0[:, None])
    unit = units[1] * h0[:, None] / units[0]
    given = _states(problem)
    inner = count + 2 * dims * (count - 1)

    def state(i: int, d: int) -> Any:
        if i in (0, count):
            return given[i, d]
        at = count + ((i - 1) * dims + d) * 2
        return x[at], x[at + 1]

    weight = h0 / h0.mean()
    cost: Any = 0.0 if problem.total is not None else ca.dot(ca.DM(weight), x[:count])
    over: list[Any] = []
    under: list[Any] = []
    for i in range(count):
        eta = x[i]
        powers = ca.vertcat(1, eta, eta**2, eta**3)[row_orders.tolist()]
        for d in range(dims):
            head, tail = end_points(problem.nodes[i, d], move[i, d], unit[i, d], eta, state(i, d), state(i + 1, d))
            at = inner + (i * dims + d) * (k - 3)
            control = ca.vertcat(*head, x[at : at + k - 3], *tail)
            g = ca.mtimes(ca.sparsify(ca.DM(maps[i, d])), control)
            for rows, bound in ((over, upper), (under, lower)):
                limit = bound[row_orders, i, d]
                kept = np.flatnonzero(np.isfinite(limit)).tolist()
                rows.append(g[kept] - ca.DM(limit[kept]) * powers[kept])
            if problem.total is not None:
                jerks = g[np.flatnonzero(row_orders == 3).tolist()]
                cost += weight[i] / dims * ca.dot(ca.DM(np.diff(problem.nodes[i, d])), jerks**2) * eta**-5
    above, below = ca.vertcat(*over), ca.vertcat(*under)
    parts: list[tuple[Any, float, float]] = [(above, -np.inf, 0.0), (below, 0.0, np.inf)]
    if problem.total is not None:
        whole = problem.total / h0.mean()
        parts.append((ca.dot(ca.DM(weight), x[:count]), whole, whole))
    lbx, ubx = _bounds(problem, h0, lower, upper)
    return {
        "x": x,
        "f": cost,
        "g": ca.vertcat(*[g for g, _, _ in parts]),
        "x0": x0,
        "lbx": lbx,
        "ubx": ubx,
        "lbg": np.concatenate([np.full(g.shape[0], low) for g, low, _ in parts]),
        "ubg": np.concatenate([np.full(g.shape[0], high) for g, _, high in parts]),
    }


def _pack(problem: WaypointTiming, start: Spline) -> Array:
    """Return x at ``start``, with the states that are given."""
    h0, units, asked = start.durations, problem.units(), _states(problem)
    states = np.stack([start.velocity / units[0], start.acceleration / units[1]], axis=2)
    states = np.where(np.isfinite(asked), asked, states)
    control = start.control[:, :, 3 : problem.pieces] / (units[0] * h0[:, None])[..., None]
    eta = np.where(problem.least == problem.most, problem.least / h0, 1.0)
    return np.concatenate([eta, states[1:-1].reshape(-1), control.reshape(-1)])


def from_x(problem: WaypointTiming, start: Spline, x: Array) -> Spline:
    """Return the spline that x means, all its control points filled in; the start as given to ``to_casadi``."""
    h0, units, k = start.durations, problem.units(), problem.pieces
    count, dims = problem.lower.shape[1:]
    inner = count + 2 * dims * (count - 1)
    states = _states(problem)
    states[1:-1] = x[count:inner].reshape(count - 1, dims, 2)
    way = units[0] * h0[:, None]
    head, tail = end_points(
        np.moveaxis(problem.nodes, 2, 0),
        np.diff(problem.waypoints, axis=0) / way,
        units[1] * h0[:, None] / units[0],
        x[:count, None],
        np.moveaxis(states[:-1], 2, 0),
        np.moveaxis(states[1:], 2, 0),
    )
    middle = x[inner:].reshape(count, dims, k - 3)
    control = np.concatenate([np.stack(head, axis=2), middle, np.stack(tail, axis=2)], axis=2)
    return Spline(x[:count] * h0, states[..., 0] * units[0], states[..., 1] * units[1], control * way[..., None])
