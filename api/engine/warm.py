"""Kernels are loaded, or compiled where they are not on disk yet, by planning the named cases once."""

import logging
from typing import Any

from planner import CASES, METHODS, PlannerError

from ..formats import written
from ..media import CSV, JSON
from ..reading import parse
from ..schemas import PlanBody
from ..settings import LOCAL
from ..work import draft_plan
from .lanes import QUICK

log = logging.getLogger("waywright.api")

_done = False


def warm() -> None:
    """Plan every case here and now, unless that was done. From nothing that takes minutes."""
    global _done
    if not _done:
        for case in CASES.values():
            _plan(case.name, dict(case.request))
        _done = True


def warm_quick() -> None:
    """Plan once with every method of the event loop's own lane."""
    points = [[0.0, 0.0], [1.0, 2.0], [2.0, 1.0], [3.0, 3.0], [4.0, 2.0], [5.0, 0.0]]
    given = {"times": [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]}
    for method in sorted(QUICK):
        row = METHODS[method]
        capabilities = row.capabilities(row.options())
        timing, limits = capabilities.timing, {"velocity": 1.0, "acceleration": 2.0, "jerk": 10.0}
        limited = {"limits": {name: bound for name, bound in limits.items() if name in capabilities.honours}}
        asked: dict[str, Any] = {"waypoints": points, "method": method, "include": ["samples", "polynomial"]}
        _plan(method, asked | (given if timing in ("given", "either") else limited if timing == "chosen" else {}))


def _plan(name: str, asked: dict[str, Any]) -> None:
    try:
        for media_type in (JSON, CSV):
            written(draft_plan(parse(PlanBody, asked), LOCAL, media_type), media_type)
    except PlannerError as error:
        log.warning("warm-up: %s: %s", name, error)
    except Exception:
        log.exception("warm-up: %s", name)
