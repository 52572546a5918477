"""The law s(t) of a stretch of path by nonlinear programming."""

import numpy as np
from numpy.typing import NDArray

from problems.path_timing import PathTiming

from ..errors import SolverFailed
from ..limits import Limits
from ..solvers import select
from ..solvers.nlp import solve_nlp
from ..trajectory import Trajectory
from ..types import Note
from .following import Timed, Units
from .grids import constant_acceleration_law
from .scaling import local_factors

Array = NDArray[np.float64]


def nlp_law(stretch: Trajectory, limits: Limits, units: Units, grid: Array, time_limit: float | None) -> Timed:
    """Return the time-optimal law on the stations; where the solver stopped short of an optimum it says so.

    Raises
    ------
    SolverFailed, TimeLimit
    """
    problem = _statement(stretch, limits, units, grid)
    guess = _smooth_guess(stretch, limits, units, grid)
    answer = solve_nlp(lambda: problem.to_casadi(*guess), select("nlp")[0], time_limit)
    speed, acceleration, steps = problem.read(answer.x)
    if not (np.isfinite(steps).all() and (steps > 0).all()):
        raise SolverFailed("ipopt", "the path speed vanishes between stations")
    speed, acceleration = speed * units.parameter / units.second, acceleration * units.parameter / units.second**2
    notes: tuple[Note, ...] = ()
    if answer.status not in ("Solve_Succeeded", "Solved_To_Acceptable_Level"):
        notes = (Note("not_optimal", f"IPOPT stopped at a feasible law, not at an optimum: {answer.status}"),)
    if not problem.jerk:
        return Timed(constant_acceleration_law(grid, speed), answer.seconds, notes)
    # sdot² quadratic in s is no polynomial in time: quintics through the stations' states are, and are checked exactly
    times = np.concatenate([[0.0], np.cumsum(steps)]) * units.second
    law = Trajectory.from_hermite(times, grid[:, None], speed[:, None], acceleration[:, None])
    return Timed(law, answer.seconds, notes)


def _statement(stretch: Trajectory, limits: Limits, units: Units, grid: Array) -> PathTiming:
    pieces = stretch.split(grid)
    joints = np.flatnonzero(units.moving)
    ends = np.stack([pieces.ends(m) for m in (1, 2, 3)], axis=1)[:, :, :, joints]
    powers = units.parameter ** np.arange(1, 4)
    derivatives = ends * powers[None, :, None, None] / units.length[joints]
    bounds = [limits.bounds(m, stretch.dims) for m in (1, 2, 3)]
    scale = np.array([units.second**m for m in (1, 2, 3)])[:, None] / units.length[joints]
    lower, upper = np.stack([b.lower[joints] for b in bounds]), np.stack([b.upper[joints] for b in bounds])
    jerk = limits.jerk is not None
    return PathTiming(np.diff(pieces.breaks) / units.parameter, derivatives, lower * scale, upper * scale, jerk)


def _smooth_guess(stretch: Trajectory, limits: Limits, units: Units, grid: Array) -> tuple[Array, Array]:
    """Return sdot² and sddot at the inner stations of the minimum-jerk law, slow enough to keep every limit."""
    span = stretch.duration
    law = Trajectory(np.array([0.0, 1.0]), np.array([6.0, -15.0, 10.0, 0.0, 0.0, 0.0])[:, None, None] * span)
    law = Trajectory(law.breaks, law.coefficients + np.eye(6)[5][:, None, None] * stretch.start)
    factor = 1.02 * max(float(local_factors(stretch.compose(law), limits).max()), 1e-12)
    target = (grid[1:-1] - stretch.start) / span
    low, high = np.zeros(len(target)), np.ones(len(target))
    for _ in range(60):
        u = 0.5 * (low + high)
        below = u**3 * (10 - 15 * u + 6 * u**2) < target
        low, high = np.where(below, u, low), np.where(below, high, u)
    u = 0.5 * (low + high)
    rate, step = factor / units.second, span / units.parameter
    return (step * 30 * u**2 * (1 - u) ** 2 / rate) ** 2, step * 60 * u * (1 - u) * (1 - 2 * u) / rate**2
