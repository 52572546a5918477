"""The report's section: a table a part."""

from collections.abc import Sequence

from ..markdown import number, table
from . import end_to_end, first_call, given_stations, quality, with_jerk
from .rows import DENSE, Timing

ABOUT = f"""The fastest law along a given path (a cubic spline with seven joints; copp's own examples are quintic),
one thread, process time; all calls of a problem in turn, round after round.

- **Ratio**: the peer's time over that of our first entry, median of the rounds. The *goal* is the least it should be;
  for a figure of ours (*at most*) the most.
- **Beyond**: how far a limit is exceeded, relative to it, at {DENSE} samples of the answer. **Strict**: the duration
  when it is slowed until none is.
- **Given stations**: limits of velocity and acceleration; derivatives of the path, rows and limits at the stations are
  ready, and only the solving counts. toppra: seidel, Interpolation scheme.
- **Jerk limits on given stations**: ours counts everything from the path on (derivatives, the profile without jerk as a
  start, an interior point to {with_jerk.TOLERANCE:g}); copp-py counts its profile without jerk and one linearised conic
  program, on derivatives that are ready; IPOPT counts posing and solving the statement of `time_optimal_nlp`, to an
  optimum of the program as it is. None is refined or mended between its stations.
- **Quality**: plans as they are, exact extrema. **Over the best**: duration over that of the best profile known on a
  fine grid, which may break limits between its stations, and over what remains of it when slowed until it does not.
  **Gap**: to the lower bound proved, which holds for the laws that *scope* says; with a jerk limit the usual one knows
  nothing of jerk. *Finer* is the same solver on a grid that may lose {quality.GOAL:g} of the duration (at most
  {quality.MOST} stations), to show what is possible.
"""


def section(rows: Sequence[Timing]) -> str:
    """Return the section, or nothing without rows."""
    parts = [f"## Path timing\n\n{ABOUT}"] if rows else []
    shown = {
        given_stations.PART: _stations,
        end_to_end.PART: _samples,
        with_jerk.PART: _jerk,
        first_call.PART: _start,
        quality.PART: _quality,
    }
    for part, show in shown.items():
        mine = [row for row in rows if row.part == part]
        if mine:
            parts.append(f"### {part.capitalize()}\n\n{show(mine)}")
    return "\n".join(parts)


def _stations(rows: Sequence[Timing]) -> str:
    heads = "path,stations,entry,ms,ratio,goal,met,duration s,".split(",")
    lines = [[*_problem(r), *_ratio(r), number(r.duration, ".6f"), r.told] for r in rows if not r.figure]
    figures = [[str(r.stations), r.entry, number(r.ms, ".3g"), *_ratio(r), r.told] for r in rows if r.figure]
    return f"{table(heads, lines)}\n{table('stations,of ours,ms,ratio,goal,met,'.split(','), figures)}"


def _samples(rows: Sequence[Timing]) -> str:
    lines = [[r.problem, r.entry, number(r.ms, ".3g"), *_ratio(r), *_durations(r), r.told] for r in rows]
    return table("path,entry,ms,ratio,goal,met,duration s,strict s,beyond,".split(","), lines)


def _jerk(rows: Sequence[Timing]) -> str:
    lines = [[*_problem(r), *_ratio(r), *_durations(r), number(r.over, ".2%"), r.told] for r in rows]
    heads = "path,stations,entry,ms,ratio,goal,met,duration s,strict s,beyond,strict over the best,".split(",")
    return table(heads, lines)


def _start(rows: Sequence[Timing]) -> str:
    lines = [[r.entry, number(r.ms, ".0f"), *_ratio(r), r.told] for r in rows]
    return table("step,ms,s,goal,met,".split(","), lines)


def _quality(rows: Sequence[Timing]) -> str:
    lines = [
        [
            r.problem,
            r.entry,
            number(r.duration, ".6g"),
            number(r.over, ".3%"),
            number(r.over_strict, ".3%"),
            number(r.beyond, ".1e"),
            number(r.gap, ".3%"),
            r.scope,
            number(r.ms, ".3g"),
            "" if r.stations is None else str(r.stations),
            r.told.replace("|", "/"),
        ]
        for r in rows
    ]
    heads = "path,entry,duration s,over the best,over it strict,beyond,gap,scope,ms,pieces,".split(",")
    return table(heads, lines)


def _problem(row: Timing) -> list[str]:
    return [row.problem, str(row.stations), row.entry, number(row.ms, ".3g")]


def _durations(row: Timing) -> list[str]:
    return [number(row.duration, ".5f"), number(row.strict, ".5f"), number(row.beyond, ".1e")]


def _ratio(row: Timing) -> list[str]:
    goal = "" if row.goal is None else f"at most {row.goal:g}" if row.figure else f"≥ {row.goal:g}"
    return [number(row.ratio, ".3g"), goal, "" if row.met is None else "yes" if row.met else "**no**"]
