"""How good the answers are: every path of the data, with and without jerk limits, and what finer stations find."""

import time
from statistics import median

import numpy as np

from planner import Plan, PlannerError, plan
from planner.deadline import Deadline
from planner.timing import second_order, third_order
from planner.timing.course import exact_use
from planner.timing.grids import initial_grid
from planner.timing.refinement import Attempt, refined

from ..figures import Array
from .problems import Posed, cases
from .rows import Timing

PART = "quality"
DEFAULT, FINER = "default", "finer"
#: What may be lost by the stations where more of them are to show what is possible, the most of them, and where: on
#: paths of at least so many waypoints.
GOAL, MOST, MANY = 1e-4, 40_000, 50
#: Rounds; one where a plan takes longer than so many s.
ROUNDS, SLOW = 3, 0.5


def measure(quick: bool = False) -> list[Timing]:
    """Return the lines."""
    found = []
    for name, case in cases().items():
        if quick and name not in ("toppra_straight_line", "toppra_two_points_1"):
            continue
        for jerk in (False, True):
            found.append(_row(name, jerk, 1 if quick else ROUNDS))
            if jerk and not quick and len(case["request"]["waypoints"]) >= MANY:
                found.append(finer(name))
    return found


def finer(name: str) -> Timing:
    """Return what a finer grid finds with jerk limits, once."""
    problem = Posed.of(name, jerk=True)
    (course,) = problem.courses
    grid = initial_grid(course.curve, 8 * course.curve.pieces)
    began = time.process_time()

    def solve(grid: Array, tight: Array, before: Attempt | None, rough: bool) -> Attempt:
        ceiling = second_order.fastest_profile(course.without_jerk(), grid, np.ones_like(tight))
        guess = before.spline.guess(grid) if before and before.spline else third_order.first_guess(ceiling)
        spline = third_order.solve(third_order.pose(course, grid, tight, ceiling), guess, (1.0, 0.0), 1e-6)
        return Attempt(third_order.law_of(spline), third_order.shares(spline, tight), spline)

    found = refined(course, grid, solve, GOAL, MOST, Deadline(None))
    law = found.attempt.law
    spent = 1e3 * (time.process_time() - began)
    duration = law.duration * max(float(exact_use(course, found.grid, law).factors.max()), 1.0)
    best = {"over": problem.best["duration"], "over_strict": problem.best["duration_strict"]}
    over = {key: duration / value - 1.0 for key, value in best.items()}
    told = "by the solver alone, slowed until the limits hold"
    title, pieces = f"{name}, with jerk", law.pieces.shape[1]
    return Timing(PART, title, pieces, FINER, spent, duration=duration, **over, told=told, rounds=1)


def _row(name: str, jerk: bool, rounds: int) -> Timing:
    problem = Posed.of(name, jerk)
    title = f"{name}, with jerk" if jerk else name
    seconds: list[float] = []
    try:
        done = plan(problem.asked, "time_optimal_path", problem.options)  # kernels are compiled
        slow = sum(done.seconds.values()) > SLOW
        for _ in range(1 if slow else rounds):
            began = time.process_time()
            done = plan(problem.asked, "time_optimal_path", problem.options)
            seconds.append(time.process_time() - began)
    except PlannerError as error:
        return Timing(PART, title, None, DEFAULT, told=f"**{type(error).__name__}: {error}**")
    return _judged(problem, done, title, seconds)


def _judged(problem: Posed, done: Plan, title: str, seconds: list[float]) -> Timing:
    duration, best, told = done.trajectory.duration, problem.best, done.certificate
    goal = told.objective
    return Timing(
        PART,
        title,
        done.trajectory.pieces,
        DEFAULT,
        1e3 * median(seconds),
        duration=duration,
        beyond=max(c.ratio for c in told.checks if c.ratio is not None) - 1.0,
        over=duration / best["duration"] - 1.0 if best else None,
        over_strict=duration / best["duration_strict"] - 1.0 if best else None,
        gap=None if goal is None else goal.gap,
        scope="" if goal is None or goal.bound_scope is None else goal.bound_scope,
        told="; ".join([*(n.code for n in done.notes), *([] if told.holds else ["**does not hold**"])]),
        rounds=len(seconds),
    )
