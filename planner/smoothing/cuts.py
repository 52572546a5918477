"""Cutting planes for one joint: which limits a motion breaks, and the rows that forbid it."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from problems.banded_qp import BandedQP
from problems.minimum_jerk import MinimumJerk

from ..limits import magnitude
from ..trajectory import Trajectory

Array = NDArray[np.float64]

#: Limits are tightened by this part of their size, so that what comes out keeps them strictly.
TIGHTER = 1e-7
#: And where a waypoint or an end state already touches a limit: how far rounding may go.
ROUNDING = 1e-9

#: A row: gap, place u in [0, 1], order of the derivative, side (1 upper, -1 lower).
Row = tuple[int, float, int, int]


@dataclass(frozen=True, eq=False)
class JointBounds:
    """Bounds of the derivatives 0 … 3 on every gap, (4, M) each, scaled.

    ``unit`` (4,), ``origin`` and the caller's ``times`` (M + 1,) undo the scaling.
    """

    lower: Array
    upper: Array
    unit: Array
    origin: float
    times: Array

    def physical(self, order: int, value: float) -> float:
        """Return a scaled value in the caller's units."""
        return float(value * self.unit[order] + (self.origin if order == 0 else 0.0))

    def clock(self, gap: int, u: float) -> float:
        """Return the caller's time at a place in [0, 1] on a gap."""
        return float(self.times[gap] + u * (self.times[gap + 1] - self.times[gap]))


@dataclass(frozen=True, eq=False)
class Cuts:
    """A statement of one joint (the caller's ``joint``) and its bounds.

    ``relaxed`` (elastic solves) widens the bounds of each order by that part of their size; ``tighter`` is the part
    they are tightened by.
    """

    problem: MinimumJerk
    joint: int
    bounds: JointBounds
    relaxed: Array = field(default_factory=lambda: np.zeros(4))
    tighter: float = TIGHTER

    def exact(self) -> "Cuts":
        """Return the same without tightening."""
        return replace(self, tighter=0.0)

    def scale(self) -> Array:
        """Return what errors are relative to, (4, M)."""
        return magnitude(self.bounds.lower, self.bounds.upper)

    def motion(self, y: Array) -> Trajectory:
        """Return the joint's motion for node states y."""
        velocity, acceleration = self.problem.states(y[:, None])
        times = np.concatenate([[0.0], np.cumsum(self.problem.h)])
        return Trajectory.from_hermite(times, self.problem.positions, velocity, acceleration)

    def _margin(self) -> Array:
        """Return by how much each bound is tightened, (2, 4, M): less where a node touches it already."""
        scale = self.scale()
        room = np.full((2, 4, scale.shape[1]), np.inf)
        q = self.problem.positions[:, 0]
        fixed = [(0, slice(None), np.stack([q[:-1], q[1:]]))]
        for order in (1, 2):
            fixed.append((order, slice(0, 1), self.problem.start[order - 1, :, None]))
            fixed.append((order, slice(-1, None), self.problem.end[order - 1, :, None]))
        for order, gaps, values in fixed:
            above = self.bounds.upper[order, gaps] - values.max(axis=0)
            below = values.min(axis=0) - self.bounds.lower[order, gaps]
            room[0, order, gaps], room[1, order, gaps] = above, below
        return np.asarray(np.clip(0.5 * room, 0.0, self.tighter * scale))

    def _excess(self, y: Array) -> tuple[Array, Array]:
        """Return how far each gap's extrema lie beyond the bounds and where, (2 sides, 4, M) each."""
        motion = self.motion(y)
        found = motion.extrema(4)
        h, t = np.diff(motion.breaks), motion.breaks[:-1]
        room = self.relaxed[:, None] * self.scale()
        high = found.high[:, :, 0] - self.bounds.upper - room
        low = self.bounds.lower - room - found.low[:, :, 0]
        where = np.stack([(found.at_high[:, :, 0] - t) / h, (found.at_low[:, :, 0] - t) / h])
        return np.stack([high, low]), np.clip(where, 0.0, 1.0)

    def new_rows(self, y: Array) -> list[Row]:
        """Return a row for each bound that is not kept with half its margin."""
        excess, where = self._excess(y)
        margin = self._margin()
        allowed = np.where(margin > ROUNDING * self.scale(), -0.5 * margin, ROUNDING * self.scale())
        found = np.argwhere(excess > allowed)
        return [(int(i), float(where[s, m, i]), int(m), 1 - 2 * int(s)) for s, m, i in found]

    def rows_at(self, places: Array) -> list[Row]:
        """Return the rows of every finite bound at fixed places in [0, 1] on every gap."""
        sides = np.stack([self.bounds.upper, self.bounds.lower])
        return [
            (int(i), float(u), int(m), 1 - 2 * int(s)) for s, m, i in np.argwhere(np.isfinite(sides)) for u in places
        ]

    def table(self, rows: Sequence[Row], tightened: bool) -> tuple[csr_matrix, Array, Array]:
        """Return the rows as G and h, each divided by its bound's size, and those sizes."""
        n = 2 * (len(self.problem.h) - 1)
        scale, margin = self.scale(), self._margin()
        data: list[float] = []
        columns: list[int] = []
        starts, upper, sizes = [0], [], []
        for gap, u, order, side in rows:
            indices, values, constant = self.problem.row(gap, u, order, 0)
            size = float(scale[order, gap])
            bound = (self.bounds.upper if side > 0 else self.bounds.lower)[order, gap]
            tight = margin[0 if side > 0 else 1, order, gap] if tightened else 0.0
            columns += indices
            data += [side * v / size for v in values]
            starts.append(len(columns))
            upper.append((side * (bound - constant) - tight) / size)
            sizes.append(size)
        return csr_matrix((data, columns, starts), shape=(len(rows), n)), np.array(upper), np.array(sizes)

    def program(self, rows: Sequence[Row], tightened: bool) -> BandedQP:
        """Return the joint's quadratic program with these rows."""
        matrix, upper, _ = self.table(rows, tightened)
        return self.problem.joint(0, matrix, upper)
