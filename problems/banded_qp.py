r"""A convex quadratic program with a banded, positive definite Hessian; its last rows may be second-order cones.

.. math:: \min_y\ \tfrac12 y^T H y + g^T y + c \quad\text{s.t.}\quad s = h - G y \in K

K is the non-negative orthant, followed by a cone {(r, x): |x| <= r} of every size in ``cones``. The band is kept: free
minimisation and the dual value cost O(n).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.sparse import csc_matrix, csr_matrix, diags_array

Array = NDArray[np.float64]

#: Objectives below this part of what an unknown of size one usually costs are zero but for rounding.
NOTHING = 1e-9
#: And these, in the square of rounding, are no evidence that anything costs at all.
ROUNDING = 1e-20


@dataclass(frozen=True, eq=False)
class BandedQP:
    """Statement above; ``bands`` (b + 1, n) is H in LAPACK's upper form, ``rows`` is G (m, n), ``upper`` is h (m,).

    ``ridge`` is the part of H's diagonal that is not of the problem, but added to make H definite.
    """

    bands: Array
    gradient: Array
    constant: float
    rows: csr_matrix
    upper: Array
    cones: tuple[int, ...] = ()
    ridge: float = 0.0

    def __str__(self) -> str:
        width, n = self.bands.shape
        plain = len(self.upper) - sum(self.cones)
        lines = [
            "minimise    1/2 y'Hy + g'y + c",
            "subject to  h - Gy >= 0" + (f", in {len(self.cones)} second-order cones the rest" if self.cones else ""),
            f"y: {n}, half bandwidth of H: {max(width - 1, 0)}, linear rows: {plain}, entries of G: {self.rows.nnz}",
            f"c = {self.constant:.17g}, |g| <= {np.abs(self.gradient).max(initial=0.0):.6g}",
        ]
        return "\n".join(lines)

    def hessian(self) -> csc_matrix:
        """Return H as a sparse matrix."""
        width, n = self.bands.shape
        if not n:
            return csc_matrix((0, 0))
        above = {k: self.bands[width - 1 - k, k:] for k in range(min(width, n))}
        both = {**above, **{-k: v for k, v in above.items()}}
        return csc_matrix(diags_array(list(both.values()), offsets=list(both), shape=(n, n)))

    def _times(self, y: Array) -> Array:
        """Return H y."""
        found = self.bands[-1] * y
        for t in range(1, min(len(self.bands), len(y))):
            above = self.bands[-1 - t, t:]
            found[t:] += above * y[:-t]
            found[:-t] += above * y[t:]
        return np.asarray(found)

    @cached_property
    def _factors(self) -> Array | None:
        """The Hessian's factors, or None where rounding leaves it indefinite."""
        try:
            return np.asarray(cholesky_banded(self.bands))
        except np.linalg.LinAlgError:
            return None

    def _inverse(self, r: Array) -> Array:
        """Return H^{-1} r; infinite where rounding leaves H indefinite."""
        if not len(r):
            return r
        if self._factors is None:
            return np.full(len(r), np.inf)
        return np.asarray(cho_solve_banded((self._factors, False), r))

    @cached_property
    def _usual(self) -> float:
        """What an unknown of size one usually costs: the median of the Hessian's diagonal."""
        return float(np.median(self.bands[-1])) if self.bands.size else 0.0

    def value(self, y: Array) -> float:
        """Return the objective at y."""
        return float(0.5 * y @ self._times(y) + self.gradient @ y + self.constant)

    def free_minimum(self) -> Array:
        """Return the minimiser without the rows, -H^{-1} g."""
        return -self._inverse(self.gradient)

    def _each_cone(self) -> list[slice]:
        ends = len(self.upper) - sum(self.cones) + np.cumsum((0, *self.cones))
        return [slice(int(i), int(j)) for i, j in zip(ends[:-1], ends[1:], strict=True)]

    def dual_feasible(self, z: Array) -> Array:
        """Return the multipliers nearest by that lie in the dual cone, which is K itself."""
        z = z.copy()
        plain = len(z) - sum(self.cones)
        z[:plain] = np.maximum(z[:plain], 0.0)
        for cone in self._each_cone():
            z[cone.start] = max(z[cone.start], float(np.linalg.norm(z[cone.start + 1 : cone.stop])))
        return z

    def dual_value(self, z: Array) -> float:
        """Return c - 1/2 (g + G'z)' H^{-1} (g + G'z) - h'z: for any z in K no feasible objective is below it."""
        z = self.dual_feasible(z)
        r = self.gradient + self.rows.T @ z
        if len(r) and self._factors is None:
            return -float("inf")
        return float(self.constant - 0.5 * r @ self._inverse(r) - self.upper @ z)

    def best_dual_value(self, z: Array) -> float:
        """Return the largest dual value of a multiple t z, t >= 0: beyond every bound where z proves infeasibility."""
        z = self.dual_feasible(z)
        if len(self.gradient) and self._factors is None:
            return -float("inf")
        push = self.rows.T @ z
        slope = float(-push @ self._inverse(self.gradient) - self.upper @ z)
        if slope <= 0.0:
            return self.dual_value(np.zeros(len(z)))
        bend = float(push @ self._inverse(push))
        return self.dual_value(z * (slope / bend)) if bend > 0.0 else float("inf")

    def residuals(self, y: Array, z: Array) -> dict[str, float]:
        """Return the KKT residuals, recomputed from the statement's matrices, relative to the objective F(y).

        ``primal``: by how much s leaves K; ``dual``: sqrt(r' H^{-1} r / (2 F)) for the gradient left r, whose square is
        what a Newton step could still save; ``complementarity``: |z's| / F.
        """
        slack = self.upper - self.rows @ y
        left = self._times(y) + self.gradient + self.rows.T @ z
        out = float(np.maximum(-slack[: len(slack) - sum(self.cones)], 0.0).max(initial=0.0))
        for cone in self._each_cone():
            out = max(out, float(np.linalg.norm(slack[cone.start + 1 : cone.stop]) - slack[cone.start]))
        size = max(abs(self.value(y)), NOTHING * self._usual, 1e-300)
        if len(left) and self._factors is None:  # then by the entries alone
            gradient = float(np.abs(left).max()) / max(float(np.abs(self.rows.T @ z).max()), size)
        else:
            gradient = float(np.sqrt(max(left @ self._inverse(left), 0.0) / (2.0 * size)))
        return {
            "primal": out,
            "dual": gradient,
            "complementarity": abs(float(z @ slack)) / size,
        }

    def to_qpsolvers(self) -> Any:
        """Return the statement as ``qpsolvers.Problem``, which can also be saved to a file.

        Raises
        ------
        ValueError
            There are second-order cones.
        """
        import qpsolvers

        if self.cones:
            raise ValueError("a program with second-order cones is none of qpsolvers'")
        rows = csc_matrix(self.rows) if len(self.upper) else None
        return qpsolvers.Problem(self.hessian(), self.gradient, rows, self.upper if rows is not None else None)

    def to_casadi(self) -> dict[str, Any]:
        """Return ``x, f, g`` (CasADi SX) with ``lbg, ubg, x0`` (arrays) for a solver of nonlinear programs."""
        import casadi as ca

        x = ca.SX.sym("y", len(self.gradient))
        f = 0.5 * ca.dot(x, ca.DM(self.hessian()) @ x) + ca.dot(ca.DM(self.gradient), x) + self.constant
        s = ca.DM(self.upper) - ca.DM(csc_matrix(self.rows)) @ x
        plain = len(self.upper) - sum(self.cones)
        rows = [s[:plain]]
        for cone in self._each_cone():
            r, rest = s[cone.start], s[cone.start + 1 : cone.stop]
            rows += [r, r * r - ca.dot(rest, rest)]
        return {"x": x, "f": f, "g": ca.vertcat(*rows), "x0": np.zeros(len(self.gradient)), "lbg": 0.0, "ubg": np.inf}


@dataclass(frozen=True, eq=False)
class KKTPoint:
    """A point and multipliers for each of several independent programs, and their weights in the whole objective.

    The objectives are sums of squares: none is below zero.
    """

    programs: tuple[BandedQP, ...]
    points: tuple[Array, ...]
    multipliers: tuple[Array, ...]
    weights: Array

    def lower_bound(self) -> float:
        """Return the weighted sum of the dual values."""
        values = []
        for program, y, z in zip(self.programs, self.points, self.multipliers, strict=True):
            value = program.dual_value(z) - program.ridge * float(program.bands[-1] @ y**2)  # twice what was added
            values.append(value if value > ROUNDING * program._usual else 0.0)
        return float(self.weights @ np.array(values))

    def residuals(self) -> dict[str, float]:
        """Return the largest of the programs' KKT residuals, each relative to its own program."""
        each = [p.residuals(*yz) for p, *yz in zip(self.programs, self.points, self.multipliers, strict=True)]
        return {name: max((e[name] for e in each), default=0.0) for name in ("primal", "dual", "complementarity")}
