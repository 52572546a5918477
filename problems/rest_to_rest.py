r"""Rest to rest: the shortest time to move one coordinate by a distance and stop again.

.. math::

    \min T \quad\text{s.t.}\quad x(0) = 0,\ x(T) = d,\ \dot x = \ddot x = 0 \text{ at both ends},\
    |\dot x| \le v,\ -a^- \le \ddot x \le a^+,\ |\dddot x| \le j.

The answer is closed-form: bang-bang in the jerk (or, without a jerk limit, in the acceleration).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def double_integrator(distance: Array, velocity: Array, rising: Array, falling: Array) -> Array:
    """Return the shortest times without a jerk limit.

    ``rising`` and ``falling`` are the largest acceleration and deceleration along the motion, all entries > 0:
    d / v + v (1/a+ + 1/a-) / 2 if v is reached, else sqrt(2 d (1/a+ + 1/a-)).
    """
    slowness = 1.0 / rising + 1.0 / falling
    reached = distance >= 0.5 * velocity**2 * slowness
    cruise = np.where(np.isfinite(velocity), distance / velocity + 0.5 * velocity * slowness, 0.0)
    return np.where(reached, cruise, np.sqrt(2.0 * distance * slowness))


def triple_integrator(distance: Array, velocity: Array, acceleration: Array, jerk: Array) -> Array:
    """Return the shortest times under symmetric velocity, acceleration and (finite) jerk limits.

    T = d/v + t_v if v is reached, t_v = a/j + v/a (or 2 sqrt(v/j) if a is not); else, if a is reached,
    a/j + sqrt((a/j)² + 4 d/a); else 4 cbrt(d / (2 j)).
    """
    ramp = acceleration / jerk
    rise = np.where(velocity >= acceleration * ramp, ramp + velocity / acceleration, 2.0 * np.sqrt(velocity / jerk))
    return np.where(
        distance >= velocity * rise,
        distance / velocity + rise,
        np.where(
            distance >= 2.0 * acceleration * ramp**2,
            ramp + np.sqrt(ramp**2 + 4.0 * distance / acceleration),
            4.0 * np.cbrt(distance / (2.0 * jerk)),
        ),
    )


@dataclass(frozen=True, eq=False)
class SegmentTimes:
    """The joints' own shortest times on every segment, (S, D), and the least durations asked for the segments, (S,).

    No segment can be faster than its slowest joint; nor can the whole be shorter than ``total``.
    """

    shortest: Array
    least: Array
    total: float

    def lower_bound(self) -> float:
        """Return a duration that no motion which takes such times can fall below."""
        return max(float(np.maximum(self.shortest.max(axis=1), self.least).sum()), self.total)
