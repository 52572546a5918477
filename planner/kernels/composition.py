"""Composition of a piecewise polynomial with a scalar law, piece by piece."""

import numpy as np
from numba import njit

from .lanes import LANES, load, scaled, step, store


@njit(cache=True, error_model="numpy")
def compose(c, law, piece, left, h, out):  # type: ignore[no-untyped-def]
    """Write the coefficients of c(law(u)).

    Parameters
    ----------
    c : array (n + 1, P, D)
        The curve's coefficients, highest power first, in the local variable of its pieces.
    law : array (m + 1, L)
        The law's coefficients; its values are those of the curve's parameter.
    piece : array (L,) of int64
        On which piece of the curve each piece of the law runs.
    left, h : array (L,)
        Where that piece of the curve starts, and how long it is.
    out : array (n m + 1, L, D)
        Overwritten.
    """
    size, _, dims = c.shape
    count, n, m = len(piece), len(c) - 1, len(law) - 1
    wide = (dims + LANES - 1) // LANES * LANES
    own, last, flat = np.zeros(size * wide), np.zeros(wide), out.reshape(-1)
    powers = np.zeros((size, n * m + 1))  # powers[k, j]: the coefficient of u^j in the k-th power of the local variable
    w = np.zeros(m + 1)
    powers[0, 0] = 1.0
    held = -1
    for i in range(count):
        p = piece[i]
        if p != held:
            held = p
            for k in range(size):
                for d in range(dims):
                    own[k * wide + d] = c[n - k, p, d]
        for j in range(m + 1):
            w[j] = (law[m - j, i] - (left[i] if j == 0 else 0.0)) / h[i]
        for k in range(1, size):
            for j in range(k * m + 1):
                x = 0.0
                for r in range(max(0, j - (k - 1) * m), min(j, m) + 1):
                    x += powers[k - 1, j - r] * w[r]
                powers[k, j] = x
        for j in range(n * m + 1):
            first = (j + m - 1) // m if m > 0 else 0  # the lowest power that has such a term
            for d in range(0, wide, LANES):
                x = scaled(load(own, first * wide + d), powers[first, j])
                for k in range(first + 1, size):
                    x = step(load(own, k * wide + d), powers[k, j], x)
                at = (n * m - j) * count * dims + i * dims + d
                if i * dims + wide <= count * dims:  # what is written past the joints is overwritten by the next piece
                    store(flat, at, x)
                    continue
                store(last, d, x)
                for e in range(d, min(d + LANES, dims)):
                    flat[at + e - d] = last[e]
