"""The evaluation kernel against SciPy's PPoly, piece by piece and all at once."""

import numpy as np
import pytest
from scipy.interpolate import PPoly

from planner.kernels.evaluation import evaluate


def problem(rng, degree, pieces, dims, scale=1.0):
    breaks = rng.normal() + np.concatenate([[0.0], np.cumsum(rng.uniform(0.2, 2.0, pieces))])
    decay = 0.7 ** np.arange(degree, -1, -1)[:, None, None]
    return breaks, scale * decay * rng.standard_normal((degree + 1, pieces, dims))


def reference(breaks, coefficients, times, order):
    n = len(coefficients) - 1
    powers = np.diff(breaks)[None, :] ** -np.arange(n, -1.0, -1.0)[:, None]
    p = PPoly(coefficients * powers[:, :, None], breaks)
    return p.derivative(order)(times) if order else p(times)


def check(breaks, coefficients, times, first, orders):
    out = np.full((orders, len(times), coefficients.shape[2]), np.nan)
    evaluate(breaks, coefficients, times, first, out)
    rate = 1.0 / np.diff(breaks).min()
    size = np.abs(coefficients).sum(axis=0).max()
    n = len(coefficients) - 1
    for r in range(orders):
        m = first + r
        expected = reference(breaks, coefficients, times, m) if m <= n else np.zeros(out.shape[1:])
        np.testing.assert_allclose(out[r], expected, rtol=0, atol=1e-13 * size * (rate * max(n, 1)) ** m + 0.0)
    return out


@pytest.mark.parametrize("seed", range(60))
def test_agrees_with_ppoly(seed):
    rng = np.random.default_rng(seed)
    degree, pieces, dims = rng.integers(0, 13), rng.integers(1, 40), rng.integers(1, 20)
    breaks, coefficients = problem(rng, degree, pieces, dims)
    times = rng.uniform(breaks[0], breaks[-1], rng.integers(1, 200))
    if seed % 3:
        times.sort()
    check(breaks, coefficients, times, rng.integers(0, 4), rng.integers(1, 7))


@pytest.mark.parametrize("degree", [30, 50, 60])
@pytest.mark.parametrize("dims", [1, 8, 64])
def test_high_degrees(degree, dims):
    breaks, coefficients = problem(np.random.default_rng(degree), degree, 3, dims)
    check(breaks, coefficients, np.linspace(breaks[0], breaks[-1], 50), 0, 4)


@pytest.mark.parametrize("dims", [1, 3, 7, 8, 9, 16, 33])
def test_the_value_at_a_break_is_from_the_right_and_the_end_closed(dims):
    rng = np.random.default_rng(dims)
    breaks, coefficients = problem(rng, 5, 9, dims)
    out = np.empty((4, 10, dims))
    evaluate(breaks, coefficients, breaks, 0, out)
    np.testing.assert_array_equal(out[0, :-1], coefficients[-1])
    np.testing.assert_allclose(out[0, -1], coefficients[:, -1].sum(axis=0), rtol=0, atol=1e-14)
    np.testing.assert_allclose(out[1, :-1], coefficients[-2] / np.diff(breaks)[:, None], rtol=1e-14)
    backwards = np.empty_like(out)
    evaluate(breaks, coefficients, breaks[::-1].copy(), 0, backwards)
    np.testing.assert_array_equal(backwards, out[:, ::-1])


@pytest.mark.parametrize("count", [0, 1, 2, 7, 8, 9, 64])
@pytest.mark.parametrize("dims", [1, 5, 8, 11])
def test_nothing_is_written_outside(count, dims):
    rng = np.random.default_rng(count)
    breaks, coefficients = problem(rng, 5, 4, dims)
    times = np.sort(rng.uniform(breaks[0], breaks[-1], count))
    guard = 100
    around = np.full(2 * guard + 4 * count * dims, 7.5)
    out = around[guard : len(around) - guard].reshape(4, count, dims)
    evaluate(breaks, coefficients, times, 0, out)
    assert (around[:guard] == 7.5).all() and (around[len(around) - guard :] == 7.5).all()
    for r in range(4):
        expected = reference(breaks, coefficients, times, r)
        np.testing.assert_allclose(out[r], expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_each_time_is_its_own_whatever_the_order_of_times(seed):
    rng = np.random.default_rng(seed)
    breaks, coefficients = problem(rng, 5, 1 + 400 * (seed % 2), 7)
    times = rng.uniform(breaks[0], breaks[-1], 500)
    order = np.argsort(times)
    mixed, sorted_ = np.empty((4, 500, 7)), np.empty((4, 500, 7))
    evaluate(breaks, coefficients, times, 0, mixed)
    evaluate(breaks, coefficients, times[order], 0, sorted_)
    np.testing.assert_array_equal(mixed[:, order], sorted_)


def test_times_a_rounding_outside_count_as_the_ends():
    breaks, coefficients = problem(np.random.default_rng(0), 5, 3, 2)
    out = np.empty((2, 4, 2))
    times = np.array([breaks[0] - 1.0, breaks[0], breaks[-1], breaks[-1] + 1.0])
    evaluate(breaks, coefficients, times, 0, out)
    np.testing.assert_array_equal(out[:, 0], out[:, 1])
    np.testing.assert_array_equal(out[:, 2], out[:, 3])


def test_a_hold_without_duration():
    out = np.empty((4, 3, 2))
    evaluate(np.array([1.0, 1.0]), np.array([[[3.0, -4.0]]]), np.ones(3), 0, out)
    np.testing.assert_array_equal(out[0], [[3.0, -4.0]] * 3)
    np.testing.assert_array_equal(out[1:], 0.0)


def test_orders_beyond_the_degree_are_zero_even_on_the_shortest_pieces():
    out = np.full((8, 2, 1), np.nan)
    evaluate(np.array([0.0, 1e-75]), np.array([[[0.0]], [[2.0]]]), np.zeros(2), 0, out)
    np.testing.assert_array_equal(out[0], 2.0)
    np.testing.assert_array_equal(out[1:], 0.0)


def test_what_is_no_number_ends_as_none():
    breaks, coefficients = problem(np.random.default_rng(0), 5, 20, 7)
    out = np.empty((4, 3, 7))
    evaluate(breaks, coefficients, np.array([breaks[3], np.nan, breaks[5]]), 0, out)
    assert np.isnan(out[0, 1]).all() and np.isfinite(out[:, [0, 2]]).all()
