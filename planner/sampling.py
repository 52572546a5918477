"""Sampling: position, velocity, acceleration and jerk of a trajectory at chosen times, from its exact pieces."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import InvalidRequest, TooLarge
from .trajectory import Trajectory
from .types import Sampling

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Samples:
    """Times (M,) in s and the derivatives of order 0 to 3 at them, (M, D) each."""

    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    jerk: Array


def sample_count(sampling: Sampling, duration: float) -> int:
    """Return how many samples a trajectory of that duration gets."""
    if duration == 0.0:
        return 2
    if sampling.times is not None:
        return len(sampling.times)
    if sampling.dt is not None:
        return 1 + max(1, math.ceil(min(duration / sampling.dt, 1e18) - 1e-9))
    assert sampling.count is not None
    return sampling.count


def sample(trajectory: Trajectory, sampling: Sampling, most: int | None = None) -> Samples:
    """Sample a trajectory.

    With ``dt`` and ``count`` the last sample is exactly the end, never doubled. At a jump the value from the right is
    given, at the end the one from the left. A trajectory without duration gives two equal samples.

    Parameters
    ----------
    most : int
        Cap on samples x joints, decided before anything is allocated.

    Raises
    ------
    TooLarge
        More than ``most`` numbers per derivative.
    InvalidRequest
        A sampling time outside the trajectory (``out_of_range``).
    """
    times = sample_times(trajectory, sampling, most)
    return Samples(times, *trajectory.states(times, 4))


def sample_times(trajectory: Trajectory, sampling: Sampling, most: int | None = None) -> Array:
    """Return the times, (M,) in s, at which ``sample`` samples; refuses what it refuses."""
    count = sample_count(sampling, trajectory.duration)
    refuse_too_many(count, trajectory.dims, most, sampling, trajectory.duration)
    start, end = trajectory.start, trajectory.end
    if trajectory.duration == 0.0:
        times = np.array([start, start])
    elif sampling.times is not None:
        times = sampling.times
        outside = (times < start) | (times > end)
        if outside.any():
            i = int(np.argmax(outside))
            raise InvalidRequest.of(f"/sampling/times/{i}", "out_of_range", f"must lie in [{start!r}, {end!r}]")
    elif sampling.dt is not None:
        times = start + sampling.dt * np.arange(count, dtype=np.float64)
        times[-1] = end
    else:
        times = np.linspace(start, end, count, dtype=np.float64)
    times = np.minimum(np.maximum(times, start), end)
    if trajectory.duration > 0 and not (times[1:] > times[:-1]).all():
        times = np.unique(times)  # those that fall on one instant of the clock are one
    return times


def refuse_too_many(
    count: int, dims: int, most: int | None, sampling: Sampling | None = None, duration: float = 0.0
) -> None:
    """Raise TooLarge if ``count`` samples of ``dims`` joints are over the cap; its hint says what would fit.

    Parameters
    ----------
    sampling, duration
        What was asked, and the trajectory's duration in s, or the least that it can have.
    """
    if most is None or count * dims <= most:
        return
    fitting, fewer = most // dims, "take fewer"
    if sampling is not None and sampling.dt is not None and fitting >= 2 and duration > 0.0:
        fewer = f"a motion of {duration:.6g} s fits with a dt of {_rounded_up(duration / (fitting - 1)):g} s or more"
    elif sampling is not None and sampling.count is not None and fitting >= 2:
        fewer = f"a count of {fitting:,} fits"
    hint = f"{count:,} samples of {dims} joints were asked; {fewer}; or ask for the exact pieces instead of samples: "
    raise TooLarge("samples x joints", most, hint + '"include": ["polynomial"]')


def _rounded_up(value: float) -> float:
    """Return the next number of three digits that is not less."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.ceil(value / unit * (1 + 1e-9)) * unit
