"""Velocity, acceleration and jerk limits on given even stations: ours beside conic and nonlinear programs."""

import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np

from planner.timing import second_order, third_order
from planner.timing.course import Course
from planner.timing.following import Units
from planner.timing.nlp_law import nlp_law

from ..figures import Array
from ..minimum_jerk.rounds import in_turn, over
from .peers import COPP, WITHOUT_COPP, copp_jerk
from .problems import Posed, uniform
from .rows import Timing, of_law, of_profile

PART = "jerk limits on given stations"
OURS, PEER, IPOPT = "pose and solve", "copp-py topp3_socp", "IPOPT"
CASES = ("rand7_w10_s1", "rand7_w50_s1", "copp_randspline_0")
SIZES = (300, 1000)
GOALS = {300: 9.0, 1000: 8.0}
TOLERANCE = 1e-6
#: Where IPOPT is shown, by case and stations: it takes seconds.
SHOWN = (("rand7_w10_s1", 300), ("rand7_w10_s1", 1000))


def measure(quick: bool = False) -> list[Timing]:
    """Return the lines."""
    found = []
    for name in CASES[:1] if quick else CASES:
        for count in (50,) if quick else SIZES:
            found += _problem(Posed.of(name, jerk=True), count, quick)
    return found


def ours(course: Course, grid: Array) -> third_order.Spline:
    """Return the profile, from the path and nothing else."""
    whole = np.ones((4, len(grid) - 1, course.curve.dims))
    ceiling = second_order.fastest_profile(course.without_jerk(), grid, whole)
    problem = third_order.pose(course, grid, whole, ceiling)
    return third_order.solve(problem, third_order.first_guess(ceiling), (1.0, 0.0), TOLERANCE)


def _problem(problem: Posed, count: int, quick: bool) -> list[Timing]:
    course = problem.course
    grid = uniform(course, count)
    calls: dict[str, Callable[[], Any]] = {OURS: lambda: ours(course, grid)}
    if COPP is not None:
        calls[PEER] = copp_jerk(course, grid)
    answers = {name: run() for name, run in calls.items()}
    seconds = in_turn(calls, 1 if quick else 7, budget=10.0, always=tuple(calls))
    spline = answers[OURS]
    law = third_order.law_of(spline).law
    found = [_row(problem, grid, OURS, seconds, law.duration, of_law(course, law), f"{spline.iterations} iterations")]
    if COPP is None:
        found.append(Timing(PART, problem.name, len(grid), PEER, told=WITHOUT_COPP))
    else:
        profile = answers[PEER]
        taken = float(COPP.interpolation.s_to_t_topp3(grid, profile)[0])
        slow = of_profile(course, grid, profile.a, profile.b, taken)
        told = "linearised once; its derivatives and rows are ready"
        found.append(_row(problem, grid, PEER, seconds, taken, slow, told, GOALS.get(count)))
    if quick or (problem.name, count) in SHOWN:
        began = time.process_time()
        timed = nlp_law(course.curve, problem.asked.limits, Units.of(course.curve, problem.asked.limits), grid, None)
        once = {IPOPT: [time.process_time() - began], OURS: seconds[OURS]}
        told = f"once, of which the solver {timed.seconds:.2g} s"
        found.append(_row(problem, grid, IPOPT, once, timed.law.duration, of_law(course, timed.law), told))
    return found


def _row(
    problem: Posed,
    grid: Array,
    name: str,
    seconds: dict[str, list[float]],
    duration: float,
    slow: Any,
    told: str,
    goal: float | None = None,
) -> Timing:
    own = seconds[name]
    entry = (PART, problem.name, len(grid), name, 1e3 * median(own), over(own, seconds[OURS]), goal)
    best = problem.best
    return Timing(
        *entry,
        duration=duration,
        strict=slow.strict,
        beyond=slow.beyond,
        over=slow.strict / best["duration"] - 1.0,
        told=told,
        rounds=len(own),
    )
