"""The report's section: a table a part."""

from collections.abc import Iterable, Sequence
from statistics import median

from ..markdown import number, table
from . import growth, program, quality, random_problems, speed
from .problems import PIECES
from .rows import Line

ABOUT = f"""The fastest motion through waypoints, the path between them free: `time_optimal_waypoints`, one thread,
process time; all calls of a problem in turn, round after round.

- **Quality**: the cases of the tests' data. *Best known* was found by a slow search; Ruckig Pro's are what it gave for
  its own published examples. **Gap**: to the lower bound proved, which holds for all motions and is mostly what is
  missing. **Beyond**: how far a limit is exceeded at the exact extrema, relative to it. **Missed**: how far a waypoint
  is missed. **Off the lines**: how far the motion goes from the straight lines between the waypoints.
- **Speed**: our whole plan (request checked, solved, certified) beside laws along a fixed curve. copp-py: jerk limits,
  on a quintic spline whose knots are the times of the plan with stops (of the conditions at its ends, those that suit
  copp-py best); its derivatives and rows are ready, only its profile without jerk and one linearised conic program
  count. It keeps limits at its stations: **strict** is the duration when slowed until they hold in between. toppra:
  quick start on a cubic spline, no jerk limits. End states, limits of positions and of the segments' durations are left
  out, which neither takes. **Ratio**: their time over ours.
- **Program**: {PIECES} pieces a segment, the same statement and start, to {program.TOLERANCE:g}; ours compiled, IPOPT
  through CasADi with exact derivatives, which are built once for each problem.
- **Random problems**: 1 to 7 joints on scales one and a half decades apart, 2 to 9 waypoints, three in ten with limits
  that differ by side; half of them begin and end in motion. *Shorter than with stops* counts those with inner
  waypoints: without, stops lose nothing.
"""


def section(rows: Sequence[Line]) -> str:
    """Return the section, or nothing without rows."""
    parts = [f"## Through waypoints\n\n{ABOUT}"] if rows else []
    shown = {
        quality.PART: _quality,
        speed.PART: _speed,
        program.PART: _program,
        growth.PART: _growth,
        random_problems.PART: _random,
    }
    for part, show in shown.items():
        mine = [row for row in rows if row.part == part]
        if mine:
            parts.append(f"### {part.capitalize()}\n\n{show(mine)}")
    return "\n".join(parts)


def _quality(rows: Sequence[Line]) -> str:
    short = []
    for effort in quality.EFFORTS:
        mine = [r for r in rows if r.entry == effort and r.over is not None and r.over_stops is not None]
        over, stops = [r.over or 0.0 for r in mine], [r.over_stops or 0.0 for r in mine]
        if mine:
            figures = (f"{median(over):.3%}", f"{max(over):.3%}", f"{median(stops):.1%}")
            short.append([effort, str(len(mine)), *figures, number(_median(r.ms for r in mine), ".3g")])
    heads = "effort,cases,over the best known (median),largest,over stops (median),ms (median)".split(",")
    lines = [
        [
            *_problem(r),
            r.entry,
            number(r.duration, ".6g"),
            number(r.over, ".3%"),
            number(r.over_stops, ".1%"),
            number(r.over_pro, ".2%"),
            number(r.gap, ".2%"),
            *_errors(r),
            number(r.deviation, ".2g"),
            number(r.ms, ".3g"),
            number(r.iterations, "d"),
            r.told.replace("|", "/"),
        ]
        for r in rows
    ]
    long = "case,joints,waypoints,effort,duration s,over the best known,over stops,over Ruckig Pro,gap,beyond,missed,"
    long += "off the lines,ms,iterations,"
    return f"{table(heads, short)}\n{table(long.split(','), lines)}"


def _speed(rows: Sequence[Line]) -> str:
    short = []
    for entry in dict.fromkeys(r.entry for r in rows):
        mine = [r for r in rows if r.entry == entry and r.ms is not None]
        ratios = [r.ratio for r in mine if r.ratio is not None]
        if ratios:
            figures = (number(x, ".3g") for x in (median(ratios), min(ratios), max(ratios)))
            short.append([entry, str(len(ratios)), *figures, number(_median(r.over for r in mine), ".2%")])
    heads = "entry,cases,time over ours (median),least,most,duration over ours (median)".split(",")
    lines = [
        [*_problem(r), r.entry, number(r.ms, ".3g"), number(r.ratio, ".3g"), number(r.duration, ".5f")]
        + [number(r.over, ".2%"), number(r.strict, ".5f"), number(r.beyond, ".0e"), r.told.replace("|", "/")]
        for r in rows
    ]
    long = "case,joints,waypoints,entry,ms,ratio,duration s,over ours,strict s,beyond,".split(",")
    return f"{table(heads, short)}\n{table(long, lines)}"


def _program(rows: Sequence[Line]) -> str:
    short = []
    for entry in dict.fromkeys(r.entry for r in rows):
        ratios = [r.ratio for r in rows if r.entry == entry and r.ratio is not None]
        if ratios:
            figures = (number(x, ".3g") for x in (median(ratios), min(ratios), max(ratios)))
            short.append([entry, str(len(ratios)), *figures])
    lines = [
        [*_problem(r), r.entry, number(r.ms, ".3g"), number(r.ratio, ".3g"), number(r.duration, ".6f")]
        + [number(r.over, ".0e"), number(r.iterations, "d"), r.told]
        for r in rows
    ]
    heads = "entry,cases,time over ours (median),least,most".split(",")
    long = "case,joints,waypoints,entry,ms,ratio,duration s,over ours,iterations,".split(",")
    return f"{table(heads, short)}\n{table(long, lines)}"


def _growth(rows: Sequence[Line]) -> str:
    lines = [
        [str(r.waypoints), number(r.ms, ".3g"), f"{r.ms / r.waypoints:.2f}" if r.ms else ""]
        + [number(r.ratio, ".2f"), "" if r.goal is None else f"at most {r.goal:g}"]
        + ["" if r.met is None else "yes" if r.met else "**no**", number(r.iterations, "d"), r.told]
        for r in rows
    ]
    heads = f"waypoints,ms,ms a waypoint,over that at {growth.BASE},goal,met,iterations,".split(",")
    return table(heads, lines)


def _random(rows: Sequence[Line]) -> str:
    lines = [
        [
            s.kind,
            f"{s.solved} of {s.count}",
            str(s.stops),
            f"{s.shorter} of {s.both}",
            str(s.longer),
            number(s.ratio, ".4f"),
            *(number(x, ".0e") for x in (s.beyond, s.missed)),
            *(number(x, ".3g") for x in (s.ms, s.slowest)),
        ]
        for s in random_problems.summaries(rows)
    ]
    heads = (
        "problems,solved,solved with stops,shorter than with stops,longer,duration over that (median),beyond,missed,"
    )
    heads += "ms (median),slowest"
    told = [[r.problem, str(r.joints), str(r.waypoints), r.told.replace("|", "/")] for r in rows if r.told]
    remarks = table("problem,joints,waypoints,".split(","), told) if told else ""
    return f"{table(heads.split(','), lines)}\n{remarks}"


def _problem(row: Line) -> list[str]:
    return [row.problem, str(row.joints), str(row.waypoints)]


def _errors(row: Line) -> list[str]:
    return [number(row.beyond, ".0e"), number(row.missed, ".0e")]


def _median(values: Iterable[float | None]) -> float | None:
    """Return the median of those there are."""
    there = [x for x in values if x is not None]
    return median(there) if there else None
