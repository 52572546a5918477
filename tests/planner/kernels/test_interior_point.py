"""The banded interior point against dense linear algebra and PIQP, on random programs of all widths."""

import numpy as np
import pytest
import qpsolvers
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_matrix

from planner.kernels.interior_point import INFEASIBLE, SOLVED, STALLED, factor, interior_point, substitute, times
from planner.smoothing.rounds import PUSHES
from planner.solvers import BACKENDS
from planner.solvers.qp import NoSolution, solve_qp
from problems.banded_qp import BandedQP

WIDTHS = st.integers(1, 27)
SEEDS = st.integers(0, 2**32 - 1)


def banded(rng, n, width):
    """Return a positive definite banded matrix, dense and as (n, width + 1)."""
    root = np.tril(rng.normal(size=(n, n)))
    root[np.subtract.outer(np.arange(n), np.arange(n)) > width] = 0.0
    dense = root @ root.T + 0.1 * np.eye(n)
    a = np.zeros((n, width + 1))
    for t in range(min(width, n - 1) + 1):
        a[t:, t] = np.diag(dense, -t)
    return dense, a


def program(rng, n, width, rows, room=0.3):
    """Return a program with rows inside the band, and a point that keeps them by ``room`` of random sizes."""
    dense, a = banded(rng, n, width)
    most = min(width + 1, n)
    columns = np.full((rows, most), -1, dtype=np.int64)
    values = np.zeros((rows, most))
    for r in range(rows):
        first = int(rng.integers(0, n - most + 1))
        chosen = np.sort(rng.choice(most, int(rng.integers(1, most + 1)), replace=False))
        columns[r, : len(chosen)], values[r, : len(chosen)] = first + chosen, rng.normal(size=len(chosen))
    matrix = np.zeros((rows, n))
    for r in range(rows):
        matrix[r, columns[r][columns[r] >= 0]] = values[r][columns[r] >= 0]
    inside = rng.normal(size=n)
    upper = matrix @ inside + room * rng.random(rows)
    return dense, a, rng.normal(size=n), columns, values, matrix, upper, inside


def solve(a, gradient, columns, values, upper, bends=None, offsets=None, kappa=None, ceiling=np.inf, scale=1.0):
    own = np.zeros_like(a)
    assert factor(a, own)
    y, z = np.zeros(len(gradient)), np.empty(len(upper))
    none = np.zeros(len(upper))
    curves = (np.zeros_like(values) if bends is None else bends, none if offsets is None else offsets)
    table = (columns, values, upper, *curves, none if kappa is None else kappa)
    for push in PUSHES:  # as the rounds do where it stalls
        y[:] = 0.0
        status, iterations = interior_point(a, own, gradient, *table, ceiling, scale, scale, push, 1e-11, 100, y, z)
        if status != STALLED:
            break
    return status, iterations, y, z


@given(SEEDS, st.integers(0, 27), st.integers(1, 60))
def test_factors_solve_and_multiply(seed, width, n):
    rng = np.random.default_rng(seed)
    dense, a = banded(rng, n, width)
    factors, x, out = np.zeros_like(a), rng.normal(size=n), np.empty(n)
    assert factor(a, factors)
    times(a, x, out)
    np.testing.assert_allclose(out, dense @ x, rtol=1e-11, atol=1e-11 * np.abs(dense).max())
    lower = np.zeros((n, n))
    for t in range(min(width, n - 1) + 1):
        lower += np.diag(factors[t:, t] if t else 1.0 / factors[:, 0], -t)
    np.testing.assert_allclose(lower @ lower.T, dense, atol=1e-12 * np.abs(dense).max())
    substitute(factors, out)
    np.testing.assert_allclose(out, x, rtol=1e-6, atol=1e-11 * np.linalg.cond(dense))


@pytest.mark.parametrize("width", [1, 2, 3, 4, 11])
def test_what_is_not_positive_definite_has_no_factors(width):
    _, a = banded(np.random.default_rng(width), 12, width)
    for i in (0, 5, 11):
        bad = a.copy()
        bad[i, 0] = -1.0
        assert not factor(bad, np.zeros_like(a))
        bad[i, 0] = np.nan
        assert not factor(bad, np.zeros_like(a))


@given(SEEDS, WIDTHS)
def test_solutions_agree_with_piqp(seed, width):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 60))
    dense, a, gradient, columns, values, matrix, upper, inside = program(rng, n, width, int(rng.integers(1, 3 * n + 1)))
    scale = 1.0 + 0.5 * inside @ dense @ inside
    status, _, y, z = solve(a, gradient, columns, values, upper, scale=scale)
    assert status != INFEASIBLE
    problem = qpsolvers.Problem(csr_matrix(dense).tocsc(), gradient, csr_matrix(matrix).tocsc(), upper)
    other = qpsolvers.solve_problem(problem, solver="piqp", eps_abs=1e-11, eps_rel=1e-11, max_iter=500)
    cost, reference = (0.5 * v @ dense @ v + gradient @ v for v in (y, other.x))
    assert cost == pytest.approx(reference, rel=1e-8, abs=1e-8)
    np.testing.assert_allclose(y, other.x, atol=1e-4 * max(1.0, np.abs(y).max()))
    assert (matrix @ y - upper).max() <= 1e-9 and (z >= 0).all()
    left = dense @ y + gradient + matrix.T @ z
    assert np.abs(left).max() <= 1e-8 * max(1.0, np.abs(dense @ y).max(), np.abs(matrix.T * z).max())
    assert z @ (upper - matrix @ y) <= 1e-9 * scale


@pytest.mark.parametrize("seed", [1, 118, 203])
def test_what_is_solved_is_called_solved(seed):
    """The last factorisation fails where s and z are at rounding; by then the residuals pass, or nearly."""
    rng = np.random.default_rng(seed)
    width, n = int(rng.integers(1, 28)), int(rng.integers(1, 60))
    dense, a, gradient, columns, values, _, upper, inside = program(rng, n, width, int(rng.integers(1, 3 * n + 1)))
    status, iterations, _, _ = solve(
        a, gradient, columns, values, upper, scale=max(abs(0.5 * gradient @ np.linalg.solve(dense, gradient)), 1e-300)
    )
    assert status == SOLVED and iterations < 40


def test_no_point_is_found_out_and_mostly_proved():
    """Rows that contradict one another: the multipliers' dual value rises above the ceiling; none counts as solved."""
    proved = 0
    for seed in range(100):
        rng = np.random.default_rng(seed)
        n, width = int(rng.integers(2, 40)), int(rng.integers(1, 28))
        dense, a, gradient, columns, values, matrix, upper, inside = program(rng, n, width, 2 * n)
        against = int(rng.integers(0, 2 * n))
        columns, values = np.vstack([columns, columns[against]]), np.vstack([values, -values[against]])
        upper = np.append(upper, -upper[against] - 10 ** rng.uniform(-3, 0))
        scale = 1.0 + 0.5 * inside @ dense @ inside
        status, _, _, z = solve(a, gradient, columns, values, upper, ceiling=1e3 * scale, scale=scale)
        assert status != SOLVED, seed
        rows = csr_matrix(np.vstack([matrix, -matrix[against]]))
        statement = BandedQP(np.ascontiguousarray(a.T[::-1]), gradient, 0.0, rows, upper)
        if status == INFEASIBLE:
            proved += statement.best_dual_value(z) > 1e3 * scale
    assert proved >= 90


@given(SEEDS, st.integers(1, 9))
def test_what_has_a_point_is_never_called_infeasible(seed, width):
    """However little room there is; the ceiling is the cost of a point that keeps all rows."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 40))
    dense, a, gradient, columns, values, matrix, upper, inside = program(rng, n, width, 3 * n, 10 ** rng.uniform(-9, 0))
    cost = 0.5 * inside @ dense @ inside + gradient @ inside
    status, _, y, _ = solve(a, gradient, columns, values, upper, ceiling=cost + 1e-6 * (1 + abs(cost)))
    assert status != INFEASIBLE
    if status == SOLVED:
        assert 0.5 * y @ dense @ y + gradient @ y <= cost + 1e-8 * (1 + abs(cost))
        assert (matrix @ y - upper).max() <= 1e-9


@given(SEEDS, st.integers(1, 9))
def test_bent_rows(seed, width):
    """G y + 1/2 kappa (D y + e)^2 <= h: kept, stationary, complementary."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 30))
    dense, a, gradient, columns, values, matrix, upper, inside = program(rng, n, width, 2 * n)
    bends = np.where(columns >= 0, rng.normal(size=columns.shape), 0.0)
    slopes = np.zeros_like(matrix)
    for r in range(2 * n):
        slopes[r, columns[r][columns[r] >= 0]] = bends[r][columns[r] >= 0]
    kappa, offsets = rng.random(2 * n) * (rng.random(2 * n) < 0.6), rng.normal(size=2 * n)
    upper = upper + 0.5 * kappa * (slopes @ inside + offsets) ** 2
    status, _, y, z = solve(a, gradient, columns, values, upper, bends, offsets, kappa)
    assert status == SOLVED
    away = slopes @ y + offsets
    slack = upper - matrix @ y - 0.5 * kappa * away**2
    assert slack.min() >= -1e-8 and z @ slack <= 1e-8
    push = matrix.T @ z + slopes.T @ (z * kappa * away)
    size = max(1.0, np.abs(dense @ y).max(), np.abs(matrix.T * z).max())
    assert np.abs(dense @ y + gradient + push).max() <= 1e-8 * size


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("backend", [b for b in BACKENDS if "qp" in b.kinds], ids=lambda b: b.name)
def test_back_ends_agree(backend, seed):
    rng = np.random.default_rng(seed)
    dense, a, gradient, _, _, matrix, upper, _ = program(rng, 20, 5, 30)
    bands = np.ascontiguousarray(a.T[::-1])
    answer = solve_qp(BandedQP(bands, gradient, 1.0, csr_matrix(matrix), upper), backend)
    assert max(answer.residuals.values()) < 1e-5
    first = solve_qp(BandedQP(bands, gradient, 1.0, csr_matrix(matrix), upper), BACKENDS[0])
    costs = [0.5 * v @ dense @ v + gradient @ v for v in (first.y, answer.y)]
    assert costs[0] == pytest.approx(costs[1], abs=1e-7)
    with pytest.raises(NoSolution):
        rows = csr_matrix(np.vstack([matrix, -matrix]))
        solve_qp(BandedQP(bands, gradient, 1.0, rows, np.concatenate([upper, -upper - 0.1])), backend)
