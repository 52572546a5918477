"""A closer bound from multipliers: each joint by itself, its segments priced so that the joints need not agree.

With prices lambda >= 0 that add up to one on each segment, sum_i h_i = sum_d sum_i lambda_di h_i  for every motion;
each joint's part is at least what it comes to with durations of its own: the sum of those least values bounds the
duration. The prices are the multipliers of the joint program, where that sum meets its optimum. Each one-joint program
is solved to a local optimum on a grid, and lowered by what the grid is estimated to cost: the bound is evidence of
optimality, not a proof for all.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from problems.waypoint_timing import WaypointTiming

from ..deadline import Deadline
from ..types import Bound
from .first_guess import nodes_of, spline_durations, spline_start
from .program import Found, solve

Array = NDArray[np.float64]

#: Pieces a segment of the one-joint programs: from what the finer grid saves, what it still costs is estimated.
PIECES = (24, 48)
#: Of that estimate, a third of the difference for errors of second order, this much is taken off.
SAFETY = 3.0
#: Prices below this are raised to it: without any, durations are not bounded.
LEAST = 1e-4


@dataclass(frozen=True, eq=False)
class Priced:
    """Evidence: the program, its answer's durations (S,), and prices (S, D) that add up to one on each segment."""

    problem: WaypointTiming
    durations: Array
    prices: Array
    floor: float
    deadline: Deadline

    def lower_bound(self) -> float:
        """Return the sum of the joints' least prices, s; 0 where one of them is not found."""
        return self._bound

    @cached_property
    def _bound(self) -> float:
        total = 0.0
        for d in range(self.prices.shape[1]):
            if self.prices[:, d].max() <= LEAST * 1.5:  # never the one that is waited for: its part is next to nothing
                continue
            one = _alone(self.problem, d)
            durations = spline_durations(one, self.durations)
            values = []
            for pieces in PIECES:
                here = replace(one, nodes=nodes_of(pieces, durations, np.full((2, 1), np.nan)))
                start = spline_start(here, durations)
                found = solve(here, start, prices=self.prices[:, d], most=300, deadline=self.deadline)
                if not found.solved:
                    return 0.0
                values.append(float(self.prices[:, d] @ found.spline.durations))
            total += values[1] - SAFETY * abs(values[0] - values[1]) / 3.0
        return max(total, self.floor)


def priced(problem: WaypointTiming, found: Found, floor: float, deadline: Deadline) -> Bound:
    """Return the bound from the multipliers of a program's answer."""
    prices = np.maximum(found.shares, LEAST)
    prices /= prices.sum(axis=1, keepdims=True)
    return Bound("on_grid", Priced(problem, found.spline.durations, prices, floor, deadline))


def _alone(problem: WaypointTiming, joint: int) -> WaypointTiming:
    """Return the program of one joint."""
    one = slice(joint, joint + 1)
    return replace(
        problem,
        waypoints=problem.waypoints[:, one],
        nodes=problem.nodes[:, one],
        lower=problem.lower[:, :, one],
        upper=problem.upper[:, :, one],
        velocity=problem.velocity[:, one],
        acceleration=problem.acceleration[:, one],
    )
