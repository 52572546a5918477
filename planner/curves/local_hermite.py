"""The cubic Hermite spline and the rules that give it tangents."""

from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Discriminator, Field, Tag

from ..trajectory import Trajectory
from .options import Matrix, Spaced, checked, derivatives, rows_of

Array = NDArray[np.float64]

Rule = Literal["catmull_rom", "finite_difference", "monotone"]


def _form(value: Any) -> str:
    return "#velocities" if isinstance(value, (list, tuple)) else "#rule"


TangentOption = Annotated[Annotated[Rule, Tag("#rule")] | Annotated[Matrix, Tag("#velocities")], Discriminator(_form)]


class CubicHermiteOptions(Spaced):
    """Options of the cubic Hermite spline."""

    tangents: TangentOption = Field(
        default="catmull_rom",
        description="N×D velocities at the waypoints, per second, or a rule: catmull_rom (from the waypoint before "
        "to the one after), finite_difference (mean of both slopes), monotone (no overshoot)",
        json_schema_extra={"unit": "unit/s"},
    )

    @property
    def fixes_knots(self) -> bool:
        """Whether every waypoint has a tangent of its own."""
        return not isinstance(self.tangents, str)

    @property
    def moves_by_itself(self) -> bool:
        """Whether there are tangents, which move equal waypoints too."""
        return not isinstance(self.tangents, str)


def tangents(times: ArrayLike, points: ArrayLike, rule: Rule = "catmull_rom") -> Array:
    """Return velocities at the points, (N, D), from slopes d_i = (x_{i+1} - x_i) / (t_{i+1} - t_i).

    catmull_rom: (x_{i+1} - x_{i-1}) / (t_{i+1} - t_{i-1}); finite_difference: (d_{i-1} + d_i) / 2; the outer slopes at
    the ends. monotone: the latter, zero where the slopes differ in sign, and drawn back to the circle of radius 3 where
    the spline would overshoot.

    References
    ----------
    F. N. Fritsch and R. E. Carlson, Monotone piecewise cubic interpolation, SIAM J. Numer. Anal. 17(2), 1980.
    """
    t, x = checked(times, points)
    d = np.diff(x, axis=0) / np.diff(t)[:, None]
    if rule == "catmull_rom":
        inner = (x[2:] - x[:-2]) / (t[2:] - t[:-2])[:, None]
    else:
        inner = 0.5 * (d[:-1] + d[1:])
    v = np.concatenate([d[:1], inner, d[-1:]])
    return _monotone(v, d) if rule == "monotone" else v


def _monotone(v: Array, d: Array) -> Array:
    """Limit velocities so that every piece is monotone: those over the slope lie within a circle of radius 3."""
    v = v.copy()
    v[1:-1][d[:-1] * d[1:] <= 0.0] = 0.0
    for i in range(len(d)):  # in turn, as the neighbour's limit counts for the next piece
        flat = d[i] == 0.0
        v[i][flat] = v[i + 1][flat] = 0.0
        slope = np.where(flat, 1.0, d[i])
        size = np.hypot(v[i] / slope, v[i + 1] / slope)
        scale = np.where(size > 3.0, 3.0 / np.maximum(size, 3.0), 1.0)
        v[i] *= scale
        v[i + 1] *= scale
    return v


def cubic_hermite(times: ArrayLike, points: ArrayLike, velocities: ArrayLike | None = None) -> Trajectory:
    """Return the C1 cubic spline with the given points and velocities (per second; by default those of Catmull-Rom).

    On a piece of duration h, with tangents t = h velocity in u: c0 = m0, c1 = t0, c2 = -3 m0 - 2 t0 + 3 m1 - t1,
    c3 = 2 m0 + t0 - 2 m1 + t1.

    Parameters
    ----------
    times : (N,), increasing
    points, velocities : (N, D)
    """
    t, x = checked(times, points)
    rates = tangents(t, x) if velocities is None else derivatives(velocities, x, "/options/tangents")
    return Trajectory.from_hermite(t, x, rates)


def from_options(options: CubicHermiteOptions, times: Array, points: Array) -> Trajectory:
    """Return the curve that the options describe."""
    if isinstance(options.tangents, str):
        return cubic_hermite(times, points, tangents(times, points, options.tangents))
    return cubic_hermite(times, points, rows_of(options.tangents, points.shape, "/options/tangents"))
