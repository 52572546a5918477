"""Cholesky's factorisation of block-tridiagonal matrices with small dense blocks."""

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def factorise(diag, off, shift, lower, across):  # type: ignore[no-untyped-def]
    """Factorise a symmetric block-tridiagonal matrix; False if it is not positive definite.

    Parameters
    ----------
    diag, off : array (N, B, B)
        Blocks on the diagonal, of which the lower triangles are read, and to the right of them (N - 1 are read).
    shift : float
        This part of its own size is added to each entry of the diagonal.
    lower, across : array (N, B, B)
        Overwritten: the factor's blocks on the diagonal, and, transposed, below it.
    """
    n, size = len(diag), diag.shape[1]
    for j in range(n):
        for r in range(size):
            for s in range(r + 1):
                value = diag[j, r, s]
                if r == s:
                    value += shift * (abs(value) + 1e-6)
                if j > 0:
                    for q in range(size):
                        value -= across[j - 1, q, r] * across[j - 1, q, s]
                for q in range(s):
                    value -= lower[j, r, q] * lower[j, s, q]
                if r == s:
                    if not value > 1e-14 * abs(diag[j, r, r]):
                        return False
                    lower[j, r, r] = np.sqrt(value)
                else:
                    lower[j, r, s] = value / lower[j, s, s]
        if j < n - 1:
            for column in range(size):
                for r in range(size):
                    value = off[j, r, column]
                    for q in range(r):
                        value -= lower[j, r, q] * across[j, q, column]
                    across[j, r, column] = value / lower[j, r, r]
    return True


@njit(cache=True, error_model="numpy")
def solve(lower, across, rhs, out):  # type: ignore[no-untyped-def]
    """Solve with the factor; ``rhs`` and ``out``, which is overwritten, are (N, B)."""
    n, size = rhs.shape
    for j in range(n):
        for r in range(size):
            value = rhs[j, r]
            if j > 0:
                for q in range(size):
                    value -= across[j - 1, q, r] * out[j - 1, q]
            for q in range(r):
                value -= lower[j, r, q] * out[j, q]
            out[j, r] = value / lower[j, r, r]
    for j in range(n - 1, -1, -1):
        for r in range(size - 1, -1, -1):
            value = out[j, r]
            if j < n - 1:
                for q in range(size):
                    value -= across[j, r, q] * out[j + 1, q]
            for q in range(r + 1, size):
                value -= lower[j, q, r] * out[j, q]
            out[j, r] = value / lower[j, r, r]
