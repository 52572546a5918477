"""The minimum-jerk motion from state to state in closed form: a quintic, in its Bézier form."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InvalidRequest
from ..trajectory import Trajectory

Array = NDArray[np.float64]

#: Peaks of the rest-to-rest motion over a unit distance in unit time: velocity, acceleration, jerk.
PEAKS = (15.0 / 8.0, 10.0 / np.sqrt(3.0), 60.0)


def control_points(duration: float, start: ArrayLike, end: ArrayLike) -> Array:
    """Return the six control points (6, D) of the quintic with the given states.

    P0 = x0, P1 = x0 + v0 T/5, P2 = x0 + 2 v0 T/5 + a0 T²/20; P5 = xf, P4 = xf - vf T/5, P3 = xf - 2 vf T/5 + af T²/20.

    Parameters
    ----------
    duration : float
        T > 0, s.
    start, end : (3, D)
        Position, velocity and acceleration.
    """
    (x0, v0, a0), (xf, vf, af) = (np.asarray(s, dtype=np.float64) for s in (start, end))
    t = duration
    near = [x0, x0 + v0 * t / 5, x0 + 2 * v0 * t / 5 + a0 * t * t / 20]
    far = [xf - 2 * vf * t / 5 + af * t * t / 20, xf - vf * t / 5, xf]
    return np.stack(near + far)


def minimum_jerk_motion(duration: float, start: ArrayLike, end: ArrayLike) -> Trajectory:
    r"""Return the motion that minimises \int_0^T |x'''|² dt between two states.

    By Euler-Lagrange x^(6) = 0: a quintic. NaN in ``end`` leaves that value free: then the natural condition takes its
    place, x''' = 0 at the end for a free acceleration, x'''' = 0 for a free velocity, x''''' = 0 for a free position.

    Parameters
    ----------
    duration : float
        T > 0, s.
    start, end : (3, D)
        Position, velocity and acceleration; NaN in ``end`` where free.

    Raises
    ------
    InvalidRequest
        ``bad_duration`` unless 0 < T, ``shape_mismatch``, ``not_finite``.

    References
    ----------
    T. Flash and N. Hogan, The coordination of arm movements, Journal of Neuroscience 5(7), 1985.
    """
    a, b = np.asarray(start, dtype=np.float64), np.array(end, dtype=np.float64)
    if not 0 < duration < np.inf:
        raise InvalidRequest.of("/duration", "bad_duration", "must be > 0")
    if a.ndim != 2 or a.shape != b.shape or len(a) != 3:
        raise InvalidRequest.of("/end", "shape_mismatch", "states are position, velocity and acceleration, (3, D)")
    if not np.isfinite(a).all() or np.isinf(b).any():
        raise InvalidRequest.of("/start", "not_finite", "must be finite; only the end may hold NaN, for free")
    for joint in range(a.shape[1]):
        b[:, joint] = _closed(duration, a[:, joint], b[:, joint])
    return Trajectory.from_bernstein([0.0, duration], control_points(duration, a, b)[:, None, :])


def _closed(t: float, start: Array, end: Array) -> Array:
    """Return the end state with its free entries set by the natural conditions x^(5 - m)(T) = 0, one joint."""
    free = np.isnan(end)
    if not free.any():
        return end
    powers = np.arange(6)
    rows, right = [], []
    for m in range(3):  # unknown: c_0 … c_5 of u = t / T; derivatives at u = 1 are falling factorials
        order = 5 - m if free[m] else m
        rows.append([np.prod(np.arange(k - order + 1, k + 1)) if k >= order else 0.0 for k in powers])
        right.append(0.0 if free[m] else end[m] * t**m)
    known = start * np.array([1.0, t, 0.5 * t * t])
    matrix = np.array(rows)
    rest = np.linalg.solve(matrix[:, 3:], np.array(right) - matrix[:, :3] @ known)
    c = np.concatenate([known, rest])
    return np.array([c.sum(), (powers * c).sum() / t, (powers * (powers - 1) * c).sum() / t**2])


def shortest_duration(
    distance: ArrayLike, velocity: float = np.inf, acceleration: float = np.inf, jerk: float = np.inf
) -> float:
    """Return the shortest duration at which the rest-to-rest motion keeps symmetric limits.

    T = max(1.875 d / v, sqrt(5.7735 d / a), cbrt(60 d / j)), d the largest distance of a joint.
    """
    d = float(np.abs(np.asarray(distance, dtype=np.float64)).max())
    limits = zip(PEAKS, (velocity, acceleration, jerk), (1, 2, 3), strict=True)
    return max(float((peak * d / limit) ** (1.0 / order)) for peak, limit, order in limits)
