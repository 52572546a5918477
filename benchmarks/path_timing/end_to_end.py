"""From waypoints to samples of position, velocity and acceleration, as users call it; ours with the certificate."""

from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np

from planner import plan

from ..figures import Array
from ..minimum_jerk.rounds import in_turn, over
from .peers import toppra_instance
from .problems import Posed
from .rows import DENSE, Timing, sampled

PART = "from waypoints to samples"
OURS, FIXED = "plan, default", "plan, stations=200"
WHOLE, CONSTANT, REST = "toppra", "toppra, ParametrizeConstAccel", "toppra, path and constraints ready"
FINE = "toppra, ParametrizeConstAccel, as many stations as ours"
CASES = ("rand7_w10_s0", "rand7_w10_s1")
SAMPLES = 1000
GOAL = 30.0
TOLD = {
    OURS: "request checked and answer certified",
    FIXED: "the same",
    WHOLE: "its defaults",
    CONSTANT: "exact between its stations",
    REST: "compute_trajectory and samples",
    FINE: "even ones",
}


def measure(quick: bool = False) -> list[Timing]:
    """Return the lines."""
    return [row for name in (CASES[:1] if quick else CASES) for row in _problem(Posed.of(name, jerk=False), quick)]


def _problem(problem: Posed, quick: bool) -> list[Timing]:
    ready = toppra_instance(problem)
    count = plan(problem.asked, "time_optimal_path", problem.options).trajectory.pieces
    even = np.linspace(problem.course.curve.start, problem.course.curve.end, count + 1)
    exact = {"parametrizer": "ParametrizeConstAccel"}
    motions: dict[str, Callable[[], Any]] = {
        OURS: lambda: plan(problem.asked, "time_optimal_path", problem.options).trajectory,
        FIXED: lambda: plan(problem.asked, "time_optimal_path", {**problem.options, "stations": 200}).trajectory,
        WHOLE: lambda: toppra_instance(problem).compute_trajectory(),
        CONSTANT: lambda: toppra_instance(problem, **exact).compute_trajectory(),
        REST: ready.compute_trajectory,
        FINE: lambda: toppra_instance(problem, **exact, gridpoints=even).compute_trajectory(),
    }
    calls = {name: _sampling(make) for name, make in motions.items()}
    held = {name: make() for name, make in motions.items()}
    for run in calls.values():
        run()
    seconds = in_turn(calls, 1 if quick else 9, budget=6.0, always=tuple(calls))
    limits = np.stack(problem.sides)
    found = []
    for name, own in seconds.items():
        duration = float(held[name].duration)
        slow = sampled(_states(held[name], DENSE)[1:], limits[:, :, 0], limits[:, :, 1], duration)
        goal = GOAL if name == WHOLE and not quick else None
        entry = (PART, problem.name, None, name, 1e3 * median(own), over(own, seconds[OURS]), goal)
        told = TOLD[name] if name != WHOLE else f"{TOLD[name]}, {len(ready.gridpoints)} stations"
        told = f"{told}, {held[name].pieces + 1} stations" if name in (OURS, FIXED) else told
        extra = {"duration": duration, "strict": slow.strict, "beyond": slow.beyond, "told": told}
        found.append(Timing(*entry, **extra, rounds=len(own)))
    ratio = over(seconds[WHOLE], seconds[FIXED])
    return [*found, Timing(PART, problem.name, None, f"{WHOLE} over {FIXED}", None, ratio, None if quick else GOAL)]


def _sampling(make: Callable[[], Any]) -> Callable[[], Array]:
    return lambda: _states(make(), SAMPLES)


def _states(motion: Any, count: int) -> Array:
    """Return position, velocity and acceleration at even times, (3, n, D), of a trajectory of either package."""
    if hasattr(motion, "states"):
        return motion.states(np.linspace(motion.start, motion.end, count), 3)
    at = np.linspace(0.0, motion.duration, count)
    return np.stack([motion(at), motion(at, 1), motion(at, 2)])
