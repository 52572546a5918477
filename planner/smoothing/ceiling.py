r"""How much the limits themselves let a motion cost: what proves a program infeasible whose dual value is above it.

On a gap of length h a polynomial of degree n that stays within b of some value has, by V. A. Markov's inequality, a
j-th derivative of at most b (2 / h)^j T_n^{(j)}(1), T_n being Chebyshev's polynomial.
"""

from math import inf, prod

import numpy as np
from numpy.typing import NDArray

from problems.minimum_derivative import MinimumDerivative

from .linear import LinearLimits

Array = NDArray[np.float64]


def chebyshev_slope(n: int, j: int) -> float:
    """Return the j-th derivative of T_n at 1: the product over i < j of (n² - i²) / (2 i + 1)."""
    return prod((n * n - i * i) / (2 * i + 1) for i in range(j))


def most_cost(statement: MinimumDerivative, limits: LinearLimits, norm: Array | None = None) -> float:
    """Return a cost, scaled, that no best motion within the limits exceeds; infinite where a gap is not limited.

    The statement's unknowns are to count from the optimum without limits.
    """
    k = statement.order
    total = 0.0
    for d in range(statement.dims):
        own = (limits.directions[:, 0, d] != 0) & ((limits.directions != 0).sum(axis=2).max(axis=1) == 1)
        most = np.full(len(statement.h), inf)
        for c in np.flatnonzero(own & limits.everywhere & (limits.orders <= k)):
            m = int(limits.orders[c])
            middle_free = 0.5 * (limits.upper[c] - limits.lower[c])
            wide = middle_free if m < k else np.maximum(np.abs(limits.upper[c]), np.abs(limits.lower[c]))
            most = np.fmin(most, _highest(wide, statement, m))
        if norm is not None:
            most = np.fmin(most, _highest(norm, statement, 1))
        if not own.any() and not statement.bound:  # nothing keeps it from its own optimum, from which unknowns count
            total += float(statement.constants[d])
        else:
            total += float((statement.h * most**2).sum())
    return total * (1.0 + 1e-9)


def _highest(width: Array, statement: MinimumDerivative, order: int) -> Array:
    k = statement.order
    return np.asarray(width * (2.0 / statement.h) ** (k - order) * chebyshev_slope(2 * k - 1 - order, k - order))
