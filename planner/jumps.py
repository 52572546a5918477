"""Which jumps at a trajectory's breaks count as such, and which are rounding."""

import numpy as np
from numpy.typing import NDArray

from .trajectory import Trajectory

Array = NDArray[np.float64]

#: A jump counts above this part of the derivative's peak.
JUMP = 1e-6


#: By how much a curve's rounding may grow from one derivative to the next, in units of the step.
GROWTH = 16.0


class Jumps:
    """The jumps of a trajectory; what its derivatives are at the ends of its pieces is found once.

    Parameters
    ----------
    trajectory : Trajectory
    span : float
        What errors of positions are relative to.
    ends : (R, 2, K, D)
        The derivatives of order 0 … R - 1 at the ends of the pieces, where they are known.
    """

    def __init__(self, trajectory: Trajectory, span: float = 1.0, ends: Array | None = None) -> None:
        self._trajectory, self._span = trajectory, span
        self._ends: list[Array] = [] if ends is None else list(ends)

    def ends(self, order: int) -> Array:
        """Return the derivative at the left and at the right end of every piece, (2, K, D)."""
        known = len(self._ends)
        if order >= known:
            curve, last = self._trajectory, max(order + 1, 4)
            if not curve.rational:  # a few more cost less than asking again
                last = max(last, min(2 * order, curve.degree + 2))
            self._ends.extend(curve.all_ends(known, last))
        return self._ends[order]

    def judged(self, order: int, peak: Array) -> tuple[NDArray[np.bool_], bool]:
        """Return which jumps of a derivative at the interior breaks count, (K - 1, D), and if the curve is less smooth.

        Positions: above 1e-6 x ``span``; other derivatives: above 1e-6 of their ``peak`` (D,) and above the rounding
        of values and of the clock. By these limits are judged.

        A curve's class is judged more leniently: where a derivative is nothing but rounding (that of a straight line,
        say) its jumps do not make the curve less smooth, however it was computed; not so in pieces much shorter than
        their neighbours, which could hide anything.
        """
        ends = self.ends(order)
        jumps = np.abs(ends[0, 1:] - ends[1, :-1])
        counted = jumps > (JUMP * self._span if order == 0 else JUMP * peak)
        if order == 0 or not counted.any():  # most often nothing is near to a jump
            return counted, bool(counted.any())
        from .kernels.jumps import judge

        trajectory, c = self._trajectory, self._trajectory.coefficients
        if trajectory.weights is not None:  # where the denominator is small, so is what rounding is relative to
            c = c / np.minimum(trajectory.weights[-1], trajectory.weights.sum(axis=0))[:, None]
        near = (self.ends(m) for m in (order, order + 1, 0))
        h = np.diff(trajectory.breaks)
        return counted, bool(judge(c, trajectory.breaks, h, order, *near, peak, JUMP, GROWTH, counted))


def counted_jumps(trajectory: Trajectory, order: int, peak: Array, span: float = 1.0) -> NDArray[np.bool_]:
    """Return which jumps of a derivative at the interior breaks count, shape (K - 1, D): see ``Jumps``."""
    return Jumps(trajectory, span).judged(order, peak)[0]
