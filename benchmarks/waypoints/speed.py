"""Whole plans beside copp-py, toppra and stops at all waypoints: from rest to rest, limits of derivatives only."""

from collections.abc import Callable
from statistics import median
from typing import Any

from planner import plan

from ..minimum_jerk.rounds import in_turn, over
from ..path_timing.peers import COPP, WITHOUT_COPP
from .peers import CoppTask, toppra_run
from .problems import METHOD, cases, plain, stop_times
from .rows import Line, of_plan, remarks

PART = "speed"
OURS, STOPS, TOPPRA = "plan, default", "plan, ruckig: stops at all", "toppra: without jerk limits"
#: Stations a segment; fewer are faster, and further from the law that they stand for.
STATIONS = (40, 20)
#: The same waypoints as another case, once durations and end states are left out.
SAME = ("ruckig_ex08_mindur",)


def copp_entry(stations: int) -> str:
    """Return the name of copp-py's entry."""
    return f"copp-py topp3_socp, {stations} stations a segment"


def measure(quick: bool = False) -> list[Line]:
    """Return the lines."""
    names = ("d3_rand_1wp", "d3_rand_5wp") if quick else [n for n in cases() if n not in SAME]
    return [row for name in names for row in _problem(name, quick)]


def _problem(name: str, quick: bool) -> list[Line]:
    asked = plain(name)
    times = stop_times(asked)
    plans = {OURS: METHOD, STOPS: "ruckig"}
    calls: dict[str, Callable[[], Any]] = {OURS: lambda: plan(asked, METHOD), STOPS: lambda: plan(asked, "ruckig")}
    tasks = {copp_entry(n): CoppTask.of(asked, times, n) for n in STATIONS} if COPP is not None else {}
    calls |= {entry: task.run for entry, task in tasks.items()} | {TOPPRA: toppra_run(asked, times)}
    answers, failed = {}, {}
    for entry, run in calls.items():
        try:
            answers[entry] = run()
        except Exception as error:  # whatever a peer may raise
            failed[entry] = f"**{type(error).__name__}: {str(error).partition(chr(10))[0][:120]}**"
    seconds = in_turn({e: calls[e] for e in answers}, 1 if quick else 7, budget=5.0)
    if COPP is None:
        failed[copp_entry(STATIONS[0])] = WITHOUT_COPP
    title = (PART, name, asked.dims, asked.count)
    found = []
    for entry, answer in answers.items():
        extra: dict[str, Any]
        if entry in plans:
            extra = {**of_plan(answer), "told": remarks(answer, usual=answer.stats.name)}
        elif entry in tasks:
            law = tasks[entry].judged(answer)
            extra = {"duration": law.duration, "strict": law.strict, "beyond": law.beyond}
        else:
            extra = {"duration": float(answer.duration)}
        found.append(_row(title, entry, seconds, extra, answers, float(times[-1])))
    return found + [Line(*title, entry, told=why) for entry, why in failed.items()]


def _row(
    title: tuple[str, str, int, int],
    entry: str,
    seconds: dict[str, list[float]],
    extra: dict[str, Any],
    answers: dict[str, Any],
    stops: float,
) -> Line:
    own, taken = seconds[entry], extra["duration"]
    ratio = over(own, seconds[OURS]) if OURS in seconds else None
    more = taken / answers[OURS].trajectory.duration - 1.0 if OURS in answers else None
    ms = 1e3 * median(own)
    return Line(*title, entry, ms, ratio, over=more, stops=stops, **extra, rounds=len(own))
