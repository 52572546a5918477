"""The report: CSV files with everything, Markdown with what a reader wants to see."""

import csv
import os
import platform
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from typing import Any

from planner import __version__

from .cases import GROUPS
from .figures import JOINTS, Figure
from .markdown import number, table
from .minimum_jerk.growth import draw
from .minimum_jerk.rounds import Standing
from .minimum_jerk.tables import section
from .path_timing import Timing
from .path_timing.tables import section as path_timing
from .rows import Row
from .service import Served
from .service.tables import sections
from .waypoints import Line
from .waypoints.tables import section as waypoints

PACKAGES = ("numpy", "scipy", "numba", "casadi", "toppra", "ruckig", "spline-trajectory", "copp-py")
PACKAGES += ("qpsolvers", "piqp", "clarabel", "osqp", "daqp")

INTRODUCTION = """# Benchmarks

Our methods beside the documented calls of toppra (its quick start), ruckig (offline: one calculation a segment, from
rest to rest) and scipy, on the same problems; minimum jerk also beside spline-trajectory, IPOPT and solvers of
quadratic programs; laws along a path and motions through waypoints also beside copp-py and IPOPT. Made by `make bench`.

- **Certified**: the answer keeps everything asked (limits, waypoints, rest at the ends) to 1e-6 relative, judged by our
  verification at the exact extrema of the pieces. A peer's answer is taken over piece by piece, not sampled. A peer
  that does not know a kind of limit cannot be expected to keep it; the table says what comes of using it all the same.
- **Velocity, acceleration, jerk**: the peak divided by its limit.
- **ms**: median process time of one call, one thread, entries run in turn. Ours includes checking the request and
  certifying the answer, which the peers do not do; *solving* (by the clock) is the part without it. **x** is the time
  divided by that of the first peer, round by round.
- **Best known**: the best value in the problem's data (a long search, a fine grid or another solver): what is
  possible, not what any entry here reached.
"""

KERNELS = f"""Single calls, one thread, process time, ours and the peer's in turn; results are compared before they are
timed. Ours are the calls that users make, with all their checks, unless a kernel is named. Curves have {JOINTS} joints,
uneven times and random waypoints; ours come as pieces, while `make_interp_spline` leaves B-spline coefficients. The
quintic spline is under *Minimum jerk*.

- **Ratio**: the peer's time over ours, median of the rounds; the *goal* is the least it should be.
- **ns an item**: our time by sample, piece or waypoint. **Growth**: the same over that of the smallest N; 1 is linear.
- **Difference**: the largest between the results, relative to the largest value.
"""

SUMMARY = "Above 1: slower than the first peer, in the last column worse than the best known.\n"


def write(
    rows: Sequence[Row],
    figures: Sequence[Figure],
    standings: Sequence[Standing],
    timings: Sequence[Timing],
    motions: Sequence[Line],
    served: Served,
    out: Path,
) -> Path:
    """Write the tables as CSV files, the picture of growth and ``report.md`` to a folder; return the report's path."""
    out.mkdir(parents=True, exist_ok=True)
    _csv(out / "rows.csv", [asdict(r) for r in rows])
    _csv(out / "kernels.csv", [{**asdict(f), "each_ns": f.each_ns, "met": f.met} for f in figures])
    _csv(out / "minimum_jerk.csv", [{**asdict(s), "each_ns": s.each_ns, "met": s.met} for s in standings])
    _csv(out / "path_timing.csv", [{**asdict(t), "met": t.met} for t in timings])
    _csv(out / "waypoints.csv", [{**asdict(m), "over_stops": m.over_stops, "met": m.met} for m in motions])
    _csv(out / "service.csv", [{**asdict(s), "rest": s.rest} for s in served.splits])
    _csv(out / "service_costs.csv", [{**asdict(c), "ratio": c.ratio} for c in served.costs])
    _csv(out / "page.csv", [asdict(s) for s in served.shown])
    draw(standings, out)
    report = out / "report.md"
    report.write_text(markdown(rows, figures, standings, timings, motions, served), encoding="utf-8")
    return report


def markdown(
    rows: Sequence[Row],
    figures: Sequence[Figure],
    standings: Sequence[Standing],
    timings: Sequence[Timing],
    motions: Sequence[Line],
    served: Served,
) -> str:
    """Return the report."""
    parts = [INTRODUCTION, machine(), "## Summary\n", SUMMARY, summary(rows)]
    for group, about in GROUPS.items():
        parts += [f"## {group.capitalize()}\n", f"{about}\n"]
        for problem in dict.fromkeys(r.problem for r in rows if r.group == group):
            parts += [_problem([r for r in rows if r.problem == problem])]
    if figures:
        parts += ["## Kernels and curves\n", KERNELS, _kernels(figures)]
    if standings:
        parts += [section(standings)]
    if timings:
        parts += [path_timing(timings)]
    if motions:
        parts += [waypoints(motions)]
    return "\n".join([*parts, *sections(served)])


def machine() -> str:
    """Return what the figures were measured on."""
    system = f"{_processor()}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}"
    there = [name for name in PACKAGES if find_spec(name.replace("-", "_")) is not None]
    versions = ", ".join(f"{name} {version(name)}" for name in there)
    return f"Measured on {system}; waywright {__version__}, {versions}.\n"


def summary(rows: Sequence[Row]) -> str:
    """Return a line an entry and group: how often certified, how fast, how far from the best known."""
    lines = []
    for group, entry in dict.fromkeys((r.group, r.entry) for r in rows):
        mine = [r for r in rows if (r.group, r.entry) == (group, entry)]
        times = [r.time_ratio for r in mine if r.time_ratio is not None]
        kept = [r for r in mine if r.certified]
        beyond = [_value(r) / r.reference for r in kept if r.reference and _value(r) is not None]
        lines.append(
            [
                group,
                entry,
                f"{len(kept)} of {len(mine)}",
                number(median(times) if times else None, ".3g"),
                number(median(beyond) if beyond else None, ".4f"),
            ]
        )
    heads = [
        "group",
        "entry",
        "certified",
        "time, x the first peer's (median)",
        "value / best known (median, certified)",
    ]
    return table(heads, lines)


def _problem(rows: Sequence[Row]) -> str:
    best = "" if rows[0].reference is None else f" (best known: {rows[0].reference:.6g})"
    lines = [
        [
            r.entry,
            "yes" if r.certified else "**no**",
            number(r.duration, ".4f"),
            number(r.squared_jerk, ".5g"),
            *(number(x, ".4f") for x in (r.velocity, r.acceleration, r.jerk)),
            number(r.ms, ".3g"),
            number(r.solve_ms, ".3g"),
            number(r.time_ratio, ".3g"),
            r.why.replace("|", "/"),
        ]
        for r in rows
    ]
    heads = "entry,certified,duration s,squared jerk,velocity,acceleration,jerk,ms,solving,x,what is broken".split(",")
    return f"### {rows[0].problem}{best}\n\n{table(heads, lines)}"


def _kernels(figures: Sequence[Figure]) -> str:
    lines = [
        [
            f.name,
            f.what,
            number(f.ours_ms, ".3g"),
            f.peer,
            number(f.peer_ms, ".3g"),
            number(f.ratio, ".3g"),
            "" if f.goal is None else f"≥ {f.goal:.3g}",
            "" if f.met is None else "yes" if f.met else "**no**",
            number(f.each_ns, ".0f" if (f.each_ns or 0.0) >= 100 else ".3g"),
            number(f.growth, ".2f"),
            "" if f.difference is None else f"{f.difference:.0e}" + ("" if f.agrees else " **(not timed)**"),
        ]
        for f in figures
    ]
    heads = "call,what,ours ms,peer,peer ms,ratio,goal,met,ns an item,growth,difference".split(",")
    return table(heads, lines)


def _value(row: Row) -> Any:
    return row.squared_jerk if row.group == "times" else row.duration


def _csv(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        if rows:
            writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
