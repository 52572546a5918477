"""Calls in turn, round after round, and what is told of them."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from statistics import median
from typing import Any

from ..figures import Call

#: The C++ splines, which only the extra ``bench`` installs; without them their rows are left out.
MINCO = import_module("spline_trajectory") if find_spec("spline_trajectory") else None

FEWEST = 3
#: A call that takes longer than the first, s, is made in the first two rounds only, longer than the second in one,
#: unless all rounds are asked of it.
SLOW, SLOWEST = 0.5, 2.0


@dataclass(frozen=True)
class Standing:
    """One line: an entry on a problem, or a ``figure`` of ours that has a goal of its own.

    ``ratio`` is, for a peer, its time over ours, medians over the rounds of both; the ``goal`` is the least it should
    be, for a figure the most. ``difference`` of curves is relative to their size; ``beyond`` is the cost over the best
    proved lower bound, or over ours, less one; ``violation`` how far the exact peaks exceed a limit, relative to it.
    """

    part: str
    problem: str
    joints: int
    waypoints: int
    entry: str
    ms: float | None = None
    ratio: float | None = None
    goal: float | None = None
    figure: bool = False
    difference: float | None = None
    beyond: float | None = None
    violation: float | None = None
    told: str = ""
    rounds: int = 0

    @property
    def each_ns(self) -> float | None:
        """The time a waypoint."""
        return None if self.ms is None else 1e6 * self.ms / self.waypoints

    @property
    def met(self) -> bool | None:
        """Whether the goal is reached; None without a goal."""
        if self.goal is None or self.ratio is None:
            return None
        return self.ratio <= self.goal if self.figure else self.ratio >= self.goal


def in_turn(
    calls: Mapping[Any, Callable[[], Any]], rounds: int, budget: float, always: Sequence[Any] = ()
) -> dict[Any, list[float]]:
    """Return the process times of all calls, round by round, s; ``always``: slow ones to call in every round too.

    Every call must have been made before, so that nothing is left to be compiled. After ``budget`` s no round begins,
    unless fewer than ``FEWEST`` were made.
    """
    made = {key: Call(run) for key, run in calls.items()}
    began = time.perf_counter()
    for done in range(rounds):
        if done >= FEWEST and time.perf_counter() - began > budget:
            break
        for key, call in made.items():
            first = call.seconds[0] if done else 0.0
            if key in always or first < SLOW or (done < 2 and first < SLOWEST):
                call.once()
    return {key: call.seconds for key, call in made.items()}


def over(theirs: Sequence[float], ours: Sequence[float]) -> float:
    """Return the median of the ratios of the rounds that both were in."""
    return median(a / b for a, b in zip(theirs, ours, strict=False))
