"""The best laws along courses: the fastest, or of a given duration those of least squared path acceleration.

Without jerk limits the fastest law has constant path acceleration by pieces (``second_order``); with them, and wherever
path acceleration has a price, constant path jerk (``third_order``).
"""

import time
from dataclasses import dataclass, replace
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
#: Halvings of the intervals next to rests: without jerk limits s grows as t² there, with them as t³.
HALVINGS = 6, 12
#: Ends where sdot² is below this share of its largest are slow ones, next to which the grid is to be finer.
SLOW = 0.1
#: The same share where limits are not meant to be used in full: the grid is split only where they are broken.
UNUSED = 1e3
#: Tolerances of the interior point while the grid changes, and at last.
ROUGH, FINE = 1e-4, 1e-6


#: A duration that is asked for is met from below by this much; the rest is a uniform slow-down.
NEAR = 2e-4, 1.5e-3
#: The same where the ends move, which no slow-down leaves alone.
EXACT = 0.0, 2e-8
SEARCHES = 30
#: Profiles whose durations differ by less than this, relatively, may be mixed.
MIXED = 3e-4


@dataclass(frozen=True, eq=False)
class Answer:
    """A law along a course, the grid on which it was found, and the spline profile behind it, if there is one."""

    course: Course
    timed: Timed
    grid: Array
    spline: third_order.Spline | None = None


def fastest(courses: list[Course], stations: int | None, deadline: Deadline) -> list[Answer | None]:
    """Return the fastest law along each course; None for one that stands still. Raises as ``best_law``."""
    return [best_law(c, stations, 0.0, deadline) if c.moves else None for c in courses]


def lasting(courses: list[Course], stations: int | None, duration: float, deadline: Deadline) -> list[Answer | None]:
    """Return the laws of least squared path acceleration that take a duration together.

    It is longer than the fastest laws', and met to ``NEAR`` (moving ends: ``EXACT``). All courses share one price g of
    the squared path acceleration. Without limits a course of length L takes (36 g L²)^(1/4), from where the search for
    the price begins.

    Raises
    ------
    SolverFailed
        The duration was not met.
    """
    rests = all(c.rests for c in courses)
    low, high = NEAR if rests else EXACT
    wanted = duration * (1.0 - 0.5 * (low + high))
    lengths = np.array([c.curve.duration for c in courses if c.moves])
    x, y = 4.0 * np.log(wanted / np.sqrt(lengths).sum()) - np.log(36.0), np.log(wanted)
    slope, known = 0.25, []
    below: list[Answer | None] | None = None
    above: list[Answer | None] | None = None
    grids: list[Array | None] = [None] * len(courses)
    for _ in range(SEARCHES):
        answers = [
            best_law(c, stations, float(np.exp(x)), deadline, grid) if c.moves else None
            for c, grid in zip(courses, grids, strict=True)
        ]
        taken = _taken(answers)
        if duration * (1.0 - high) <= taken <= duration * (1.0 - low):
            return answers
        if grids[0] is not None:
            below, above = (answers, above) if taken < wanted else (below, answers)
            if not rests and below and above and _taken(above) < _taken(below) * (1.0 + MIXED):
                return _mixed(below, above, wanted)
        # from now on the same grids, so that the duration is smooth in the price
        grids = [None if a is None else a.grid for a in answers]
        known.append((x, float(np.log(taken))))
        if len(known) > 1 and min(k[1] for k in known) > y and known[-2][1] - known[-1][1] < 0.02 * (known[-1][1] - y):
            break  # a lower price hardly makes it faster
        x = _next(known, y, slope)
    raise SolverFailed("timing", "no price of path acceleration gives the duration asked for")


def _taken(answers: list[Answer | None]) -> float:
    return float(sum(a.timed.law.duration for a in answers if a is not None))


def _mixed(below: list[Answer | None], above: list[Answer | None], wanted: float) -> list[Answer | None]:
    """Return answers of a duration between those of two on the same grids: of convex sums of their profiles.

    The limits of velocity and acceleration are linear in a profile, those of jerk nearly so between close ones.
    """
    low, high = 0.0, 1.0
    for _ in range(60):
        share = 0.5 * (low + high)
        answers = [_sum(x, y, share) for x, y in zip(below, above, strict=True)]
        low, high = (share, high) if _taken(answers) < wanted else (low, share)
    return answers


def _sum(x: Answer | None, y: Answer | None, share: float) -> Answer | None:
    if x is None or y is None or x.spline is None or y.spline is None:
        return x
    law = third_order.law_of(third_order.mixed(x.spline, y.spline, share)).law
    return replace(x, timed=replace(x.timed, law=law))


def _next(known: list[tuple[float, float]], wanted: float, slope: float) -> float:
    """Return where an increasing function is ``wanted`` next: by secants inside the bracket, or a step beyond."""
    x, y = known[-1]
    below = max((k for k in known if k[1] < wanted), default=None)
    above = min((k for k in known if k[1] > wanted), default=None)
    if below is None or above is None:
        step = (wanted - y) / slope
        return x + float(np.sign(step) * np.clip(abs(step), 2.0, 8.0))
    share = (wanted - below[1]) / (above[1] - below[1])
    return below[0] + float(np.clip(share, 0.05, 0.95)) * (above[0] - below[0])


def best_law(
    course: Course, stations: int | None, price: float, deadline: Deadline, grid: Array | None = None
) -> Answer:
    """Return the best law for a price of squared path acceleration against time; 0: the fastest.

    Parameters
    ----------
    stations : int
        A fixed number of them; None: as many as are needed.
    grid : (n + 1,)
        The stations themselves.

    Raises
    ------
    Infeasible
        No law joins the states asked at the ends.
    SolverFailed
        None was found that does.
    TimeLimit
    """
    third = course.jerk or price > 0.0
    goal = np.inf if stations or grid is not None else UNUSED if price > 0.0 else GOAL[third]
    if grid is None:
        scale = 4 if price > 0.0 else 1
        count = stations or scale * max(FIRST[0], FIRST[1] * course.curve.pieces)
        grid = initial_grid(course.curve, count, (False, False))
        fast = 0.0 if course.rests else float(second_order.fastest_profile(course.without_jerk(), grid).max())
        slow = course.start[0] ** 2 <= SLOW * fast, course.end[0] ** 2 <= SLOW * fast
        grid = initial_grid(course.curve, count, slow, HALVINGS[third and not course.curve.rational])
    most = max(MOST[third], 2 * len(grid))
    started = time.perf_counter()
    solve = partial(_third, course, price) if third else partial(_second, course)
    notes: tuple[Note, ...] = ()
    try:
        found = refined(course, grid, solve, goal, most, deadline)
        law, grid, rounds, spline = found.attempt.law.law, found.grid, found.rounds, found.attempt.spline
    except SolverFailed as error:
        if not course.rests:
            raise
        law, rounds, spline = smooth_law(course.curve), 0, None
        notes = (Note("not_optimal", f"no time-optimal profile was found ({error.status}): a smooth law stands in"),)
    return Answer(course, Timed(law, time.perf_counter() - started, notes, rounds), grid, spline)


def _second(course: Course, grid: Array, tight: Array, before: Attempt | None, rough: bool) -> Attempt:
    return Attempt(second_order.law_of(grid, second_order.fastest_profile(course, grid, tight)))


def _third(course: Course, price: float, grid: Array, tight: Array, before: Attempt | None, rough: bool) -> Attempt:
    ceiling = second_order.fastest_profile(course.without_jerk(), grid)
    if before is None or before.spline is None:
        guess = third_order.first_guess(ceiling)
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
