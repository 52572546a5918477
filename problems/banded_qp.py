r"""A convex quadratic program with a banded, positive definite Hessian.

.. math:: \min_y\ \tfrac12 y^T H y + g^T y + c \quad\text{s.t.}\quad G y \le h

The band is kept: free minimisation and the dual value cost O(n).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded
from scipy.sparse import csc_matrix, csr_matrix, diags_array

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BandedQP:
    """Statement above; ``bands`` (b + 1, n) is H in LAPACK's upper form, ``rows`` is G (m, n), ``upper`` is h (m,)."""

    bands: Array
    gradient: Array
    constant: float
    rows: csr_matrix
    upper: Array

    def hessian(self) -> csc_matrix:
        """Return H as a sparse matrix."""
        width, n = self.bands.shape
        if not n:
            return csc_matrix((0, 0))
        above = {k: self.bands[width - 1 - k, k:] for k in range(min(width, n))}
        both = {**above, **{-k: v for k, v in above.items()}}
        return csc_matrix(diags_array(list(both.values()), offsets=list(both), shape=(n, n)))

    def value(self, y: Array) -> float:
        """Return the objective at y."""
        return float(0.5 * y @ (self.hessian() @ y) + self.gradient @ y + self.constant)

    def free_minimum(self) -> Array:
        """Return the minimiser without the rows, -H^{-1} g."""
        return -np.asarray(solveh_banded(self.bands, self.gradient))

    def dual_value(self, z: Array) -> float:
        """Return c - 1/2 (g + G'z)' H^{-1} (g + G'z) - h'z: for any z >= 0 no feasible objective is below it."""
        if not len(self.gradient):
            return self.constant
        z = np.maximum(z, 0.0)
        r = self.gradient + self.rows.T @ z
        return float(self.constant - 0.5 * r @ solveh_banded(self.bands, r) - self.upper @ z)

    def residuals(self, y: Array, z: Array) -> dict[str, float]:
        """Return the KKT residuals: rows broken, gradient left (both in the largest entry), and |z'(h - G y)|."""
        slack = self.upper - self.rows @ y
        push = self.rows.T @ z
        left = self.hessian() @ y + self.gradient + push
        scale = max(float(np.abs(self.gradient).max(initial=0.0)), float(np.abs(push).max(initial=0.0)), 1.0)
        return {
            "primal": float(np.maximum(-slack, 0.0).max(initial=0.0)),
            "dual": float(np.abs(left).max(initial=0.0)) / scale,
            "gap": abs(float(z @ slack)),
        }

    def to_qpsolvers(self) -> Any:
        """Return the statement as ``qpsolvers.Problem``."""
        import qpsolvers

        rows = csc_matrix(self.rows) if len(self.upper) else None
        return qpsolvers.Problem(self.hessian(), self.gradient, rows, self.upper if rows is not None else None)


@dataclass(frozen=True, eq=False)
class DualPoint:
    """Multipliers for several independent programs, and the weight of each in the whole objective."""

    programs: tuple[BandedQP, ...]
    multipliers: tuple[Array, ...]
    weights: Array

    def lower_bound(self) -> float:
        """Return the weighted sum of the dual values."""
        values = [p.dual_value(z) for p, z in zip(self.programs, self.multipliers, strict=True)]
        return float(self.weights @ np.array(values))
