"""Piecewise linear interpolation."""

from numpy.typing import ArrayLike

from ..trajectory import Trajectory
from .options import Spaced, checked


class LinearOptions(Spaced):
    """Options of linear interpolation."""


def linear(times: ArrayLike, points: ArrayLike) -> Trajectory:
    """Return the polyline q(t) = (1 - u) q_i + u q_{i+1}, u = (t - t_i) / (t_{i+1} - t_i); class C0.

    Parameters
    ----------
    times : (N,), increasing
    points : (N, D)
    """
    return Trajectory.from_hermite(*checked(times, points))
