"""Limits in continuous time by cutting planes: rows at the extrema that break one, until none does.

The rows are a relaxation: where the free optimum keeps all limits it is the answer, and an infeasible program proves
that there is none. Limits are tightened a little, so that what comes out keeps them strictly.
"""

import time
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from problems.banded_qp import BandedQP
from problems.minimum_derivative import MinimumDerivative, hermite_basis

from ..deadline import Deadline
from ..errors import SolverFailed
from ..solvers import Backend
from ..solvers.qp import NoSolution, solve_qp
from .linear import LinearLimits
from .posing import Posed

Array = NDArray[np.float64]

#: Limits are tightened by this part of their size, so that what comes out keeps them strictly.
TIGHTER = 1e-10
#: And where a waypoint or a given state already touches a limit: how far rounding may go.
ROUNDING = 1e-9
ROUNDS = 60
#: Largest residuals, by the statement's own matrices, of what counts as an optimum.
RESIDUALS = 1e-4
#: Iterations of the interior point at most.
MOST = 100
#: With what slacks times multipliers it begins, in units of the cost; the next where it stalls.
PUSHES = (1.0, 1e4, 1e8)
#: Below this excess the rows get their second-order terms.
CURVED = 0.1
#: Extrema at least this close to breaking a limit get a row along with those that do, once rows are curved.
NEAR = 1e-6
#: Rows broken by no more than this before they are kept will not move by much.
SETTLED = 1e-6
#: Accuracy of the last program, of those before it, and of the first.
FINE, MIDDLE, COARSE = 1e-11, 1e-9, 1e-4


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of a program over y: see ``kernels.cuts``."""

    place: NDArray[np.int64]
    u: Array
    columns: NDArray[np.int64]
    values: Array
    bends: Array
    upper: Array
    offsets: Array
    kappa: Array

    def and_(self, other: "Rows") -> "Rows":
        """Return these rows and others."""
        both = {
            f.name: np.concatenate([getattr(self, f.name), getattr(other, f.name)], axis=-1 if f.name == "place" else 0)
            for f in fields(self)
        }
        return Rows(**both)

    def straight(self) -> "Rows":
        """Return the rows without second-order terms."""
        return replace(self, kappa=np.zeros_like(self.kappa))


@dataclass(frozen=True, eq=False)
class Kept:
    """The optimum within limits: unknowns, the program with the limits as asked, its multipliers, and what it took.

    ``gave``: by what part of their sizes limits were let give for it.
    """

    y: Array
    z: Array
    program: BandedQP
    name: str
    iterations: int
    seconds: float
    gave: float = 0.0


class NoPoint(Exception):
    """A program is infeasible: ``proved`` if the dual value shows it, with the rows and multipliers that do."""

    def __init__(self, rows: Rows, z: Array, proved: bool, norm: tuple[NDArray[np.int64], Array, Array] | None = None):
        super().__init__("infeasible")
        self.rows, self.z, self.proved = rows, z, proved
        #: Gaps, places and multipliers of the bounds of the velocity's norm, where there are some.
        self.norm = norm


@dataclass(frozen=True, eq=False)
class Cuts:
    """A statement made ready for finding cuts: what the kernel needs of it and its limits."""

    statement: MinimumDerivative
    limits: LinearLimits
    bounds: Array  # (4, C, M): imposed lower and upper, then those beyond which a limit counts as broken
    shape: tuple[NDArray[Any], ...]
    wide: int

    @classmethod
    def of(cls, posed: Posed, limits: LinearLimits, tighter: float) -> "Cuts":
        """Return the cuts of a posed statement within limits (its own, or others of the same kind)."""
        statement = posed.statement
        # one layout only: kernels are compiled for each
        arrays = (statement.h, statement.local, statement.given, statement.reference[:-1])
        shape = tuple(np.ascontiguousarray(a) for a in arrays)
        along = int((limits.directions != 0).sum(axis=2).max(initial=1))
        wide = min(2 * statement.order * along, 2 * statement.order * statement.dims)
        return cls(statement, limits, _bounds(posed, limits, tighter), shape, wide)

    @cached_property
    def band(self) -> Array:
        """The Hessian, (n, width + 1): entry (i, i - t) in column t."""
        return np.ascontiguousarray(self.statement.bands[::-1].T)

    @cached_property
    def factors(self) -> Array:
        """Its factors.

        Raises
        ------
        SolverFailed
            It is not positive definite in double precision.
        """
        from ..kernels.interior_point import factor

        factors = np.zeros_like(self.band)
        if not factor(self.band, factors):
            raise SolverFailed("elimination", "the Hessian is not positive definite in double precision")
        return factors

    def at(self, y: Array, near: float, curved: bool) -> tuple[Rows, float]:
        """Return the rows of limits touched by the motion of y (to within ``near``), and the worst excess."""
        from ..kernels.cuts import cuts
        from ..kernels.hermite import hermite_pieces

        statement, limits = self.statement, self.limits
        filled = statement.filled(y)
        pieces = np.empty((2 * statement.order, len(statement.h), statement.dims))
        points = statement.reference + filled[0]
        hermite_pieces(statement.h, points, filled[1:], pieces)
        table = tuple(
            np.ascontiguousarray(a) for a in (limits.orders, limits.directions, limits.sizes, limits.everywhere)
        )
        basis = hermite_basis(statement.order)
        *rows, worst = cuts(pieces, self.shape, basis, table, self.bounds, near, curved, self.wide)
        return Rows(*rows), float(worst)

    @cached_property
    def usual(self) -> float:
        """What a state of size one usually costs: where the optimum without limits costs nothing, a scale."""
        return float(np.median(self.band[:, 0])) if len(self.band) else 0.0

    def free(self) -> Array:
        """Return the optimum without limits."""
        from ..kernels.interior_point import substitute

        y = -self.statement.gradient
        substitute(self.factors, y)
        return y

    def program(self, rows: Rows, own: bool) -> BandedQP:
        """Return the program with these rows: with the limits as asked (``own``), or tightened."""
        gap, limit, side = rows.place
        matrix, constant = self.statement.rows(
            gap, rows.u, self.limits.orders[limit], self.limits.directions[limit, gap]
        )
        lower, upper = (self.limits.lower, self.limits.upper) if own else (self.bounds[0], self.bounds[1])
        bound = np.where(side > 0, upper[limit, gap], lower[limit, gap])
        size = self.limits.sizes[limit, gap]
        scaled = csr_matrix(matrix.multiply((side / size)[:, None]))
        return self.statement.program(scaled, side * (bound - constant) / size)


def _bounds(posed: Posed, limits: LinearLimits, tighter: float) -> Array:
    """Return bounds imposed, and those beyond which a limit is broken.

    They are tightened less where a given state touches a limit, and widened where ``tighter`` is negative.
    """
    margin = tighter * limits.sizes
    if tighter > 0:
        margin = np.maximum(margin, limits.rounding[:, None])
    given = np.full((4, *posed.statement.reference.shape), np.nan)
    given[: posed.statement.order] = posed.statement.states[:4]
    given[0] += posed.statement.reference
    along = limits.directions
    room = np.full((2, *limits.lower.shape), np.inf)
    for nodes, counts in ((given[:, :-1], True), (given[:, 1:], limits.everywhere[:, None])):
        at = np.where(along != 0, along * nodes[limits.orders], 0.0).sum(axis=2)
        at = np.where(counts, at, np.nan)
        room = np.fmin(room, np.stack([at - limits.lower, limits.upper - at]))
    if tighter >= 0:
        own = np.clip(0.5 * room, 0.0, margin)
        accept = np.where(own <= ROUNDING * margin, -ROUNDING * limits.sizes, 0.5 * own)
    else:
        own, accept = np.stack([margin, margin]), np.stack([1.5 * margin, 1.5 * margin])
    sides = [limits.lower + own[0], limits.upper - own[1], limits.lower + accept[0], limits.upper - accept[1]]
    return np.stack(sides)


def kept_within(cuts: Cuts, backend: Backend, ceiling: float, deadline: Deadline, optimal: bool = True) -> Kept:
    """Return the optimum within the limits, or, unless ``optimal``, some motion within them.

    The statement's unknowns are to count from the optimum without limits. ``ceiling`` is a cost that no motion within
    the limits exceeds.

    Raises
    ------
    NoPoint
        There is none, proved or not.
    SolverFailed
    TimeLimit
    """
    own = backend.name == "interior_point"
    y = np.zeros(cuts.statement.size)
    z, seconds, used = np.zeros(0), 0.0, 0
    rows: Rows | None = None
    fine, bent, worst = True, True, 0.0
    for _ in range(ROUNDS):
        curved = own and bent and rows is not None and worst < CURVED
        bent = True
        before, near = worst, float(np.clip(10.0 * worst, NEAR, 0.01)) if curved else 0.0
        found, worst = cuts.at(y, near, curved)
        if worst <= 0.0 and (fine or not optimal):
            last = found if rows is None else rows
            program = cuts.program(last, own=True)
            if optimal and max(program.residuals(y, z).values()) > RESIDUALS:
                raise NoPoint(last, z, False)
            return Kept(y, z, program, backend.name, used, seconds)
        # kept, by a motion near the last: now once more at the present places, without second-order terms
        fine = not own or (worst <= 0.0 and before <= SETTLED)
        both = found if rows is None else rows.straight().and_(found)
        rows = both.straight() if fine else both
        if not len(y):
            raise NoPoint(rows, np.ones(len(rows.u)), True)
        left, began = deadline.left(), time.perf_counter()
        if own:
            accuracy = FINE if fine else float(np.clip(1e-3 * worst, MIDDLE, COARSE))
            try:
                y, z, iterations = _solved(cuts, rows, y, accuracy, ceiling)
            except NoPoint as none:
                if none.proved or not rows.kappa.any():
                    raise
                bent, rows = False, rows.straight()  # an extremum that moves far is not where its parabola is
                y, z, iterations = _solved(cuts, rows, y, accuracy, ceiling)
        else:
            try:
                answer = solve_qp(cuts.program(rows, own=False), backend, left)
            except NoSolution as none:
                raise _judged(cuts, rows, none.multipliers, ceiling) from None
            y, z, iterations = answer.y, answer.z, max(answer.iterations, 1)
        seconds, used = seconds + time.perf_counter() - began, used + iterations
    raise SolverFailed(backend.name, f"limits still broken after {ROUNDS} rounds")


def _solved(cuts: Cuts, rows: Rows, y: Array, accuracy: float, ceiling: float) -> tuple[Array, Array, int]:
    from ..kernels.interior_point import INFEASIBLE, STALLED, interior_point

    statement, z = cuts.statement, np.empty(len(rows.u))
    size = max(statement.constant, 1e-3 * cuts.usual, 1e-300)
    program = (cuts.band, cuts.factors, statement.gradient)
    table = (rows.columns, rows.values, rows.upper, rows.bends, rows.offsets, rows.kappa)
    worth = (ceiling - statement.constant, statement.constant, size)
    used = 0
    for push in PUSHES:
        found = y.copy()
        status, iterations = interior_point(*program, *table, *worth, push, accuracy, MOST, found, z)
        used += iterations
        if status == INFEASIBLE:
            break
        if status != STALLED:
            return found, z, used
    raise _judged(cuts, rows, z, ceiling)


def _judged(cuts: Cuts, rows: Rows, z: Array | None, ceiling: float) -> NoPoint:
    """Return that there is no point; proved if, by the limits as asked, the multipliers' dual value is too large."""
    if z is None:
        return NoPoint(rows, np.ones(len(rows.u)), False)
    return NoPoint(rows, z, cuts.program(rows, own=True).best_dual_value(z) > ceiling)
