"""The optimum of a posed statement within its limits: which back end, and how strictly."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..deadline import Deadline
from ..errors import SolverFailed
from ..solvers import Backend
from .ceiling import most_cost
from .cones import kept_within_norm
from .linear import LinearLimits
from .posing import Posed
from .rounds import Cuts, Kept, NoPoint, kept_within

Array = NDArray[np.float64]

#: Where tightening alone leaves no room, limits may give by so much of their sizes: verification calls that kept.
GIVING = (-1e-8, -3e-7)


def kept(
    posed: Posed,
    limits: LinearLimits,
    norm: Array | None,
    backends: Sequence[Backend],
    deadline: Deadline,
    optimal: bool = True,
    giving: bool = True,
) -> Kept:
    """Return the optimum within limits (the posed statement's, or others of the same kind).

    Unless ``optimal``: some motion that the first two back ends find within them.

    The first two back ends are asked with the limits tightened a little; where that proves nothing, the first and then
    the others with limits as they may give, if ``giving``. The statement's unknowns are to count from the optimum
    without limits.

    Raises
    ------
    NoPoint
        There is none, proved or not.
    SolverFailed
        No back end came to an end.
    TimeLimit
    """
    ceiling = most_cost(posed.statement, limits, norm)
    first = backends[0]
    attempts = [(backend, backend.precision) for backend in backends[:2]]
    if optimal and giving:
        attempts += [(first, margin) for margin in GIVING]
        attempts += [(other, GIVING[-1]) for other in backends[1:]]
    last: NoPoint | SolverFailed | None = None
    for backend, margin in attempts:
        cuts = Cuts.of(posed, limits, margin)
        try:
            if norm is not None:
                found = kept_within_norm(cuts, posed, norm, margin, ceiling, deadline)
            else:
                found = kept_within(cuts, backend, ceiling, deadline, optimal)
            return replace(found, gave=max(-margin, 0.0))
        except NoPoint as proof:
            last = proof
            if proof.proved:
                raise
        except SolverFailed as failed:
            last = failed if last is None else last
    assert last is not None
    raise last
