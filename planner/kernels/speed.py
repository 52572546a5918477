"""The Euclidean norm of polynomial vectors at many places: what the length of a path is integrated from."""

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def speeds(coefficients, piece, u, out):  # type: ignore[no-untyped-def]
    """Write the norms at the places.

    Parameters
    ----------
    coefficients : array (n + 1, K, D)
        Highest power first, in the local variable u.
    piece : array (I,) of int64
    u : array (I, M)
    out : array (I, M)
        Overwritten.
    """
    size, _, dims = coefficients.shape
    own = np.empty((dims, size))
    for k in range(len(piece)):
        i = piece[k]
        for d in range(dims):
            for p in range(size):
                own[d, p] = coefficients[p, i, d]
        for m in range(u.shape[1]):
            at, total = u[k, m], 0.0
            for d in range(dims):
                value = own[d, 0]
                for p in range(1, size):
                    value = value * at + own[d, p]
                total += value * value
            out[k, m] = np.sqrt(total)
