"""The service's part of the report."""

from collections.abc import Sequence

from ..markdown import number, table
from . import Served
from .costs import Cost
from .page import EVERY_MS, Shown
from .split import PARTS, Split


def sections(served: Served) -> list[str]:
    """Return a heading and a table for each thing that was measured."""
    parts = []
    if served.splits:
        parts += ["## Where a request's time goes\n", _service(served.splits)]
    if served.costs:
        parts += ["## What a request costs the service\n", _costs(served.costs)]
    if served.shown:
        parts += ["## The page\n", _page(served.shown)]
    return parts


def _service(splits: Sequence[Split]) -> str:
    lines = []
    for s in splits:
        shares = (f"{100 * getattr(s, part) / s.total:.0f} %" for part in (*PARTS, "rest"))
        lines.append([s.request, s.method, f"{s.total:.2f}", *shares])
    intro = "In process, without a network; *rest* is reading the body, routing and the test's own client.\n\n"
    return intro + table(["request", "method", "total ms", *PARTS, "rest"], lines)


def _costs(costs: Sequence[Cost]) -> str:
    intro = """A plan of 20 waypoints and 7 joints, over a connection, beside a handler of the same framework that
checks and plans nothing and encodes arrays of the same shapes in the same way. Process time of the server; its inverse
is the requests a second that fill a core, of which ours are the share given.

"""
    heads = ["what", "ms a request", "bare handler, ms", "share", "goal"]
    lines = []
    for c in costs:
        share, goal = (
            ("-", f"{c.goal:g} ms") if c.ratio is None else (f"{100 * c.ratio:.0f} %", f"{100 * c.goal:.0f} %")
        )
        lines.append([c.what, f"{c.ours_ms:.3f}", number(c.theirs_ms, ".3f"), share, goal])
    return intro + table(heads, lines)


def _page(shown: Sequence[Shown]) -> str:
    intro = f"""The browser's own clock, on the machine of the service: from asking for the page to the first plan on
screen (goal 2,000 ms) and to waypoints that can be dragged, when plotly.js has replaced the first sketch; and from
asking for a plan to having it painted (goal 100 ms, median), while a waypoint is dragged by a step every {EVERY_MS} ms.

"""
    heads = ["case", "joints", "first plan, ms", "to be dragged, ms", "plan and drawing, ms", "slowest, ms", "plans"]
    lines = [
        [
            s.case,
            str(s.joints),
            *(f"{ms:.0f}" for ms in (s.first_ms, s.handles_ms, s.replan_ms, s.slowest_ms)),
            str(s.plans),
        ]
        for s in shown
    ]
    return intro + table(heads, lines)
