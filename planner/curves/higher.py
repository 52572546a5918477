"""Quintic (C4) and septic (C6) splines, O(N) in the number of points."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import Unsupported
from ..kernels import quintic
from ..kernels.hermite import hermite_jumps, hermite_pieces
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
    t, x = checked(times, points)
    return _trajectory(t, _quintic(t, x, _ends(x, 3, start, end), np.empty((6, len(x) - 1, x.shape[1]))))


def quintic_pieces(
    times: ArrayLike, points: ArrayLike, start: Any = None, end: Any = None, out: Array | None = None
) -> Array:
    """Return the coefficients of ``quintic_spline``, (6, N - 1, D), as a ``Trajectory`` has them.

    ``out`` of that shape, C-contiguous, is filled and returned in place of a new array.

    Raises
    ------
    Unsupported
        As for ``quintic_spline``.
    """
    t, x = checked(times, points)
    shape = (6, len(x) - 1, x.shape[1])
    if out is None:
        out = np.empty(shape)
    elif out.shape != shape or out.dtype != np.float64 or not out.flags.c_contiguous or not out.flags.writeable:
        raise ValueError(f"out must be a writeable C-contiguous array of float64 of shape {shape}")
    return _quintic(t, x, _ends(x, 3, start, end), out)


def septic_spline(times: ArrayLike, points: ArrayLike, start: Any = None, end: Any = None) -> Trajectory:
    """Return the C6 septic spline through the points; ``start`` and ``end`` (3, D) hold the jerk as well.

    Raises
    ------
    Unsupported
        As for ``quintic_spline``.
    """
    t, x = checked(times, points)
    out = np.empty((8, len(x) - 1, x.shape[1]))
    return _trajectory(t, _odd_spline("septic_spline", t, x, _ends(x, 4, start, end), out))


def _ends(points: Array, order: int, start: Any, end: Any) -> Array:
    """Return the derivatives of order 1 … order - 1 at both ends, (2, order - 1, D)."""
    ends = np.zeros((2, order - 1, points.shape[1]))
    for side, given in enumerate((start, end)):
        if given is not None:
            ends[side] = given
    return ends


def _trajectory(times: Array, pieces: Array) -> Trajectory:
    """Return the trajectory of these pieces, which nobody else has."""
    pieces.setflags(write=False)
    return Trajectory(times, pieces)


def _quintic(times: Array, points: Array, ends: Array, out: Array) -> Array:
    """Fill ``out`` with the pieces: in windows or, where the steps are too uneven for that, all at once."""
    solved, uneven = quintic.quintic_pieces(times, points, ends, out)
    if not solved:
        return _odd_spline("quintic_spline", times, points, ends, out)
    if not uneven < EVEN:
        _refuse_jumps("quintic_spline", np.diff(times), out)
    return out


def _odd_spline(name: str, times: Array, points: Array, ends: Array, out: Array) -> Array:
    r"""Fill ``out`` with the spline of degree 2 k - 1 and class C^(2k-2), the curve of least \int |x^(k)|^2."""
    states = np.empty((ends.shape[1], *points.shape))
    h = np.diff(times)
    solved = hermite_states(h, points, ends, np.ones(ends.shape[:2], dtype=bool), states)
    if solved:
        hermite_pieces(h, points, states, out)
    ratio = h[1:] / h[:-1]
    if not solved or (ratio.size and not 1 / EVEN < ratio.min() <= ratio.max() < EVEN):
        _refuse_jumps(name, h, out if solved else None)
    return out


def _refuse_jumps(name: str, h: Array, pieces: Array | None) -> None:
    """Raise Unsupported if there are no pieces or the lowest derivative that is no state of the knots jumps."""
    jump = np.zeros(1)
    if pieces is not None:
        hermite_jumps(h, pieces, jump)
    if pieces is None or not jump[0] <= CONTINUOUS:
        reason = "times this uneven leave the higher derivatives to rounding: even them out, or use cubic_spline"
        raise Unsupported(name, "times", ["cubic_spline"], reason)
