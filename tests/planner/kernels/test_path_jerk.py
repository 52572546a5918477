"""The jerk-limited program: splines against SciPy's, the answer against an optimum's conditions, IPOPT and Clarabel."""

import clarabel
import numpy as np
import pytest
from scipy import sparse
from scipy.interpolate import BSpline

from planner import PlanRequest
from planner.kernels.path_jerk import solve_profile, spline_maps
from planner.paths import PathOptions, build_path
from planner.timing import second_order, third_order
from planner.timing.following import cut_at_corners
from planner.timing.grids import initial_grid
from planner.timing.path_bounds import dual_value

NODES = np.array([0.0, 0.1, 0.4, 0.45, 1.0, 2.0, 2.1])


def spline(nodes, y):
    return BSpline(np.concatenate([[nodes[0]] * 2, nodes, [nodes[-1]] * 2]), y, 2)


@pytest.mark.parametrize("nodes", [NODES, NODES[:2], NODES[:3], 1e3 + NODES, np.linspace(0, 1, 41) ** 3])
def test_maps_are_mean_slope_and_curvature(nodes):
    """Of a = sdot²: its mean, and half its first (middle) and second derivative; scale and place are nothing."""
    m = len(nodes) - 1
    y, maps = np.random.default_rng(m).uniform(1, 2, m + 2), np.empty((m, 3, 3))
    spline_maps(nodes, np.zeros(2), maps)
    found = np.stack([maps[k] @ y[k : k + 3] for k in range(m)])
    a, middles = spline(nodes, y), 0.5 * (nodes[1:] + nodes[:-1])
    mean = np.array([a.integrate(p, q) / (q - p) for p, q in zip(nodes[:-1], nodes[1:], strict=True)])
    np.testing.assert_allclose(found[:, 0], mean, rtol=1e-8)
    np.testing.assert_allclose(found[:, 1], 0.5 * a(middles, 1), rtol=1e-8, atol=1e-8 * np.abs(found[:, 1]).max())
    scale = np.abs(found[:, 2]).max()
    np.testing.assert_allclose(found[:, 2], 0.5 * a(middles, 2), rtol=1e-7, atol=1e-8 * scale)
    np.testing.assert_allclose(maps[:, 0].sum(axis=1), 1.0, rtol=1e-9)  # a constant is its own mean
    np.testing.assert_allclose(maps[:, 1].sum(axis=1), 0.0, atol=1e-9 * np.abs(maps[:, 1]).max())


def test_folded_ends():
    """An outermost coefficient that is a multiple of its neighbour gives the same forms when it is folded into it."""
    m, ratios = len(NODES) - 1, np.array([0.4, 0.7])
    plain, folded = np.empty((m, 3, 3)), np.empty((m, 3, 3))
    spline_maps(NODES, np.zeros(2), plain)
    spline_maps(NODES, ratios, folded)
    y = np.random.default_rng(0).uniform(1, 2, m + 2)
    full, short = y.copy(), y.copy()
    full[0], full[-1] = ratios[0] * y[1], ratios[1] * y[-2]
    short[0] = short[-1] = 0.0
    for k in range(m):
        np.testing.assert_allclose(folded[k] @ short[k : k + 3], plain[k] @ full[k : k + 3], rtol=1e-12, atol=1e-9)


def posed(seed, stations, start=0.0, end=0.0, scale=1.0, joints=3, tight=1.0):
    """Return the program of a random path, and a profile to begin with."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(int(rng.integers(2, 6)), joints))
    curve = build_path(PathOptions().path, points).curve
    limits = {
        name: (size * rng.uniform(0.7, 1.3, joints) * scale**power * tight).tolist()
        for power, (name, size) in enumerate((("velocity", 1.0), ("acceleration", 3.0), ("jerk", 30.0)), 1)
    }
    fastest = [0.1 * scale * s / np.abs(curve(at, 1)).max() for s, at in ((start, curve.start), (end, curve.end))]
    path = build_path(PathOptions().path, points)
    states = [(float(v), 0.0) for v in fastest]
    course = cut_at_corners(path, PlanRequest.of(points, limits=limits), *states)[0]
    grid = initial_grid(course.curve, stations)
    shares = np.ones((4, len(grid) - 1, joints))
    ceiling = second_order.fastest_profile(course.without_jerk(), grid, shares)
    return third_order.pose(course, grid, shares, ceiling), third_order.first_guess(ceiling)


class Rows:
    """The program written out once more, dense: its slacks and objective by y."""

    def __init__(self, problem):
        p, m = problem, len(problem.maps)
        pushes, rows, width = p.sizes
        self.p, self.m, self.pushes, self.rows = p, m, pushes, rows
        self.h = np.diff(p.nodes)
        self.e = p.forms.reshape(rows, 3, width)[:, :, :m]
        self.inverse = p.inverse.reshape(rows, 2, width)[:, :, :m]
        self.over_caps = p.over_caps[:m]
        self.free = np.flatnonzero(~p.fixed)
        self.abc = np.zeros((3 * m, m + 2))  # rows by form, then interval
        for k in range(m):
            for r in range(3):
                self.abc[r * m + k, k : k + 3] = p.maps[k, r]
        self.lines = (
            np.concatenate(  # (rows, 2, m, m + 2)
                [[(self.e[r, i, :, None] * self.abc[i * m : (i + 1) * m]) for i in range(3)] for r in range(rows)]
            )
            .reshape(rows, 3, m, m + 2)
            .sum(axis=1)
        )

    def means(self, y):
        return self.abc[: self.m] @ y

    def slacks(self, y):
        """Return those of pushes, of jolts over sqrt(A), of caps, of the ends."""
        value = (self.lines @ y)[:, None] * self.inverse
        a = self.means(y)
        ends = [1 - s * y[at] / cap for (s, _, cap, _), at in zip(self.p.ends, (1, -2), strict=True) if s > 0]
        return 1 - value[: self.pushes], a**-0.5 - value[self.pushes :], 1 - a * self.over_caps, np.array(ends)

    def objective(self, y, price=(1.0, 0.0)):
        a, b = self.means(y), self.abc[self.m : 2 * self.m] @ y
        ends = sum(
            price[0] * t / np.sqrt(s * y[at]) + price[1] * f * (s * y[at]) ** 1.5
            for (s, t, _, f), at in zip(self.p.ends, (1, -2), strict=True)
            if s > 0
        )
        return float((self.h * (price[0] + price[1] * b * b) / np.sqrt(a)).sum() + ends)


@pytest.mark.parametrize("price", [0.0, 0.3])
@pytest.mark.parametrize(("start", "end"), [(0.0, 0.0), (1.0, 0.0), (0.0, 2.0), (1.0, 1.0)])
@pytest.mark.parametrize("seed", range(4))
def test_feasible_from_all_ends_and_better_than_the_guess(seed, start, end, price):
    problem, guess = posed(seed, 60, start, end)
    rows = Rows(problem)
    found = third_order.solve(problem, guess, (1.0, price), 1e-8)
    for slack in rows.slacks(found.values):
        assert slack.size == 0 or slack.min() >= 0.0
    assert (found.values[rows.free] > 0).all() and (rows.means(found.values) > 0).all()
    for end_, at, beside, step in ((problem.first, 0, 1, rows.h[0]), (problem.last, -1, -2, rows.h[-1])):
        if end_.fixed is not None:  # given coefficients stay
            assert found.values[at] == end_.fixed[0]
            assert found.values[beside] == end_.fixed[0] + end_.fixed[1] * step
    for share in (0.999, 0.99, 0.9):  # moving towards any slower profile is no better
        slower = found.values.copy()
        slower[rows.free] *= share
        assert rows.objective(slower, (1.0, price)) >= rows.objective(found.values, (1.0, price)) or price > 0


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("price", [0.0, 0.1])
def test_the_conditions_of_an_optimum_hold(seed, price):
    """Stationarity of the true Lagrangian, complementarity, no negative multiplier; written out again, densely."""
    problem, guess = posed(seed, 40)
    rows, m = Rows(problem), len(problem.maps)
    found = third_order.solve(problem, guess, (1.0, price), 1e-11)
    y, value = found.values, rows.objective(found.values, (1.0, price))
    lam = found.multipliers[0]
    count, width = problem.sizes[1], problem.sizes[2]
    sides = lam[: 2 * count * width].reshape(count, 2, width)[:, :, :m]
    caps, singles = lam[2 * count * width :][:m], found.multipliers[1]
    assert min(sides.min(), caps.min(), singles.min()) >= 0.0
    gradient = np.zeros(m + 2)
    for i in rows.free:  # the objective's, by complex step
        moved = y.astype(complex)
        moved[i] += 1e-30j
        a, b = rows.abc[:m] @ moved, rows.abc[m : 2 * m] @ moved
        total = (rows.h * (1.0 + price * b * b) / np.sqrt(a)).sum()
        for (s, t, _, f), at in zip(problem.ends, (1, -2), strict=True):
            total += t / np.sqrt(s * moved[at]) + price * f * (s * moved[at]) ** 1.5 if s > 0 else 0.0
        gradient[i] = total.imag / 1e-30
    size = np.abs(gradient * y).sum()
    pulls = (sides * rows.inverse).sum(axis=1)
    gradient += np.einsum("rk,rkc->c", pulls, rows.lines) + (caps * rows.over_caps) @ rows.abc[:m]
    jolts = sides[rows.pushes :].sum(axis=(0, 1))
    gradient += (0.5 * jolts * rows.means(y) ** -1.5) @ rows.abc[:m]
    for (share, _, cap, _), at, single in zip(problem.ends, (1, -2), singles[:2], strict=True):
        if share > 0:
            gradient[at] += single * share / cap
    gradient[rows.free] -= singles[2:][rows.free]
    assert np.abs(gradient * y)[rows.free].max() <= 1e-3 * size  # it stops by its gap, not by its gradient
    push, jolt, cap, _ = rows.slacks(y)
    gap = (sides[: rows.pushes] * push).sum() + (sides[rows.pushes :] * jolt).sum() + (caps * cap).sum()
    assert 0 <= gap <= 1e-7 * value


def test_an_infeasible_start_is_told():
    problem, guess = posed(0, 40)
    rows, width = problem.sizes[1], problem.sizes[2]
    m = len(problem.maps)
    steps = np.zeros(width)
    steps[:m] = np.diff(problem.nodes)
    for y in (np.full(m + 2, 1e9), np.zeros(m + 2), np.full(m + 2, -1.0), np.full(m + 2, np.nan)):
        count, _ = solve_profile(
            problem.sizes, steps, problem.maps, problem.fixed, problem.forms, problem.inverse, problem.over_caps,
            problem.ends, np.array([1.0, 0.0]), y, np.empty((2 * rows + 1) * width), np.zeros(m + 4),
            0.1, 1e-4, 1e-8, 50,
        )  # fmt: skip
        assert count == -1


@pytest.mark.parametrize("scale", [1e-4, 1.0, 100.0])
def test_time_scales_are_nothing(scale):
    problem, guess = posed(3, 50, scale=scale)
    once, _ = posed(3, 50)
    base = Rows(once).objective(third_order.solve(once, guess / scale**2, (1.0, 0.0), 1e-9).values)
    ours = Rows(problem).objective(third_order.solve(problem, guess, (1.0, 0.0), 1e-9).values)
    assert ours * scale == pytest.approx(base, rel=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_against_ipopt_on_the_very_same_program(seed):
    import casadi as ca

    problem, guess = posed(seed, 50)
    rows = Rows(problem)
    ours = third_order.solve(problem, guess, (1.0, 0.0), 1e-10)
    best, m = rows.objective(ours.values), rows.m
    begin = 0.5 * ours.values[rows.free]
    unit = ours.values[rows.free]
    x = ca.SX.sym("x", len(rows.free))
    y = ca.mtimes(ca.DM(sparse.csc_matrix(np.eye(m + 2)[:, rows.free] * unit)), x)
    a = ca.mtimes(ca.DM(sparse.csc_matrix(rows.abc[:m])), y)
    time = ca.dot(ca.DM(rows.h), a**-0.5)
    for (share, seconds, _, _), at in zip(problem.ends, (1, m), strict=True):
        if share > 0:
            time += seconds / ca.sqrt(share * y[at])
    limits = [1 - a * rows.over_caps]
    for r in range(rows.rows):
        value = ca.mtimes(ca.DM(sparse.csc_matrix(rows.lines[r])), y)
        free = 1 if r < rows.pushes else 1.0
        root = 1 if r < rows.pushes else ca.sqrt(a)
        limits += [free - root * value * ca.DM(rows.inverse[r, side]) for side in range(2)]
    for (share, _, cap, _), at in zip(problem.ends, (1, m), strict=True):
        if share > 0:
            limits.append(1 - share * y[at] / cap)
    quiet = {"ipopt.print_level": 0, "print_time": False, "ipopt.tol": 1e-10, "ipopt.sb": "yes"}
    g = ca.vertcat(*limits)
    solver = ca.nlpsol("s", "ipopt", {"x": x, "f": time, "g": g}, quiet | {"ipopt.max_iter": 500})
    found = solver(x0=begin / unit, lbx=1e-9, lbg=0, ubg=ca.inf)
    assert solver.stats()["success"]
    assert best == pytest.approx(float(found["f"]), rel=1e-5)
    assert dual_value(ours) <= min(best, float(found["f"])) * (1 + 1e-7)


def relaxed(rows, unit):
    """Return the optimum of the relaxation sum h t, t >= A^(-1/2), jolts below t times the limit, by Clarabel.

    t >= A^(-1/2) is the power cone t^(2/3) A^(1/3) >= 1. ``unit``: sizes of the coefficients.
    """
    p, m, n = rows.p, rows.m, rows.m + 2
    sides = [i for i in range(2) if p.ends[i, 0] > 0]
    size = n + m + len(sides)
    cost = np.concatenate([np.zeros(n), rows.h, [p.ends[i, 1] for i in sides]])
    parts, right = [], []

    def keep(on_y, on_t, bound):  # on_y y + on_t t <= bound
        parts.append(np.hstack([on_y, on_t, np.zeros((len(on_y), len(sides)))]))
        right.append(bound)

    for r in range(rows.rows):
        for side in range(2):
            bounded = rows.inverse[r, side] != 0
            line = (rows.lines[r] * rows.inverse[r, side][:, None])[bounded]
            t = np.zeros_like(np.eye(m)) if r < rows.pushes else -np.eye(m)
            keep(line, t[bounded], np.full(bounded.sum(), 1.0 if r < rows.pushes else 0.0))
    keep(rows.abc[:m] * rows.over_caps[:, None], np.zeros((m, m)), np.ones(m))
    keep(-np.eye(n)[rows.free], np.zeros((len(rows.free), m)), np.zeros(len(rows.free)))
    for i in sides:
        keep(p.ends[i, 0] / p.ends[i, 2] * np.eye(n)[[1 if i == 0 else m]], np.zeros((1, m)), np.ones(1))
    cones = [clarabel.NonnegativeConeT(sum(len(x) for x in right))]
    fixed = np.flatnonzero(p.fixed)
    equal = np.hstack([np.eye(n)[fixed], np.zeros((len(fixed), m + len(sides)))])
    for k in range(m + len(sides)):
        mean = rows.abc[k] if k < m else p.ends[sides[k - m], 0] * np.eye(n)[1 if sides[k - m] == 0 else m]
        block = np.zeros((3, size))
        block[0, n + k], block[1, :n] = -1.0, -mean
        parts.append(block)
        right.append(np.array([0.0, 0.0, 1.0]))
        cones.append(clarabel.PowerConeT(2 / 3))
    parts.append(equal)
    right.append(np.zeros(len(fixed)))
    cones.append(clarabel.ZeroConeT(len(fixed)))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-10
    dense = np.vstack(parts)
    dense[:, :n] *= unit
    matrix = sparse.csc_matrix(dense)
    answer = clarabel.DefaultSolver(
        sparse.csc_matrix((size, size)), cost, matrix, np.concatenate(right), cones, settings
    ).solve()
    assert "Solved" in str(answer.status), answer.status
    return answer.obj_val_dual


@pytest.mark.parametrize("seed", range(3))
def test_against_the_convex_relaxation_by_clarabel(seed):
    """A lower bound of every profile on the grid, and reached where the jolts' multipliers are small, as here."""
    problem, guess = posed(seed, 30)
    rows = Rows(problem)
    ours = third_order.solve(problem, guess, (1.0, 0.0), 1e-10)
    best, bound = rows.objective(ours.values), relaxed(rows, np.where(ours.values > 0, ours.values, 1.0))
    assert bound <= best * (1 + 1e-7)
    assert best == pytest.approx(bound, rel=1e-5)
    assert dual_value(ours) <= best * (1 + 1e-9)
    assert dual_value(ours) >= bound * (1 - 1e-2)


@pytest.mark.parametrize("tight", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("seed", range(5))
def test_dual_values_are_below(seed, tight):
    problem, guess = posed(seed, 40, tight=tight)
    for tolerance in (1e-2, 1e-4, 1e-10):  # true at any multipliers
        found = third_order.solve(problem, guess, (1.0, 0.0), tolerance)
        best = Rows(problem).objective(third_order.solve(problem, guess, (1.0, 0.0), 1e-10).values)
        assert dual_value(found) <= best * (1 + 1e-9)
