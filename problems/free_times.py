r"""Splines of degree 2k - 1 with free durations: least energy plus weight times duration, or least duration.

.. math::

    \min_{h, x} \int \lVert q^{(k)} \rVert^2 dt + \rho \sum_i h_i \quad\text{or}\quad \min_{h, x} \sum_i h_i
    \quad\text{s.t.}\quad q(t_i) = q_i,\ \underline q^{(m)} \le q^{(m)} \le \overline q^{(m)},\ m = 0, \dots, 3

with h the durations of the gaps and x the node states: the derivatives 1 … k-1 at the waypoints, which with the
positions fix one polynomial of degree 2k - 1 per gap. Where a derivative is given at an end it is no variable. With
z = (rise, h x_1, h² x_2, … at the left, the same at the right) a gap's energy is h^{1 - 2k} z'Qz and its m-th
derivative at u in [0, 1] is h^{-m} w_m(u) z. Limits are rows at places that the caller chooses. Not convex.
"""

from dataclasses import dataclass
from functools import cache, cached_property
from math import factorial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .banded_qp import KKTPoint
from .minimum_derivative import element_cost, hermite_basis

Array = NDArray[np.float64]

#: A place: gap, u in [0, 1], order of the derivative, joint.
Place = tuple[int, float, int, int]


@cache
def basis(order: int) -> Array:
    """Return the coefficients of 1, u, …, u^(2k-1) less the position at the left from z (see above), (2k, 2k - 1)."""
    k = order
    return np.asarray(hermite_basis(k)[:, [k, *range(1, k), *range(k + 1, 2 * k)]])


@cache
def energy_matrix(order: int) -> Array:
    """Return Q, (2k - 1, 2k - 1)."""
    k = order
    kept = [k, *range(1, k), *range(k + 1, 2 * k)]
    return np.asarray(element_cost(k)[np.ix_(kept, kept)])


@dataclass(frozen=True, eq=False)
class FreeDurations:
    """Positions (N, D); order k; end states (2, k - 1, D), NaN where free; bounds (4, N - 1, D) or None.

    The objective is ``cost`` (D + 1,): what a unit of each joint's energy and of time costs. ``low``, ``high`` (N - 1,)
    bound the durations, ``least`` and ``most`` their sum.
    """

    positions: Array
    order: int
    ends: Array
    cost: Array
    lower: Array | None = None
    upper: Array | None = None
    low: Array | None = None
    high: Array | None = None
    least: float = 0.0
    most: float = float("inf")

    @cached_property
    def _free(self) -> NDArray[np.bool_]:
        """Return which node states are variables, (k - 1, N, D)."""
        free = np.ones((self.order - 1, *self.positions.shape), dtype=bool)
        free[:, 0], free[:, -1] = np.isnan(self.ends)
        return free

    def vector(self, h: Array, states: Array) -> Array:
        """Return the variables: log h, then the free node states."""
        return np.concatenate([np.log(h), states[self._free]])

    def read(self, x: Array) -> tuple[Array, Array]:
        """Return h (M,) and node states (k - 1, N, D)."""
        gaps = len(self.positions) - 1
        states = np.zeros(self._free.shape)
        states[:, 0], states[:, -1] = self.ends
        states[self._free] = x[gaps:]
        return np.exp(x[:gaps]), states

    def to_casadi(self, h: Array, states: Array, places: Array, more: tuple[Place, ...] = ()) -> dict[str, Any]:
        """Return ``x, f, g`` (CasADi SX) with ``lbx, ubx, lbg, ubg, x0`` (arrays) for an NLP solver.

        Parameters
        ----------
        h, states
            A guess: (M,), (k - 1, N, D).
        places : (P,)
            Where in [0, 1] every gap keeps its limits; besides at the places ``more``.
        """
        import casadi as ca

        gaps, dims = len(self.positions) - 1, self.positions.shape[1]
        start = self.vector(h, states)
        x = ca.SX.sym("x", len(start))
        steps = ca.exp(x[:gaps])
        nodes = self._nodes(ca, x)
        z = [self._entries(ca, steps, nodes, d) for d in range(dims)]
        total = ca.sum1(steps)
        quad = energy_matrix(self.order)
        cost = float(self.cost[-1]) * total
        for d in range(dims):
            if self.cost[d] > 0:
                energy = ca.sum2((z[d] @ ca.DM(quad)) * z[d])
                cost = cost + float(self.cost[d]) * ca.sum1(energy * steps ** (1 - 2 * self.order))
        rows = [total]
        low, high = [np.array([self.least])], [np.array([self.most])]
        if self.lower is not None and self.upper is not None:
            for m in range(4):
                weights = [(float(u), self._weights(float(u), m)) for u in places]
                for d in range(dims):
                    own = [(u, w, list(range(gaps))) for u, w in weights]
                    own += [(u, self._weights(u, m), [i]) for i, u, order, joint in more if (order, joint) == (m, d)]
                    for u, w, which in own:
                        self._limit(ca, rows, low, high, steps, z[d], (m, d, u), w, which)
        lbx, ubx = np.full(len(start), -np.inf), np.full(len(start), np.inf)
        with np.errstate(divide="ignore"):
            if self.low is not None:
                lbx[:gaps] = np.log(self.low)
            if self.high is not None:
                ubx[:gaps] = np.log(self.high)
        return {
            "x": x,
            "f": cost,
            "g": ca.vertcat(*rows),
            "x0": start,
            "lbx": lbx,
            "ubx": ubx,
            "lbg": np.concatenate(low),
            "ubg": np.concatenate(high),
        }

    def _nodes(self, ca: Any, x: Any) -> list[list[Any]]:
        """Return the derivatives 1 … k-1 of each joint at all nodes, as columns [r][d] of N."""
        free, at = self._free, len(self.positions) - 1
        count, dims = self.positions.shape
        cells: list[list[list[Any]]] = [[[None] * count for _ in range(dims)] for _ in range(self.order - 1)]
        for r in range(self.order - 1):
            for i in range(count):
                for d in range(dims):
                    if free[r, i, d]:
                        cells[r][d][i] = x[at]
                        at += 1
                    else:
                        cells[r][d][i] = float(self.ends[0 if i == 0 else 1, r, d])
        return [[ca.vertcat(*cells[r][d]) for d in range(dims)] for r in range(self.order - 1)]

    def _entries(self, ca: Any, steps: Any, nodes: list[list[Any]], d: int) -> Any:
        """Return z of a joint in all gaps, (M, 2k - 1)."""
        rise = ca.DM(np.diff(self.positions[:, d]))
        left = [steps ** (r + 1) * nodes[r][d][:-1] for r in range(self.order - 1)]
        right = [steps ** (r + 1) * nodes[r][d][1:] for r in range(self.order - 1)]
        return ca.horzcat(rise, *left, *right)

    def _weights(self, u: float, m: int) -> Array:
        """Return w_m(u), (2k - 1,)."""
        size = 2 * self.order
        power = [factorial(n) // factorial(n - m) * u ** (n - m) if n >= m else 0.0 for n in range(size)]
        return np.asarray(np.array(power) @ basis(self.order))

    def _limit(
        self,
        ca: Any,
        rows: list[Any],
        low: list[Array],
        high: list[Array],
        steps: Any,
        z: Any,
        what: tuple[int, int, float],
        weights: Array,
        which: list[int],
    ) -> None:
        """Add the limits of order m of joint d at a place u on some gaps, scaled to one."""
        assert self.lower is not None and self.upper is not None
        m, d, u = what
        if m == 0 and u in (0.0, 1.0):
            return
        sides = np.stack([self.lower[m, which, d], self.upper[m, which, d]])
        kept = np.isfinite(sides).any(axis=0)
        if not kept.any():
            return
        at = [which[i] for i in np.flatnonzero(kept)]
        sides = sides[:, kept]
        value = (z[at, :] @ ca.DM(weights)) / steps[at] ** m
        if m == 0:
            value = value + ca.DM(self.positions[at, d])
        size = np.where(np.isfinite(sides), np.abs(sides), 0.0).max(axis=0)
        size = np.where(size > 0, size, 1.0)
        rows.append(value / ca.DM(size))
        low.append(sides[0] / size)
        high.append(sides[1] / size)


@dataclass(frozen=True, eq=False)
class Stationary:
    """A point of the statement without limits or bounds, for judging it.

    Durations h (M,), positions and derivatives at the nodes (k, N, D), what a unit of time costs, and the point
    ``inner`` of the problem with those durations given.
    """

    h: Array
    states: Array
    time_weight: float
    inner: KKTPoint

    def lower_bound(self) -> float:
        """Return NaN: the problem is not convex, no bound is known."""
        return float("nan")

    def residuals(self) -> dict[str, float]:
        """Return the inner problem's residuals; ``dual`` is at least the largest dF / dlog h over the objective F.

        By the envelope theorem that is the derivative at fixed node states.
        """
        k, h = len(self.states), self.h[:, None]
        powers = np.arange(k)[:, None, None]
        w = np.concatenate([self.states[:, :-1] * h**powers, self.states[:, 1:] * h**powers])
        w[k] -= w[0]
        w[0] = 0.0
        turned = np.concatenate([powers, powers]) * w  # dw / dlog h
        cost = element_cost(k)
        energy = np.einsum("amd,ab,bmd->m", w, cost, w) * self.h ** (1 - 2 * k)
        slope = (1 - 2 * k) * energy + 2.0 * np.einsum("amd,ab,bmd->m", turned, cost, w) * self.h ** (1 - 2 * k)
        slope += self.time_weight * self.h
        total = float(energy.sum() + self.time_weight * self.h.sum())
        inner = self.inner.residuals()
        return {**inner, "dual": max(inner["dual"], float(np.abs(slope).max()) / max(total, 1e-300))}
