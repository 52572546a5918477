"""Coefficients of compositions against NumPy's polynomials."""

import numpy as np
import pytest

from planner.kernels.composition import compose


@pytest.mark.parametrize("seed", range(40))
def test_agrees_with_polynomials(seed):
    rng = np.random.default_rng(seed)
    n, m, dims = int(rng.integers(0, 6)), int(rng.integers(0, 5)), int(rng.integers(1, 18))
    pieces, runs = int(rng.integers(1, 4)), int(rng.integers(1, 9))
    c, law = rng.normal(size=(n + 1, pieces, dims)), rng.normal(size=(m + 1, runs))
    piece, left, h = rng.integers(0, pieces, runs), rng.normal(size=runs), rng.uniform(0.5, 2.0, runs)
    out = np.full((n * m + 1, runs, dims), np.nan)
    compose(c, law, piece, left, h, out)
    for i, p in enumerate(piece):
        w = np.poly1d(law[:, i] - np.append(np.zeros(m), left[i])) / h[i]
        for d in range(dims):
            expected = np.poly1d(c[:, p, d])(w)
            coefficients = np.atleast_1d(expected.coeffs if isinstance(expected, np.poly1d) else expected)
            padded = np.concatenate([np.zeros(n * m + 1 - len(coefficients)), coefficients])
            np.testing.assert_allclose(out[:, i, d], padded, rtol=1e-9, atol=1e-9 * np.abs(padded).max())
