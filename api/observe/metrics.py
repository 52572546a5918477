"""The service's metrics, in a registry of its own: two services in one process do not mix theirs.

Every label has few values, whatever clients send: a route is its template, a verb one that HTTP knows, a method an id
of the catalogue. What the engine knows anyway is read from it when somebody asks.
"""

import os
import platform
from collections.abc import Iterable, Iterator
from http import HTTPMethod
from typing import Any, Protocol

from prometheus_client import CollectorRegistry, Counter, GCCollector, Histogram, Info, ProcessCollector
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4, generate_latest
from prometheus_client.metrics_core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from starlette.concurrency import run_in_threadpool

from planner import METHODS, __version__

from .lag import Lag

#: Prometheus' text format, which every scraper reads.
CONTENT_TYPE = CONTENT_TYPE_PLAIN_0_0_4

VERBS = frozenset(HTTPMethod)

#: What a plan's method can be besides the catalogue's ids.
_METHODS = frozenset(METHODS) | {"auto", "retiming"}

#: Why a request was turned away; each is there from the start, so that its first increase is seen as one.
SHED = ("queue_full", "expired", "crashed", "stopping", "loop_busy", "rate_limited", "other")

#: Why a solver was replaced.
RESTARTS = ("crashed", "timeout", "cancelled", "recycled", "lost")

_REQUEST_BUCKETS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0)
_SOLVE_BUCKETS = (0.0005, *_REQUEST_BUCKETS)

_PAGE = os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 4096


class Source(Protocol):
    """What is read at a scrape: the service's state."""

    engine: Any
    turns: Any

    @property
    def ready(self) -> bool:
        """Whether requests are taken."""
        ...


class Metrics:
    """The counters and histograms of one service, and what a scrape reads from its state."""

    def __init__(self, source: Source) -> None:
        self.registry = CollectorRegistry(auto_describe=False)
        self.in_flight = 0
        self._source = source
        self.lag = Lag(self.registry)
        made: dict[str, Any] = {"registry": self.registry}
        self._requests = Counter(
            "waywright_requests", "Requests answered; 499: the client went away", ("route", "verb", "status"), **made
        )
        self._seconds = Histogram(
            "waywright_request_seconds",
            "Seconds from a request's headers to its answer's last byte",
            ("route",),
            buckets=_REQUEST_BUCKETS,
            **made,
        )
        self._solving = Histogram(
            "waywright_solve_seconds",
            "Seconds of work on a request, without waiting; status: solved, or the problem's code",
            ("method", "status"),
            buckets=_SOLVE_BUCKETS,
            **made,
        )
        self._queued = Histogram(
            "waywright_queue_seconds",
            "Seconds that a request waited for a solver or for its turn",
            buckets=_SOLVE_BUCKETS,
            **made,
        )
        self._shed = Counter("waywright_shed", "Requests turned away because there were too many", ("reason",), **made)
        for reason in SHED:
            self._shed.labels(reason)
        Info("waywright_build", "Versions that are running", **made).info(
            {"version": __version__, "python": platform.python_version()}
        )
        ProcessCollector(registry=self.registry)
        GCCollector(registry=self.registry)
        # labels() hashes and locks: what was looked up once is kept. As bounded as the labels are.
        self._answered: dict[tuple[str, str, int], tuple[Counter, Histogram]] = {}
        self._solved: dict[tuple[str, str], Histogram] = {}

    def answered(self, route: str, verb: str, status: int, seconds: float) -> None:
        """Count an answer."""
        key = (route, verb, status)
        found = self._answered.get(key)
        if found is None:
            found = self._answered[key] = self._requests.labels(*key), self._seconds.labels(route)
        found[0].inc()
        found[1].observe(seconds)

    def solved(self, method: str, status: str, seconds: float, queued: float) -> None:
        """Take note of an outcome: its method's label, ``solved`` or the problem's code."""
        key = (method, status)
        found = self._solved.get(key)
        if found is None:
            found = self._solved[key] = self._solving.labels(*key)
        found.observe(seconds)
        self._queued.observe(queued)

    def shed(self, reason: str) -> None:
        """Count a request that was turned away."""
        self._shed.labels(reason if reason in SHED else "other").inc()

    async def text(self) -> bytes:
        """Return all of it in Prometheus' text format.

        With every label in use that is some 30 ms of work: in a thread, where others get their turns. What is read from
        the state is read before, here on its own loop.
        """
        now = list(self._now())
        return await run_in_threadpool(lambda: generate_latest(_Everything(self.registry, now)))

    def _now(self) -> Iterator[Metric]:
        source, engine = self._source, self._source.engine
        rows = (
            ("queue_depth", "Requests that wait for a solver", engine.waiting),
            ("turns_depth", "Quick requests that wait for their turn on the event loop", source.turns.waiting),
            ("in_flight", "Requests that are being answered", self.in_flight),
            ("solvers", "Solver processes that are up", engine.solvers),
            ("solvers_busy", "Solver processes at work", engine.running),
            ("solvers_resident_bytes", "Resident memory of the solvers; pages they share count in each", rss(engine)),
            ("event_loop_lag_max_seconds", "Largest lag of the last minute", self.lag.largest()),
            ("ready", "Whether requests are taken: 1 or 0", float(source.ready)),
        )
        for name, text, value in rows:
            yield GaugeMetricFamily(f"waywright_{name}", text, value=value)
        restarts = CounterMetricFamily("waywright_worker_restarts", "Solvers replaced by new ones", labels=("reason",))
        for reason in sorted({*RESTARTS, *engine.restarts}):
            restarts.add_metric((reason,), engine.restarts[reason])
        yield restarts


def method_label(method: str | None) -> str:
    """Return the label of a method: its id, or nothing for what is no id of ours."""
    return method if method in _METHODS and method is not None else ""


class _Everything(Collector):
    """A registry and what was read from the state, without the moments at which series were made: nobody reads them."""

    def __init__(self, registry: CollectorRegistry, now: list[Metric]) -> None:
        self._registry, self._now = registry, now

    def collect(self) -> Iterable[Metric]:
        """Return all metrics."""
        for metric in self._registry.collect():
            metric.samples = [sample for sample in metric.samples if not sample.name.endswith("_created")]
            yield metric
        yield from self._now


def rss(engine: Any) -> int:
    """Return the resident memory of the solvers, bytes; 0 where the system does not tell."""
    total = 0
    for pid in engine.pids:
        try:
            with open(f"/proc/{pid}/statm", "rb") as file:
                total += int(file.read().split()[1]) * _PAGE
        except OSError:  # it has just ended, or there is no /proc
            continue
    return total
