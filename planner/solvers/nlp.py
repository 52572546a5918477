"""Nonlinear programs through CasADi; a solution counts when the constraint residual that we compute passes."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SolverFailed, TimeLimit
from . import Backend

Array = NDArray[np.float64]

#: CasADi is not safe for threads, neither in building expressions nor in solving: one at a time.
_ONE_AT_A_TIME = threading.Lock()

#: Asked of the solver, and accepted by us (constraints are scaled to one).
ASKED = 1e-8
PRIMAL = 1e-5


@dataclass(frozen=True, eq=False)
class NLPSolution:
    """Minimiser, iterations, seconds, the solver's own word, and the largest constraint violation computed by us."""

    x: Array
    iterations: int
    seconds: float
    status: str
    violation: float


def solve_nlp(pose: Callable[[], dict[str, Any]], backend: Backend, time_limit: float | None = None) -> NLPSolution:
    """Solve the program that ``pose`` returns: what a statement's ``to_casadi`` gives.

    Raises
    ------
    SolverFailed
        The iterate at which the solver stopped breaks its constraints.
    TimeLimit
        It stopped, or had not begun, because the time ran out.
    """
    started = time.perf_counter()
    if not _ONE_AT_A_TIME.acquire(timeout=-1 if time_limit is None else time_limit):
        raise TimeLimit(time_limit or 0.0)
    try:
        waited = time.perf_counter() - started
        return _solve(pose(), backend, None if time_limit is None else max(time_limit - waited, 1e-3))
    finally:
        _ONE_AT_A_TIME.release()


def _solve(problem: dict[str, Any], backend: Backend, time_limit: float | None) -> NLPSolution:
    import casadi as ca

    settings = {f"{backend.name}.{k}": v for k, v in backend.settings(ASKED, time_limit).items()}
    expressions = {k: problem[k] for k in ("x", "f", "g")}
    solver = ca.nlpsol(
        "solver", backend.name, expressions, {**settings, "print_time": False, "show_eval_warnings": False}
    )
    constraints = ca.Function("g", [problem["x"]], [problem["g"]])
    started = time.perf_counter()
    try:
        answer = solver(**{k: problem[k] for k in ("x0", "lbx", "ubx", "lbg", "ubg")})
    except RuntimeError as error:  # CasADi's word for a program with NaN in it
        raise SolverFailed(backend.name, str(error).strip().splitlines()[-1][:300]) from None
    seconds = time.perf_counter() - started
    stats = solver.stats()
    status = str(stats["return_status"])
    if "Time_Exceeded" in status or "WallTime" in status:
        raise TimeLimit(time_limit or seconds)
    x = np.asarray(answer["x"]).reshape(-1)
    g = np.asarray(constraints(x)).reshape(-1)
    violation = float(np.maximum(problem["lbg"] - g, g - problem["ubg"]).max(initial=0.0))
    if not np.isfinite(x).all() or not violation <= PRIMAL:
        raise SolverFailed(backend.name, status, {"primal": violation if np.isfinite(violation) else 1e300})
    return NLPSolution(x, int(stats["iter_count"]), seconds, status, violation)
