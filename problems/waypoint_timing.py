r"""The fastest motion through waypoints, the path between them free: durations and splines of piecewise constant jerk.

.. math::

    \min \sum_i h_i \quad\text{s.t.}\quad q(t_i) = W_i,\ t_{i+1} - t_i = h_i,\quad
    v^- \le \dot q \le v^+,\ a^- \le \ddot q \le a^+,\ j^- \le \dddot q \le j^+,\ p^- \le q \le p^+.

On segment i each joint is a cubic spline of the class C2 over u = (t - t_i) / h_i, with K pieces between the nodes
0 = u_0 < … < u_K = 1: K + 3 B-spline control points, the outer three of which at each end follow from the waypoint and
the state there,

.. math::

    c_1 = W_i + h v u_1 / 3,\quad c_2 = W_i + h v (u_1 + u_2) / 3 + h^2 a u_1 u_2 / 6

(mirrored at the end), so that neighbours share velocity and acceleration and the motion is C2 throughout. Unknown are
the durations, the waypoints' velocities and accelerations, and the K - 3 inner control points of each joint and
segment. A spline lies in the hull of its control points, so the limits hold at all times where those of the velocity
(quadratic), the accelerations at the nodes (linear) and the jerks (constant) keep them, times h, h^2 and h^3: linear
in the control points. Sufficient, and close: only the velocity's points lie off its curve, by a h^2 / 8 a piece.

With ``total`` the sum of the durations is given, and the integral of the squared jerk is least instead:
sum over pieces of (u_(k+1) - u_k) J_k^2 / h^5, each joint in units of its jerk limit.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class WaypointTiming:
    """The statement in SI units, S segments, D joints, all of which move.

    Attributes
    ----------
    waypoints : (S + 1, D)
    nodes : (S, D, K + 1)
        Where the pieces end, in [0, 1]; K >= 4.
    lower, upper : (4, S, D)
        Limits of position, velocity, acceleration and jerk; of position they may be infinite.
    velocity, acceleration : (S + 1, D)
        States asked at the waypoints, NaN where free; those at the ends are all given.
    least, most : (S,)
        Bounds of the durations, s; equal where one is given.
    total : float, optional
        The whole duration, s, where it is given.
    """

    waypoints: Array
    nodes: Array
    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    least: Array
    most: Array
    total: float | None = None

    @property
    def pieces(self) -> int:
        """K, the pieces of a segment."""
        return int(self.nodes.shape[2]) - 1

    @property
    def positions(self) -> bool:
        """Whether a position is limited."""
        return bool(np.isfinite(self.lower[0]).any() or np.isfinite(self.upper[0]).any())

    def units(self) -> Array:
        """Return each joint's largest velocity, acceleration and jerk limit, (3, D): what the program is scaled by."""
        return np.asarray(np.maximum(self.upper[1:], -self.lower[1:]).max(axis=1))

    def knots(self) -> Array:
        """Return the clamped knots of the B-splines, (S, D, K + 7)."""
        return np.asarray(np.pad(self.nodes, ((0, 0), (0, 0), (3, 3)), mode="edge"))

    def to_casadi(self, start: "Spline") -> dict[str, Any]:
        """Return x, f, g, x0, lbx, ubx, lbg, ubg for CasADi's nlpsol, scaled as the interior point's.

        x = (h_i / h0_i; v, a at the waypoints; inner control points, joint by joint in each segment), from ``start``.
        """
        from .waypoint_casadi import to_casadi

        return to_casadi(self, start)


@dataclass(frozen=True, eq=False)
class Spline:
    """A motion through the waypoints: durations (S,) s, velocities and accelerations (S + 1, D), and control points.

    ``control`` (S, D, K + 3) are positions relative to the segment's first waypoint; the outer ones follow from the
    rest and need not be filled in.
    """

    durations: Array
    velocity: Array
    acceleration: Array
    control: Array

    def phases(self, nodes: Array) -> Array:
        """Return every joint's pieces on every segment, (S, D, K + 1, 5).

        Duration, then position relative to the segment's first waypoint, velocity, acceleration and jerk at the start;
        a last one without duration has the state at the end.
        """
        t = np.pad(nodes, ((0, 0), (0, 0), (3, 3)), mode="edge")
        k, c, h = nodes.shape[2] - 1, self.control, self.durations[:, None, None]
        v = 3.0 * np.diff(c, axis=2) / (t[:, :, 4:-1] - t[:, :, 1:-4])[:, :, : k + 2]
        a = 2.0 * np.diff(v, axis=2) / (t[:, :, 4:-2] - t[:, :, 2:-4])[:, :, : k + 1]
        step = np.diff(nodes, axis=2)
        right, left = t[:, :, 4 : k + 5] - t[:, :, 3 : k + 4], t[:, :, 3 : k + 4] - t[:, :, 2 : k + 3]
        out = np.zeros((*c.shape[:2], k + 1, 5))
        out[:, :, :k, 0] = step * h
        out[:, :, :, 2] = (right * v[:, :, : k + 1] + left * v[:, :, 1:]) / (right + left) / h
        out[:, :, :, 3] = a / h**2
        out[:, :, :k, 4] = np.diff(a, axis=2) / step / h**3
        d, _, speed, push, jerk = np.moveaxis(out[:, :, :k], 3, 0)
        out[:, :, 1:, 1] = np.cumsum(d * (speed + d * (push / 2 + d * jerk / 6)), axis=2)
        return out
