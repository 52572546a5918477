"""Integrals over pieces by Gauss-Legendre rules, halving where two rules differ."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Gauss-Legendre rules on [0, 1]: a coarse one of 8 nodes and a fine one of 16, which also looks at both ends.
_COARSE, _FINE = ((0.5 + 0.5 * x, 0.5 * w) for x, w in map(np.polynomial.legendre.leggauss, (8, 16)))
#: The nodes of both and the ends, the last of them doubled up to whole vector registers; and the weights of the rules.
NODES, WEIGHTS = np.concatenate([_COARSE[0], _FINE[0], [0.0], np.ones(7)]), np.concatenate([_COARSE[1], _FINE[1]])
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
        values = function(piece, left[:, None] + width[:, None] * NODES[:26])
        fine = values[:, 8:]
        a, b = (values[:, :8] @ WEIGHTS[:8]) * width, (fine[:, :16] @ WEIGHTS[8:]) * width
        lowest, end, highest = fine.min(axis=1), fine[:, 16:].min(axis=1), fine.max(axis=1)
        scale = max(total + float(b.sum()), 1e-300)
        allowed = np.maximum(1e-11 * scale / np.sqrt(len(a)), noise[piece] * width)
        rough = np.abs(a - b) > allowed
        # it may come down to zero and rise again between the places looked at, unless it rises from a rest at an end
        kink = (lowest < LOW * highest) & (end > 1e-9 * highest)
        if kink.any():
            rough |= kink & (width * highest > 10 * allowed)
        if not rough.any():
            return total + float(b.sum())
        total += float(b[~rough].sum())
        seen += len(piece)
        if rough.sum() > MOST_PIECES or seen > max(most, 8 * pieces):  # rounding, or kinks without end
            break
        piece, half = np.repeat(piece[rough], 2), 0.5 * width[rough]
        left = np.stack([left[rough], left[rough] + half], axis=1).reshape(-1)
        width = np.repeat(half, 2)
    return total + float(b[rough].sum())
