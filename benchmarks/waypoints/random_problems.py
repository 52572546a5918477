"""Random problems: what is solved, how much shorter than with stops, and what is refused.

``python -m benchmarks.waypoints.random_problems 500`` prints the summary of so many.
"""

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from planner import Infeasible, Plan, PlannerError, PlanRequest, plan

from .problems import METHOD, random_request
from .rows import Line, of_plan, remarks

PART = "random problems"
COUNT = 40
KINDS = ("at rest at both ends", "moving at both ends")
#: What is shorter or longer than the plan with stops by more than rounding.
SHORTER = 1e-9


@dataclass(frozen=True)
class Summary:
    """What becomes of the random problems of a kind, and in how many of them the plan with stops is found.

    Of ``both``, solved either way and with inner waypoints, so many are ``shorter`` than with stops; ``longer`` counts
    in all; ``ratio`` is the median of the durations over those with stops.
    """

    kind: str
    count: int
    solved: int
    stops: int
    both: int
    shorter: int
    longer: int
    ratio: float | None
    beyond: float | None
    missed: float | None
    ms: float | None
    slowest: float | None


def measure(quick: bool = False, count: int = COUNT) -> list[Line]:
    """Return the lines, one a seed: the even ones are at rest at both ends, the odd ones move there."""
    _row(0)  # kernels are compiled
    return [_row(seed) for seed in range(4 if quick else count)]


def summaries(rows: Sequence[Line]) -> list[Summary]:
    """Return a summary a kind, and of all."""
    found = []
    for kind in (*KINDS, ""):
        mine = [r for r in rows if r.problem.endswith(kind)]
        solved = [r for r in mine if r.duration is not None]
        compared = [(r.waypoints, 1.0 + r.over_stops) for r in solved if r.over_stops is not None]
        ratios = [ratio for waypoints, ratio in compared if waypoints > 2]
        worst = (max((getattr(r, x) or 0.0 for r in solved), default=None) for x in ("beyond", "missed", "ms"))
        beyond, missed, slowest = worst
        found.append(
            Summary(
                kind or "all",
                len(mine),
                len(solved),
                sum(r.stops is not None for r in mine),
                len(ratios),
                sum(r < 1.0 - SHORTER for r in ratios),
                sum(r > 1.0 + SHORTER for _, r in compared),
                median(ratios) if ratios else None,
                beyond,
                missed,
                median(r.ms for r in solved if r.ms is not None) if solved else None,
                slowest,
            )
        )
    return found


def _row(seed: int) -> Line:
    """Return the line of a seed."""
    kind = seed % 2
    asked = random_request(seed, moving=kind == 1)
    entry = (PART, f"seed {seed}, {KINDS[kind]}", asked.dims, asked.count, "plan, default")
    stops, why = _tried(asked, "ruckig")
    began = time.process_time()
    done, refusal = _tried(asked, METHOD)
    ms = 1e3 * (time.process_time() - began)
    longest = None if stops is None else stops.trajectory.duration
    words = [f"with stops: {why}"] if why and refusal else []
    if done is None:
        return Line(*entry, ms, stops=longest, told="; ".join([f"**{refusal}**", *words]), rounds=1)
    return Line(*entry, ms, stops=longest, **of_plan(done), told=remarks(done), rounds=1)


def _tried(asked: PlanRequest, method: str) -> tuple[Plan | None, str]:
    """Return a plan, or None and why there is none."""
    try:
        return plan(asked, method), ""
    except PlannerError as error:
        proved = ", certified" if isinstance(error, Infeasible) and error.certified else ""
        return None, f"{type(error).__name__}{proved}: {error}"


if __name__ == "__main__":
    lines = measure(count=int(sys.argv[1]) if len(sys.argv) > 1 else COUNT)
    print(*[f"{r.problem}: {r.told}" for r in lines if r.told], *summaries(lines), sep="\n")
