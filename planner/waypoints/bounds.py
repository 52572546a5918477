"""A lower bound of the duration of every trajectory through waypoints, whatever its path and times between them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Segments that one joint is charged for at most, other than from the first waypoint on.
MOST = 64
#: What the sums may be wrong by, relatively; far more than they are.
ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class LeastRuns:
    """Evidence that no trajectory through waypoints takes less: what single joints need between their turning points.

    Intervals of segments that follow one another are each charged to a joint, or a segment to its least duration: the
    best such sum. See ``kernels.least_times`` for why it holds.

    ``waypoints`` (N, D); ``lower`` and ``upper`` (3, S, D): velocity, acceleration, jerk on each segment; ``least``
    (S,) s; ``floor``: least duration of the whole, s; ``rests``: whether start and end are at rest, v = a = 0;
    ``states`` (2, 2, D): else velocity and acceleration at the start and at the end, NaN where not given.
    """

    waypoints: Array
    lower: Array
    upper: Array
    least: Array
    floor: float
    rests: tuple[bool, bool]
    states: Array | None = None

    def lower_bound(self) -> float:
        """Return the best sum, s."""
        from ..kernels.least_times import PASS, REST, STATE, TURN, least_times

        count, dims = self.waypoints.shape
        points, lower, upper = (np.ascontiguousarray(x, dtype=float) for x in (self.waypoints, self.lower, self.upper))
        states = np.full((2, 2, dims), np.nan) if self.states is None else np.array(self.states, dtype=float)
        states[np.array(self.rests)] = 0.0
        known, turning = ~np.isnan(states), states[:, 0] == 0.0
        kinds = np.where(known.all(axis=1), STATE, np.where(turning, TURN, PASS))
        kinds[turning & (states[:, 1] == 0.0)] = REST
        uniform = np.array([(x == x[:, :1]).all(axis=(0, 1)) for x in (lower, upper)]).all(axis=0)
        best = np.empty(count)
        least, by_joint = np.ascontiguousarray(self.least, dtype=float), np.ascontiguousarray(states.transpose(2, 0, 1))
        lasting = _lasting(states, lower[:, 0], upper[:, 0]) & uniform
        least_times(points, lower, upper, least, kinds, by_joint, lasting, uniform, MOST, best)
        return max(float(best[-1]) * (1.0 - ROUNDING), self.floor)


def _lasting(states: Array, lower: Array, upper: Array) -> NDArray[np.bool_]:
    """Return whether each joint's limits (3, D) let the acceleration become 0 beyond its ends, (2, D)."""
    velocity, slope = states[:, 0], states[:, 1] * np.array([-1.0, 1.0])[:, None]  # outwards in time
    over = velocity + 0.5 * np.maximum(slope, 0.0) ** 2 / -lower[2] <= upper[0]
    under = velocity - 0.5 * np.minimum(slope, 0.0) ** 2 / upper[2] >= lower[0]
    lasting: NDArray[np.bool_] = over & under | (slope == 0.0)
    return lasting
