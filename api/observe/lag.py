"""How late the event loop runs: a task that wakes every so often and measures by how much it overslept."""

import asyncio
import time
from collections import deque

from prometheus_client import CollectorRegistry, Histogram

#: Seconds between looks.
EVERY = 0.02

#: Seconds that the gauge looks back, in steps of ``STEP``.
WINDOW = 60.0
STEP = 5.0

_BUCKETS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5)


class Lag:
    """The probe; ``run`` is the task.

    The largest lag is that of the last minute, not that since the last scrape: two scrapers would take it from each
    other, and a look at ``/metrics`` by hand would hide a stall from the record.
    """

    def __init__(self, registry: CollectorRegistry) -> None:
        self._seen = Histogram(
            "waywright_event_loop_lag_seconds",
            "How late the event loop ran, looked at every 20 ms",
            buckets=_BUCKETS,
            registry=registry,
        )
        self._largest: deque[tuple[float, float]] = deque()  # (when its step began, the largest of that step), s

    async def run(self) -> None:
        """Look until cancelled."""
        while True:
            due = time.perf_counter() + EVERY
            await asyncio.sleep(EVERY)
            self.saw(max(time.perf_counter() - due, 0.0))

    def saw(self, late: float) -> None:
        """Take note of a lag, s."""
        self._seen.observe(late)
        now = time.monotonic()
        if not self._largest or now - self._largest[-1][0] >= STEP:
            self._largest.append((now, late))
            self._forget(now)
        elif late > self._largest[-1][1]:
            self._largest[-1] = (self._largest[-1][0], late)

    def largest(self) -> float:
        """Return the largest lag of the last minute, s; 0 if nothing was seen."""
        self._forget(time.monotonic())
        return max((late for _, late in self._largest), default=0.0)

    def _forget(self, now: float) -> None:
        while self._largest and now - self._largest[0][0] > WINDOW:
            self._largest.popleft()
