r"""Minimum jerk at fixed times, one quintic per gap, over node states.

.. math::

    \min \int \lVert \dddot q \rVert^2 dt \quad\text{s.t.}\quad q(t_i) = q_i,\ q \in C^2,\
    \dot q, \ddot q \text{ given at both ends}

Between two nodes the quintic is fixed by position, velocity and acceleration there (z = [d, v0 h, a0 h², v1 h, a1 h²],
d the step in position), and its cost is h^{-5} z'Qz. The unknowns are the velocities and accelerations at the interior
nodes, y = (v_1, a_1, v_2, a_2, …): no equality constraints remain, and the Hessian is block-tridiagonal and positive
definite, the same for every joint. A limit on a derivative at one instant is one row in y.
"""

from dataclasses import dataclass
from functools import cached_property
from math import factorial

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from .banded_qp import BandedQP

Array = NDArray[np.float64]

#: Coefficients of u^3, u^4, u^5 from z.
UPPER = np.array([[10.0, -6.0, -1.5, -4.0, 0.5], [-15.0, 8.0, 1.5, 7.0, -1.0], [6.0, -3.0, -0.5, -3.0, 0.5]])
#: Coefficients of 1 … u^5 (less the position at the left) from z.
COEFFICIENTS = np.vstack([np.zeros(5), np.eye(5)[1], 0.5 * np.eye(5)[2], UPPER])
#: Integral of the squared third derivative over u in [0, 1], from the upper coefficients, and from z.
GRAM = np.array([[36.0, 72.0, 120.0], [72.0, 192.0, 360.0], [120.0, 360.0, 720.0]])
COST = UPPER.T @ GRAM @ UPPER


@dataclass(frozen=True, eq=False)
class MinimumJerk:
    """Durations of the gaps (M,), positions (M + 1, D), and at each end velocity and acceleration, (2, D)."""

    h: Array
    positions: Array
    start: Array
    end: Array

    def only(self, joint: int) -> "MinimumJerk":
        """Return the statement of one joint."""
        one = slice(joint, joint + 1)
        return MinimumJerk(self.h, self.positions[:, one], self.start[:, one], self.end[:, one])

    @cached_property
    def _elements(self) -> Array:
        """Return each gap's cost matrix in (d, v0, a0, v1, a1), (M, 5, 5)."""
        scale = np.stack([np.ones_like(self.h), self.h, self.h**2, self.h, self.h**2], axis=1)
        return np.asarray(scale[:, :, None] * COST * scale[:, None, :] / self.h[:, None, None] ** 5)

    @cached_property
    def bands(self) -> Array:
        """Return the Hessian over the interior node states in LAPACK's upper banded form, (4, 2 (M - 1))."""
        k = self._elements
        inner = len(self.h) - 1
        bands = np.zeros((4, 2 * inner))
        diagonal = 2.0 * (k[:-1, 3:, 3:] + k[1:, 1:3, 1:3])
        bands[3, 0::2], bands[3, 1::2], bands[2, 1::2] = diagonal[:, 0, 0], diagonal[:, 1, 1], diagonal[:, 0, 1]
        across = 2.0 * k[1:-1, 1:3, 3:]
        bands[1, 2::2], bands[0, 3::2] = across[:, 0, 0], across[:, 0, 1]
        bands[2, 2::2], bands[1, 3::2] = across[:, 1, 0], across[:, 1, 1]
        return bands

    @cached_property
    def gradients(self) -> Array:
        """Return the linear terms, (2 (M - 1), D)."""
        k, step = self._elements, np.diff(self.positions, axis=0)
        left, right = k[:-1, 3:, 0, None] * step[:-1, None, :], k[1:, 1:3, 0, None] * step[1:, None, :]
        g = 2.0 * (left + right)
        if len(g):
            g[0] += 2.0 * k[0, 3:, 1:3] @ self.start
            g[-1] += 2.0 * k[-1, 1:3, 3:] @ self.end
        return np.asarray(g.reshape(-1, self.positions.shape[1]))

    @cached_property
    def constants(self) -> Array:
        """Return the constant terms, (D,)."""
        k, step = self._elements, np.diff(self.positions, axis=0)
        total = (k[:, 0, 0, None] * step**2).sum(axis=0)
        for gap, index, state in ((0, slice(1, 3), self.start), (-1, slice(3, 5), self.end)):
            total += 2.0 * step[gap] * (k[gap, 0, index] @ state)
            total += np.einsum("kd,kl,ld->d", state, k[gap, index, index], state)
        if len(self.h) == 1:
            total += 2.0 * np.einsum("kd,kl,ld->d", self.start, k[0, 1:3, 3:], self.end)
        return np.asarray(total)

    def states(self, y: Array) -> tuple[Array, Array]:
        """Return velocities and accelerations at all nodes, (M + 1, D) each, from y (2 (M - 1), D)."""
        inner = y.reshape(len(self.h) - 1, 2, self.positions.shape[1])
        velocity = np.concatenate([self.start[:1], inner[:, 0], self.end[:1]])
        acceleration = np.concatenate([self.start[1:], inner[:, 1], self.end[1:]])
        return velocity, acceleration

    def row(self, gap: int, u: float, order: int, joint: int) -> tuple[list[int], list[float], float]:
        """Return the derivative at u in [0, 1] of a gap as indices and values over y, plus a constant."""
        power = np.array(
            [factorial(k) // factorial(k - order) * u ** (k - order) if k >= order else 0 for k in range(6)]
        )
        h = float(self.h[gap])
        weights = (power @ COEFFICIENTS) * np.array([1.0, h, h**2, h, h**2]) / h**order
        step = self.positions[gap + 1, joint] - self.positions[gap, joint]
        constant = weights[0] * step + (self.positions[gap, joint] if order == 0 else 0.0)
        indices: list[int] = []
        values: list[float] = []
        for node, pair in ((gap, weights[1:3]), (gap + 1, weights[3:5])):
            if node == 0:
                constant += pair @ self.start[:, joint]
            elif node == len(self.h):
                constant += pair @ self.end[:, joint]
            else:
                indices += [2 * node - 2, 2 * node - 1]
                values += [float(p) for p in pair]
        return indices, values, float(constant)

    def joint(self, joint: int, rows: csr_matrix | None = None, upper: Array | None = None) -> BandedQP:
        """Return one joint's quadratic program, with rows G y <= h."""
        n = 2 * (len(self.h) - 1)
        rows = csr_matrix((0, n)) if rows is None else rows
        upper = np.zeros(0) if upper is None else upper
        return BandedQP(self.bands, self.gradients[:, joint], float(self.constants[joint]), rows, upper)
