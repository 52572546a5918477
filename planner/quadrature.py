"""Integrals over pieces by Gauss-Legendre rules, halving where two rules differ."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Gauss-Legendre rules on [0, 1]: (nodes, weights), a coarse and a fine one; the fine one also looks at both ends.
_COARSE, _INNER = ((0.5 + 0.5 * x, 0.5 * w) for x, w in map(np.polynomial.legendre.leggauss, (8, 16)))
_FINE = np.concatenate([[0.0], _INNER[0], [1.0]]), np.concatenate([[0.0], _INNER[1], [0.0]])
#: Where a function falls to this part of its largest value inside an interval it may have a kink.
LOW = 0.05

#: Intervals looked at together.
MOST_PIECES = 1 << 16


def integral(
    function: Callable[[NDArray[np.int64], Array], Array], pieces: int, noise: Array, most: int = 1 << 18
) -> float:
    """Return the sum over the pieces of the integral of a non-negative function over u in [0, 1], to about 1e-10.

    Parameters
    ----------
    function
        Of piece numbers (I,) and of u (I, M): values (I, M).
    pieces : int
    noise : (K,)
        By how much rounding lets a piece's integral differ.
    most : int
        Intervals looked at in all, or 8 for every piece, before what is found has to do.
    """
    piece, left, width = np.arange(pieces), np.zeros(pieces), np.ones(pieces)
    total, seen = 0.0, 0
    for _ in range(48):
        coarse, fine = (function(piece, left[:, None] + width[:, None] * u) for u, _ in (_COARSE, _FINE))
        a, b = width * (coarse @ _COARSE[1]), width * (fine @ _FINE[1])
        scale = max(total + float(b.sum()), 1e-300)
        allowed = np.maximum(1e-11 * scale / np.sqrt(len(a)), noise[piece] * width)
        rough = (np.abs(a - b) > allowed) | (_hidden_kink(fine) & (width * fine.max(axis=1) > 10 * allowed))
        total += float(b[~rough].sum())
        if not rough.any():
            return total
        seen += len(piece)
        if rough.sum() > MOST_PIECES or seen > max(most, 8 * pieces):  # rounding, or kinks without end
            break
        piece, half = np.repeat(piece[rough], 2), 0.5 * width[rough]
        left = np.stack([left[rough], left[rough] + half], axis=1).reshape(-1)
        width = np.repeat(half, 2)
    return total + float(b[rough].sum())


def _hidden_kink(values: Array) -> NDArray[np.bool_]:
    """Return where a non-negative function may come down to zero and rise again between the places looked at.

    Not where it is smallest at an end, and zero there: then it rises from a rest.
    """
    lowest, highest = values.min(axis=1), values.max(axis=1)
    at_end = np.minimum(values[:, 0], values[:, -1]) <= 1e-9 * highest
    return np.asarray((lowest < LOW * highest) & ~at_end)
