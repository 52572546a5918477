"""What is measured by itself: calls of ours beside a peer's, in turn, round after round."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

JOINTS = 7
ROUNDS, FEWEST = 9, 3
SHORTEST = 5e-3  # s; shorter calls are repeated within a round until this much time has passed
BUDGET = 6.0  # s for the rounds of one group; it is kept to unless fewer than FEWEST were run


@dataclass(frozen=True)
class Figure:
    """What was measured: medians of the process time, and of the ratios of the same rounds.

    ``ratio`` is the peer's time over ours, ``goal`` the least it should be. ``growth`` is our time an item over that
    of the smallest size. ``difference`` is the largest between the results, relative to their size; results that do
    not agree are not timed.
    """

    name: str
    what: str
    peer: str
    items: int
    difference: float | None
    agrees: bool
    goal: float | None
    ours_ms: float | None = None
    peer_ms: float | None = None
    ratio: float | None = None
    growth: float | None = None
    rounds: int = 0

    @property
    def each_ns(self) -> float | None:
        """Our time an item."""
        return None if self.ours_ms is None else 1e6 * self.ours_ms / self.items

    @property
    def met(self) -> bool | None:
        """Whether the goal is reached; None without a goal."""
        return None if self.goal is None else self.ratio is not None and self.ratio >= self.goal


@dataclass(frozen=True)
class Task:
    """One call of ours and, unless it stands alone, one of the peer's; ``difference`` compares what they return."""

    name: str
    what: str
    items: int
    ours: Callable[[], Any]
    peer: str = ""
    theirs: Callable[[], Any] | None = None
    goal: float | None = None
    difference: Callable[[Any, Any], float] | None = None
    tolerance: float = 1e-9


@dataclass
class Call:
    """A call on its way through the rounds."""

    run: Callable[[], Any]
    seconds: list[float] = field(default_factory=list)

    def once(self) -> None:
        """Run one round."""
        began, passed, repeats = time.process_time(), 0.0, 0
        while passed < SHORTEST:
            self.run()
            repeats += 1
            passed = time.process_time() - began
        self.seconds.append(passed / repeats)


def in_turn(tasks: list[Task], rounds: int) -> list[Figure]:
    """Measure one group: all its calls in turn, round after round."""
    checked = [_check(task) for task in tasks]
    calls = [
        (Call(task.ours), None if task.theirs is None else Call(task.theirs)) if agrees else None
        for task, (_, agrees) in zip(tasks, checked, strict=True)
    ]
    flat = [call for pair in calls if pair for call in pair if call]
    began = time.perf_counter()
    for done in range(rounds):
        if done >= FEWEST and time.perf_counter() - began > BUDGET:
            break
        for call in flat:
            call.once()
    first = calls[0][0] if calls and calls[0] else None
    figures = []
    for task, (difference, agrees), pair in zip(tasks, checked, calls, strict=True):
        figure = (task.name, task.what, task.peer, task.items, difference, agrees, task.goal)
        if pair is None:
            figures.append(Figure(*figure))
            continue
        ours, theirs = pair
        ratio = growth = None
        if theirs is not None:
            ratio = median(b / a for a, b in zip(ours.seconds, theirs.seconds, strict=True))
        if first is not None and task.items > tasks[0].items:
            share = tasks[0].items / task.items
            growth = median(share * a / b for a, b in zip(ours.seconds, first.seconds, strict=True))
        peer_ms = None if theirs is None else 1e3 * median(theirs.seconds)
        figures.append(Figure(*figure, 1e3 * median(ours.seconds), peer_ms, ratio, growth, len(ours.seconds)))
    return figures


def _check(task: Task) -> tuple[float | None, bool]:
    """Run both once, so that kernels are compiled; return by how much they differ, and whether that is rounding."""
    ours, theirs = task.ours(), None if task.theirs is None else task.theirs()
    if task.difference is None:
        return None, True
    difference = task.difference(ours, theirs)
    return difference, difference <= task.tolerance


def power(count: int) -> str:
    """Return a power of ten as one."""
    return f"10^{round(math.log10(count))}"


def random_walk(count: int, dims: int = JOINTS, seed: int = 1) -> tuple[Array, Array]:
    """Return uneven times (N,) and a random walk (N, D)."""
    random = np.random.default_rng(seed)
    times = np.concatenate([[0.0], np.cumsum(random.uniform(0.5, 1.5, count - 1))])
    return times, np.cumsum(random.normal(size=(count, dims)), axis=0)


def relative(ours: Any, theirs: Any) -> float:
    """Return the largest difference of each entry, over the largest magnitude in it: the worst of them."""
    return max(
        float(np.abs(a - b).max() / max(float(np.abs(b).max()), 1e-300)) for a, b in zip(ours, theirs, strict=True)
    )
