"""Quintic (C4) and septic (C6) splines, O(N) in the number of points."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import Unsupported
from ..kernels.hermite import hermite_jumps
from ..kernels.splines import hermite_states
from ..trajectory import Trajectory
from .options import Spaced, checked

Array = NDArray[np.float64]

#: Largest relative jump of the lowest derivative that is not a state of the knots (quintic: the jerk): in a gap much
#: shorter than its neighbours the states' rounding is all that is left of it.
CONTINUOUS = 1e-6
#: Neighbouring steps that differ by less than this factor need no such check.
EVEN = 30.0


class QuinticSplineOptions(Spaced):
    """Options of the quintic spline."""


class SepticSplineOptions(Spaced):
    """Options of the septic spline."""


def quintic_spline(times: ArrayLike, points: ArrayLike, start: Any = None, end: Any = None) -> Trajectory:
    """Return the C4 quintic spline through the points.

    Parameters
    ----------
    times : (N,), increasing
    points : (N, D)
    start, end : (2, D)
        Velocity and acceleration at the ends; zero by default.

    Raises
    ------
    Unsupported
        The times are so uneven that double precision cannot keep the derivatives continuous.
    """
    return _odd_spline("quintic_spline", times, points, 3, start, end)


def septic_spline(times: ArrayLike, points: ArrayLike, start: Any = None, end: Any = None) -> Trajectory:
    """Return the C6 septic spline through the points; ``start`` and ``end`` (3, D) hold the jerk as well.

    Raises
    ------
    Unsupported
        As for ``quintic_spline``.
    """
    return _odd_spline("septic_spline", times, points, 4, start, end)


def _odd_spline(name: str, times: ArrayLike, points: ArrayLike, order: int, start: Any, end: Any) -> Trajectory:
    r"""Return the spline of degree 2 k - 1 and class C^(2k-2): it minimises \int |x^(k)|^2 among all such curves."""
    t, x = checked(times, points)
    ends = np.zeros((2, order - 1, x.shape[1]))
    for side, given in enumerate((start, end)):
        if given is not None:
            ends[side] = given
    states = np.empty((order - 1, *x.shape))
    h, jump = np.diff(t), np.zeros(1)
    solved = hermite_states(h, x, ends, np.ones((2, order - 1), dtype=bool), states)
    curve = Trajectory.from_states(t, x, states) if solved else None
    ratio = h[1:] / h[:-1]
    if curve is not None and ratio.size and not 1 / EVEN < ratio.min() <= ratio.max() < EVEN:
        hermite_jumps(h, curve.coefficients, jump)
    if curve is None or not jump[0] <= CONTINUOUS:
        reason = "times this uneven leave the higher derivatives to rounding: even them out, or use cubic_spline"
        raise Unsupported(name, "times", ["cubic_spline"], reason)
    return curve
