"""The page in a browser: how soon the first plan is on screen, and how soon a waypoint that is dragged shows its plan.

Both are read from the browser's own clock: the page measures each plan from asking for it to when it is painted. The
browser shares the machine with the service, its solvers and this script.
"""

import json
import os
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any
from urllib.parse import quote

from planner import CASES

#: The cases that are dragged: two axes and six joints, on the event loop and in a solver.
CASES_DRAGGED = ("contract_example", "gantry_in_its_frame", "ur5e_times", "ur5e_jerk", "pen_path")

#: Moves of the pointer, one every so many milliseconds.
MOVES, EVERY_MS = 60, 25

_SKETCHED = """performance.getEntriesByName("sketched")[0].startTime"""
_PLANS = """performance.getEntriesByName("replan").map((plan) => [plan.startTime + plan.duration, plan.duration])"""


@dataclass(frozen=True)
class Shown:
    """Of a case, ms: the first plan on screen, and waypoints to drag, since it was asked for; a plan while dragging."""

    case: str
    joints: int
    first_ms: float
    handles_ms: float
    replan_ms: float
    slowest_ms: float
    plans: int


def browser() -> str | None:
    """Return the browser's path, if there is one."""
    names = (os.environ.get("WAYWRIGHT_BROWSER", ""), "chromium", "chromium-browser", "google-chrome")
    return next((found for name in names if name and (found := shutil.which(name))), None)


def measure(address: str, loads: int = 5, cases: Sequence[str] = CASES_DRAGGED) -> list[Shown]:
    """Return a row a case; none, with a line that says so, where there is no browser."""
    path = browser()
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        path = None
    if path is None:
        print("the page: not measured, there is no browser (apt-get install chromium)", file=sys.stderr)
        return []
    with sync_playwright() as play:
        running = play.chromium.launch(executable_path=path, args=["--no-sandbox"])
        try:
            return [_shown(running, address, name, loads) for name in cases]
        finally:
            running.close()


def _shown(running: Any, address: str, name: str, loads: int) -> Shown:
    request = dict(CASES[name].request)
    target = f"{address}/#tab=plan&request={quote(json.dumps(request))}"
    first, handles, plans = [], [], []
    for _ in range(loads):
        page = running.new_page(viewport={"width": 1440, "height": 1000})
        page.goto(target)
        page.wait_for_selector(".handle")
        page.wait_for_function("() => performance.getEntriesByName('replan').length")
        first.append(page.evaluate(_SKETCHED))
        handles.append(page.evaluate(_PLANS)[0][0])
        plans += _dragged(page)
        page.close()
    return Shown(
        name, len(request["waypoints"][0]), median(first), median(handles), median(plans), max(plans), len(plans)
    )


def _dragged(page: Any) -> list[float]:
    """Drag the second waypoint's first joint up and down; return how long each plan took."""
    page.evaluate("performance.clearMeasures()")
    box = page.locator(".handle").nth(1).bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    for move in range(MOVES):
        page.mouse.move(x, y - 12 + abs(12 - move % 24))
        page.wait_for_timeout(EVERY_MS)
    page.mouse.up()
    page.wait_for_timeout(500)
    return [plan[1] for plan in page.evaluate(_PLANS)]
