"""The extrema kernel against dense sampling, NumPy's roots and polynomials whose extrema are known."""

import numpy as np
import pytest
from numpy.polynomial import polynomial as P

from planner.kernels.extrema import extrema

DENSE = np.linspace(0.0, 1.0, 2001)


def derivative(c, order):
    """Highest power first, as in the kernel; at least one coefficient."""
    return np.polyder(c, order) if order < len(c) else np.zeros(1)


def brute(c):
    """Return the extrema by sampling and NumPy's roots, which are candidates wherever they are."""
    points = DENSE
    if len(c) > 2 and len(c) < 20:
        roots = np.roots(np.polyder(c)) if np.abs(np.polyder(c)).max() > 0 else np.empty(0)
        near = roots.real[(roots.real > 0) & (roots.real < 1)]
        points = np.concatenate([DENSE, near])
    values = np.polyval(c, points)
    return values.min(), values.max()


def check(coefficients, orders):
    low, at_low, high, at_high = extrema(coefficients, orders)
    n, pieces, dims = len(coefficients) - 1, *coefficients.shape[1:]
    for m in range(orders):
        for i in range(pieces):
            for d in range(dims):
                c = derivative(coefficients[:, i, d], m)
                size = np.abs(c).sum()
                assert 0.0 <= at_low[m, i, d] <= 1.0 and 0.0 <= at_high[m, i, d] <= 1.0
                tolerance = 1e-14 * size * (1 + n // 10)
                assert abs(np.polyval(c, at_low[m, i, d]) - low[m, i, d]) <= tolerance
                assert abs(np.polyval(c, at_high[m, i, d]) - high[m, i, d]) <= tolerance
                smallest, largest = brute(c)
                assert low[m, i, d] <= smallest + tolerance and high[m, i, d] >= largest - tolerance
    return low, at_low, high, at_high


@pytest.mark.parametrize("seed", range(40))
def test_agrees_with_brute_force(seed):
    rng = np.random.default_rng(seed)
    degree = seed % 13
    coefficients = rng.standard_normal((degree + 1, 3, 2)) * 10.0 ** rng.uniform(-3, 3, (degree + 1, 1, 1))
    check(coefficients, int(rng.integers(1, degree + 4)))


@pytest.mark.parametrize("seed", range(6))
def test_many_wiggles(seed):
    """Chebyshev's polynomials on [0, 1] have all their extrema inside, all alike."""
    n = 2 + seed
    c = np.polynomial.chebyshev.cheb2poly([0.0] * n + [1.0])
    shifted = np.zeros(1)
    for a in c[::-1]:
        shifted = P.polyadd(P.polymul(shifted, [-1.0, 2.0]), [a])
    coefficients = np.zeros((n + 1, 1, 1))
    coefficients[:, 0, 0] = shifted[: n + 1][::-1]
    low, at_low, high, at_high = check(coefficients, 2)
    assert abs(low[0] + 1.0).max() < 1e-12 * 6.0**n and abs(high[0] - 1.0).max() < 1e-12 * 6.0**n


@pytest.mark.parametrize("degree", [30, 40, 50, 60])
def test_high_degrees(degree):
    rng = np.random.default_rng(degree)
    decay = 0.6 ** np.arange(degree, -1, -1)[:, None, None]
    check(rng.standard_normal((degree + 1, 2, 1)) * decay, 4)


@pytest.mark.parametrize("power", range(1, 9))
@pytest.mark.parametrize("root", [0.0, 0.25, 0.5, 0.7, 1.0])
def test_repeated_roots(power, root):
    c = np.array([1.0])
    for _ in range(power):
        c = np.convolve(c, [1.0, -root])
    low, at_low, high, at_high = check(c[:, None, None].copy(), power + 2)
    ends = np.array([(-root) ** power, (1.0 - root) ** power])
    assert abs(high[0, 0, 0] - ends.max()) < 1e-14
    assert abs(low[0, 0, 0] - (0.0 if power % 2 == 0 else ends.min())) < 1e-14


@pytest.mark.parametrize("factor", [1e-300, 1e-200, 1e-100, 1e90, 1e100])
@pytest.mark.parametrize("degree", [1, 2, 3, 5, 8])
def test_tiny_and_huge_numbers(factor, degree):
    c = np.random.default_rng(degree).standard_normal((degree + 1, 20, 1))
    plain, scaled = extrema(c, 4), extrema(c * factor, 4)
    size = np.abs(c).sum(axis=0)
    for k in (0, 2):
        for m in range(4):
            error = np.abs(scaled[k, m] / factor - plain[k, m])
            assert (error <= 1e-12 * size * (degree + 1.0) ** m).all()


def test_vanishing_leading_coefficients():
    rng = np.random.default_rng(0)
    for leading in (0.0, 1e-300, 1e-30, 1e-12):
        for degree in (3, 4, 5, 7):
            c = rng.standard_normal((degree + 1, 4, 1))
            c[:2] = leading
            check(c, 4)


def test_zeros_and_constants():
    for degree in (0, 3, 5, 9):
        c = np.zeros((degree + 1, 1, 2))
        c[-1, 0, 1] = 3.0
        out = extrema(c, 4)
        np.testing.assert_array_equal(out[[0, 2], 0], [[[0.0, 3.0]]] * 2)
        np.testing.assert_array_equal(out[:, 1:], 0.0)
        np.testing.assert_array_equal(out[[1, 3]], 0.0)


@pytest.mark.parametrize("lead", [0, 1, 4])
def test_of_equal_extremes_the_first_is_told(lead):
    c = np.zeros((3 + lead, 1, 1))
    c[lead:, 0, 0] = [1.0, -1.0, 0.0]  # u (u - 1): zero at both ends
    low, at_low, high, at_high = extrema(c, 1)
    assert high[0, 0, 0] == 0.0 and at_high[0, 0, 0] == 0.0
    assert abs(at_low[0, 0, 0] - 0.5) < 1e-15 and low[0, 0, 0] == -0.25


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e308])
@pytest.mark.parametrize("degree", [1, 2, 4, 5, 6, 12])
def test_what_is_no_number_comes_to_an_end(bad, degree):
    for k in range(degree + 1):
        c = np.random.default_rng(k).standard_normal((degree + 1, 2, 2))
        c[k, 0, 0] = bad
        with np.errstate(all="ignore"):
            out = extrema(c, 4)
        assert np.isfinite(out[:, :, 1]).all()
