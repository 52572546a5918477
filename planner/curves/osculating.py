"""Global Hermite interpolation: one polynomial that takes values and slopes at all nodes."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from ..trajectory import Trajectory
from .barycentric import refuse_ill_conditioned, refuse_missed
from .local_hermite import tangents
from .newton import newton_trajectory
from .options import Matrix, Spaced, checked, derivatives, rows_of

Array = NDArray[np.float64]


class HermiteOptions(Spaced):
    """Options of osculating interpolation."""

    velocities: Matrix | None = Field(
        default=None,
        description="N×D velocities at the waypoints, unit/s (default: finite differences, with a warning)",
        json_schema_extra={"unit": "unit/s"},
    )

    @property
    def fixes_knots(self) -> bool:
        """Whether every waypoint has a velocity of its own."""
        return self.velocities is not None

    @property
    def moves_by_itself(self) -> bool:
        """Whether there are velocities, which move equal waypoints too."""
        return self.velocities is not None


def hermite(times: ArrayLike, points: ArrayLike, velocities: ArrayLike) -> Trajectory:
    r"""Return the polynomial of degree 2 N - 1 with the given values and slopes.

    .. math:: p(t) = \sum_i x_i [1 - 2 l_i'(t_i)(t - t_i)] l_i(t)^2 + v_i (t - t_i) l_i(t)^2

    evaluated in Newton's form on doubled nodes.

    Parameters
    ----------
    times : (N,), increasing
    points, velocities : (N, D)

    Raises
    ------
    InvalidRequest
        ``bad_degree`` where the nodes are too ill conditioned to be of use.

    References
    ----------
    J. Stoer and R. Bulirsch, Introduction to Numerical Analysis, Springer, 2002, section 2.1.5.
    """
    t, x = checked(times, points)
    v = derivatives(velocities, x, "/options/velocities")
    refuse_ill_conditioned(t, float(t[0]), float(t[-1]), "cubic_hermite", twice=True)
    curve = newton_trajectory(t, x, v, float(t[0]), float(t[-1]))
    refuse_missed(curve, t, x, "cubic_hermite")
    return curve


def from_options(options: HermiteOptions, times: Array, points: Array) -> Trajectory:
    """Return the curve that the options describe; velocities that were not given are finite differences."""
    if options.velocities is None:
        return hermite(times, points, tangents(times, points, "finite_difference"))
    return hermite(times, points, rows_of(options.velocities, points.shape, "/options/velocities"))
