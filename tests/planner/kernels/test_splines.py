"""Spline kernels: against SciPy, exact polynomials, optimality, uneven steps."""

from fractions import Fraction
from itertools import product
from math import factorial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PPoly, make_interp_spline

from planner.kernels.hermite import hermite_jumps, hermite_pieces
from planner.kernels.splines import hermite_states

Array = NDArray[np.float64]
SEEDS = range(3)


def solve(h: Any, points: Array, ends: Array, fixed: Any = True) -> tuple[Array, Array]:
    """Return states and pieces; k is read off the ends."""
    b, n, dims = ends.shape[1], *points.shape
    states, pieces = np.full((b, n, dims), np.nan), np.full((2 * b + 2, n - 1, dims), np.nan)
    mask = np.ascontiguousarray(np.broadcast_to(fixed, (2, b)), dtype=bool)
    assert hermite_states(np.asarray(h, dtype=float), points, ends, mask, states)
    hermite_pieces(np.asarray(h, dtype=float), points, states, pieces)
    return states, pieces


def problem(k: int, n: int, seed: int, dims: int = 2, decades: float = 1.0) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng([seed, k, n])
    h = 10.0 ** rng.uniform(-decades, 0, n - 1)
    return h, rng.standard_normal((n, dims)), rng.standard_normal((2, k - 1, dims))


def knots(h: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(h)])


def ppoly(h: Array, pieces: Array) -> PPoly:
    powers = np.arange(len(pieces))[::-1]
    return PPoly(pieces / h[None, :, None] ** powers[:, None, None], knots(h))


def jumps(h: Array, pieces: Array) -> Array:
    worst = np.empty(len(pieces) // 2 - 1)
    hermite_jumps(h, pieces, worst)
    return worst


def energy(h: Array, pieces: Array) -> Array:
    """Return the integral of the squared k-th derivative, by Gauss's rule."""
    k = len(pieces) // 2
    nodes, weights = np.polynomial.legendre.leggauss(k)
    curve, t = ppoly(h, pieces), knots(h)
    at = t[:-1, None] + h[:, None] * (nodes + 1) / 2
    return np.asarray(np.einsum("i,q,iqd->d", h / 2, weights, curve(at, k) ** 2))


def test_worked_example() -> None:
    points, h = np.array([[0.0], [2.0], [3.0]]), np.ones(2)
    states, pieces = solve(h, points, np.zeros((2, 2, 1)))
    x = ppoly(h, pieces)
    assert states[:, 1, 0] == pytest.approx([2.8125, -10 / 3], abs=1e-14)
    assert x([0.5, 1.5])[:, 0] == pytest.approx([0.50846354, 2.88736979], abs=1e-8)
    assert x(0.5, 3)[0] == pytest.approx(-12.8125, abs=1e-12)
    assert [x(1 - 1e-13, 4)[0], x(1.0, 4)[0]] == pytest.approx([60, 60], abs=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("n", [2, 3, 4, 30, 1500])
@pytest.mark.parametrize("k", [2, 3, 4])
def test_agrees_with_scipy(k: int, n: int, seed: int) -> None:
    h, points, ends = problem(k, n, seed, decades=0.5)
    t = knots(h)
    states, pieces = solve(h, points, ends)
    if k == 2:
        peer = CubicSpline(t, points, bc_type=((1, ends[0, 0]), (1, ends[1, 0])))
    else:
        conditions = [[(r + 1, ends[side, r]) for r in range(k - 1)] for side in (0, 1)]
        peer = make_interp_spline(t, points, k=2 * k - 1, bc_type=tuple(conditions))
    for r in range(k - 1):
        assert np.abs(states[r] - peer(t, r + 1)).max() < 1e-10 * np.abs(states[r]).max()
    assert (states[:, [0, -1]].swapaxes(0, 1) == ends).all()
    middle = (t[:-1] + t[1:]) / 2
    assert np.abs(ppoly(h, pieces)(middle) - peer(middle)).max() < 1e-9 * np.abs(points).max()


@pytest.mark.parametrize("k", [2, 3, 4])
def test_free_ends_meet_natural_conditions_and_are_minimal(k: int) -> None:
    """Each end derivative free or fixed in turn; down to N = 2, where the line, the parabola … come out."""
    rng = np.random.default_rng(k)
    for fixed, n in product(product([False, True], repeat=2 * k - 2), [2, 3, 4, 9]):
        mask = np.array(fixed).reshape(2, k - 1)
        h, points, ends = problem(k, n, 0, decades=0.3)
        states, pieces = solve(h, points, np.where(mask[:, :, None], ends, np.nan), mask)
        assert np.abs(states[:, [0, -1]].swapaxes(0, 1) - ends)[mask].max(initial=0) < 1e-13
        assert n == 2 or jumps(h, pieces)[0] < 1e-8
        lowest = energy(h, pieces)
        curve, size = ppoly(h, pieces), 1 + lowest**0.5
        for side, r in zip(*np.nonzero(~mask), strict=True):
            m = 2 * k - 2 - r
            end = curve.c[len(pieces) - 1 - m, 0] * factorial(m) if side == 0 else curve(curve.x[-1], m)
            assert (np.abs(end) * h.min() ** (m - 1) < 1e-8 * size).all()
        for _ in range(3):
            bump = rng.standard_normal(states.shape)
            bump[:, [0, -1]] *= ~mask.T[:, :, None]
            if bump.any():
                hermite_pieces(h, points, states + bump, pieces)
                assert (energy(h, pieces) > lowest).all()


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("k", [2, 3, 4])
def test_polynomials_of_the_degree_are_reproduced(k: int, seed: int) -> None:
    h, _, _ = problem(k, 12, seed)
    t = knots(h) - 1.0
    p = np.polynomial.Polynomial(np.random.default_rng(seed).standard_normal(2 * k))
    exact = np.array([p.deriv(r)(t) for r in range(1, k)])[:, :, None]
    states, pieces = solve(h, p(t)[:, None], np.ascontiguousarray(exact[:, [0, -1]].swapaxes(0, 1)))
    scale = np.abs(exact).max(axis=(1, 2), keepdims=True)
    assert (np.abs(states - exact) < 1e-11 * scale).all()
    middle = (t[:-1] + t[1:]) / 2
    assert ppoly(h, pieces)(middle + 1.0)[:, 0] == pytest.approx(p(middle), rel=1e-11, abs=1e-12 * np.abs(p(t)).max())


@pytest.mark.parametrize("k", [1, 2, 3, 4])
def test_pieces_take_values_and_states(k: int) -> None:
    rng = np.random.default_rng(k)
    h, points, states = rng.uniform(0.3, 2, 5), rng.standard_normal((6, 3)), rng.standard_normal((k - 1, 6, 3))
    pieces = np.empty((2 * k, 5, 3))
    hermite_pieces(h, points, states, pieces)
    for r, values in enumerate([points, *states]):
        for u, at in ((0.0, values[:-1]), (1.0, values[1:])):
            found = sum(pieces[-1 - q] * factorial(q) / factorial(q - r) * u ** (q - r) for q in range(r, 2 * k))
            assert found / h[:, None] ** r == pytest.approx(at, abs=1e-9)


@pytest.mark.parametrize("k", [2, 3, 4])
def test_columns_are_separate_and_laws_hold(k: int) -> None:
    h, points, ends = problem(k, 40, 5, dims=7)
    states, pieces = solve(h, points, ends)
    for d in range(7):
        alone = solve(h, points[:, d : d + 1].copy(), ends[:, :, d : d + 1].copy())
        assert (alone[0][:, :, 0] == states[:, :, d]).all() and (alone[1][:, :, 0] == pieces[:, :, d]).all()
    order = np.arange(1, k)[:, None, None]
    slow, _ = solve(4.0 * h, points, ends / 4.0 ** np.arange(1, k)[:, None])  # powers of two: exact
    assert (slow * 4.0**order == states).all()
    scale = np.abs(states).max(axis=(1, 2), keepdims=True)
    moved, _ = solve(h, 3.0 - 1.5 * points, -1.5 * ends)
    assert (np.abs(moved + 1.5 * states) < 1e-11 * scale).all()
    back, _ = solve(h[::-1].copy(), points[::-1].copy(), ends[::-1] * (-1.0) ** np.arange(1, k)[:, None])
    assert (np.abs(back[:, ::-1] * (-1.0) ** order - states) < 1e-10 * scale).all()


def exact(k: int, h: Array, points: Array, ends: Array) -> Array:
    """Return the states for fixed ends, from the Hessian in rational numbers."""
    b, n = k - 1, len(points)
    steps, x, end = [Fraction(s) for s in h], [Fraction(p) for p in points], [[Fraction(e) for e in r] for r in ends]
    known = {(i, 0): x[i] for i in range(n)} | {(s * (n - 1), r + 1): end[s][r] for s in (0, 1) for r in range(b)}
    unknown = [(i, r) for i in range(1, n - 1) for r in range(1, k)]
    rows = [[Fraction(0)] * (len(unknown) + 1) for _ in unknown]
    place = {node: p for p, node in enumerate(unknown)}
    unit = np.zeros((2 * k, 1, 2 * k))  # pieces of the 2k unit states
    values, states = np.zeros((2, 2 * k)), np.zeros((b, 2, 2 * k))
    for c in range(2 * k):
        (values if c % k == 0 else states[c % k - 1])[c // k, c] = 1.0
    hermite_pieces(np.ones(1), values, states, unit)
    poly = [[Fraction(v).limit_denominator(10**6) for v in unit[::-1, 0, c]] for c in range(2 * k)]
    high = [[v * factorial(q) / factorial(q - k) for q, v in enumerate(p) if q >= k] for p in poly]
    gram = [[sum(a * c / (p + q + 1) for p, a in enumerate(f) for q, c in enumerate(g)) for g in high] for f in high]
    for i, s in enumerate(steps):
        for f, g in product(range(2 * k), repeat=2):
            row, column = (i + f // k, f % k), (i + g // k, g % k)
            if row in place:
                value = gram[f][g] * s ** (f % k + g % k + 1 - 2 * k)
                if column in place:
                    rows[place[row]][place[column]] += value
                else:
                    rows[place[row]][-1] -= value * known[column]
    for i, pivot in enumerate(rows):
        for other in rows[i + 1 :]:
            factor = other[i] / pivot[i]
            other[i:] = [a - factor * c for a, c in zip(other[i:], pivot[i:], strict=True)]
    found = [Fraction(0)] * len(rows)
    for i in reversed(range(len(rows))):
        rest = sum(a * c for a, c in zip(rows[i][i + 1 : -1], found[i + 1 :], strict=True))
        found[i] = (rows[i][-1] - rest) / rows[i][i]
    return np.array(found, dtype=float).reshape(n - 2, b).T


@pytest.mark.parametrize(("k", "bound"), [(2, 1e-14), (3, 1e-13), (4, 1e-5)])
@pytest.mark.parametrize(
    "steps", [(1, 1e-9, 1, 1, 0.5), (1, 1e-9, 2e-9, 1, 1), (1e-9, 1, 1e-6, 1, 1), (1, 1e-3, 1, 1e3, 1)]
)
def test_uneven_steps_against_rational_numbers(k: int, bound: float, steps: tuple[float, ...]) -> None:
    _, points, ends = problem(k, 6, 3, dims=1)
    h = np.array(steps)
    states, _ = solve(h, points, ends)
    reference = exact(k, h, points[:, 0], ends[:, :, 0])
    assert (np.abs(states[:, 1:-1, 0] - reference).max(axis=1) < bound * np.abs(reference).max(axis=1)).all()


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize(("k", "loss"), [(2, 0.0), (3, 0.0), (4, 1.0)])
def test_one_short_gap_leaves_the_states_precise(k: int, loss: float, gap: float) -> None:
    """The way back, through the gap from the other side, gives the same; the two points fix the velocity there."""
    h, points, ends = problem(k, 21, 1, decades=0.3)
    h[10] = gap
    points[11] = points[10] + gap * np.array([0.7, -0.4])
    velocity = (points[11] - points[10]) / gap  # rounded as the points are
    states, pieces = solve(h, points, ends)
    flipped, _ = solve(h[::-1].copy(), points[::-1].copy(), ends[::-1] * (-1.0) ** np.arange(1, k)[:, None])
    error = np.abs(flipped[:, ::-1] * (-1.0) ** np.arange(1, k)[:, None, None] - states).max(axis=(1, 2))
    assert (error < 1e-12 * gap**-loss * np.abs(states).max(axis=(1, 2))).all()
    assert np.abs(states[0, 10:12] - velocity).max() < 50 * gap
    assert (jumps(h, pieces) < 1e-11 * gap ** -(np.arange(k, 2 * k - 1) - 1.0)).all()


def test_trouble_is_told() -> None:
    h, points, ends = problem(3, 9, 0)
    fixed, states = np.ones((2, 2), dtype=bool), np.empty((2, 9, 2))
    for value in (0.0, -1.0, np.nan, np.inf):
        bad = h.copy()
        bad[4] = value
        assert not hermite_states(bad, points, ends, fixed, states)
    for place in (points, ends):
        kept = place.copy()
        place.flat[-1] = np.nan
        assert not hermite_states(h, points, ends, fixed, states)
        place[:] = kept
    assert hermite_states(h, points, ends, fixed, states)
    assert not hermite_states(h[:0], points[:1], ends, fixed, states[:, :1].copy())
    pieces = np.full((6, 8, 2), np.nan)
    assert np.isnan(jumps(h, pieces)).all()
