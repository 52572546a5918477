"""The statements against dense linear algebra and quadrature, without any solver of ours."""

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from planner import Trajectory
from problems.banded_qp import BandedQP, DualPoint
from problems.minimum_jerk import MinimumJerk
from problems.path_timing import PathTiming
from problems.rest_to_rest import StopsAtWaypoints


def random_statement(seed, gaps=5, dims=2):
    rng = np.random.default_rng(seed)
    shape = (gaps + 1, dims)
    ends = rng.normal(size=(2, 2, dims))
    return MinimumJerk(rng.uniform(0.3, 2, gaps), rng.normal(size=shape), ends[0], ends[1]), rng


@pytest.mark.parametrize("gaps", [1, 2, 3, 6])
def test_the_cost_is_the_integral(gaps):
    """1/2 y'Hy + g'y + c is the integral of the squared jerk for any node states, joint by joint."""
    problem, rng = random_statement(gaps, gaps)
    y = rng.normal(size=(2 * (gaps - 1), 2))
    velocity, acceleration = problem.states(y)
    times = np.concatenate([[0], np.cumsum(problem.h)])
    for d in range(2):
        motion = Trajectory.from_hermite(times, problem.positions[:, [d]], velocity[:, [d]], acceleration[:, [d]])
        assert problem.joint(d).value(y[:, d]) == pytest.approx(motion.squared_integral(3), rel=1e-10)


def test_a_row_is_the_derivative():
    problem, rng = random_statement(1)
    y = rng.normal(size=(8, 2))
    velocity, acceleration = problem.states(y)
    times = np.concatenate([[0], np.cumsum(problem.h)])
    motion = Trajectory.from_hermite(times, problem.positions, velocity, acceleration)
    for gap in range(5):
        for order in range(4):
            u = float(rng.uniform(0.01, 0.99))
            indices, values, constant = problem.row(gap, u, order, 1)
            at = times[gap] + u * problem.h[gap]
            assert constant + np.dot(values, y[indices, 1]) == pytest.approx(motion(at, order)[1], rel=1e-9, abs=1e-9)


def test_the_free_minimum_solves_the_dense_system():
    problem, _ = random_statement(2)
    program = problem.joint(0)
    dense = program.hessian().toarray()
    np.testing.assert_allclose(dense, dense.T)
    assert np.linalg.eigvalsh(dense).min() > 0
    np.testing.assert_allclose(program.free_minimum(), np.linalg.solve(dense, -program.gradient), rtol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_the_dual_value_is_below_every_feasible_value(seed):
    rng = np.random.default_rng(seed)
    base = random_statement(seed)[0].joint(0)
    n = len(base.gradient)
    rows = csr_matrix(rng.normal(size=(4, n)))
    inside = rng.normal(size=n)
    program = BandedQP(base.bands, base.gradient, base.constant, rows, rows @ inside + 0.1)
    for _ in range(10):
        z = rng.uniform(0, 100, 4)
        assert program.dual_value(z) <= program.value(inside) + 1e-9
        assert program.dual_value(-z) == program.dual_value(np.zeros(4))  # a negative multiplier proves nothing
    assert program.dual_value(np.zeros(4)) == pytest.approx(program.value(program.free_minimum()), rel=1e-9)
    both = DualPoint((program, base), (np.zeros(4), np.zeros(0)), np.array([2.0, 3.0]))
    assert both.lower_bound() == pytest.approx(5 * program.dual_value(np.zeros(4)))


def test_residuals_are_zero_at_the_optimum_only():
    program = random_statement(3)[0].joint(0)
    best = program.free_minimum()
    assert program.residuals(best, np.zeros(0))["dual"] < 1e-12
    assert program.residuals(best + 0.1, np.zeros(0))["dual"] > 1e-3
    rows = csr_matrix(np.eye(len(best))[:1])
    tight = BandedQP(program.bands, program.gradient, 0.0, rows, best[:1] - 1)
    assert tight.residuals(best, np.zeros(1))["primal"] == pytest.approx(1)


def test_stops_add_up():
    bound = StopsAtWaypoints(np.array([[1.0, 2.0], [3.0, 0.5]]), np.array([0.0, 4.0]), 0.0)
    assert bound.lower_bound() == 6
    assert StopsAtWaypoints(bound.shortest, bound.least, 7.0).lower_bound() == 7


def line_timing(jerk, n=40):
    """One joint, q(s) = s on [0, 1], as a path-timing statement."""
    derivatives = np.zeros((2, 3, n, 1))
    derivatives[:, 0] = 1.0
    limits = np.array([[10.0], [1.0], [5.0]])
    return PathTiming(np.full(n, 1 / n), derivatives, -limits, limits, jerk)


def test_path_timing_reads_constant_acceleration():
    problem = line_timing(jerk=False)
    s = np.arange(1, 40) / 40
    a = 2 * np.minimum(s, 1 - s)  # bang-bang with acceleration 1: sdot² = 2 s
    speed, _, steps = problem.read(a)
    assert steps.sum() == pytest.approx(2, rel=1e-12) and speed[0] == speed[-1] == 0
    assert problem.fastest() == pytest.approx(np.full(39, 100.0))


def test_path_timing_rows_accept_the_closed_form_and_no_faster():
    import casadi as ca

    problem = line_timing(jerk=False)
    s = np.arange(1, 40) / 40
    a = 2 * np.minimum(s, 1 - s)
    posed = problem.to_casadi(a, np.zeros(39))
    rows = ca.Function("g", [posed["x"]], [posed["g"]])
    value = np.asarray(rows(a)).ravel()
    assert (value <= posed["ubg"] + 1e-12).all() and (value >= posed["lbg"] - 1e-12).all()
    value = np.asarray(rows(1.01 * a)).ravel()
    assert (value > posed["ubg"] + 1e-3).any()


def test_path_timing_with_jerk_has_consistent_rows():
    """A law of constant path jerk out of rest and into it satisfies the equality rows of the transcription."""
    import casadi as ca

    problem = line_timing(jerk=True, n=3)
    h = 1 / 3
    a1 = 0.7
    b1, b2 = 2 * a1 / (3 * h), -2 * a1 / (3 * h)
    posed = problem.to_casadi(np.array([a1, a1]), np.array([b1, b2]))
    value = np.asarray(ca.Function("g", [posed["x"]], [posed["g"]])([a1, a1, b1, b2])).ravel()
    np.testing.assert_allclose(value[:3], 0, atol=1e-12)
    speed, acceleration, steps = problem.read(np.array([a1, a1, b1, b2]))
    jerk = 2 * a1**1.5 / (9 * h**2)
    assert steps[0] == pytest.approx((6 * h / jerk) ** (1 / 3)) and acceleration[1] == pytest.approx(jerk * steps[0])
    assert speed[1] == pytest.approx(0.5 * jerk * steps[0] ** 2)
