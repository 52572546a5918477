"""Measure and judge: every entry in turn, round after round, and each answer under our own certificate."""

import math
import time
from dataclasses import dataclass, field
from statistics import median
from typing import Any

from planner import Certificate, InvalidRequest, PlannerError, Unsupported
from planner.verify import verify

from .adapters import Entry, entries
from .cases import Problem

ROUNDS, FEWEST = 7, 3
SHORTEST = 2e-3  # s; shorter calls are repeated within a round until this much time has passed
SLOW = 5.0  # s; more than any compilation, so that a second call would tell nothing new
BUDGET = 20.0  # s for the rounds of one problem; it is kept to unless fewer than FEWEST were run


@dataclass(frozen=True)
class Row:
    """What one entry made of one problem.

    Ratios are peak / limit, None where there is no limit, infinite where the peak is unbounded. ``ms`` is the median
    of the process time of a call, ``solve_ms`` what of it went into the answer (our own entries also check and
    certify), ``time_ratio`` the median over the rounds of its time divided by the baseline's in the same round.
    """

    group: str
    problem: str
    entry: str
    package: str
    certified: bool
    why: str
    reference: float | None
    duration: float | None = None
    squared_jerk: float | None = None
    velocity: float | None = None
    acceleration: float | None = None
    jerk: float | None = None
    waypoint_error: float | None = None
    ms: float | None = None
    solve_ms: float | None = None
    time_ratio: float | None = None
    rounds: int = 0


@dataclass
class _Run:
    """An entry on its way through the rounds; repeated ``repeats`` times in each."""

    entry: Entry
    answer: Any = None
    repeats: int = 1
    seconds: list[float] = field(default_factory=list)
    solving: list[float] = field(default_factory=list)
    failure: str | None = None

    def start(self) -> bool:
        """Call it, twice unless it is slow, to compile kernels and fill caches; return whether it takes the problem."""
        once = 0.0
        try:
            for _ in range(2):
                began = time.process_time()
                self.answer = self.entry.run()
                once = time.process_time() - began
                if once > SLOW:
                    break
        except Exception as error:  # whatever a peer may raise
            self.failure = str(error).partition("\n")[0] or type(error).__name__
            return not _declined(error)
        self.repeats = max(1, min(1000, math.ceil(SHORTEST / max(once, 1e-7))))
        return True

    def once(self) -> None:
        """Run one round."""
        began = time.process_time()
        for _ in range(self.repeats):
            self.answer = self.entry.run()
        self.seconds.append((time.process_time() - began) / self.repeats)
        if self.entry.solving is not None:
            self.solving.append(self.entry.solving(self.answer))


def measure(problem: Problem, rounds: int = ROUNDS) -> list[Row]:
    """Return a row for every entry that takes the problem; an entry that fails on it is a row, too."""
    runs = [run for run in map(_Run, entries(problem)) if run.start()]
    began = time.perf_counter()
    for done in range(rounds):
        if done >= FEWEST and time.perf_counter() - began > BUDGET:
            break
        for run in runs:
            if run.failure is None:
                run.once()
    baseline = next((run.seconds for run in runs if run.entry.name == problem.baseline), [])
    return [_row(problem, run, baseline) for run in runs]


def _declined(error: Exception) -> bool:
    """Return whether a method of ours says that the problem is not one of its kind."""
    if isinstance(error, InvalidRequest):
        return all(e.code in ("missing", "bad_degree", "too_few_points") for e in error.errors)
    return isinstance(error, Unsupported)


def _row(problem: Problem, run: _Run, baseline: list[float]) -> Row:
    name = (problem.group, problem.name, run.entry.name, run.entry.package)
    if run.failure is None:
        try:
            read = run.entry.read(run.answer)
        except (PlannerError, ValueError) as error:
            run.failure = str(error)
    if run.failure is not None:
        return Row(*name, certified=False, why=run.failure, reference=problem.reference)
    judged = verify(read.trajectory, problem.demands, read.waypoint_times)
    ratios = {c.quantity: math.inf if c.ratio is None else c.ratio for c in judged.checks}
    return Row(
        *name,
        certified=judged.holds,
        why=reason(judged),
        reference=problem.reference,
        duration=read.trajectory.duration,
        squared_jerk=judged.cost["squared_jerk"],
        velocity=ratios.get("velocity"),
        acceleration=ratios.get("acceleration"),
        jerk=ratios.get("jerk"),
        waypoint_error=judged.waypoint_error,
        ms=1e3 * median(run.seconds),
        solve_ms=1e3 * median(run.solving) if run.solving else None,
        time_ratio=median(t / b for t, b in zip(run.seconds, baseline, strict=True)) if baseline else None,
        rounds=len(run.seconds),
    )


def reason(judged: Certificate) -> str:
    """Return in a few words what an answer breaks; empty if nothing."""
    broken = [
        f"{c.quantity} unbounded" if c.ratio is None else f"{c.quantity} {c.ratio:.4g} x its limit"
        for c in judged.checks
        if not c.holds
    ]
    for name, error in (("a waypoint", judged.waypoint_error), ("an end state", judged.boundary_error)):
        if error is not None and error > 1e-6:
            broken.append(f"misses {name} by {error:.1e}")
    return ", ".join(broken)
