"""The statement of the motion through waypoints as a program: its variables, rows and cost against SciPy's splines."""

import casadi as ca
import numpy as np
import pytest
from scipy.interpolate import BSpline

from problems.waypoint_casadi import from_x, orders
from problems.waypoint_timing import Spline, WaypointTiming


def random_problem(seed, count=3, dims=2, pieces=5, positions=True, total=None):
    rng = np.random.default_rng(seed)
    waypoints = rng.normal(size=(count + 1, dims))
    nodes = np.sort(rng.uniform(0, 1, (count, dims, pieces + 1)), axis=2)
    nodes[..., 0], nodes[..., -1] = 0.0, 1.0
    size = 10.0 ** rng.uniform(-1, 2, (4, 1, dims))
    lower, upper = (side * size * rng.uniform(1, 2, (4, count, dims)) for side in (-1, 1))
    lower[0], upper[0] = np.minimum(lower[0], -10), np.maximum(upper[0], 10)
    upper[0, 0, 0] = np.inf
    if not positions:
        lower[0], upper[0] = -np.inf, np.inf
    states = np.full((2, count + 1, dims), np.nan)
    states[:, [0, -1]] = rng.normal(size=(2, 2, dims))
    if count > 2:
        states[:, 1, -1] = rng.normal(size=2)
    least, most = rng.uniform(0.1, 0.5, count), np.full(count, np.inf)
    least[-1] = most[-1] = 0.7
    problem = WaypointTiming(waypoints, nodes, lower, upper, *states, least, most, total)
    start = Spline(
        rng.uniform(0.5, 2, count),
        rng.normal(size=(count + 1, dims)),
        rng.normal(size=(count + 1, dims)),
        rng.normal(size=(count, dims, pieces + 3)),
    )
    return problem, start, rng


def curve(problem, spline, i, d):
    """The motion of a joint on a segment over its time."""
    return BSpline(problem.knots()[i, d] * spline.durations[i], problem.waypoints[i, d] + spline.control[i, d], 3)


@pytest.mark.parametrize("count, dims, pieces", [(1, 1, 4), (1, 2, 5), (3, 2, 4), (4, 3, 7)])
def test_the_start_is_read_back(count, dims, pieces):
    problem, start, _ = random_problem(count, count, dims, pieces)
    posed = problem.to_casadi(start)
    assert len(posed["x0"]) == count + 2 * dims * (count - 1) + count * dims * (pieces - 3) == posed["x"].shape[0]
    read = from_x(problem, start, posed["x0"])
    np.testing.assert_allclose(read.durations[:-1], start.durations[:-1])
    assert read.durations[-1] == pytest.approx(0.7)
    for asked, given, found in (
        (problem.velocity, start.velocity, read.velocity),
        (problem.acceleration, start.acceleration, read.acceleration),
    ):
        np.testing.assert_allclose(found, np.where(np.isnan(asked), given, asked), rtol=1e-12)
    np.testing.assert_allclose(read.control[:, :, 3:pieces], start.control[:, :, 3:pieces])
    fixed = posed["lbx"] == posed["ubx"]
    assert fixed.sum() == 1 + np.isfinite(problem.velocity[1:-1]).sum() + np.isfinite(problem.acceleration[1:-1]).sum()
    np.testing.assert_allclose(posed["x0"][fixed], posed["lbx"][fixed])


@pytest.mark.parametrize("seed", range(4))
def test_any_x_is_a_motion_through_the_waypoints(seed):
    problem, start, rng = random_problem(seed, 3, 2, 4 + seed)
    posed = problem.to_casadi(start)
    spline = from_x(problem, start, posed["x0"] * rng.uniform(0.5, 2, len(posed["x0"])))
    for i in range(3):
        for d in range(2):
            q = curve(problem, spline, i, d)
            for end, at in ((i, 0.0), (i + 1, spline.durations[i])):
                expected = problem.waypoints[end, d], spline.velocity[end, d], spline.acceleration[end, d]
                np.testing.assert_allclose([q(at), q(at, 1), q(at, 2)], expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("positions", [False, True])
@pytest.mark.parametrize("total", [None, 3.0])
@pytest.mark.parametrize("seed", range(2))
def test_rows_and_cost(seed, total, positions):
    """Rows are what a spline leaves to its limits, in units, times powers of the duration's share."""
    problem, start, rng = random_problem(10 + seed, pieces=5 + seed, positions=positions, total=total)
    posed = problem.to_casadi(start)
    x = posed["x0"] * rng.uniform(0.5, 2, len(posed["x0"]))
    f, g = (np.asarray(v).reshape(-1) for v in ca.Function("p", [posed["x"]], [posed["f"], posed["g"]])(x))
    spline, h0, units, k = from_x(problem, start, x), start.durations, problem.units(), problem.pieces
    over, under, cost = [], [], 0.0
    for i in range(3):
        for d in range(2):
            q, eta = curve(problem, spline, i, d), spline.durations[i] / h0[i]
            inner = problem.nodes[i, d] * spline.durations[i]
            middles = 0.5 * (inner[1:] + inner[:-1])
            speeds, jerks = q.derivative(1).c[1 : k + 1], q(middles, 3)
            values = [speeds, q(inner[1:-1], 2), jerks] + ([q.c[1 : k + 2]] if positions else [])
            for m, value in zip((1, 2, 3, 0), values, strict=False):
                unit = units[m - 1, d] if m else units[0, d] * h0[i]
                for rows, limit in ((over, problem.upper[m, i, d]), (under, problem.lower[m, i, d])):
                    if np.isfinite(limit):
                        rows.append((value - limit) / unit * eta**m)
            cost += np.diff(inner) @ (jerks / units[2, d]) ** 2 / 2
    np.testing.assert_array_equal(orders(problem), np.repeat([1, 2, 3, 0][: len(values)], [len(v) for v in values]))
    expected = np.concatenate(over + under + ([] if total is None else [[spline.durations.sum() / h0.mean()]]))
    np.testing.assert_allclose(g, expected, rtol=1e-7, atol=1e-7 * np.abs(expected).max())
    duration = spline.durations.sum() / h0.mean()
    assert f[0] == pytest.approx(duration if total is None else cost / h0.mean(), rel=1e-9)
    n = sum(len(r) for r in over)
    assert (posed["ubg"][:n] == 0).all() and np.isneginf(posed["lbg"][:n]).all()
    m = n + sum(len(r) for r in under)
    assert (posed["lbg"][n:m] == 0).all() and np.isposinf(posed["ubg"][n:m]).all()
    assert (posed["lbg"][m:] == posed["ubg"][m:]).all()
    assert total is None or posed["ubg"][m] == pytest.approx(total / h0.mean())


def test_bounds_of_the_unknowns():
    problem, start, _ = random_problem(7)
    posed = problem.to_casadi(start)
    units, h0 = problem.units(), start.durations
    np.testing.assert_allclose(posed["lbx"][:3], problem.least / h0)
    np.testing.assert_allclose(posed["ubx"][:3], problem.most / h0)
    at = 3 + np.arange(8).reshape(2, 2, 2)  # waypoint, joint, velocity or acceleration
    for w in range(2):
        for d in range(2):
            for m, asked in enumerate((problem.velocity, problem.acceleration)):
                low, high = problem.lower[m + 1, w : w + 2, d].max(), problem.upper[m + 1, w : w + 2, d].min()
                if not np.isnan(asked[w + 1, d]):
                    low = high = asked[w + 1, d]
                found = posed["lbx"][at[w, d, m]], posed["ubx"][at[w, d, m]]
                np.testing.assert_allclose(found, (low / units[m, d], high / units[m, d]))
    assert np.isinf(posed["lbx"][11:]).all() and np.isinf(posed["ubx"][11:]).all()
