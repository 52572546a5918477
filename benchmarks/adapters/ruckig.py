"""ruckig, as its wheel works without a network: one calculation a segment, from rest to rest."""

from typing import Any

import numpy as np
import ruckig

from planner import Trajectory

from ..cases import Problem
from .entry import Answer, Entry


def entries(problem: Problem) -> list[Entry]:
    """Return the entry, for waypoints under velocity, acceleration and jerk limits."""
    asked = problem.asked
    limits = (asked.limits.velocity, asked.limits.acceleration, asked.limits.jerk)
    if asked.times is not None or problem.path is not None or None in limits:
        return []

    def run() -> Any:
        generator = ruckig.Ruckig(asked.dims)
        given = ruckig.InputParameter(asked.dims)
        given.max_velocity, given.max_acceleration, given.max_jerk = (limit.upper for limit in limits if limit)
        given.min_velocity, given.min_acceleration = (limit.lower for limit in limits[:2] if limit)
        found = []
        for start, end in zip(asked.waypoints[:-1], asked.waypoints[1:], strict=True):
            given.current_position, given.target_position = start, end
            segment = ruckig.Trajectory(asked.dims)
            result = generator.calculate(given, segment)
            if result < 0:
                raise ValueError(f"ruckig: {result}")
            found.append(segment)
        return found

    def read(found: Any) -> Answer:
        times = np.concatenate([[0.0], np.cumsum([segment.duration for segment in found])])
        parts = [_exact(s, t) for s, t in zip(found, times[:-1], strict=True) if s.duration > 0]
        return Answer(Trajectory.concatenate(parts), times)

    return [Entry("ruckig by segments", "ruckig", run, read)]


def _exact(segment: Any, start: float) -> Trajectory:
    """Return a segment as cubic pieces: each joint's phases of constant jerk, cut where any joint's phase changes."""
    joints = [_joint(profile, segment.duration) for profile in segment.profiles[0]]
    breaks = np.unique(np.concatenate([j.breaks for j in joints]))
    breaks = breaks[np.append(np.diff(breaks) > 1e-12, True)]  # phases that end together but for rounding
    breaks[0] = 0.0
    middles = 0.5 * (breaks[:-1] + breaks[1:])
    pieces = np.empty((4, len(middles), len(joints)))
    for d, joint in enumerate(joints):
        for k in range(4):  # a Taylor expansion at each break, with the jerk of the phase that follows
            at = breaks[:-1] if k < 3 else middles
            pieces[k, :, d] = joint(at, k)[:, 0] / (1, 1, 2, 6)[k]
    return Trajectory.from_powers(start + breaks, pieces)


def _joint(profile: Any, duration: float) -> Trajectory:
    """Return one joint's profile; one that arrives early or does not move holds its place until the end."""
    lengths = np.array(profile.t)
    kept = lengths > 1e-12
    states = [np.array(x)[:7][kept] for x in (profile.p, profile.v, profile.a, profile.j)]
    lengths = lengths[kept]
    rest = duration - lengths.sum()
    if rest > 1e-12:
        lengths = np.append(lengths, rest)
        states = [np.append(x, last) for x, last in zip(states, (profile.pf, 0.0, 0.0, 0.0), strict=True)]
    breaks = np.concatenate([[0.0], np.cumsum(lengths)])
    breaks[-1] = duration
    powers = np.stack(states) / np.array([1.0, 1.0, 2.0, 6.0])[:, None]
    return Trajectory.from_powers(breaks, powers[:, :, None])
