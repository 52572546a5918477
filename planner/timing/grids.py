"""Stations along a path: knots on the grid, dense where limits bind, graded towards the rests at both ends."""

import numpy as np
from numpy.typing import NDArray

from ..errors import SolverFailed
from ..trajectory import Trajectory

Array = NDArray[np.float64]

#: Halvings of the first and the last interval: from rest, s grows as t², so even times need uneven stations.
GRADED = 6


def initial_grid(
    stretch: Trajectory, stations: int, rests: tuple[bool, bool] = (True, True), halvings: int = GRADED
) -> Array:
    """Return about ``stations`` stations, the path's breaks among them, halved repeatedly towards ends at rest."""
    each = max(int(np.ceil(stations / stretch.pieces)), 4)
    inner = stretch.breaks[:-1, None] + np.diff(stretch.breaks)[:, None] * np.arange(each) / each
    grid = np.append(inner.reshape(-1), stretch.end)
    first = grid[0] + (grid[1] - grid[0]) * 0.5 ** np.arange(halvings, 0, -1)
    last = grid[-1] - (grid[-1] - grid[-2]) * 0.5 ** np.arange(1, halvings + 1)
    return np.unique(np.concatenate([grid, *([first] if rests[0] else []), *([last] if rests[1] else [])]))


def refined(grid: Array, where: NDArray[np.bool_]) -> Array:
    """Return the grid with the marked intervals, and their neighbours, halved."""
    wide = where.copy()
    wide[1:] |= where[:-1]
    wide[:-1] |= where[1:]
    return np.sort(np.concatenate([grid, 0.5 * (grid[:-1] + grid[1:])[wide]]))


def constant_acceleration_law(grid: Array, speed: Array) -> Trajectory:
    """Return the law s(t) that has the given speeds at the stations and constant path acceleration between them.

    Between stations sdot² is linear in s: the step takes 2 ds / (sdot_i + sdot_{i+1}).

    Raises
    ------
    SolverFailed
        The speed vanishes at two neighbouring stations.
    """
    step, total = np.diff(grid), speed[:-1] + speed[1:]
    if not (total > 0).all():
        raise SolverFailed("timing", "the path speed vanishes on a whole interval")
    duration = 2.0 * step / total
    acceleration = (speed[1:] ** 2 - speed[:-1] ** 2) / (2.0 * step)
    times = np.concatenate([[0.0], np.cumsum(duration)])
    powers = np.stack([grid[:-1], speed[:-1], 0.5 * acceleration])
    return Trajectory.from_powers(times, powers[:, :, None])
