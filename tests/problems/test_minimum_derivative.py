"""Minimum acceleration, jerk and snap as stated, against quadrature and evaluation of the curves themselves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner import Trajectory
from problems.minimum_derivative import MinimumDerivative, element_cost, hermite_basis

SEEDS = st.integers(0, 2**32 - 1)


def made(seed, order=None, bound=None):
    """Return a statement with any of the node states given, counting from anything, and random unknowns."""
    rng = np.random.default_rng(seed)
    k = order or int(rng.integers(2, 5))
    gaps, dims, periodic = int(rng.integers(1, 7)), int(rng.integers(1, 4)), bool(rng.random() < 0.3)
    shape = (k, gaps + 1, dims)
    states = np.where(rng.random(shape) < rng.choice([0.2, 0.5, 0.9]), rng.normal(size=shape), np.nan)
    states[0, 0] = 0.0
    base = rng.normal(size=shape) if rng.random() < 0.5 else None
    if periodic:
        states[1:, -1] = states[1:, 0]
        if base is not None:
            base[1:, -1] = base[1:, 0]
    bound = bool(rng.random() < 0.5) if bound is None else bound
    h, reference = 10 ** rng.uniform(-1, 1, gaps), rng.normal(size=shape[1:])
    statement = MinimumDerivative(h, reference, states, periodic, bound, base)
    return statement, rng.normal(size=statement.size), rng


def motion_of(statement, y):
    states = statement.filled(y)
    breaks = np.concatenate([[0], np.cumsum(statement.h)])
    return Trajectory.from_states(breaks, statement.reference + states[0], np.ascontiguousarray(states[1:]))


@pytest.mark.parametrize("order", [2, 3, 4])
def test_the_element_is_the_integral(order):
    """Bᵀ takes derivatives at 0 and 1 and back; w'Qw is the integral, by quadrature."""
    basis, rng = hermite_basis(order), np.random.default_rng(order)
    w = rng.normal(size=2 * order)
    poly = np.polynomial.Polynomial(basis @ w)
    ends = [poly.deriv(r)(u) if r else poly(u) for u in (0, 1) for r in range(order)]
    np.testing.assert_allclose(ends, w, rtol=1e-9, atol=1e-9)
    u, weights = np.polynomial.legendre.leggauss(order)
    integral = 0.5 * weights @ poly.deriv(order)(0.5 * (u + 1)) ** 2
    assert w @ element_cost(order) @ w == pytest.approx(integral, rel=1e-12)


@given(SEEDS)
def test_the_value_is_the_integral(seed):
    """1/2 y'Hy + g'y + c is the integral for any unknowns, whatever is given and wherever they count from."""
    statement, y, _ = made(seed)
    motion, program = motion_of(statement, y), statement.program()
    scale = abs(program.constant) + abs(program.gradient) @ abs(y) + abs(program.value(y))
    assert program.value(y) == pytest.approx(motion.squared_integral(statement.order), abs=1e-10 * scale)
    assert statement.program().constant == pytest.approx(
        motion_of(statement, 0 * y).squared_integral(statement.order), rel=1e-9
    )


@given(SEEDS)
def test_what_is_given_stays_given(seed):
    statement, y, _ = made(seed)
    filled = statement.filled(y)
    there = ~np.isnan(statement.states)
    np.testing.assert_array_equal(filled[there], statement.states[there])
    np.testing.assert_allclose(statement.unknowns(filled), y, rtol=1e-12, atol=1e-12)
    if statement.periodic:
        np.testing.assert_array_equal(filled[1:, 0], filled[1:, -1])
    free = np.isnan(statement.states)
    if statement.periodic:
        free[1:, -1] = False
    assert statement.size == free.sum()


@given(SEEDS)
def test_rows_are_derivatives(seed):
    statement, y, rng = made(seed)
    motion, count = motion_of(statement, y), 12
    gap = rng.integers(0, len(statement.h), count)
    u, order = rng.random(count), rng.integers(0, 2 * statement.order, count)
    along = rng.normal(size=(count, statement.dims)) * (rng.random((count, statement.dims)) < 0.7)
    matrix, constant = statement.rows(gap, u, order, along)
    for r in range(count):
        at = motion.breaks[gap[r]] + u[r] * statement.h[gap[r]]
        value = along[r] @ motion(min(at, motion.end), order[r])
        size = abs(matrix[r]) @ abs(y) + abs(constant[r]) + np.abs(motion.coefficients).max() / statement.h.min() ** 0
        jumps = order[r] >= statement.order and min(u[r], 1 - u[r]) < 1e-9
        assert jumps or (matrix[r] @ y)[0] + constant[r] == pytest.approx(value, rel=1e-8, abs=1e-8 * float(size[0]))


@given(SEEDS)
def test_the_base_changes_nothing_but_the_unknowns(seed):
    statement, y, rng = made(seed)
    other = statement.rebased(y)
    step = rng.normal(size=statement.size)
    np.testing.assert_allclose(other.filled(step), statement.filled(y + step), rtol=1e-12, atol=1e-12)
    a, b = other.program().value(step), statement.program().value(y + step)
    scale = abs(b) + statement.program().constant + other.program().constant
    assert a == pytest.approx(b, abs=1e-9 * scale)
    dense = statement.program().hessian().toarray()
    if statement.size and not statement.undetermined and np.linalg.cond(dense) < 1e10:
        once = statement.rebased(statement.program().free_minimum()).program()
        left = once.value(np.zeros(statement.size)) - once.value(once.free_minimum())
        assert left <= 1e-9 * scale


@given(SEEDS)
def test_joints_apart_or_together_cost_the_same(seed):
    """The order of the unknowns is a matter of the band; joints only meet in rows."""
    apart, _, _ = made(seed, bound=False)
    together, y, _ = made(seed, bound=True)
    filled = together.filled(y)
    value = together.program().value(y)
    scale = abs(value) + together.program().constant + 1e-300
    assert apart.program().value(apart.unknowns(filled)) == pytest.approx(value, abs=1e-9 * scale)
    singles = [apart.only(d) for d in range(apart.dims)]
    parts = [s.program().value(s.unknowns(filled[:, :, d : d + 1])) for d, s in enumerate(singles)]
    assert sum(parts) == pytest.approx(value, abs=1e-9 * scale)
    assert apart.width <= together.width or apart.dims == 1
    assert max(s.width for s in singles) <= apart.width


@given(SEEDS)
def test_the_band_holds_the_hessian(seed):
    statement, _, _ = made(seed)
    program = statement.program()
    dense = program.hessian().toarray()
    np.testing.assert_array_equal(dense, dense.T)
    assert statement.bands.shape == (statement.width + 1, statement.size)
    if statement.size:
        scale = np.sqrt(np.diag(dense))
        assert np.linalg.eigvalsh(dense / scale / scale[:, None]).min() > -1e-13
        nodes = 3 if statement.periodic else 2  # around a closed curve every other one is a neighbour
        if not (statement.periodic and np.isnan(statement.states[0, -1]).any()):
            assert statement.width < nodes * statement.order * statement.dims


def test_a_polynomial_left_open_is_told():
    """One waypoint and nothing else: any constant velocity costs nothing, and the one nearest to rest is taken."""
    states = np.full((3, 3, 1), np.nan)
    states[0, 0] = 0.0
    statement = MinimumDerivative(np.ones(2), np.zeros((3, 1)), states)
    assert statement.undetermined
    np.testing.assert_allclose(statement.filled(statement.program().free_minimum()), 0, atol=1e-9)
    states[0] = 0.0
    assert not MinimumDerivative(np.ones(2), np.zeros((3, 1)), states).undetermined
