"""The report's section: a table a part."""

from collections.abc import Sequence

from ..markdown import number, table
from . import free_times, growth, unlimited, within_limits
from .limited_problems import SAMPLES
from .rounds import Standing

ABOUT = f"""Curves of least squared jerk through given waypoints, one thread, process time; all calls for so many joints
(or of one problem) in turn, round after round; slow ones in one or two rounds.

- **Ratio**: the peer's time over that of our first entry, median of the rounds. The *goal* is the least it should be;
  for a figure of ours (*at most*) the most.
- **Without limits**: random walks, uneven times, velocity and acceleration zero at the ends. Ours with all their checks
  and allocations, `out=` without the latter. spline-trajectory (C++, up to {unlimited.MOST_JOINTS} joints) gets its
  times as the list that it wants; general solvers get their matrices ready, one program a joint. *Difference*: of q, v,
  a at 1000 times from those of our first entry. Drawn in [{growth.NAME}]({growth.NAME}), beside this report.
- **Within limits**: a joint's limits lie at a share f of the way from what is barely possible to the peaks without
  limits. Ours hold at all times and count everything but request and certificate (`plan` counts these too); the solvers
  are only set up and run, on ready matrices, with limits at {SAMPLES} samples a gap. *Cost*: over the best lower bound
  that our duals prove, less one; below zero is what breaking limits saves. *Beyond*: of the exact peaks, relative to
  the limit.
- **Free times**: squared jerk + {free_times.WEIGHT:g} x duration, rest to rest, {free_times.DIMS} joints. *Cost*: over
  ours, less one.
"""


def section(rows: Sequence[Standing]) -> str:
    """Return the section, or nothing without rows."""
    parts = [f"## Minimum jerk\n\n{ABOUT}"] if rows else []
    for part, shown in ((unlimited.PART, _unlimited), (within_limits.PART, _limited), (free_times.PART, _times)):
        mine = [row for row in rows if row.part == part]
        if mine:
            parts.append(f"### {part.capitalize()}\n\n{shown(mine)}")
    return "\n".join(parts)


def _unlimited(rows: Sequence[Standing]) -> str:
    lines = [
        [*_problem(r), number(r.each_ns, ".3g"), *_ratio(r), number(r.difference, ".0e"), r.told]
        for r in rows
        if not r.figure
    ]
    figures = [[str(r.joints), r.entry, *_ratio(r), r.told] for r in rows if r.figure]
    heads = "joints,waypoints,entry,ms,ns a waypoint,ratio,goal,met,difference,".split(",")
    return f"{table(heads, lines)}\n{table(['joints', 'of ours', 'ratio', 'goal', 'met', ''], figures)}"


def _limited(rows: Sequence[Standing]) -> str:
    lines = [
        [r.problem, *_problem(r), *_ratio(r), number(r.beyond, ".1e"), number(r.violation, ".1e"), r.told] for r in rows
    ]
    return table("limits,joints,waypoints,entry,ms,ratio,goal,met,cost,beyond,".split(","), lines)


def _times(rows: Sequence[Standing]) -> str:
    lines = [[*_problem(r), *_ratio(r), number(r.beyond, ".0e"), r.told] for r in rows]
    return table("joints,waypoints,entry,ms,ratio,goal,met,cost,".split(","), lines)


def _problem(row: Standing) -> list[str]:
    return [str(row.joints), str(row.waypoints), row.entry, number(row.ms, ".3g")]


def _ratio(row: Standing) -> list[str]:
    goal = "" if row.goal is None else f"at most {row.goal:g}" if row.figure else f"≥ {row.goal:g}"
    return [number(row.ratio, ".3g"), goal, "" if row.met is None else "yes" if row.met else "**no**"]
