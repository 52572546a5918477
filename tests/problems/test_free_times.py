"""The statement of free durations: its variables, and its rows and cost against a trajectory's."""

import casadi as ca
import numpy as np
import pytest

from planner.trajectory import Trajectory
from problems.free_times import FreeDurations


@pytest.mark.parametrize("order", [2, 3, 4])
def test_rows_and_cost(order):
    rng = np.random.default_rng(order)
    n, dims = 4, 2
    points, states = rng.normal(size=(n, dims)), rng.normal(size=(order - 1, n, dims))
    ends = np.stack([states[:, 0], states[:, -1]])
    ends[0, 0, 1] = np.nan
    h, cost = rng.uniform(0.5, 2, n - 1), np.array([2.0, 3.0, 5.0])
    upper = np.full((4, n - 1, dims), np.inf)
    upper[:, :, 0] = 7.0
    problem = FreeDurations(points, order, ends, cost, -upper, upper)
    places = np.array([0.25, 0.5])
    posed = problem.to_casadi(h, states, places, ((1, 0.75, 2, 0),))
    for ours, given in zip(problem.read(posed["x0"]), (h, states), strict=True):
        np.testing.assert_allclose(ours, given)
    f, g = ca.Function("p", [posed["x"]], [posed["f"], posed["g"]])(posed["x0"])
    motion = Trajectory.from_hermite(np.concatenate([[0], np.cumsum(h)]), points, *states)
    each = [
        Trajectory(motion.breaks, motion.coefficients[:, :, d : d + 1]).squared_integral(order) for d in range(dims)
    ]
    assert float(f) == pytest.approx(cost @ [*each, motion.duration], rel=1e-9)
    t = motion.breaks[:-1]
    expected = [motion.duration]
    for m in range(4):
        expected += [motion(t + u * h, m)[:, 0] / 7.0 for u in places]
        if m == 2:
            expected.append(motion(t[1] + 0.75 * h[1], 2)[0] / 7.0)
    np.testing.assert_allclose(np.asarray(g).reshape(-1), np.hstack(expected), atol=1e-9)
    assert len(posed["lbg"]) == len(posed["ubg"]) == g.shape[0]
