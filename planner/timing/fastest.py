"""The best law along a course: the fastest, or of a given duration the one of least squared path acceleration.

Without jerk limits the fastest law has constant path acceleration by pieces (``second_order``); with them, and wherever
path acceleration has a price, constant path jerk (``third_order``).
"""

import time
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..deadline import Deadline
from ..errors import SolverFailed
from ..trajectory import Trajectory
from ..types import Note
from . import second_order, third_order
from .course import Course
from .following import Timed
from .grids import initial_grid
from .refinement import Attempt, refined

Array = NDArray[np.float64]

#: Share of the duration that the grid may cost, and the most stations that are spent on it.
GOAL = 5e-4, 1e-3
MOST = 40_000, 10_000
#: Stations to begin with: in all, and to every piece of the path.
FIRST = 64, 8
#: Tolerances of the interior point while the grid changes, and at last.
ROUGH, FINE = 1e-4, 1e-6


@dataclass(frozen=True, eq=False)
class Answer:
    """A law along a course, and the grid on which it was found."""

    course: Course
    timed: Timed
    grid: Array


def best_law(course: Course, stations: int | None, price: float, deadline: Deadline) -> Answer:
    """Return the best law for a price of squared path acceleration against time; 0: the fastest.

    Parameters
    ----------
    stations : int
        A fixed number of them; None: as many as are needed.

    Raises
    ------
    Infeasible
        No law joins the states asked at the ends.
    SolverFailed
        None was found that does.
    TimeLimit
    """
    third = course.jerk or price > 0.0
    grid = initial_grid(course.curve, stations or max(FIRST[0], FIRST[1] * course.curve.pieces))
    goal, most = np.inf if stations else GOAL[third], max(MOST[third], 2 * len(grid))
    started = time.perf_counter()
    solve = partial(_third, course, price) if third else partial(_second, course)
    notes: tuple[Note, ...] = ()
    try:
        found = refined(course, grid, solve, goal, most, deadline)
        law, grid = found.attempt.law.law, found.grid
    except SolverFailed as error:
        if not course.rests:
            raise
        law = smooth_law(course.curve)
        notes = (Note("not_optimal", f"no time-optimal profile was found ({error.status}): a smooth law stands in"),)
    return Answer(course, Timed(law, time.perf_counter() - started, notes), grid)


def _second(course: Course, grid: Array, tight: Array, before: Attempt | None, rough: bool) -> Attempt:
    return Attempt(second_order.law_of(grid, second_order.fastest_profile(course, grid, tight)))


def _third(course: Course, price: float, grid: Array, tight: Array, before: Attempt | None, rough: bool) -> Attempt:
    ceiling = second_order.fastest_profile(course.without_jerk(), grid, np.ones_like(tight))
    if before is None or before.spline is None:
        guess = np.maximum(ceiling, 1e-2 * ceiling[ceiling > 0].min())
    else:
        guess = before.spline.guess(grid)
    problem = third_order.pose(course, grid, tight, ceiling)
    prices = (1.0, price)
    spline = third_order.solve(problem, guess, prices, ROUGH if rough else FINE)
    return Attempt(third_order.law_of(spline), third_order.shares(spline, tight), spline)


def smooth_law(curve: Trajectory) -> Trajectory:
    """Return the minimum-jerk law over the curve in one second: what any limits allow, slowed enough."""
    states = np.array([[curve.start], [curve.end]])
    return Trajectory.from_hermite([0.0, 1.0], states, np.zeros((2, 1)), np.zeros((2, 1)))
