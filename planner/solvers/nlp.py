"""Nonlinear programs through CasADi; a solution counts when the constraint residual that we compute passes."""

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SolverFailed, TimeLimit
from . import Backend

Array = NDArray[np.float64]

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


def solve_nlp(problem: dict[str, Any], backend: Backend, time_limit: float | None = None) -> NLPSolution:
    """Solve the program that a statement's ``to_casadi`` returned.

    Raises
    ------
    SolverFailed
        The iterate at which the solver stopped breaks its constraints.
    TimeLimit
        It stopped because the time ran out.
    """
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
