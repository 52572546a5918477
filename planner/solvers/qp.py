"""Quadratic programs through qpsolvers; a solution counts when our own residuals pass, whatever the solver says."""

import time
import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from problems.banded_qp import BandedQP

from ..errors import SolverFailed
from . import Backend

Array = NDArray[np.float64]

#: Asked of the solver, and accepted by us (rows are scaled to one, the gradient to its largest entry).
ASKED = 1e-10
PRIMAL, DUAL = 1e-7, 1e-5


@dataclass(frozen=True, eq=False)
class QPSolution:
    """Minimiser, multipliers of the rows (>= 0), iterations and seconds, and the residuals computed by us."""

    y: Array
    z: Array
    iterations: int
    seconds: float
    residuals: dict[str, float]


def solve_qp(problem: BandedQP, backend: Backend, time_limit: float | None = None) -> QPSolution:
    """Solve with one back end.

    Raises
    ------
    SolverFailed
        No solution, or one whose residuals do not pass; an infeasible program among others.
    """
    import qpsolvers

    settings = backend.settings(ASKED, time_limit)
    if not len(problem.upper):
        settings.pop("polishing", None)  # without rows OSQP only prints that there is nothing to polish
    started = time.perf_counter()
    with warnings.catch_warnings():  # a failed solve is judged by its residuals below
        warnings.simplefilter("ignore")
        try:
            answer = qpsolvers.solve_problem(problem.to_qpsolvers(), solver=backend.name, **settings)
        except Exception as error:  # adapters raise what they like
            raise SolverFailed(backend.name, f"{type(error).__name__}: {error}"[:300]) from None
    seconds = time.perf_counter() - started
    if answer.x is None or not np.isfinite(answer.x).all():
        raise SolverFailed(backend.name, "no solution")
    y = np.asarray(answer.x, dtype=np.float64)
    z = np.zeros(len(problem.upper)) if answer.z is None else np.maximum(np.asarray(answer.z, dtype=np.float64), 0.0)
    if not np.isfinite(z).all():
        raise SolverFailed(backend.name, "no multipliers")
    residuals = problem.residuals(y, z)
    if residuals["primal"] > PRIMAL or residuals["dual"] > DUAL:
        raise SolverFailed(backend.name, "the residuals do not pass", residuals)
    return QPSolution(y, z, _iterations(answer.extras), seconds, residuals)


def _iterations(extras: dict[str, object]) -> int:
    info = extras.get("info")
    count = getattr(info, "iter", None)
    return int(count) if isinstance(count, (int, np.integer)) else 0
