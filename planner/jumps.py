"""Which jumps at a trajectory's breaks count as such, and which are rounding."""

import numpy as np
from numpy.typing import NDArray

from .pieces import differentiated
from .trajectory import Trajectory

Array = NDArray[np.float64]

#: A jump counts above this part of the derivative's peak.
JUMP = 1e-6


#: By how much a curve's rounding may grow from one derivative to the next, in units of the step.
GROWTH = 16.0


def smoothness_lost(trajectory: Trajectory, order: int, peak: Array, span: float = 1.0) -> bool:
    """Return whether a derivative jumps by more than rounding explains: what a curve's class is judged by.

    More lenient than ``counted_jumps``, by which limits are judged: where a derivative is nothing but rounding (that of
    a straight line, say) its jumps do not count, however the curve was computed; not so in pieces much shorter than
    their neighbours, which could hide anything.
    """
    counted = counted_jumps(trajectory, order, peak, span)
    if order == 0 or not counted.any():
        return bool(counted.any())
    left, right = trajectory.ends(order)
    h = np.diff(trajectory.breaks)[:, None]
    size = np.abs(np.concatenate(trajectory.ends(0))).max(axis=0)
    noise = 64 * np.finfo(float).eps * GROWTH**order * size / np.maximum(h[1:], h[:-1]) ** order
    return bool((counted & (np.abs(left[1:] - right[:-1]) > noise)).any())


def counted_jumps(trajectory: Trajectory, order: int, peak: Array, span: float = 1.0) -> NDArray[np.bool_]:
    """Return which jumps of a derivative at the interior breaks count, shape (K - 1, D).

    Positions: above 1e-6 x ``span``; other derivatives: above 1e-6 of their ``peak`` (D,) and above the rounding of
    values and of the clock.
    """
    if trajectory.pieces == 1:
        return np.zeros((0, trajectory.dims), dtype=bool)
    here, there = trajectory.ends(order)
    jumps = np.abs(here[1:] - there[:-1])
    if order == 0:
        return np.asarray(jumps > JUMP * span)
    eps, h = np.finfo(float).eps, np.diff(trajectory.breaks)[:, None]
    c = np.abs(trajectory.coefficients)
    if trajectory.weights is not None:  # where the denominator is small, so is what rounding is relative to
        c = c / np.minimum(trajectory.weights[-1], trajectory.weights.sum(axis=0))[:, None]
    size, position = c[:-1].max(axis=0, initial=0.0), c[-1]
    own = differentiated(c, order).sum(axis=0) / h**order
    rounding = 64 * eps * np.maximum(size / h**order, own)
    floor = 1e3 * eps * position / h**order
    noise = (own <= floor).all(axis=0)  # a joint that stands still but for rounding of where it stands
    rounding = np.where(noise, np.maximum(rounding, floor), rounding)
    tick = eps * np.abs(trajectory.breaks[1:-1, None])  # what the clock cannot tell moves a break, and scales pieces
    peaks, rates = (np.maximum(np.abs(a[1:]), np.abs(b[:-1])) for a, b in ((here, there), trajectory.ends(order + 1)))
    clock = tick * rates + order * tick / np.minimum(h[1:], h[:-1]) * peaks
    stand = 8 * eps * position / h**order  # where it stands is rounded too; that may hide no large jump
    stand = np.minimum(np.maximum(stand[1:], stand[:-1]), 1e-3 * peak)
    allowed = np.maximum(rounding[1:], rounding[:-1]) + np.minimum(clock, 1e-2 * peak) + stand
    return np.asarray(jumps > JUMP * peak + allowed)
