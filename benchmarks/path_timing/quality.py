"""How good the answers are: every path of the data, with and without jerk limits, and what finer stations find."""

import time
from statistics import median

from planner import Plan, PlannerError, plan

from .problems import Posed, cases
from .rows import Timing

PART = "quality"
DEFAULT = "default"
#: Fixed stations of the runs that show what more of them find, on paths of at least so many waypoints.
FINER, MANY = 30_000, 50
#: Rounds; one where a plan takes longer than so many s, none with fixed stations.
ROUNDS, SLOW = 3, 0.5


def measure(quick: bool = False) -> list[Timing]:
    """Return the lines."""
    found = []
    for name, case in cases().items():
        if quick and name not in ("toppra_straight_line", "toppra_two_points_1"):
            continue
        for jerk in (False, True):
            found.append(_row(name, jerk, None, 1 if quick else ROUNDS))
            if jerk and not quick and len(case["request"]["waypoints"]) >= MANY and case["dof"] == 7:
                found.append(_row(name, jerk, FINER, 1))
    return found


def _row(name: str, jerk: bool, stations: int | None, rounds: int) -> Timing:
    problem = Posed.of(name, jerk)
    options = {**problem.options, **({} if stations is None else {"stations": stations})}
    title = f"{name}, with jerk" if jerk else name
    entry = DEFAULT if stations is None else f"stations={stations}"
    seconds: list[float] = []
    try:
        done = plan(problem.asked, "time_optimal_path", options)  # kernels are compiled
        slow = sum(done.seconds.values()) > SLOW
        for _ in range(0 if stations is not None else 1 if slow else rounds):
            began = time.process_time()
            done = plan(problem.asked, "time_optimal_path", options)
            seconds.append(time.process_time() - began)
    except PlannerError as error:
        return Timing(PART, title, None, entry, told=f"**{type(error).__name__}: {error}**")
    return _judged(problem, done, title, entry, 1e3 * (median(seconds) if seconds else done.seconds["solve"]))


def _judged(problem: Posed, done: Plan, title: str, entry: str, ms: float) -> Timing:
    duration, best, told = done.trajectory.duration, problem.best, done.certificate
    goal = told.objective
    return Timing(
        PART,
        title,
        done.stats.iterations,
        entry,
        ms,
        duration=duration,
        beyond=max(c.ratio for c in told.checks if c.ratio is not None) - 1.0,
        over=duration / best["duration"] - 1.0 if best else None,
        over_strict=duration / best["duration_strict"] - 1.0 if best else None,
        gap=None if goal is None else goal.gap,
        scope="" if goal is None or goal.bound_scope is None else goal.bound_scope,
        told="; ".join([*(n.code for n in done.notes), *([] if told.holds else ["**does not hold**"])]),
    )
