"""Where a trajectory is worst: the largest of a linear measure of its derivatives, over all pieces, exactly."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .trajectory import Trajectory

Array = NDArray[np.float64]

#: Places this close to the maximum, relatively, are equally bad: the first of them is told.
TIE = 1e-9


@dataclass(frozen=True, eq=False)
class Worst:
    """The worst place of each order and joint; all arrays (R, D).

    ``most`` is the largest badness (-inf where nothing counts); ``value``, ``time``, ``piece`` and ``badness`` are
    those of a place within 1e-9 of it, of equally bad ones the first; ``side`` is 0 at a maximum of the derivative, 1
    at a minimum.
    """

    most: Array
    badness: Array
    value: Array
    time: Array
    piece: NDArray[np.int64]
    side: NDArray[np.int64]


def worst(trajectory: Trajectory, gain: Array, shift: Array, row: NDArray[np.int64] | None = None) -> Worst:
    """Return the worst place of each derivative and joint, from the exact extrema of the pieces.

    The badness of order m of joint d on piece i is the larger of gain[0, m, r, d] high + shift[0, m, r, d] and
    gain[1, m, r, d] low + shift[1, m, r, d], with r = row[i].

    Parameters
    ----------
    gain, shift : (2, R, S, D)
        gain[0] >= 0 >= gain[1]; a shift of -inf (and a gain of 0) leaves a side out.
    row : (K,)
        Which of the S rows counts for a piece; by default the first.
    """
    row = np.zeros(trajectory.pieces, dtype=np.int64) if row is None else row
    if trajectory.rational:
        return _from_enclosures(trajectory, gain, shift, row)
    from .kernels.worst import worst as kernel

    rate = trajectory.rates
    badness, value, u, piece, side, most = kernel(trajectory.coefficients, rate, row, gain, shift)
    h = np.diff(trajectory.breaks)
    return Worst(most, badness, value, trajectory.breaks[piece] + u * h[piece], piece, side)


def peaks(trajectory: Trajectory, orders: int) -> Array:
    """Return the largest magnitude of the derivatives of order 0 … orders - 1, (orders, D)."""
    if trajectory.rational:
        gain = np.ones((2, orders, 1, trajectory.dims))
        gain[1] = -1.0
        return np.maximum(worst(trajectory, gain, np.zeros_like(gain)).most, 0.0)
    from .kernels.motion import highest

    return np.asarray(highest(trajectory.coefficients, trajectory.rates, trajectory.all_ends(0, orders)))


def measures(lower: Array, upper: Array, scale: Array | None = None) -> tuple[Array, Array]:
    """Return gain and shift (2, R, S, D) that measure by limits (R, S, D): by the ratio to the limit's side.

    With ``scale`` (R, S, D), by the distance beyond the side over that.
    """
    sides = np.array([upper, lower])
    bounded = np.isfinite(sides)
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.abs(sides) if scale is None else scale
        gain = np.where(bounded, np.array([1.0, -1.0])[:, None, None, None] / size, 0.0)
        shift = np.where(bounded, 0.0 if scale is None else -np.abs(gain) * sides * np.sign(gain), -np.inf)
    return gain, shift


def _from_enclosures(trajectory: Trajectory, gain: Array, shift: Array, row: NDArray[np.int64]) -> Worst:
    orders = gain.shape[1]
    found = trajectory.extrema(orders, row)
    values, at = np.stack([found.high, found.low]), np.stack([found.at_high, found.at_low])
    badness = gain[:, :, row] * values + shift[:, :, row]  # (2, R, K, D)
    flat = badness.transpose(2, 0, 1, 3).reshape(-1, orders, trajectory.dims)  # by piece, then side
    most = flat.max(axis=0)
    first = (flat >= most - TIE * np.abs(most)).argmax(axis=0)
    piece, side = np.divmod(first, 2)
    order, joint = np.indices(first.shape)
    where = (side, order, piece, joint)
    return Worst(most, badness[where], values[where], at[where], piece, side)
