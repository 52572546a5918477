"""The worst of all pieces against the extrema of each."""

import numpy as np
import pytest

from planner.kernels.extrema import extrema
from planner.kernels.worst import TIE, worst


def table(coefficients, rate, row, gain, shift):
    """Return the badness of both sides of every piece, (2, R, K, D), its value and its place."""
    orders = gain.shape[1]
    low, at_low, high, at_high = extrema(coefficients, orders)
    scale = (rate ** np.arange(orders)[:, None])[:, :, None]
    values = np.stack([high * scale, low * scale])
    return gain[:, :, row] * values + shift[:, :, row], values, np.stack([at_high, at_low])


def check(coefficients, rate, row, gain, shift):
    badness, value, u, piece, side, most = worst(coefficients, rate, row, gain, shift)
    bad, values, places = table(coefficients, rate, row, gain, shift)
    scale = np.abs(gain[:, :, row] * values).max(axis=(0, 2)) + np.abs(np.where(np.isinf(shift), 0, shift)).max((0, 2))
    top = bad.max(axis=(0, 2))
    on = top > -np.inf
    assert (most[~on] == -np.inf).all()
    assert (np.abs(most[on] - top[on]) <= 1e-12 * scale[on]).all()
    assert (badness[on] >= most[on] - 1.01 * TIE * np.abs(most[on])).all() and (badness <= most).all()
    for m, d in np.argwhere(on):
        s, i = side[m, d], piece[m, d]
        assert badness[m, d] == pytest.approx(bad[s, m, i, d], abs=1e-12 * scale[m, d])
        assert value[m, d] == pytest.approx(values[s, m, i, d], rel=1e-12, abs=1e-300)
        assert u[m, d] == pytest.approx(places[s, m, i, d], abs=1e-12)
    return badness, value, u, piece, side, most


def problem(rng, degree, pieces, dims, orders, rows):
    decay = 0.7 ** np.arange(degree, -1, -1)[:, None, None]
    coefficients = decay * rng.standard_normal((degree + 1, pieces, dims))
    rate = np.exp(rng.uniform(-1, 1, pieces))
    row = rng.integers(0, rows, pieces)
    gain = rng.uniform(0.1, 10.0, (2, orders, rows, dims)) * np.array([1.0, -1.0])[:, None, None, None]
    shift = rng.normal(size=gain.shape)
    off = rng.random(gain.shape) < 0.3
    gain[off], shift[off] = 0.0, -np.inf
    return coefficients, rate, row, gain, shift


@pytest.mark.parametrize("seed", range(60))
def test_agrees_with_the_extrema_of_every_piece(seed):
    rng = np.random.default_rng(seed)
    pieces = int(rng.choice([1, 2, 7, 8, 9, 50, 300]))
    check(*problem(rng, seed % 11, pieces, int(rng.integers(1, 12)), int(rng.integers(1, 8)), int(rng.integers(1, 5))))


@pytest.mark.parametrize("degree", [15, 30, 50])
def test_high_degrees(degree):
    check(*problem(np.random.default_rng(degree), degree, 40, 2, 4, 2))


@pytest.mark.parametrize("factor", [1e-300, 1e-100, 1e60])
def test_tiny_and_huge_numbers(factor):
    coefficients, *rest = problem(np.random.default_rng(1), 5, 100, 3, 4, 1)
    check(coefficients * factor, *rest)


@pytest.mark.parametrize("dims", [1, 3, 7, 130])
def test_pieces_ever_worse(dims):
    """Each piece beats the ones before."""
    pieces = 200
    coefficients, rate, row, gain, shift = problem(np.random.default_rng(dims), 5, pieces, dims, 4, 1)
    coefficients[:] = coefficients[:, :1] * (1.0 + np.arange(pieces))[:, None]
    rate[:] = 1.0
    check(coefficients, rate, row, gain, np.where(np.isinf(shift), shift, 0.0))


@pytest.mark.parametrize("dims", [1, 2, 7, 8])
@pytest.mark.parametrize("first", [0, 3, 17, 160])
@pytest.mark.parametrize("degree", [5, 7])
def test_of_equal_peaks_the_first_is_told(dims, first, degree):
    rng = np.random.default_rng(first)
    coefficients = 0.1 * rng.standard_normal((degree + 1, 200, dims))
    peak = 1e3 * rng.standard_normal((degree + 1, dims))
    coefficients[:, first::13] = peak[:, None]
    coefficients[:, first + 13 :: 13] *= 1.0 + 1e-13 * rng.uniform(-1, 1, coefficients[:, first + 13 :: 13].shape[1:])
    gain = np.ones((2, 4, 1, dims)) * np.array([1.0, -1.0])[:, None, None, None]
    shift = -np.ones_like(gain)
    out = check(coefficients, np.ones(200), np.zeros(200, np.int64), gain, shift)
    np.testing.assert_array_equal(out[3], first)


@pytest.mark.parametrize("seed", range(20))
def test_limits_just_reached(seed):
    """Limits are the peaks themselves: the badness is zero but for rounding, and still it has a place."""
    rng = np.random.default_rng(seed)
    dims = int(rng.integers(1, 9))
    coefficients, rate, row, _, _ = problem(rng, int(rng.integers(1, 8)), int(rng.integers(1, 100)), dims, 3, 1)
    rate **= int(rng.integers(0, 9))
    unit = np.array([1.0, -1.0])[:, None, None, None] * np.ones((2, 3, 1, dims))
    peaks = worst(coefficients, rate, row, unit, np.zeros_like(unit))
    top = peaks[5]
    gain = unit / np.where(top > 0, top, 1.0)[:, None]
    badness, value, _, piece, side, most = check(coefficients, rate, row, gain, -np.ones_like(gain))
    assert (badness > -np.inf).all() and (np.abs(most[top > 0]) < 1e-12).all()
    np.testing.assert_allclose(np.abs(value), top, rtol=1e-12)


def test_within_a_piece_the_first_and_then_the_upper_side():
    gain = np.array([1.0, -1.0])[:, None, None, None] * np.ones((2, 1, 1, 1))
    one, row = np.ones(1), np.zeros(1, np.int64)
    for line, expected in (([2.0, -1.0], (1, 0.0)), ([-2.0, 1.0], (0, 0.0)), ([0.0, 0.0], (0, 0.0))):
        _, _, u, piece, side, _ = check(np.array(line)[:, None, None], one, row, gain, np.zeros_like(gain))
        assert (side[0, 0], u[0, 0], piece[0, 0]) == (*expected, 0)


def test_at_rest_orders_beyond_the_degree_and_sides_that_do_not_count():
    gain = np.array([2.0, -2.0])[:, None, None, None] * np.ones((2, 5, 2, 1))
    shift = np.full_like(gain, -1.0)
    gain[:, 4], shift[:, 4] = 0.0, -np.inf
    gain[1, 3], shift[1, 3] = 0.0, -np.inf
    shift[0, 3, 1] = -0.5
    row = np.array([0, 0, 1, 1])
    badness, value, u, piece, side, most = check(np.zeros((2, 4, 1)), np.ones(4), row, gain, shift)
    np.testing.assert_array_equal(most[:, 0], [-1, -1, -1, -0.5, -np.inf])
    np.testing.assert_array_equal(piece[:4, 0], [0, 0, 0, 2])
    np.testing.assert_array_equal(value, 0.0)
