"""The program of problems/waypoint_timing.py, scaled and handed to the interior point."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from problems.waypoint_timing import Spline, WaypointTiming

from ..deadline import Deadline

Array = NDArray[np.float64]

#: Limits are tightened by this part, so that the exact segments found afterwards have room.
MARGIN = 1e-6
#: Of a duration's first value: below it no duration falls.
SHORTEST = 1e-6


#: Iterations at least and at most, and segments times joints times iterations that are tried.
ITERATIONS, WORK = (150, 500), 50_000
#: What an iteration takes for each piece of a joint, s, on a slow machine.
SECONDS = 1e-6
#: After so many it begins again where it is: in units of the durations found, slow progress becomes fast.
ROUND = 200


#: No limit of time.
FOREVER = Deadline(None)


@dataclass(frozen=True, eq=False)
class Found:
    """Where the interior point ended, whether it came to an end there, and after how many iterations.

    ``shares`` (S, D): each joint's part of the multiplier of a segment's duration; a segment's add up to one.
    """

    spline: Spline
    shares: Array
    solved: bool
    iterations: int


def solve(
    problem: WaypointTiming,
    start: Spline,
    tolerance: float = 1e-5,
    most: int | None = None,
    prices: Array | None = None,
    deadline: Deadline = FOREVER,
) -> Found:
    """Return the fastest motion, or the smoothest one where the whole duration is given.

    Parameters
    ----------
    problem : WaypointTiming
    start : Spline
        Where to begin; it need not keep the limits.
    tolerance : float
        How far, relatively, the objective may be from the local optimum.
    most : int, optional
        Number of iterations; by default 500, and fewer where there are many segments.
    prices : (S,), optional
        What a second of each segment costs; 1 each unless given. Not with a whole duration.
    deadline : Deadline
        No more iterations are begun than it leaves time for, by an estimate.

    Raises
    ------
    TimeLimit
        The deadline has passed.
    """
    count, dims = len(problem.least), problem.waypoints.shape[1]
    if most is None:
        most = int(np.clip(WORK / (count * dims), *ITERATIONS))
    done = 0
    while True:
        left = deadline.left()
        affordable = most if left is None else int(left / (SECONDS * count * dims * problem.pieces)) + 1
        found = _solved(problem, start, tolerance, min(ROUND, most - done, affordable), prices)
        done += found.iterations
        if found.solved or done >= most or not np.isfinite(found.spline.control).all():
            return replace(found, iterations=done)
        start = found.spline


def _solved(problem: WaypointTiming, start: Spline, tolerance: float, most: int, prices: Array | None) -> Found:
    """Return where so many iterations lead from ``start``, which sets the units of time."""
    from ..kernels.waypoint_program import SOLVED, interior_point

    count, dims = len(problem.least), problem.waypoints.shape[1]
    h0 = start.durations
    v, a, j = problem.units()
    length = v * h0[:, None]  # (S, D): the unit of positions
    unit = np.stack([a * h0[:, None] / v, j * h0[:, None] ** 2 / v], axis=2)
    bound = np.empty((count, dims, 4, 2))
    around = np.zeros((count + 1, dims, 2, 2))
    for side, limit in enumerate((problem.lower, problem.upper)):
        bound[:, :, 0, side] = (limit[0] - problem.waypoints[:-1]) / length
        rates = limit[1:] / np.stack([v, a, j])[:, None] * (1.0 - MARGIN)
        bound[:, :, 1:, side] = rates.transpose(1, 2, 0)
        nearer = (np.maximum, np.minimum)[side]
        around[1:-1, :, :, side] = nearer(bound[:-1, :, 1:3, side], bound[1:, :, 1:3, side])
    asked = np.stack([problem.velocity / v, problem.acceleration / a], axis=2)  # (S + 1, D, 2)
    states = np.stack([start.velocity / v, start.acceleration / a], axis=2)
    free = np.isnan(asked)
    states = np.ascontiguousarray(np.where(free, states, asked)).reshape(count + 1, 2 * dims)
    free[0], free[-1] = False, False
    given = problem.least == problem.most
    eta = np.where(given, problem.least / h0, 1.0)
    ranges = np.stack([np.maximum(problem.least / h0, SHORTEST), problem.most / h0], axis=1)
    weight = h0 / h0.mean() if prices is None else prices * h0 / (prices * h0).mean()
    smooth = problem.total is not None
    total = 0.0 if problem.total is None or given.all() else problem.total / h0.mean()
    price = np.repeat(weight[:, None] / dims, dims, axis=1) if smooth else np.zeros((count, dims))
    control = start.control / length[:, :, None]
    shares, report = np.zeros((count, dims)), np.zeros(4)
    status = interior_point(
        np.ascontiguousarray(problem.nodes),
        np.diff(problem.waypoints, axis=0) / length,
        unit,
        bound,
        around.reshape(count + 1, 2 * dims, 2),
        free.reshape(count + 1, 2 * dims),
        ranges,
        ~given,
        weight,
        total,
        0.0 if smooth else 1.0,
        price,
        problem.positions,
        eta,
        states,
        control,
        shares,
        tolerance,
        most,
        report,
    )
    both = states.reshape(count + 1, dims, 2)
    velocity = np.where(free[:, :, 0], both[:, :, 0] * v, problem.velocity)
    acceleration = np.where(free[:, :, 1], both[:, :, 1] * a, problem.acceleration)
    spline = Spline(eta * h0, velocity, acceleration, control * length[:, :, None])
    return Found(spline, shares / weight[:, None], status == SOLVED, int(report[0]))
