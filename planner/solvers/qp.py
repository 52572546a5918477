"""Quadratic programs through libraries; a solution counts when our own residuals pass, whatever the solver says."""

import time
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, triu

from problems.banded_qp import BandedQP

from ..errors import SolverFailed
from . import Backend

Array = NDArray[np.float64]

#: Asked of the solver, and accepted by us (rows are scaled to one).
ASKED = 1e-10
PRIMAL, DUAL = 1e-7, 1e-4


@dataclass(frozen=True, eq=False)
class QPSolution:
    """Minimiser, multipliers of the rows, iterations and seconds, and the residuals computed by us."""

    y: Array
    z: Array
    iterations: int
    seconds: float
    residuals: dict[str, float]


class NoSolution(SolverFailed):
    """No solution that passes; ``multipliers`` are what the solver hands over as proof that there is none."""

    def __init__(
        self,
        backend: str,
        status: str,
        residuals: dict[str, float] | None = None,
        multipliers: Array | None = None,
    ) -> None:
        super().__init__(backend, status, residuals)
        self.multipliers = multipliers


def solve_qp(problem: BandedQP, backend: Backend, time_limit: float | None = None) -> QPSolution:
    """Solve with one back end.

    Raises
    ------
    NoSolution
        No solution, or one whose residuals do not pass; an infeasible program among others.
    """
    if len(problem.gradient) > backend.most:
        raise NoSolution(backend.name, f"meant for at most {backend.most:g} unknowns")
    started = time.perf_counter()
    call = {"clarabel": _clarabel, "interior_point": _own}.get(backend.name, _through_qpsolvers)
    y, z, iterations = call(problem, backend, time_limit)
    seconds = time.perf_counter() - started
    if not (np.isfinite(y).all() and np.isfinite(z).all()):
        raise NoSolution(backend.name, "no solution")
    z = problem.dual_feasible(z)
    residuals = problem.residuals(y, z)
    if residuals["primal"] > PRIMAL or residuals["dual"] > DUAL:
        raise NoSolution(backend.name, "the residuals do not pass", residuals)
    return QPSolution(y, z, iterations, seconds, residuals)


def _through_qpsolvers(problem: BandedQP, backend: Backend, time_limit: float | None) -> tuple[Array, Array, int]:
    import qpsolvers

    settings = backend.settings(ASKED, time_limit)
    if not len(problem.upper):
        settings.pop("polishing", None)  # without rows OSQP only prints that there is nothing to polish
    with warnings.catch_warnings():  # a failed solve is judged by its residuals
        warnings.simplefilter("ignore")
        try:
            answer = qpsolvers.solve_problem(problem.to_qpsolvers(), solver=backend.name, **settings)
        except Exception as error:  # adapters raise what they like
            raise NoSolution(backend.name, f"{type(error).__name__}: {error}"[:300]) from None
    if answer.x is None:
        raise NoSolution(backend.name, "no solution")
    z = np.zeros(len(problem.upper)) if answer.z is None else np.asarray(answer.z, dtype=np.float64)
    return np.asarray(answer.x, dtype=np.float64), z, _iterations(answer.extras)


def _clarabel(problem: BandedQP, backend: Backend, time_limit: float | None) -> tuple[Array, Array, int]:
    import clarabel

    settings = clarabel.DefaultSettings()
    for name, value in backend.settings(ASKED, time_limit).items():
        setattr(settings, name, value)
    plain = len(problem.upper) - sum(problem.cones)
    cones: list[Any] = [clarabel.NonnegativeConeT(plain)] if plain else []
    cones += [clarabel.SecondOrderConeT(size) for size in problem.cones]
    above = csc_matrix(triu(problem.hessian()))
    solver = clarabel.DefaultSolver(above, problem.gradient, csc_matrix(problem.rows), problem.upper, cones, settings)
    answer = solver.solve()
    z = np.array(answer.z, dtype=np.float64)
    if "PrimalInfeasible" in str(answer.status):
        raise NoSolution(backend.name, str(answer.status), multipliers=z if np.isfinite(z).all() else None)
    return np.array(answer.x, dtype=np.float64), z, int(answer.iterations)


def _own(problem: BandedQP, backend: Backend, time_limit: float | None) -> tuple[Array, Array, int]:
    from ..kernels.interior_point import SOLVED, factor, interior_point

    band = np.ascontiguousarray(problem.bands[::-1].T)
    factors = np.zeros_like(band)
    if problem.cones or not factor(band, factors):
        raise NoSolution(backend.name, "second-order cones, or a Hessian that is not positive definite")
    count, entries = len(problem.upper), np.diff(problem.rows.indptr)
    columns = np.full((count, int(entries.max(initial=1))), -1, dtype=np.int64)
    values = np.zeros(columns.shape)
    row = np.repeat(np.arange(count), entries)
    column = np.arange(len(row)) - np.repeat(problem.rows.indptr[:-1], entries)
    columns[row, column], values[row, column] = problem.rows.indices, problem.rows.data
    y, z, none = problem.free_minimum(), np.zeros(count), np.zeros(count)
    if not count:
        return y, z, 0
    size = max(abs(problem.value(y)), 1e-6 * abs(problem.constant), 1e-300)
    table = (columns, values, problem.upper, np.zeros_like(values), none, none)
    status, iterations = interior_point(
        band, factors, problem.gradient, *table, np.inf, size, size, 1.0, 0.1 * ASKED, 100, y, z
    )
    if status != SOLVED:
        raise NoSolution(backend.name, "the residuals do not pass")
    return y, z, int(iterations)


def _iterations(extras: dict[str, object]) -> int:
    info = extras.get("info")
    count = getattr(info, "iter", None)
    return int(count) if isinstance(count, (int, np.integer)) else 0
