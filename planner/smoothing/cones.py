"""The Euclidean norm of the velocity, kept through second-order cones at the places where it breaks its bound."""

import time

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, vstack

from problems.banded_qp import BandedQP

from ..deadline import Deadline
from ..errors import SolverFailed
from ..pieces import differentiated, product
from ..solvers import select
from ..solvers.qp import NoSolution, solve_qp
from ..trajectory import Trajectory
from .posing import Posed
from .rounds import ROUNDS, Cuts, Kept, NoPoint, Rows

Array = NDArray[np.float64]

#: By how much the norm's bound is tightened: a conic solver is less exact than the banded one.
TIGHTER = 1e-8


def kept_within_norm(cuts: Cuts, posed: Posed, norm: Array, tighter: float, ceiling: float, deadline: Deadline) -> Kept:
    """Return the optimum within the limits and with |q'| <= norm (M,) on every gap, scaled.

    Raises
    ------
    NoPoint
        There is none, proved or not.
    SolverFailed
    TimeLimit
    """
    backend = select("cone", "auto")[0]
    tighter = TIGHTER if tighter > 0 else tighter
    y, z = np.zeros(cuts.statement.size), np.zeros(0)
    rows, _ = cuts.at(y, 0.0, False)
    gap, u = np.zeros(0, np.int64), np.zeros(0)
    seconds, used = 0.0, 0
    for turn in range(ROUNDS):
        found, worst = cuts.at(y, 0.0, False)
        fast, where = fastest(posed, norm * (1.0 - 0.5 * tighter), y)
        if worst <= 0.0 and not len(fast):
            program = _with_cones(cuts, cuts.program(rows, own=True), gap, u, norm)
            sharp, z = _sharpened(cuts, program, y, z, gap, u, norm)
            return Kept(y, z, sharp, backend.name, used, seconds)
        if not len(y):
            raise NoPoint(found, np.ones(len(found.u)), True, (fast, where, np.ones(len(fast))))
        rows = found if turn == 0 else rows.and_(found)
        gap, u = np.append(gap, fast), np.append(u, where)
        left, began = deadline.left(), time.perf_counter()
        try:
            answer = solve_qp(
                _with_cones(cuts, cuts.program(rows, own=False), gap, u, norm * (1.0 - tighter)), backend, left
            )
        except NoSolution as failed:
            raise _no_point(cuts, rows, gap, u, norm, failed.multipliers, ceiling) from None
        y, z = answer.y, answer.z
        seconds, used = seconds + time.perf_counter() - began, used + max(answer.iterations, 1)
    raise SolverFailed(backend.name, f"limits still broken after {ROUNDS} rounds")


def _sharpened(
    cuts: Cuts, program: BandedQP, y: Array, z: Array, gap: NDArray[np.int64], u: Array, norm: Array
) -> tuple[BandedQP, Array]:
    """Return a program with a plain row for each cone, tangent to it at the optimum, and more exact multipliers.

    It is a relaxation with the same optimum. Of the two programs and multipliers the pair with the larger dual value is
    returned: conic solvers leave that a few digits short.
    """
    if not len(gap):
        return program, z
    plain, dims, count = len(program.upper) - sum(program.cones), cuts.statement.dims, len(gap)
    slack = (program.upper - program.rows @ y)[plain:].reshape(count, dims + 1)
    length = np.linalg.norm(slack[:, 1:], axis=1)
    along = slack[:, 1:] / np.where(length > 0, length, 1.0)[:, None]
    matrix, constant = cuts.statement.rows(gap, u, np.ones(count, np.int64), along)
    size = norm[gap]
    rows = csr_matrix(vstack([program.rows[:plain], matrix.multiply((1.0 / size)[:, None])]))
    flat = BandedQP(
        program.bands,
        program.gradient,
        program.constant,
        rows,
        np.concatenate([program.upper[:plain], 1.0 - constant / size]),
        ridge=program.ridge,
    )
    try:
        answer = solve_qp(flat, select("qp", "interior_point")[0])
    except NoSolution:
        return program, z
    return (flat, answer.z) if flat.dual_value(answer.z) > program.dual_value(z) else (program, z)


def _no_point(
    cuts: Cuts, rows: Rows, gap: NDArray[np.int64], u: Array, norm: Array, z: Array | None, ceiling: float
) -> NoPoint:
    if z is None:
        return NoPoint(rows, np.ones(len(rows.u)), False, (gap, u, np.ones(len(gap))))
    program = _with_cones(cuts, cuts.program(rows, own=True), gap, u, norm)
    return NoPoint(rows, z[: len(rows.u)], program.best_dual_value(z) > ceiling, (gap, u, z[len(rows.u) :]))


def _with_cones(cuts: Cuts, program: BandedQP, gap: NDArray[np.int64], u: Array, norm: Array) -> BandedQP:
    """Return the program with a cone (norm, q') for every place on a gap."""
    if not len(gap):
        return program
    dims = cuts.statement.dims
    order = np.ones(len(gap), np.int64)
    size = norm[gap]
    parts, uppers = [], []
    for d in range(dims):
        matrix, constant = cuts.statement.rows(gap, u, order, np.tile(np.eye(dims)[d], (len(gap), 1)))
        parts.append(csr_matrix(matrix.multiply((1.0 / size)[:, None])))
        uppers.append(-constant / size)
    none = csr_matrix((len(gap), cuts.statement.size))
    place = np.arange(len(gap) * (dims + 1)).reshape(dims + 1, len(gap)).T.reshape(-1)  # a cone's rows together
    cones = vstack([none, *parts]).tocsr()[place]
    upper = np.concatenate([np.ones(len(gap)), *uppers])[place]
    return BandedQP(
        program.bands,
        program.gradient,
        program.constant,
        csr_matrix(vstack([program.rows, cones])),
        np.concatenate([program.upper, upper]),
        (dims + 1,) * len(gap),
        program.ridge,
    )


def fastest(posed: Posed, norm: Array, y: Array | None = None) -> tuple[NDArray[np.int64], Array]:
    """Return the gaps on which the norm of the velocity is beyond its bound, and where on them it is largest."""
    motion = posed.motion(np.zeros(posed.statement.size) if y is None else y)
    slope = differentiated(motion.coefficients, 1) * motion.rates[:, None]
    squared = sum(product(slope[:, :, d : d + 1], slope[:, :, d]) for d in range(motion.dims))
    found = Trajectory(motion.breaks, np.asarray(squared)).extrema(1)
    over = np.flatnonzero(found.high[0, :, 0] > norm**2)
    place = (found.at_high[0, over, 0] - motion.breaks[over]) * motion.rates[over]
    return over, np.clip(place, 0.0, 1.0)
