"""What a smoothest trajectory hands over to be judged by: its programs, unknowns and multipliers."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from problems.banded_qp import BandedQP, KKTPoint

from .posing import Posed
from .rounds import Kept

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Found:
    """The optimum of a posed statement."""

    posed: Posed
    kept: Kept

    def parts(self) -> list[tuple[BandedQP, Array, Array, float]]:
        """Return program, unknowns, multipliers and weight of every part that is a problem of its own: each joint.

        Joints that are bound, or have the same unit and no rows, stay together.
        """
        program, y, z = self.kept.program, self.kept.y, self.kept.z
        statement, weights = self.posed.statement, self.posed.weights
        if statement.bound or (not len(z) and (weights == weights[0]).all()):
            return [(program, y, z, float(weights[0]))]
        found = []
        first = np.repeat(program.rows.indptr[:-1], np.diff(program.rows.indptr) > 0)
        filled = np.diff(program.rows.indptr) > 0
        owner = np.full(len(z), -1)
        owner[filled] = program.rows.indices[first]
        for d in range(statement.dims):
            own = statement.index[:, :, d]
            own = np.unique(own[own >= 0])
            low, high = (int(own[0]), int(own[-1]) + 1) if len(own) else (0, 0)
            mine = np.flatnonzero((owner >= low) & (owner < high))
            one = statement.only(d)
            part = one.program(program.rows[mine][:, low:high], program.upper[mine])
            found.append((part, y[low:high], z[mine], float(weights[d])))
        return found


@dataclass(frozen=True, eq=False)
class Optimum:
    """Evidence for the lower bound and the KKT residuals; what is dear of them is computed when it is asked for."""

    found: tuple[Found, ...]

    @cached_property
    def point(self) -> KKTPoint:
        """All parts together."""
        programs, points, multipliers, weights = zip(*(p for f in self.found for p in f.parts()), strict=True)
        return KKTPoint(programs, points, multipliers, np.array(weights))

    def lower_bound(self) -> float:
        """Return the weighted sum of the dual values."""
        return self.point.lower_bound()

    def residuals(self) -> dict[str, float]:
        """Return the largest of the parts' KKT residuals."""
        return self.point.residuals()
