"""Free path through waypoints: rows against SciPy's splines, Newton's steps against dense ones, answers by IPOPT."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.interpolate import BSpline, CubicSpline

from planner.kernels import waypoint_rows as kernel
from planner.kernels.waypoint_sweep import factorise
from planner.kernels.waypoint_sweep import solve as back_solve
from planner.solvers import select
from planner.solvers.nlp import solve_nlp
from planner.waypoints.program import MARGIN, solve
from problems.waypoint_casadi import from_x, row_bounds
from problems.waypoint_timing import Spline, WaypointTiming


def random_nodes(rng, pieces, shape=()):
    gaps = rng.uniform(0.3, 1, (*shape, pieces))
    nodes = np.concatenate([np.zeros((*shape, 1)), np.cumsum(gaps, axis=-1)], axis=-1)
    nodes /= nodes[..., -1:]
    nodes[..., -1] = 1.0
    return nodes


def random_problem(seed, count=3, dims=2, pieces=5, positions=False, moving=False, total=None):
    """Return a problem with asymmetric limits, and a cubic spline to begin with, which need not keep them."""
    rng = np.random.default_rng(seed)
    waypoints = np.cumsum(rng.uniform(0.3, 1, (count + 1, dims)) * rng.choice([-1, 1], (count + 1, dims)), axis=0)
    upper = (
        np.array([np.inf, 1.0, 4.0, 30.0])[:, None, None] * rng.uniform(0.7, 1.4, (4, 1, dims)) * np.ones((count, 1))
    )
    lower = -upper * rng.uniform(0.7, 1.4, (4, 1, dims))
    if positions:
        room = 0.03 if moving else 1e-3
        lower[0] = waypoints.min(axis=0) - rng.uniform(room, 0.04, dims)
        upper[0] = waypoints.max(axis=0) + rng.uniform(room, 0.04, dims)
    states = np.full((2, count + 1, dims), np.nan)
    states[:, [0, -1]] = rng.uniform(-0.2, 0.2, (2, 2, dims)) if moving else 0.0
    least, most = np.full(count, 0.01), np.full(count, np.inf)
    nodes = random_nodes(rng, pieces, (count, dims))
    problem = WaypointTiming(waypoints, nodes, lower, upper, *states, least, most, total)
    h = np.abs(np.diff(waypoints, axis=0)).max(axis=1) * 2
    return problem, first_guess(problem, h if total is None else h * total / h.sum()), rng


def first_guess(problem, h):
    t = np.append(0, np.cumsum(h))
    cubic = CubicSpline(t, problem.waypoints, bc_type=((1, problem.velocity[0]), (1, problem.velocity[-1])))
    knots = problem.knots() * h[:, None, None]
    x, y, z = knots[..., 1:-3], knots[..., 2:-2], knots[..., 3:-1]
    c = cubic.c[..., None]
    control = c[2] * (x + y + z) / 3 + c[1] * (x * y + y * z + x * z) / 3 + c[0] * x * y * z
    return Spline(h, cubic(t, 1), cubic(t, 2), control)


def rows_of(nodes, unit=(1.0, 1.0), positions=True):
    pieces = len(nodes) - 1
    rows = kernel.rows_count(pieces, positions)
    coef, start = np.empty((rows, 4)), np.empty(rows, np.int64)
    kernel.fill_rows(nodes, 1 / unit[0], 1 / unit[1], coef, start)
    return coef, start


@pytest.mark.parametrize("positions", [False, True])
@pytest.mark.parametrize("pieces", [4, 5, 6, 9])
def test_rows_are_those_of_a_spline(pieces, positions):
    rng = np.random.default_rng(pieces)
    nodes, c, unit = random_nodes(rng, pieces), rng.normal(size=pieces + 3), (0.7, 3.0)
    coef, start = rows_of(nodes, unit, positions)
    values = [f @ c[j : j + 4] for f, j in zip(coef, start, strict=True)]
    q, middles = BSpline(np.pad(nodes, 3, mode="edge"), c, 3), 0.5 * (nodes[1:] + nodes[:-1])
    expected = [q.derivative(1).c[1 : pieces + 1], q(nodes[1:-1], 2) / unit[0], q(middles, 3) / unit[1]]
    if positions:
        expected.append(c[1:-1])
    np.testing.assert_allclose(values, np.concatenate(expected), rtol=1e-9, atol=1e-9)
    sizes = [len(e) for e in expected]
    assert [kernel.order_of(r, pieces) for r in range(sum(sizes))] == np.repeat(
        [1, 2, 3, 0][: len(sizes)], sizes
    ).tolist()


@pytest.mark.parametrize("pieces", [4, 5, 8])
def test_end_points_and_their_derivatives(pieces):
    rng = np.random.default_rng(pieces)
    nodes, unit, move, at = random_nodes(rng, pieces), 1.7, 0.4, (1, 2, pieces, pieces + 1)
    x, force = np.append(rng.normal(size=4), 1.3), rng.normal(size=pieces + 3)  # v0, a0, v1, a1, eta

    def points(x):
        c = np.full(pieces + 3, 0.3)
        kernel.fill_ends(nodes, move, unit, x[4], *x[:4], c)
        return c

    c, eta = points(x), x[4]
    q = BSpline(np.pad(nodes, 3, mode="edge"), c, 3)
    for u, place, v, a in ((0, 0, *x[:2]), (1, move, *x[2:4])):
        np.testing.assert_allclose([q(u), q(u, 1) / eta, q(u, 2) / eta**2 / unit], [place, v, a], atol=1e-10)

    def slopes(x):
        tangent = np.empty((4, 5))
        kernel.fill_tangents(nodes, unit, x[4], *x[:4], tangent)
        return tangent

    step, eye = 1e-5, np.eye(5)
    by_hand = np.stack([points(x + step * e) - points(x - step * e) for e in eye], axis=1) / (2 * step)
    np.testing.assert_allclose(slopes(x), by_hand[list(at)], atol=1e-9)
    second = np.stack([force[list(at)] @ (slopes(x + step * e) - slopes(x - step * e)) for e in eye]) / (2 * step)
    matrix = np.ones((5, 5))
    kernel.curvature(nodes, unit, eta, x[1], x[3], force, matrix)
    np.testing.assert_allclose(matrix - 1, second, atol=1e-8)


def random_blocks(seed, count, dims):
    """Return segments' matrices, diagonals, and the whole matrix, in the order eta_0, x_1, eta_1, x_2 …"""
    rng = np.random.default_rng(seed)
    local = rng.normal(size=(count, dims, 5, 5))
    local = local @ local.transpose(0, 1, 3, 2)
    around, held = rng.uniform(0.1, 1, (count + 1, 2 * dims)), rng.uniform(0.1, 1, count)
    place = np.arange(count)[:, None] * (2 * dims + 1) + np.arange(2 * dims + 1)  # rows: states of waypoint i, eta_i
    dense = np.zeros((place.max() + 1 + 2 * dims,) * 2)
    for i in range(count):
        for d in range(dims):
            at = place[i, 2 * d : 2 * d + 2], place[i, -1:] + 1 + 2 * d + np.arange(2), place[i, -1:]
            at = np.concatenate(at)
            dense[np.ix_(at, at)] += local[i, d]
        dense[place[i, -1], place[i, -1]] += held[i]
        dense[place[i, :-1], place[i, :-1]] += around[i]
    return local, around, held, dense, place, rng


@pytest.mark.parametrize("hold", ["ends", "states", "durations", "both"])
@pytest.mark.parametrize("count, dims", [(1, 1), (1, 3), (2, 1), (4, 2), (7, 3)])
def test_block_elimination_is_a_dense_solution(count, dims, hold):
    local, around, held, dense, place, rng = random_blocks(count, count, dims)
    free_states, free_eta = np.zeros((count + 1, 2 * dims), bool), np.ones(count, bool)
    free_states[1:-1] = True
    if hold in ("states", "both"):
        free_states[1:-1] = rng.random((count - 1, 2 * dims)) < 0.6
    if hold in ("durations", "both"):
        free_eta = rng.random(count) < 0.6
    free = np.concatenate([np.column_stack([free_states[:-1], free_eta]).reshape(-1), free_states[-1]])
    damping = 0.37
    right = np.where(free, rng.normal(size=len(dense)), 0.0)
    expected = np.zeros(len(dense))
    reduced = (dense + damping * np.eye(len(dense)))[np.ix_(free, free)]
    expected[free] = np.linalg.solve(reduced, right[free])
    size = 2 * dims
    factors = np.zeros((count + 1, size, size)), np.zeros((count + 1, size, size + 1)), np.zeros(count)
    factors = *factors, np.zeros((count, size))
    states, eta = np.zeros((count + 1, size)), right[place[:, -1]].copy()
    states[:-1] = right[place[:, :-1]]
    assert factorise(local, around, held, (free_states, free_eta), damping, *factors)
    back_solve(*factors, states, eta)
    np.testing.assert_allclose(eta, expected[place[:, -1]], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(states[1:-1], expected[place[1:, :-1]], rtol=1e-9, atol=1e-12)


def test_what_is_not_positive_definite_is_told():
    for seed in range(10):
        local, around, held, dense, *_ = random_blocks(seed, 3, 2)
        free_states, free_eta = np.zeros((4, 4), bool), np.ones(3, bool)
        free_states[1:-1] = True
        least = np.linalg.eigvalsh(dense[4:-4, 4:-4])[0]
        for shift, good in ((1e-6, True), (-1e-6, False)):
            room = np.zeros((4, 4, 4)), np.zeros((4, 4, 5)), np.zeros(3), np.zeros((3, 4))
            assert factorise(local, around, held, (free_states, free_eta), shift - least, *room) == good


class Newton:
    """A step of the kernels at any point, slacks and duals."""

    def __init__(self, problem, start, seed, smooth):
        p, self.problem, self.start, self.smooth = problem, problem, start, smooth
        rng = np.random.default_rng(seed)
        self.count, self.dims = p.least.size, p.waypoints.shape[1]
        self.h0, (v, a, j) = start.durations, p.units()
        self.unit = np.stack([a * self.h0[:, None] / v, j * self.h0[:, None] ** 2 / v], axis=2)
        self.way = v * self.h0[:, None]
        self.bound = np.stack(row_bounds(p, self.h0), axis=3).transpose(1, 2, 0, 3).copy()
        self.rows = kernel.rows_count(p.pieces, p.positions)
        shape = (self.count, self.dims, self.rows, 2)
        self.slack, self.dual, self.miss = (
            rng.uniform(0.5, 2, shape),
            rng.uniform(0.5, 2, shape),
            rng.normal(size=shape),
        )
        orders = [kernel.order_of(r, p.pieces) for r in range(self.rows)]
        self.present = np.isfinite(self.bound[:, :, orders])
        self.dual[~self.present] = 0.0
        self.mu = 0.3
        self.around, self.held = rng.uniform(0, 1, (self.count + 1, 2 * self.dims)), rng.uniform(0, 1, self.count)
        weight = self.h0 / self.h0.mean()
        self.price = np.repeat(weight[:, None] / self.dims, self.dims, axis=1) * smooth
        self.time = 0.0 * weight if smooth else weight

    def step(self, damping):
        """Return steps of eta, states and control points, and the Lagrangian's slopes by control points."""
        p, count, dims, pieces = self.problem, self.count, self.dims, self.problem.pieces
        states = np.stack([self.start.velocity / p.units()[0], self.start.acceleration / p.units()[1]], axis=2)
        asked = np.stack([p.velocity / p.units()[0], p.acceleration / p.units()[1]], axis=2)
        free = np.isnan(asked).reshape(count + 1, 2 * dims)
        states = np.where(np.isnan(asked), states, asked)
        x_states, x_eta = np.zeros((count + 1, 2 * dims)), -self.time
        y_states, y_eta = np.zeros((count + 1, 2 * dims)), self.time.copy()
        local, tangents = np.empty((count, dims, 5, 5)), np.empty((count, dims, 4, 5))
        factor, reach = np.zeros((count, dims, pieces - 3, 4)), np.zeros((count, dims, pieces - 3, 6))
        force = np.empty((count, dims, pieces + 3))
        band, cross, right = np.empty((pieces + 3, 4)), np.empty(pieces + 3), np.empty(pieces + 3)
        ends, side, at = np.empty((5, 6)), np.empty(5), [1, 2, pieces, pieces + 1]
        for i in range(count):
            for d in range(dims):
                u, unit, bound, price = p.nodes[i, d], self.unit[i, d], self.bound[i, d], self.price[i, d]
                coef, first = rows_of(u, unit, p.positions)
                c = self.start.control[i, d] / self.way[i, d]
                move = (p.waypoints[i + 1, d] - p.waypoints[i, d]) / self.way[i, d]
                around = *states[i, d], *states[i + 1, d]
                kernel.fill_ends(u, move, unit[0], 1.0, *around, c)
                value = np.array([f @ c[j : j + 4] for f, j in zip(coef, first, strict=True)])
                dual, t = self.dual[i, d], tangents[i, d]
                own = kernel.forces(u, coef, first, bound, dual, value, 1.0, price, force[i, d])
                kernel.fill_tangents(u, unit[0], 1.0, *around, t)
                slopes = force[i, d, at] @ t
                y_states[i, 2 * d : 2 * d + 2] += slopes[:2]
                y_states[i + 1, 2 * d : 2 * d + 2] += slopes[2:4]
                y_eta[i] += own + slopes[4]
                diagonal = kernel.condense(
                    u, coef, first, bound, self.slack[i, d], dual, self.miss[i, d], value, 1.0, self.mu, price,
                    band, cross, right,
                )  # fmt: skip
                assert kernel.eliminate(pieces, band, cross, right, factor[i, d], reach[i, d], ends, diagonal)
                kernel.fold(t, ends, local[i, d], side)
                kernel.curvature(u, unit[0], 1.0, around[1], around[3], force[i, d], local[i, d])
                x_states[i, 2 * d : 2 * d + 2] += side[:2]
                x_states[i + 1, 2 * d : 2 * d + 2] += side[2:4]
                x_eta[i] += side[4]
        x_states[~free] = 0.0
        size = 2 * dims
        room = np.zeros((count + 1, size, size)), np.zeros((count + 1, size, size + 1)), np.zeros(count)
        room = *room, np.zeros((count, size))
        if not factorise(local, self.around, self.held, (free, np.ones(count, bool)), damping, *room):
            return None
        back_solve(*room, x_states, x_eta)
        steps = np.empty((count, dims, pieces + 3))
        for i in range(count):
            for d in range(dims):
                both = *x_states[i, 2 * d : 2 * d + 2], *x_states[i + 1, 2 * d : 2 * d + 2], x_eta[i]
                kernel.inner_step(pieces, factor[i, d], reach[i, d], tangents[i, d] @ both, x_eta[i], steps[i, d])
        slope = np.concatenate([y_eta, y_states[1:-1].reshape(-1), force[:, :, 3:pieces].reshape(-1)])
        return np.concatenate([x_eta, x_states[1:-1].reshape(-1), steps[:, :, 3:pieces].reshape(-1)]), slope

    def dense(self, damping):
        """Return the same, from CasADi's derivatives; None where the matrix is not positive definite."""
        posed = replace(self.problem, total=1.0 if self.smooth else None).to_casadi(self.start)
        x, f, g, x0 = (posed[k] for k in ("x", "f", "g", "x0"))
        at, below = self.present[..., 1], self.present[..., 0]
        g = g[: int(at.sum() + below.sum())]
        parts = [np.concatenate([y[..., 1][at], y[..., 0][below]]) for y in (self.slack, self.dual, self.miss)]
        slack, dual, miss = parts
        sign = np.repeat([-1.0, 1.0], [at.sum(), below.sum()])  # of g, to be what is left
        lagrangian = f - ca.dot(ca.DM(sign * dual), g)
        hessian, slope = ca.hessian(lagrangian, x)
        out = ca.Function("d", [x], [hessian, slope, ca.jacobian(g, x), ca.gradient(f, x)])(x0)
        matrix, slope, jacobian, gradient = (np.array(ca.DM(o)) for o in out)
        jacobian = sign[:, None] * jacobian
        matrix = matrix + jacobian.T @ ((dual / slack)[:, None] * jacobian)
        n = self.count + 2 * self.dims * (self.count - 1)
        matrix[range(n), range(n)] += np.concatenate([self.held, self.around[1:-1].reshape(-1)]) + damping
        right = jacobian.T @ ((self.mu - dual * miss) / slack) - gradient.reshape(-1)
        free = posed["lbx"] < posed["ubx"]
        reduced = matrix[np.ix_(free, free)]
        if np.linalg.eigvalsh(reduced)[0] <= 0:
            return None
        step = np.zeros(len(x0))
        step[free] = np.linalg.solve(reduced, right[free])
        return step, slope.reshape(-1)


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("positions", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_a_step_is_that_of_the_dense_system(seed, positions, smooth):
    """Of the whole Lagrangian's Hessian with all slacks and duals eliminated."""
    problem, start, rng = random_problem(seed, positions=positions, moving=True, pieces=(5, 4, 7)[seed])
    if positions:
        problem.upper[0, 1, 0] = np.inf
    problem.velocity[1, 0] = problem.acceleration[2, 1] = 0.1
    newton = Newton(problem, start, seed, smooth)
    failed = 0
    for damping in (0.0, 1e-2, 1.0, 1e2, 1e4):
        ours, dense = newton.step(damping), newton.dense(damping)
        assert (ours is None) == (dense is None)
        if ours is None:
            failed += 1
            continue
        np.testing.assert_allclose(ours[0], dense[0], rtol=1e-6, atol=1e-7 * np.abs(dense[0]).max())
        np.testing.assert_allclose(ours[1], dense[1], rtol=1e-8, atol=1e-8 * np.abs(dense[1]).max())
    assert failed < 5


def tightened(problem):
    """The program that is solved, its limits less the margin."""
    lower, upper = problem.lower.copy(), problem.upper.copy()
    lower[1:] *= 1 - MARGIN
    upper[1:] *= 1 - MARGIN
    return replace(problem, lower=lower, upper=upper)


def excess(problem, spline, samples=200):
    """How far a spline breaks its limits at dense samples, waypoints and states, in units."""
    worst, units = 0.0, np.vstack([np.ones(problem.waypoints.shape[1]), problem.units()])
    for i, h in enumerate(spline.durations):
        for d in range(problem.waypoints.shape[1]):
            q = BSpline(problem.knots()[i, d] * h, problem.waypoints[i, d] + spline.control[i, d], 3)
            t = np.linspace(0, h, samples)
            for m in range(4):
                low, high = problem.lower[m, i, d], problem.upper[m, i, d]
                worst = max(worst, max(np.max(low - q(t, m)), np.max(q(t, m) - high)) / units[m, d])
            for end, at in ((i, 0.0), (i + 1, h)):
                found = q(at), q(at, 1), q(at, 2)
                expected = problem.waypoints[end, d], spline.velocity[end, d], spline.acceleration[end, d]
                worst = max(worst, np.max(np.abs(np.subtract(found, expected)) / units[:3, d]))
                for x, asked in zip(found[1:], (problem.velocity[end, d], problem.acceleration[end, d]), strict=True):
                    if np.isfinite(asked):
                        worst = max(worst, abs(x - asked))
    return worst


def objective(problem, spline):
    if problem.total is None:
        return spline.durations.sum()
    h = spline.durations[:, None]
    knots, cost = problem.knots(), 0.0
    for i, h in enumerate(spline.durations):
        for d in range(problem.waypoints.shape[1]):
            u = problem.nodes[i, d]
            q = BSpline(knots[i, d] * h, spline.control[i, d], 3)
            cost += h * np.diff(u) @ (q(h * 0.5 * (u[1:] + u[:-1]), 3) / problem.units()[2, d]) ** 2
    return cost


CASES = {
    "one joint": dict(seed=0, count=2, dims=1, pieces=6),
    "two joints": dict(seed=1, count=3, dims=2, pieces=5),
    "three joints": dict(seed=2, count=4, dims=3, pieces=6),
    "moving ends": dict(seed=3, count=3, dims=2, pieces=6, moving=True),
    "one segment": dict(seed=4, count=1, dims=2, pieces=6),
    "positions": dict(seed=5, count=4, dims=2, pieces=6, positions=True),
    "positions, moving": dict(seed=6, count=3, dims=1, pieces=6, positions=True, moving=True),
    "exact total": dict(seed=7, count=3, dims=2, pieces=6, total=8.0),
    "exact total, positions": dict(seed=8, count=4, dims=3, pieces=5, total=6.0, positions=True),
}


def by_ipopt(problem, start, size=1.0):
    """Return IPOPT's answer; ``size`` of the objective, which its tolerance is meant for."""

    def pose():
        posed = problem.to_casadi(start)
        return {**posed, "f": posed["f"] / size}

    return from_x(problem, start, solve_nlp(pose, select("nlp", "ipopt")[0]).x)


@pytest.mark.parametrize("case", CASES)
def test_against_ipopt_on_the_very_same_program(case):
    problem, start, _ = random_problem(**CASES[case])
    found = solve(problem, start, 1e-9, 200)
    assert found.solved
    ours = objective(problem, found.spline)
    theirs = objective(problem, by_ipopt(tightened(problem), start, ours / start.durations.mean()))
    assert ours == pytest.approx(theirs, rel=1e-6)
    assert excess(problem, found.spline) <= 1e-8
    if problem.total is not None:
        assert found.spline.durations.sum() == pytest.approx(problem.total, rel=1e-9)


def test_limits_are_what_binds():
    """The answers above are at their limits of every order, positions' too."""
    problem, start, _ = random_problem(**CASES["positions"])
    spline = solve(problem, start, 1e-9, 200).spline
    for m in range(4):
        nearest = np.inf
        for i, h in enumerate(spline.durations):
            for d in range(2):
                q = BSpline(problem.knots()[i, d] * h, problem.waypoints[i, d] + spline.control[i, d], 3)
                x = q(np.linspace(0, h, 1000), m)
                room = np.minimum(x - problem.lower[m, i, d], problem.upper[m, i, d] - x).min()
                nearest = min(nearest, room / (problem.upper[m, i, d] - problem.lower[m, i, d]))
        assert -1e-9 <= nearest <= 1e-3


@pytest.mark.parametrize("case", CASES)
def test_the_tolerance_is_of_the_objective(case):
    problem, start, _ = random_problem(**CASES[case])
    best = objective(problem, solve(problem, start, 1e-9, 200).spline)
    for tolerance in (1e-3, 1e-5):
        found = solve(problem, start, tolerance, 200)
        assert found.solved
        assert objective(problem, found.spline) <= best * (1 + 3 * tolerance)
        assert excess(problem, found.spline) <= 1e-8


@pytest.mark.parametrize("total", [6.0, 24.0])
def test_the_tolerance_is_of_the_smoothness(total):
    """However small the integral: it falls with the fifth power of the duration."""
    problem, start, _ = random_problem(8, 4, 3, 5, True, total=total)
    best = objective(problem, solve(problem, start, 1e-11, 200).spline)
    for tolerance in (1e-3, 1e-5):
        assert objective(problem, solve(problem, start, tolerance, 200).spline) <= best * (1 + 3 * tolerance)


@pytest.mark.parametrize("total", [None, 8.0])
@pytest.mark.parametrize("second, metre", [(1e-2, 1.0), (50.0, 1e3), (1.0, 1e-4)])
def test_units_are_nothing(second, metre, total):
    """Seconds and metres of other lengths give the same motion after the same iterations."""
    problem, start, _ = random_problem(11, 3, 2, 6, True, True, total)
    per = metre / second ** np.arange(4)
    other = replace(
        problem,
        waypoints=problem.waypoints * metre,
        lower=problem.lower * per[:, None, None],
        upper=problem.upper * per[:, None, None],
        velocity=problem.velocity * per[1],
        acceleration=problem.acceleration * per[2],
        least=problem.least * second,
        total=None if total is None else total * second,
    )
    begin = Spline(
        start.durations * second, start.velocity * per[1], start.acceleration * per[2], start.control * metre
    )
    ours, theirs = solve(problem, start, 1e-8, 200), solve(other, begin, 1e-8, 200)
    assert ours.solved and theirs.solved and abs(ours.iterations - theirs.iterations) <= 1
    np.testing.assert_allclose(theirs.spline.durations / second, ours.spline.durations, rtol=1e-6)
    np.testing.assert_allclose(theirs.spline.control / metre, ours.spline.control, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(theirs.shares, ours.shares, rtol=1e-3, atol=1e-4)


def permuted(problem, start, order):
    """The same with joints in another order."""
    changes = {n: getattr(problem, n)[..., order] for n in ("waypoints", "lower", "upper", "velocity", "acceleration")}
    joints = Spline(start.durations, start.velocity[:, order], start.acceleration[:, order], start.control[:, order])
    return replace(problem, nodes=problem.nodes[:, order], **changes), joints


def reversed_time(problem, start):
    """The same motion backwards: velocities and jerks change their signs."""
    lower, upper = problem.lower[:, ::-1].copy(), problem.upper[:, ::-1].copy()
    for m in (1, 3):
        lower[m], upper[m] = -upper[m], -lower[m]
    other = WaypointTiming(
        problem.waypoints[::-1], 1 - problem.nodes[::-1, :, ::-1], lower, upper, -problem.velocity[::-1],
        problem.acceleration[::-1], problem.least[::-1], problem.most[::-1], problem.total,
    )  # fmt: skip
    control = start.control + problem.waypoints[:-1, :, None] - problem.waypoints[1:, :, None]
    return other, Spline(start.durations[::-1], -start.velocity[::-1], start.acceleration[::-1], control[::-1, :, ::-1])


def mirrored(problem, start):
    """The same with all directions turned."""
    changes = {n: -getattr(problem, n) for n in ("waypoints", "velocity", "acceleration")}
    other = replace(problem, lower=-problem.upper, upper=-problem.lower, **changes)
    return other, Spline(start.durations, -start.velocity, -start.acceleration, -start.control)


@pytest.mark.parametrize("total", [None, 8.0])
@pytest.mark.parametrize("law", ["permuted", "reversed", "mirrored"])
def test_laws(law, total):
    problem, start, _ = random_problem(12, 3, 3, 6, True, True, total)
    ours = solve(problem, start, 1e-8, 200)
    durations, shares = ours.spline.durations, ours.shares
    if law == "permuted":
        other, shares = permuted(problem, start, [2, 0, 1]), shares[:, [2, 0, 1]]
    elif law == "reversed":
        other, durations, shares = reversed_time(problem, start), durations[::-1], shares[::-1]
    else:
        other = mirrored(problem, start)
    theirs = solve(*other, 1e-8, 200)
    assert ours.solved and theirs.solved
    np.testing.assert_allclose(theirs.spline.durations, durations, rtol=1e-6)
    np.testing.assert_allclose(theirs.shares, shares, rtol=1e-3, atol=1e-4)


def test_shares_add_up():
    """Each joint's part of a duration's multiplier: together the duration itself, where no bound of it is active."""
    for seed in range(3):
        problem, start, _ = random_problem(seed, 4, 3, 6)
        found = solve(problem, start, 1e-8, 200)
        np.testing.assert_allclose(found.shares.sum(axis=1), 1.0, atol=1e-5)


@pytest.mark.parametrize("first", [0, 1, 2])
def test_given_durations_are_kept(first):
    problem, start, _ = random_problem(21, 3, 2, 6)
    free = solve(problem, start, 1e-8, 200).spline
    problem.least[first] = problem.most[first] = 1.2 * free.durations[first]
    found = solve(problem, start, 1e-8, 200)
    assert found.solved
    assert found.spline.durations[first] == pytest.approx(problem.least[first], rel=1e-12)
    theirs = by_ipopt(tightened(problem), start)
    assert found.spline.durations.sum() == pytest.approx(theirs.durations.sum(), rel=1e-6)
    assert found.spline.durations.sum() >= free.durations.sum()
    assert excess(problem, found.spline) <= 1e-8


def test_bounds_of_durations_and_states_are_kept():
    problem, start, _ = random_problem(22, 4, 2, 6)
    free = solve(problem, start, 1e-8, 200).spline
    problem.least[1] = 1.3 * free.durations[1]
    problem.velocity[1, 0], problem.acceleration[2, 1] = 0.5 * free.velocity[1, 0], 0.0
    longest = solve(problem, start, 1e-8, 200).spline.durations.argmax()
    problem.most[longest] = 0.97 * solve(problem, start, 1e-8, 200).spline.durations[longest]
    found = solve(problem, start, 1e-8, 200)
    assert found.solved
    theirs = by_ipopt(tightened(problem), start)
    assert found.spline.durations.sum() == pytest.approx(theirs.durations.sum(), rel=1e-6)
    assert (found.spline.durations >= problem.least * (1 - 1e-9)).all()
    assert found.spline.durations[longest] == pytest.approx(problem.most[longest], rel=1e-6)
    assert excess(problem, found.spline) <= 1e-8


def test_what_no_motion_keeps_is_not_solved():
    problem, start, _ = random_problem(23)
    problem.least[:], problem.most[:] = 1e-4, 1e-2  # much too short
    assert not solve(problem, start, 1e-5, 100).solved
