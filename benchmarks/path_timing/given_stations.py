"""Velocity and acceleration limits, path derivatives at given stations: the solving alone; and how it grows."""

from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np

from planner.kernels.path_speeds import fastest_speeds, speed_caps
from planner.timing.course import Course
from planner.timing.second_order import derivatives

from ..figures import Array, power
from ..minimum_jerk.rounds import in_turn, over
from .peers import COPP, WITHOUT_COPP, copp_solve, toppra_solve
from .problems import Posed, uniform
from .rows import Timing

PART = "given stations"
OURS, TOPPRA, PEER = "fastest_speeds", "toppra compute_parameterization", "copp-py topp2_ra"
CASES = ("rand7_w5_s0", "rand7_w10_s1", "rand7_w50_s1", "toppra_plot_kinematics_seed9")
GOALS = {TOPPRA: 80.0, PEER: 5.0}
AT = 1000  # stations of the goals
#: The most: time a station at the most stations over that at the fewest.
GROWTH = 2.0
AGREE = 1e-2


def measure(quick: bool = False) -> list[Timing]:
    """Return the lines."""
    found = []
    for name in CASES[1:2] if quick else CASES:
        sizes = (100,) if quick else (100, AT, 10_000) if name == "rand7_w10_s1" else (AT,)
        for count in sizes:
            found += _problem(Posed.of(name, jerk=False), count, quick)
    return found + _growth(
        Posed.of("rand7_w10_s1", jerk=False), (10**2, 10**3) if quick else (10**3, 10**4, 10**5, 10**6)
    )


def ours(course: Course, grid: Array) -> Callable[[], Array]:
    """Return a call for sdot² at the stations; derivatives and limits of every interval are in place."""
    count = len(grid) - 1
    slopes, bends = derivatives(course, grid, np.array([0.0, 1.0]), 2)
    piece, steps = course.pieces(grid), np.diff(grid)
    limits = [np.ascontiguousarray(side[m][piece]) for m in (0, 1) for side in (course.lower, course.upper)]
    norm, whole = course.norm[piece], np.ones(count)
    caps, best, least, a = (np.empty(count + 1) for _ in range(4))

    def run() -> Array:
        speed_caps(slopes, *limits[:2], norm, whole, caps)
        status, _ = fastest_speeds(steps, slopes, bends, caps, *limits[2:], 0.0, 0.0, best, least, a)
        assert status == 0
        return a

    return run


def seconds_of(a: Array, grid: Array) -> float:
    """Return the duration of sdot² that is linear between stations."""
    speed = np.sqrt(a)
    return float((2.0 * np.diff(grid) / (speed[1:] + speed[:-1])).sum())


def _problem(problem: Posed, count: int, quick: bool) -> list[Timing]:
    grid = uniform(problem.course, count)
    calls: dict[str, Callable[[], Any]] = {OURS: ours(problem.course, grid), TOPPRA: toppra_solve(problem, grid)}
    if COPP is not None:
        calls[PEER] = copp_solve(problem.course, grid)
    durations = {name: seconds_of(run(), grid) for name, run in calls.items()}
    seconds = in_turn(calls, 1 if quick else 9, budget=6.0, always=tuple(calls))
    found = []
    for name, own in seconds.items():
        off = durations[name] / durations[OURS] - 1.0
        told = "**not the same profile**" if abs(off) > AGREE else ""
        goal = GOALS.get(name) if count == AT else None
        entry = (PART, problem.name, len(grid), name, 1e3 * median(own), over(own, seconds[OURS]), goal)
        found.append(Timing(*entry, duration=durations[name], told=told, rounds=len(own)))
    return found + ([] if COPP is not None else [Timing(PART, problem.name, len(grid), PEER, told=WITHOUT_COPP)])


def _growth(problem: Posed, sizes: tuple[int, ...]) -> list[Timing]:
    calls = {count: ours(problem.course, uniform(problem.course, count)) for count in sizes}
    for run in calls.values():
        run()
    seconds = in_turn(calls, 5, budget=10.0, always=sizes)
    found = []
    for count, own in seconds.items():
        each = 1e9 * median(own) / count
        growth = over(own, seconds[sizes[0]]) * sizes[0] / count
        goal = GROWTH if count == 10**6 else None
        entry = f"time a station at {power(count)} over that at {power(sizes[0])}"
        told = f"{each:.0f} ns a station"
        found.append(
            Timing(PART, problem.name, count, entry, 1e3 * median(own), growth, goal, True, told=told, rounds=len(own))
        )
    return found
