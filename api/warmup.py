"""Readiness: compiled kernels are loaded by planning the named cases once, beside the event loop."""

import logging
import threading

from planner import CASES, PlannerError

from .encode import CSV, JSON
from .reading import parse
from .schemas import PlanBody
from .settings import Caps
from .work import answer_plan

log = logging.getLogger("waywright.api")


class Warmup:
    """Plans every named case once in a thread of its own."""

    def __init__(self) -> None:
        self._done = threading.Event()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def ready(self) -> bool:
        """Whether every case has been planned."""
        return self._done.is_set()

    def start(self) -> None:
        """Begin; returns at once."""
        self._thread = threading.Thread(target=self._run, name="warm-up", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop after the case at hand."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(timeout=5.0)

    def _run(self) -> None:
        for case in CASES.values():
            if self._stop.is_set():
                return
            try:
                for media_type in (JSON, CSV):
                    answer_plan(parse(PlanBody, dict(case.request)), Caps(), media_type)
            except PlannerError as error:
                log.warning("warm-up: %s: %s", case.name, error)
            except Exception:
                log.exception("warm-up: %s", case.name)
        self._done.set()
