"""Where the interior point begins: nodes of the pieces, and a cubic spline through the waypoints, slowed."""

import numpy as np
from numpy.typing import NDArray

from problems.waypoint_timing import Spline, WaypointTiming

from ..curves.cubic import cubic_spline

Array = NDArray[np.float64]

#: The largest factor by which the durations are lengthened for the spline to keep its limits.
SLOWER = 3.0
#: Part of its velocity limit with which the slowest joint is guessed to pass through a segment.
PASSING = 0.5
#: Velocities and accelerations begin within this part of their limits.
INSIDE = 0.9
#: Parts of a segment in which the acceleration asked at an end is brought to zero: at least, at most.
RAMP = (0.02, 0.5)


def nodes_of(pieces: int, durations: Array, ramps: Array) -> Array:
    """Return the nodes of every joint's pieces on every segment, (S, D, K + 1).

    Even, but for joints that move at an end of the whole: there the first three pieces are each a third of the time in
    which the jerk limit brings the acceleration to zero. A piece much longer than that would make states that lead up
    to a limit infeasible.

    Parameters
    ----------
    durations : (S,)
        About how long the segments take, s.
    ramps : (2, D)
        That time at the start and at the end, s; NaN where a joint is at rest there.
    """
    count, dims = len(durations), ramps.shape[1]
    nodes = np.tile(np.linspace(0.0, 1.0, pieces + 1), (count, dims, 1))
    fine = 3 if count > 1 else 2
    thirds = np.arange(1, fine + 1) / fine
    for d in np.flatnonzero(~np.isnan(ramps).all(axis=0)):
        start, end = ramps[:, d]
        if not np.isnan(start):
            ramp = np.clip(start / durations[0], *RAMP)
            nodes[0, d, 1 : fine + 1] = ramp * thirds
            nodes[0, d, fine:] = np.linspace(ramp, 1.0, pieces - fine + 1)
        if not np.isnan(end):
            ramp = np.clip(end / durations[-1], *RAMP)
            nodes[-1, d, -1 - fine : -1] = 1.0 - ramp * thirds[::-1]
            first = nodes[-1, d, fine] if count == 1 and not np.isnan(start) else 0.0
            at = fine if first else 0
            if first >= 1.0 - ramp:  # both ramps do not fit: even between their inner ends
                nodes[-1, d] = np.linspace(0.0, 1.0, pieces + 1)
            else:
                nodes[-1, d, at : pieces - fine + 1] = np.linspace(first, 1.0 - ramp, pieces - fine - at + 1)
    return nodes


def passing(problem: WaypointTiming) -> Array:
    """Return durations (S,) of segments that are run through: far less than with stops where they are short."""
    move = np.diff(problem.waypoints, axis=0)
    speed = np.where(move > 0, problem.upper[1], problem.lower[1]) * PASSING
    return np.asarray((move / speed).max(axis=1))


def spline_durations(problem: WaypointTiming, rough: Array) -> Array:
    """Return durations for the spline: rough ones (S,), slowed to keep its limits, up to a factor.

    Those that are given stay, and none leaves its bounds by much.
    """
    room = np.where(problem.least < problem.most, 1.02, 1.0)
    low, high = problem.least * room, problem.most / room
    h = np.minimum(np.maximum(rough, low), high)
    times = np.concatenate([[0.0], np.cumsum(h)])
    curve = cubic_spline(times, problem.waypoints, "clamped", problem.velocity[0], problem.velocity[-1])
    inner = times[:-1, None] + h[:, None] * np.linspace(0.0, 1.0, 9)
    slower = 1.0
    for order in (1, 2):
        x = curve(inner, order)  # (S, 9, D)
        over = np.maximum(x / problem.upper[order][:, None], x / problem.lower[order][:, None]).max()
        slower = max(slower, float(over) ** (1.0 / order))
    return np.asarray(np.minimum(np.maximum(h * min(slower, SLOWER), low), high))


def spline_start(problem: WaypointTiming, durations: Array) -> Spline:
    """Return the cubic spline through the waypoints at these durations, its states moved well within the limits."""
    times = np.concatenate([[0.0], np.cumsum(durations)])
    curve = cubic_spline(times, problem.waypoints, "clamped", problem.velocity[0], problem.velocity[-1])
    states = []
    for order, asked in ((1, problem.velocity), (2, problem.acceleration)):
        low = INSIDE * np.maximum(problem.lower[order][:-1], problem.lower[order][1:])
        high = INSIDE * np.minimum(problem.upper[order][:-1], problem.upper[order][1:])
        x = curve(times, order)
        x[1:-1] = np.minimum(np.maximum(x[1:-1], low), high)
        states.append(np.where(np.isnan(asked), x, asked))
    powers = curve.powers()  # (4, S, D)
    knots = problem.knots() * durations[:, None, None]
    x, y, z = (knots[:, :, m : m + problem.pieces + 3] for m in (1, 2, 3))  # the cubics' blossoms
    control = powers[1][:, :, None] * (x + y + z) / 3.0 + powers[2][:, :, None] * (x * y + y * z + x * z) / 3.0
    control += powers[3][:, :, None] * x * y * z
    return Spline(durations, states[0], states[1], control)
