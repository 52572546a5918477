"""Profiles a(s) = sdot² that leave and reach given path speeds and accelerations smoothly: to begin a search with.

Two families: minimum-jerk laws between the two states, of many durations; and braking from the start to a crawl, at a
bounded path acceleration that is reached and left at constant path jerk, the same backwards at the end.
"""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from .course import State

Array = NDArray[np.float64]

#: Distances, sdot² and sddot at them.
Law = tuple[Array, Array, Array]

#: Durations of the minimum-jerk laws, over that at mean speed.
DURATIONS = np.geomspace(0.2, 20.0, 30)
#: Path accelerations and path jerks of braking, in units of the whole length and the time that the motion takes.
BRAKES = np.geomspace(0.3, 3e3, 11)
JERKS = np.geomspace(3.0, 3e6, 11)
#: The crawl's speed over that at the end.
CRAWL = 0.05
#: Times, as shares, at which a law is sampled: dense towards both ends, as the grids are.
_EARLY = np.geomspace(1e-7, 0.5, 500)
SAMPLES = np.concatenate([[0.0], _EARLY, 1.0 - _EARLY[-2::-1], [1.0]])


def first_profiles(
    at: Array, length: float, start: State, end: State, seconds: float, rate: Callable[[Array], Array]
) -> Iterator[Array]:
    """Yield values a at the distances ``at`` from the start, all > 0.

    Parameters
    ----------
    at : (M,)
        Those below 0 or beyond ``length`` do not matter.
    start, end : (float, float)
        Path speed and path acceleration.
    seconds : float
        About what the motion takes.
    rate : function
        Of such values: how bad they are on each of m intervals.
    """
    mean = 0.5 * (start[0] + end[0])
    for scale in DURATIONS:
        law = _minimum_jerk(length, start, end, scale * min(length / mean if mean > 0 else np.inf, seconds))
        if law is not None:
            yield _read(at, law)
    leaving = [_read(at, law) for law in _brakes(length, seconds, start)]
    reaching = [_read(length - at, law) for law in _brakes(length, seconds, (end[0], -end[1]))]
    if not leaving and not reaching:
        return
    floor = np.full(len(at), CRAWL**2 * min(x.max() for x in (*leaving, *reaching)))
    half = len(rate(floor)) // 2  # either half tells how good its own end is
    early = min((np.maximum(x, floor) for x in leaving), key=lambda x: rate(x)[:half].max(), default=floor)
    late = min((np.maximum(x, floor) for x in reaching), key=lambda x: rate(x)[half:].max(), default=floor)
    yield np.maximum(early, late)


def _read(at: Array, law: Law) -> Array:
    """Return a at the distances; 0 beyond the law's end. a' = 2 b."""
    s, a, b = law
    keep = np.append(True, np.diff(s) > 1e-15 * s[-1])
    found = CubicHermiteSpline(s[keep], a[keep], 2.0 * b[keep])(np.clip(at, 0.0, s[-1]))
    return np.where(at <= s[-1], np.maximum(found, 0.0), 0.0)


def _minimum_jerk(length: float, start: State, end: State, duration: float) -> Law | None:
    """Return s, sdot² and sddot of the quintic law between the states, if it never stands still inside."""
    (v0, b0), (v1, b1), t = start, end, duration
    x = np.array([length - v0 * t - 0.5 * b0 * t * t, (v1 - v0 - b0 * t) * t, (b1 - b0) * t * t])
    c3, c4, c5 = np.array([[10.0, -4.0, 0.5], [-15.0, 7.0, -1.0], [6.0, -3.0, 0.5]]) @ x
    u = SAMPLES
    s = u * (v0 * t + u * (0.5 * b0 * t * t + u * (c3 + u * (c4 + u * c5))))
    speed = (v0 * t + u * (b0 * t * t + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))) / t
    push = b0 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5)) / t**2
    s[-1] = length
    inside = (speed[1:-1] > 0).all() and (np.diff(s) >= 0).all()
    return (s, np.maximum(speed, 1e-9 * speed.max()) ** 2, push) if inside else None


def _brakes(length: float, seconds: float, state: State) -> Iterator[Law]:
    """Yield s, sdot² and sddot of laws that brake from a state to a crawl: jerk down, hold, jerk up."""
    speed, push = state
    if speed <= 0.0:
        return
    for jerk in JERKS * (length / seconds**3):
        top = speed + 0.5 * max(push, 0.0) ** 2 / jerk
        for brake in BRAKES * (length / seconds**2):
            brake = min(brake, np.sqrt(jerk * top * (1.0 - CRAWL)))  # more is not reached before the crawl
            first, last = (push + brake) / jerk, brake / jerk
            after = speed + 0.5 * (push - brake) * first
            hold = (after - 0.5 * brake * last - CRAWL * top) / brake
            if first < 0.0 or hold < 0.0:
                continue
            ends = np.cumsum([0.0, first, hold, last])
            t = SAMPLES * ends[-1]
            b = np.interp(t, ends, [push, -brake, -brake, 0.0])
            step = 0.5 * np.diff(t, prepend=0.0)
            v = speed + np.cumsum(step * (b + np.append(b[:1], b[:-1])))
            s = np.cumsum(step * (v + np.append(v[:1], v[:-1])))
            if s[-1] < length:
                yield s, np.maximum(v, 0.5 * CRAWL * top) ** 2, b
