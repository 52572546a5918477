r"""Time-optimal timing of a fixed path q(s), transcribed at stations s_0 < … < s_n, from rest to rest.

With a = sdot², b = sddot = a'/2 and c = b' (primes: d/ds),

.. math::

    \min \int \frac{ds}{\sqrt a} \quad\text{s.t.}\quad
    (q')^2 a \le v^2,\quad q'' a + q' b \in [\underline a, \overline a],\quad
    \sqrt a\,(q''' a + 3 q'' b + q' c) \in [\underline j, \overline j]

Without a jerk limit b is constant between stations: all rows are linear in the a_i and the program is convex. With one
c is constant between stations (a is a C1 quadratic spline, a_{i+1} - a_i = (b_i + b_{i+1}) h_i), and the first and the
last step have constant path jerk: b = 2a / (3h), sdddot = 2 a^{3/2} / (9 h²). The integral is Simpson's rule, which
keeps a positive, and b from swinging, between the stations. Limits are rows at the stations, with the path's one-sided
derivatives there; nothing is asked between.

References: D. Verscheure et al., Time-optimal path tracking for robots: a convex optimization approach, 2009.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PathTiming:
    """Steps h (n,); q', q'', q''' at the left and right end of each, (2, 3, n, D); limits of v, a, j, (3, D) each."""

    steps: Array
    derivatives: Array
    lower: Array
    upper: Array
    jerk: bool

    def fastest(self) -> Array:
        """Return the largest a at the inner stations that the velocity limits allow, (n - 1,)."""
        best = np.full(len(self.steps) - 1, np.inf)
        for slope in (self.derivatives[0, 0, 1:], self.derivatives[1, 0, :-1]):
            side = np.where(slope > 0, self.upper[0], -self.lower[0])
            with np.errstate(divide="ignore"):
                best = np.minimum(best, ((side / np.abs(slope)) ** 2).min(axis=1))
        return best

    def to_casadi(self, a: Array, b: Array) -> dict[str, Any]:
        """Return ``x, f, g`` (CasADi SX) with ``lbx, ubx, lbg, ubg, x0`` (arrays) for an NLP solver.

        x = (a at the n - 1 inner stations), with jerk followed by b there; the arguments are a guess of both.
        """
        import casadi as ca

        count, h = len(self.steps) - 1, self.steps
        x = ca.SX.sym("x", 2 * count if self.jerk else count)
        va = x[:count]
        root = ca.sqrt(va)
        low_a, high_a = 1e-9 * a, self.fastest()
        high_a = np.where(high_a > 1e6 * a.max(), np.inf, high_a)  # solvers relax bounds in proportion: huge ones hurt
        start = np.clip(a, 2.0 * low_a, 0.98 * high_a)
        if self.jerk:
            vb = x[count:]
            ends = 3 * h[0] / root[0] + 3 * h[-1] / root[-1]
            middle = (va[:-1] + va[1:]) / 2 - (vb[1:] - vb[:-1]) * h[1:-1] / 4
            cost = ends + ca.sum1(h[1:-1] / 6 * (1 / root[:-1] + 4 / ca.sqrt(middle) + 1 / root[1:]))
            rows = _Rows(ca)
            rows.equal(va[1:] - va[:-1] - (vb[:-1] + vb[1:]) * h[1:-1])
            rows.equal(3 * h[0] * vb[0] - 2 * va[0])
            rows.equal(3 * h[-1] * vb[-1] + 2 * va[-1])
            self._third_order(rows, va, vb, root)
            low = np.concatenate([low_a, np.full(count, -np.inf)])
            high = np.concatenate([high_a, np.full(count, np.inf)])
            start = np.concatenate([start, b])
        else:
            full = ca.vertcat(0, root, 0)
            cost = ca.sum1(2 * h / (full[:-1] + full[1:]))
            rows = _Rows(ca)
            self._second_order(rows, ca.vertcat(0, va, 0))
            low, high = low_a, high_a
        return {"x": x, "f": cost, "x0": start, "lbx": low, "ubx": high, **rows.done()}

    def _second_order(self, rows: "_Rows", a: Any) -> None:
        b = (a[1:] - a[:-1]) / (2 * self.steps)
        for end, at in ((0, a[:-1]), (1, a[1:])):
            for d in range(self.derivatives.shape[3]):
                q1, q2 = self.derivatives[end, :2, :, d]
                rows.within(q2 * at + q1 * b, self.lower[1, d], self.upper[1, d])

    def _third_order(self, rows: "_Rows", a: Any, b: Any, root: Any) -> None:
        h = self.steps
        c = (b[1:] - b[:-1]) / h[1:-1]
        for d in range(self.derivatives.shape[3]):
            q1, q2 = self.derivatives[0, :2, 1:, d]
            rows.within(q2 * a + q1 * b, self.lower[1, d], self.upper[1, d])
            bounds = self.lower[2, d], self.upper[2, d]
            for end, at in ((0, slice(None, -1)), (1, slice(1, None))):
                q1, q2, q3 = self.derivatives[end, :, 1:-1, d]
                rows.within(root[at] * (q3 * a[at] + 3 * q2 * b[at] + q1 * c), *bounds)
            for step, inner, outer, i in ((0, 1, 0, 0), (-1, 0, 1, -1)):  # the steps out of and into rest
                jerk = 2 * a[i] * root[i] / (9 * h[step] ** 2)
                q1, q2, q3 = self.derivatives[inner, :, step, d]
                rows.within(root[i] * (q3 * a[i] + 3 * q2 * b[i]) + q1 * jerk, *bounds)
                rows.within(self.derivatives[outer, 0, step, d] * jerk, *bounds)

    def read(self, x: Array) -> tuple[Array, Array, Array]:
        """Return speeds sdot and accelerations sddot at the stations, (n + 1,) each, and the time steps (n,).

        Time steps are infinite where sdot² would vanish between stations.
        """
        count, h = len(self.steps) - 1, self.steps
        a = np.concatenate([[0.0], np.maximum(x[:count], 0.0), [0.0]])
        speed = np.sqrt(a)
        if not self.jerk:
            return speed, np.zeros_like(speed), 2.0 * h / (speed[:-1] + speed[1:])
        b = np.concatenate([[0.0], x[count:], [0.0]])
        nodes, weights = np.polynomial.legendre.leggauss(10)
        at = 0.5 * (nodes + 1.0)
        inside = a[:-1, None] + h[:, None] * at * (2.0 * b[:-1, None] + np.diff(b)[:, None] * at)
        with np.errstate(divide="ignore"):
            steps = 0.5 * h * (weights / np.sqrt(np.maximum(inside, 0.0))).sum(axis=1)
        steps[0], steps[-1] = 3.0 * h[0] / speed[1], 3.0 * h[-1] / speed[-2]
        return speed, b, steps


class _Rows:
    """Collects constraint rows with their bounds, scaled to one."""

    def __init__(self, casadi: Any) -> None:
        self.ca = casadi
        self.g: list[Any] = []
        self.low: list[Array] = []
        self.high: list[Array] = []

    def equal(self, expression: Any) -> None:
        """Add ``expression = 0``."""
        self.g.append(expression)
        self.low.append(np.zeros(expression.shape[0]))
        self.high.append(np.zeros(expression.shape[0]))

    def within(self, expression: Any, low: float, high: float) -> None:
        """Add ``low <= expression <= high`` unless both are infinite."""
        scale = max((abs(v) for v in (low, high) if np.isfinite(v)), default=None)
        if scale is not None:
            self.g.append(expression / scale)
            self.low.append(np.full(expression.shape[0], low / scale))
            self.high.append(np.full(expression.shape[0], high / scale))

    def done(self) -> dict[str, Any]:
        """Return the rows as ``g, lbg, ubg``."""
        return {"g": self.ca.vertcat(*self.g), "lbg": np.concatenate(self.low), "ubg": np.concatenate(self.high)}
