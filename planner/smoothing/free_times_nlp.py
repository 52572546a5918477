"""Free durations within limits by CasADi: the reference, limits at places and cuts at the exact extrema."""

import numpy as np
from numpy.typing import NDArray

from problems.free_times import FreeDurations, Place

from ..deadline import Deadline
from ..solvers import select
from ..solvers.nlp import solve_nlp
from .barrier import CLOSE, STRICT, TIGHTER, Task, extremes, pack, slower, unpack

Array = NDArray[np.float64]

#: Places of every gap.
PLACES = np.linspace(0.0, 1.0, 13)
ROUNDS = 8


class Reference:
    """The nonlinear program on one task; the same use as ``Barrier``."""

    status = "ipopt"

    def __init__(self, task: Task, deadline: Deadline) -> None:
        self.task, self.deadline, self.iterations = task, deadline, 0
        self.backend = select("nlp", "ipopt")[0]

    def solve(self, x: Array, total: float) -> Array:
        """Return a solution that keeps all limits, from x (N, B); ``total`` > 0 is the duration asked for.

        Raises
        ------
        Infeasible
            After some rounds of cuts limits are still broken.
        SolverFailed, TimeLimit
        """
        task, more = self.task, set[Place]()
        free = task.movable and total == 0.0
        tighter = 0.0 if free else TIGHTER
        for _ in range(ROUNDS):
            x = self._solve(x, total, tuple(sorted(more)), tighter)
            found = extremes(task, x)
            outside = float(task.outside(found).max(initial=-np.inf))
            over = max(float(task.ratios(found).max()) - 1.0, outside)
            factor = max(task.slowdown(found), 1.0)
            if over <= 0.0 or (free and outside <= 0.0 and factor <= 1.0 + CLOSE):
                return slower(x, factor * (1.0 + STRICT), task.order) if over > 0.0 else x
            if over < 1e-4:
                tighter += 2.0 * over
            more |= self._cuts(found)
        raise task.broken(x)

    def _cuts(self, found: Array) -> set[Place]:
        """Return the places of the extrema that break a limit."""
        task = self.task
        with np.errstate(invalid="ignore"):
            high, low = found[2] > task.upper, found[0] < task.lower
        places = [(at, m, i, d) for over, at in ((high, found[3]), (low, found[1])) for m, i, d in np.argwhere(over)]
        return {(int(i), float(at[m, i, d]), int(m), int(d)) for at, m, i, d in places}

    def _solve(self, x: Array, total: float, more: tuple[Place, ...], tighter: float) -> Array:
        task = self.task
        h, states = unpack(x, task.order)
        least, most = (total, total) if total > 0.0 else (0.0, np.inf)
        ends = np.where(task.fixed, task.ends, np.nan)
        room = tighter * np.ones((4, 1, 1))
        span = task.upper[0] - task.lower[0]
        lower, upper = task.lower * (1.0 - room), task.upper * (1.0 - room)
        margin = tighter * np.where(np.isfinite(span), span, 0.0)
        lower[0], upper[0] = task.lower[0] + margin, task.upper[0] - margin
        bounds = task.bounds
        problem = FreeDurations(
            task.points, task.order, ends, task.cost, lower, upper, bounds.low, bounds.high, least, most
        )
        answer = solve_nlp(lambda: problem.to_casadi(h, states, PLACES, more), self.backend, self.deadline.left())
        self.iterations += answer.iterations
        return pack(*problem.read(answer.x))
