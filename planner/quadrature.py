"""Integrals over pieces by Gauss-Legendre rules, halving where two rules differ."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Gauss-Legendre rules on [0, 1]: (nodes, weights), a coarse and a fine one.
_RULES = [(0.5 + 0.5 * x, 0.5 * w) for x, w in map(np.polynomial.legendre.leggauss, (8, 16))]

MOST_PIECES = 1 << 16


def integral(function: Callable[[NDArray[np.int64], Array], Array], pieces: int, noise: Array) -> float:
    """Return the sum over the pieces of the integral of a non-negative function over u in [0, 1], to about 1e-10.

    Parameters
    ----------
    function
        Of piece numbers (I,) and of u (I, M): values (I, M).
    pieces : int
    noise : (K,)
        By how much rounding lets a piece's integral differ.
    """
    piece, left, width = np.arange(pieces), np.zeros(pieces), np.ones(pieces)
    total = 0.0
    for _ in range(48):
        a, b = (width * (function(piece, left[:, None] + width[:, None] * u) @ w) for u, w in _RULES)
        scale = max(total + float(b.sum()), 1e-300)
        rough = np.abs(a - b) > np.maximum(1e-11 * scale / np.sqrt(len(a)), noise[piece] * width)
        total += float(b[~rough].sum())
        if not rough.any():
            return total
        if rough.sum() > MOST_PIECES:  # rounding, or kinks without end: what there is, is good enough
            break
        piece, half = np.repeat(piece[rough], 2), 0.5 * width[rough]
        left = np.stack([left[rough], left[rough] + half], axis=1).reshape(-1)
        width = np.repeat(half, 2)
    return total + float(b[rough].sum())
