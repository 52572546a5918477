"""Within limits: ours, which hold at all times, beside solvers of the same program with limits at samples."""

from collections.abc import Callable
from functools import partial
from statistics import median
from typing import Any

import numpy as np

from planner import SolverFailed, Trajectory, plan
from planner.smoothing.minimum_jerk import Smoothing, smoothest

from ..figures import Array
from .limited_problems import SAMPLES, Limited, Program
from .qp_solvers import by_clarabel, by_daqp, by_osqp, by_piqp
from .rounds import Standing, in_turn, over

PART = "within limits"
OURS, PLAN, PIQP, CLARABEL, OSQP, DAQP = "smoothest", "plan", "PIQP", "Clarabel", "OSQP, polished", "DAQP"
SOLVERS: dict[str, Callable[[Program], Array]] = {
    PIQP: by_piqp,
    CLARABEL: by_clarabel,
    OSQP: by_osqp,
    DAQP: by_daqp,
}
GOALS = {(10, PIQP): 1.0, (100, PIQP): 6.0, (1000, PIQP): 8.0, (1000, OSQP): 12.0}
SMALL = 10  # waypoints that a dense solver is given
#: What our answers are held to: cost over the best bound, violation.
BEYOND, VIOLATION = 1e-6, 1e-6
SHARES = (0.5, 0.7)


def measure(quick: bool = False) -> list[Standing]:
    """Return the standings."""
    found = []
    for count, dims in ((10, 7),) if quick else ((10, 7), (100, 7), (1000, 3)):
        for share in SHARES[:1] if quick else SHARES:
            names = [n for n in SOLVERS if n != DAQP or count <= SMALL]
            if count == 1000 and share != SHARES[0]:
                names = [PIQP]  # the others take seconds
            found += _problem(count, dims, share, names, quick)
    return found


def _problem(count: int, dims: int, share: float, names: list[str], quick: bool) -> list[Standing]:
    problem = Limited.of(count, dims, share)
    programs = problem.programs()
    calls: dict[str, Callable[[], Any]] = {
        OURS: lambda: smoothest(problem.request, Smoothing()),
        PLAN: lambda: plan(problem.request, "minimum_jerk"),
    }
    calls |= {name: partial(_solved, SOLVERS[name], programs) for name in names}
    motions = {name: _motion(problem, run()) for name, run in calls.items()}
    bound = max(_proved(problem, how) for how in (Smoothing(), Smoothing(backend="clarabel")))
    seconds = in_turn(calls, 1 if quick else 9, budget=4.0, always=(OURS, PLAN, PIQP))
    found = []
    for name, own in seconds.items():
        beyond = motions[name].squared_integral(3) / bound - 1.0
        violation = problem.violation(motions[name])
        told = f"limits at {SAMPLES} samples a gap" if name in SOLVERS else "limits at all times"
        if name in (OURS, PLAN) and not (beyond <= BEYOND and violation <= VIOLATION):
            told += "; **misses the optimum, or a limit**"
        goal = None if quick else GOALS.get((count, name))
        entry = (PART, f"f = {share}", dims, count, name, 1e3 * median(own), over(own, seconds[OURS]), goal)
        found.append(Standing(*entry, beyond=beyond, violation=violation, told=told, rounds=len(own)))
    return found


def _solved(solver: Callable[[Program], Array], programs: list[Program]) -> list[Array]:
    return [solver(program) for program in programs]


def _motion(problem: Limited, answer: Any) -> Trajectory:
    if not isinstance(answer, list):
        return answer.trajectory
    return problem.motion([np.asarray(a, dtype=np.float64) for a in answer])


def _proved(problem: Limited, how: Smoothing) -> float:
    """Return the lower bound of the cost that an answer of ours proves: the value of its dual, by the statement."""
    try:
        bound = smoothest(problem.request, how).bound
    except SolverFailed:
        return -np.inf
    return -np.inf if bound is None else float(bound.evidence.lower_bound())
