"""Infeasible, explained: the smallest relaxation of a joint's limits that lets one quintic per gap exist."""

from collections.abc import Iterable
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
#: Places on every gap at which the first program asks for its limits; the extrema then take over.
FIRST = np.linspace(0.0, 1.0, 9)


def least_relaxation(cuts: Cuts, deadline: Deadline) -> None:
    """Raise Infeasible if the limits must give by more than rounding.

    First all limits of the joint may give, each by the same part of its size; if they must, that is a proof, and one
    of them presses most. Then that quantity alone may give: where this helps, the value is the smallest that would do.

    Raises
    ------
    Infeasible
    SolverFailed
    """
    found = _relaxed(cuts, deadline, range(4))
    if found is None:
        raise SolverFailed("highs", "the relaxation does not converge")
    part, pressing = found
    if part <= FEASIBLE or pressing is None:
        return
    gap, u, order, side = pressing
    bound = float((cuts.bounds.upper if side > 0 else cuts.bounds.lower)[order, gap])
    alone = _relaxed(cuts, deadline, [order])
    needed, quantity = None, QUANTITIES[order]
    if alone is not None:
        needed = cuts.bounds.physical(order, bound + side * (alone[0] + FEASIBLE) * float(cuts.scale()[order, gap]))
        remedy = f"it would have to give by {100 * alone[0]:.4g} %"
    else:
        remedy = f"all of its limits would have to give, by {100 * part:.4g} %"
    raise Infeasible(
        f"one quintic per gap at these times cannot keep the limits of joint {cuts.joint}: its {quantity} limit "
        f"presses most, on segment {gap}; {remedy}",
        joint=cuts.joint,
        quantity=quantity,
        segment=gap,
        time=cuts.bounds.clock(gap, u),
        bound=cuts.bounds.physical(order, bound),
        needed=needed,
        certified=True,
    )


def _relaxed(cuts: Cuts, deadline: Deadline, orders: Iterable[int]) -> tuple[float, Row | None] | None:
    """Return the least part by which limits of these orders must give, and the row that presses most.

    Minimises t subject to every limit being kept, those of ``orders`` to within t of their size: a linear program with
    rows at first at fixed places, then at the exact extrema, until none is broken by more. None if there is no such t,
    or the rounds run out.
    """
    from scipy.optimize import linprog

    n = 2 * (len(cuts.problem.h) - 1)
    exact = cuts.exact()
    rows = exact.rows_at(FIRST)
    relaxing = np.zeros(4)
    relaxing[list(orders)] = 1.0
    t, pressing = 0.0, None
    for _ in range(ROUNDS):
        deadline.left()
        matrix, upper, _ = cuts.table(rows, tightened=False)
        give = csr_matrix(-relaxing[[r[2] for r in rows]][:, None])
        answer = linprog(
            np.append(np.zeros(n), 1.0),
            A_ub=hstack([matrix, give]),
            b_ub=upper,
            bounds=[(None, None)] * n + [(0.0, None)],
            method="highs",
        )
        if answer.status != 0:
            return None
        y, t = answer.x[:-1], float(answer.x[-1])
        pressing = rows[int(np.argmin(answer.ineqlin.marginals))]
        found = replace(exact, relaxed=t * relaxing + 0.5 * FEASIBLE).new_rows(y)
        if not found:
            return t, pressing
        rows += found
    return None
