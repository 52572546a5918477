"""Infeasible, explained: the smallest relaxation of a joint's limits that lets one quintic per gap exist."""

from dataclasses import replace

import numpy as np
from scipy.sparse import csr_matrix, hstack

from ..deadline import Deadline
from ..errors import Infeasible, SolverFailed
from ..limits import QUANTITIES
from .cuts import Cuts, Row

ROUNDS = 60
#: A relaxation below this is rounding.
FEASIBLE = 2e-7


def least_relaxation(cuts: Cuts, deadline: Deadline) -> None:
    """Raise Infeasible if the limits must give by more than rounding.

    Minimises t subject to every limit being broken by at most t of its size: a linear program with rows at the exact
    extrema, added until none is broken by more. Rows are necessary conditions, so t > 0 proves infeasibility.

    Raises
    ------
    Infeasible
        With the limit that presses most, and the value that would do if all of the joint's limits gave in proportion.
    SolverFailed
    """
    from scipy.optimize import linprog

    n = 2 * (len(cuts.problem.h) - 1)
    exact = cuts.exact()
    y, t = np.zeros(n), 0.0
    if n:
        y = cuts.program([], tightened=False).free_minimum()
    rows: list[Row] = []
    pressing: Row | None = None
    for _ in range(ROUNDS):
        found = replace(exact, relaxed=t).new_rows(y)
        if not found:
            break
        deadline.left()
        rows += found
        matrix, upper, _ = cuts.table(rows, tightened=False)
        elastic = hstack([matrix, csr_matrix(-np.ones((len(rows), 1)))])
        answer = linprog(
            np.append(np.zeros(n), 1.0),
            A_ub=elastic,
            b_ub=upper,
            bounds=[(None, None)] * n + [(0.0, None)],
            method="highs",
        )
        if answer.status != 0:
            raise SolverFailed("highs", str(answer.message)[:300])
        y, t = answer.x[:-1], float(answer.x[-1])
        pressing = rows[int(np.argmin(answer.ineqlin.marginals))]
    if t <= FEASIBLE or pressing is None:
        return
    gap, u, order, side = pressing
    bound = float((cuts.bounds.upper if side > 0 else cuts.bounds.lower)[order, gap])
    needed = bound + side * t * float(cuts.scale()[order, gap])
    raise Infeasible(
        f"one quintic per gap at these times cannot keep the limits of joint {cuts.joint}: its {QUANTITIES[order]} "
        f"limit on segment {gap} presses most, and all of its limits would have to give by {100 * t:.4g} %",
        joint=cuts.joint,
        quantity=QUANTITIES[order],
        segment=gap,
        time=cuts.bounds.clock(gap, u),
        bound=cuts.bounds.physical(order, bound),
        needed=cuts.bounds.physical(order, needed),
        certified=True,
    )
