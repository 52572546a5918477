"""What a line says, and how far a motion is from its limits between all stations."""

from dataclasses import dataclass

import numpy as np

from planner import Trajectory
from planner.timing.course import Course
from planner.timing.second_order import derivatives

from ..figures import Array

#: Times, or places on the path, at which a motion is looked at.
DENSE = 100_000


@dataclass(frozen=True)
class Timing:
    """One line: an entry on a problem, or a ``figure`` of ours that has a goal of its own.

    ``ratio`` is, for a peer, its time over ours, median over the rounds of both; the ``goal`` is the least it should
    be, for a figure the most. ``beyond`` is how far a limit is exceeded between the stations, relative to it;
    ``strict`` the duration when slowed until none is. ``over`` is the duration over the best known, ``over_strict``
    over that of the same when slowed, less one; ``gap`` the duration over the lower bound, less one, which holds for
    ``scope``.
    """

    part: str
    problem: str
    stations: int | None
    entry: str
    ms: float | None = None
    ratio: float | None = None
    goal: float | None = None
    figure: bool = False
    duration: float | None = None
    strict: float | None = None
    beyond: float | None = None
    over: float | None = None
    over_strict: float | None = None
    gap: float | None = None
    scope: str = ""
    told: str = ""
    rounds: int = 0

    @property
    def met(self) -> bool | None:
        """Whether the goal is reached; None without a goal."""
        if self.goal is None or self.ratio is None:
            return None
        return self.ratio <= self.goal if self.figure else self.ratio >= self.goal


@dataclass(frozen=True)
class Slowed:
    """How far limits are exceeded, relative to them, and the duration when slowed until none is."""

    beyond: float
    strict: float

    @classmethod
    def of(cls, ratios: Array, duration: float) -> "Slowed":
        """Return it from the largest ratios to the limits of velocity, acceleration and jerk, as far as limited."""
        factor = max(float(r) ** (1.0 / m) for m, r in enumerate(ratios, start=1))
        return cls(float(max(ratios)) - 1.0, duration * factor)


def sampled(states: Array, lower: Array, upper: Array, duration: float) -> Slowed:
    """Return the same of derivatives at samples (R, n, D) and their limits (R, D)."""
    ratios = np.maximum(states / upper[:, None], states / lower[:, None])
    return Slowed.of(ratios.max(axis=(1, 2)), duration)


def of_law(course: Course, law: Trajectory) -> Slowed:
    """Return the same of a law along a course, at many times."""
    orders = 3 if course.jerk else 2
    motion = course.curve.compose(law)
    at = np.linspace(motion.start, motion.end, DENSE)
    return sampled(motion.states(at, orders, first=1), course.lower[:orders, 0], course.upper[:orders, 0], law.duration)


def of_profile(course: Course, grid: Array, a: Array, b: Array, duration: float) -> Slowed:
    """Return the same of a profile whose path acceleration b is linear in s between stations, at many places.

    The first and the last interval are run through from and to rest at constant path jerk, a ~ s^(4/3).
    """
    h = np.diff(grid)
    x = np.linspace(0.0, 1.0, max(DENSE // len(h), 5))[:, None]
    way = x * h
    slope = np.diff(b) / h
    at = np.maximum(a[:-1] + way * (2.0 * b[:-1] + slope * way), 0.0)
    push = b[:-1] + slope * way
    for k, share, far, sign in ((0, x[:, 0], a[1], 1.0), (-1, 1.0 - x[:, 0], a[-2], -1.0)):
        at[:, k], push[:, k] = far * share ** (4 / 3), sign * 2.0 / 3.0 * far / h[k] * np.cbrt(share)
    speed = np.sqrt(at)
    jolt = slope * speed
    for k, far in ((0, a[1]), (-1, a[-2])):
        jolt[:, k] = 2.0 / 9.0 * far**1.5 / h[k] ** 2
    q1, q2, q3 = derivatives(course, grid, x[:, 0], 3)
    speed, push, jolt = speed[:, :, None], push[:, :, None], jolt[:, :, None]
    each = [q1 * speed, q2 * speed**2 + q1 * push, q3 * speed**3 + 3.0 * q2 * speed * push + q1 * jolt]
    states = np.stack(each).reshape(3, -1, course.curve.dims)
    return sampled(states, course.lower[:, 0], course.upper[:, 0], duration)
