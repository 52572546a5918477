"""The statements against dense linear algebra and quadrature, without any solver of ours (but Clarabel's answers)."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_matrix

from planner import Trajectory
from planner.solvers import BACKENDS
from planner.solvers.qp import solve_qp
from problems.banded_qp import BandedQP, KKTPoint
from problems.minimum_derivative import MinimumDerivative
from problems.path_timing import PathTiming
from problems.rest_to_rest import SegmentTimes


def random_statement(seed, gaps=5, dims=2, order=3):
    rng = np.random.default_rng(seed)
    states = np.full((order, gaps + 1, dims), np.nan)
    states[0] = 0.0
    states[1:, [0, -1]] = rng.normal(size=(order - 1, 2, dims))
    return MinimumDerivative(rng.uniform(0.3, 2, gaps), rng.normal(size=(gaps + 1, dims)), states), rng


def bounded(seed, cones=(), count=4, room=0.1):
    """Return a program with rows and cones, and a point well inside."""
    statement, rng = random_statement(seed)
    base = statement.program()
    n, m = statement.size, count + sum(cones)
    rows, inside = csr_matrix(rng.normal(size=(m, n))), rng.normal(size=n)
    slack = rng.normal(size=m)
    slack[:count] = room * rng.random(count)
    at = count
    for size in cones:
        slack[at] = np.linalg.norm(slack[at + 1 : at + size]) + room
        at += size
    upper = rows @ inside + slack
    return BandedQP(base.bands, base.gradient, base.constant, rows, upper, cones), inside, rng


@pytest.mark.parametrize("gaps", [1, 2, 3, 6])
@pytest.mark.parametrize("order", [2, 3, 4])
def test_the_cost_is_the_integral(gaps, order):
    """1/2 y'Hy + g'y + c is the integral of the squared derivative for any node states."""
    statement, rng = random_statement(gaps, gaps, order=order)
    y = rng.normal(size=statement.size)
    times = np.concatenate([[0], np.cumsum(statement.h)])
    motion = Trajectory.from_hermite(times, statement.reference, *statement.filled(y)[1:])
    assert statement.program().value(y) == pytest.approx(motion.squared_integral(order), rel=1e-10)


def test_the_free_minimum_solves_the_dense_system():
    program = random_statement(2)[0].program()
    dense = program.hessian().toarray()
    np.testing.assert_allclose(dense, dense.T)
    assert np.linalg.eigvalsh(dense).min() > 0
    np.testing.assert_allclose(program.free_minimum(), np.linalg.solve(dense, -program.gradient), rtol=1e-9)


@given(st.integers(0, 2**32 - 1), st.lists(st.integers(1, 4), max_size=3))
def test_the_dual_value_is_below_every_feasible_value(seed, cones):
    program, inside, rng = bounded(seed, tuple(cones))
    value = program.value(inside)
    nothing = program.dual_value(np.zeros(len(program.upper)))
    assert nothing == pytest.approx(program.value(program.free_minimum()), abs=1e-9 * abs(program.constant))
    for size in (1e-2, 1, 1e2):
        z = size * rng.normal(size=len(program.upper))
        held = program.dual_feasible(z)
        np.testing.assert_array_equal(program.dual_feasible(held), held)
        room = 1e-9 * (abs(value) + abs(program.dual_value(z)))
        assert program.dual_value(z) == program.dual_value(held) <= value + room
        best = program.best_dual_value(z)
        assert max(program.dual_value(z), nothing) - room <= best <= value + room
        for t in 10 ** rng.uniform(-3, 3, 5):
            assert program.dual_value(t * held) <= best + room
        if not cones:
            assert program.dual_value(-held) == nothing  # a negative multiplier proves nothing
    both = KKTPoint((program, program), (inside, inside), (0 * z, 0 * z), np.array([2.0, 3.0]))
    assert both.lower_bound() == pytest.approx(5 * nothing)


def test_contradictory_rows_have_no_bound():
    base = random_statement(0)[0].program()
    first = np.eye(len(base.gradient))[:1]
    rows = csr_matrix(np.concatenate([first, -first]))
    program = BandedQP(base.bands, base.gradient, base.constant, rows, np.array([-1.0, -1.0]))
    assert program.best_dual_value(np.ones(2)) > 1e12 * program.constant
    kept = BandedQP(base.bands, base.gradient, base.constant, rows, np.array([1.0, 1.0]))
    assert kept.best_dual_value(np.ones(2)) == kept.dual_value(np.zeros(2))


@given(st.integers(0, 2**32 - 1), st.lists(st.integers(1, 4), max_size=3))
def test_residuals_are_zero_at_the_optimum_only(seed, cones):
    """By Clarabel's answer; there the dual value is the value, and any step away shows."""
    program, inside, rng = bounded(seed, tuple(cones))
    clarabel = next(b for b in BACKENDS if b.name == "clarabel")
    found = solve_qp(program, clarabel)
    assert max(program.residuals(found.y, found.z).values()) < 1e-6
    assert program.dual_value(found.z) == pytest.approx(program.value(found.y), rel=1e-6)
    assert program.value(found.y) <= program.value(inside) * (1 + 1e-9)
    step = rng.normal(size=len(found.y))
    away = program.residuals(found.y + 0.3 * step / np.linalg.norm(step), found.z)
    assert max(away.values()) > 1e-4
    assert max(program.residuals(found.y, found.z + 10.0).values()) > 1e-4
    total = KKTPoint((program,), (found.y,), (found.z,), np.ones(1))
    assert total.residuals() == program.residuals(found.y, found.z)


def test_residuals_of_known_points():
    program = random_statement(3)[0].only(0).program()
    best = program.free_minimum()
    assert program.residuals(best, np.zeros(0))["dual"] < 1e-12
    assert program.residuals(best + 0.1, np.zeros(0))["dual"] > 1e-3
    rows = csr_matrix(np.eye(len(best))[:1])
    tight = BandedQP(program.bands, program.gradient, 0.0, rows, best[:1] - 1)
    assert tight.residuals(best, np.zeros(1))["primal"] == pytest.approx(1)
    cone = BandedQP(program.bands, program.gradient, 0.0, csr_matrix((3, len(best))), np.array([1.0, 3.0, 4.0]), (3,))
    assert cone.residuals(best, np.zeros(3))["primal"] == pytest.approx(4)


@pytest.mark.parametrize("cones", [(), (3,), (1, 2)])
def test_exports_state_the_same_program(cones):
    import casadi as ca

    program, inside, rng = bounded(5, cones)
    text = str(program)
    assert f"y: {len(inside)}" in text and "linear rows: 4" in text and ("cones" in text) == bool(cones)
    posed = program.to_casadi()
    both = ca.Function("f", [posed["x"]], [posed["f"], posed["g"]])
    for y in (inside, rng.normal(size=len(inside))):
        value, rows = (np.asarray(v).ravel() for v in both(y))
        slack = program.upper - program.rows @ y
        assert value[0] == pytest.approx(program.value(y), rel=1e-10)
        expected = list(slack[:4])
        at = 4
        for size in cones:
            expected += [slack[at], slack[at] ** 2 - slack[at + 1 : at + size] @ slack[at + 1 : at + size]]
            at += size
        np.testing.assert_allclose(rows, expected, rtol=1e-9, atol=1e-9)
    if cones:
        with pytest.raises(ValueError, match="cones"):
            program.to_qpsolvers()
        return
    other = program.to_qpsolvers()
    np.testing.assert_allclose(other.P.toarray(), program.hessian().toarray())
    np.testing.assert_array_equal(other.q, program.gradient)
    np.testing.assert_allclose(other.G @ inside - other.h, program.rows @ inside - program.upper)
    without = BandedQP(program.bands, program.gradient, program.constant, program.rows[:0], program.upper[:0])
    assert without.to_qpsolvers().G is None


def test_stops_add_up():
    bound = SegmentTimes(np.array([[1.0, 2.0], [3.0, 0.5]]), np.array([0.0, 4.0]), 0.0)
    assert bound.lower_bound() == 6
    assert SegmentTimes(bound.shortest, bound.least, 7.0).lower_bound() == 7


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
