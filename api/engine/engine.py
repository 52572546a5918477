"""The engine: a bounded queue before a few solver processes, hard deadlines, and one retry where a solver crashed."""

import asyncio
import logging
import math
import time
from collections import Counter, deque
from contextlib import suppress
from dataclasses import dataclass, replace

from planner import TimeLimit

from ..errors import Refusal
from .jobs import ALARM, GRACE, Job, Outcome, failed, glimpsed_limit
from .slot import Slot, context

log = logging.getLogger("waywright.api")

#: Bytes of a body after which a solver is replaced, for the memory that it leaves behind.
LARGE = 2**20

#: Seconds that solvers have to be gone when the service stops.
STOPPING = 5.0

LATE = "no solver came free within the request's time limit"

#: Seconds between attempts to start a solver that does not start.
PAUSE = 1.0


@dataclass(frozen=True)
class Solved:
    """An outcome and the seconds it waited for a solver."""

    outcome: Outcome
    queued: float


class Engine:
    """Solver processes and the queue before them; lives on one event loop.

    Parameters
    ----------
    workers : int
        Solver processes.
    queue : int
        Jobs that may wait for one; those beyond are refused at once.
    recycle : int
        Jobs after which a solver is replaced by a new one.

    Attributes
    ----------
    restarts
        How often solvers were replaced, by reason: crashed, timeout, cancelled, recycled or lost.
    """

    def __init__(self, workers: int, queue: int, recycle: int) -> None:
        self.workers, self.queue, self.recycle = workers, queue, recycle
        self.running = 0
        self.restarts: Counter[str] = Counter()
        self._idle: deque[Slot] = deque()
        self._spare: Slot | None = None  # warm, and takes the place of the next one that is done for
        self._waiting: deque[asyncio.Future[Slot]] = deque()
        self._tasks: set[asyncio.Task[None]] = set()
        self._slots: set[Slot] = set()
        self._mean = 0.05
        self._closed = False

    @property
    def waiting(self) -> int:
        """Jobs that wait for a solver."""
        return len(self._waiting)

    @property
    def solvers(self) -> int:
        """Solvers that are up."""
        return len(self._slots)

    @property
    def ready(self) -> bool:
        """Whether a solver is up."""
        return bool(self._slots) and not self._closed

    @property
    def full(self) -> bool:
        """Whether no solver is idle and as many jobs wait as may."""
        return not self._idle and self.waiting >= self.queue

    def refusal(self) -> Refusal:
        """Return why one more job is refused."""
        return self._overloaded("queue_full", f"{self.queue} requests wait already, which is all that may")

    @property
    def pids(self) -> list[int]:
        """Processes of the solvers that are up."""
        return sorted(slot.pid for slot in self._slots)

    def tend(self) -> None:
        """Replace solvers that died while nothing was asked of them."""
        for slot in [slot for slot in self._idle if not slot.alive]:
            self._idle.remove(slot)
            self._replace(slot, "lost")
        if self._spare is not None and not self._spare.alive:
            dead, self._spare = self._spare, None
            self._replace(dead, "lost")

    def start(self) -> None:
        """Begin to start the solvers; returns at once."""
        self._context = context()
        for _ in range(self.workers + 1):
            self._spawn()

    async def stop(self) -> None:
        """Kill the solvers and refuse whoever waits."""
        self._closed = True
        for waiter in self._waiting:
            waiter.cancel()
        for task in list(self._tasks):
            task.cancel()
        slots = [*self._slots, *([] if self._spare is None else [self._spare])]
        self._slots.clear()
        with suppress(TimeoutError):
            await asyncio.wait_for(asyncio.gather(*(slot.discard() for slot in slots)), STOPPING)

    async def solve(self, job: Job, limit: float) -> Solved:
        """Solve a job within ``limit`` s from now; cancelling kills it.

        Raises
        ------
        Refusal
            ``overloaded``: the queue is full, no solver came free in time, or two solvers crashed on it.
        """
        began = time.perf_counter()
        for _ in range(2):
            slot = await self._take(limit - (time.perf_counter() - began))
            queued = time.perf_counter() - began
            if queued >= limit:  # it came free too late
                self._free(slot)
                raise self._overloaded("expired", LATE)
            try:
                outcome = await self._run(slot, replace(job, spent=job.spent + queued), limit - queued)
                return Solved(outcome, queued)
            except _Crashed:
                continue
        raise self._overloaded("crashed", "the solvers crashed on this request")

    # -- slots -------------------------------------------------------------------------------------------------------

    async def _take(self, patience: float) -> Slot:
        while self._idle:
            slot = self._idle.popleft()
            if slot.alive:
                return slot
            self._replace(slot, "lost")
        if self._closed:
            raise self._overloaded("stopping", "the service is stopping")
        if self.full:
            raise self.refusal()
        waiter: asyncio.Future[Slot] = asyncio.get_running_loop().create_future()
        self._waiting.append(waiter)
        try:  # not wait_for, which may lose a slot, or a cancellation, that comes at the same moment as the other
            await asyncio.wait([waiter], timeout=max(patience, 0.0))
        except asyncio.CancelledError:
            if waiter.done() and not waiter.cancelled():
                self._free(waiter.result())
            raise
        finally:
            with suppress(ValueError):
                self._waiting.remove(waiter)
        if not waiter.done():
            waiter.cancel()
            raise self._overloaded("expired", LATE)
        if waiter.cancelled():
            raise self._overloaded("stopping", "the service is stopping")
        return waiter.result()

    def _free(self, slot: Slot) -> None:
        while self._waiting:
            waiter = self._waiting.popleft()
            if not waiter.done():
                waiter.set_result(slot)
                return
        self._idle.append(slot)

    async def _run(self, slot: Slot, job: Job, limit: float) -> Outcome:
        """Return the outcome of a job on a solver, and free the solver or replace it."""
        began, reason = time.perf_counter(), "cancelled"
        self.running += 1
        try:
            async with asyncio.timeout(max(limit, 0.0) + 2 * GRACE):
                outcome = await slot.solve(job)
            self._mean += 0.1 * (time.perf_counter() - began - self._mean)
            reason = "recycled" if slot.solved >= self.recycle or len(job.raw) > LARGE else ""
            return outcome
        except EOFError:
            if await slot.exit_code() == -ALARM:  # it ended itself: see jobs.solve
                reason = "timeout"
                return failed(TimeLimit(glimpsed_limit(job)), job)
            reason = "crashed"
            raise _Crashed from None
        except TimeoutError:
            reason = "timeout"
            return failed(TimeLimit(round(limit + job.spent, 6)), job)
        finally:
            self.running -= 1
            if reason:
                self._replace(slot, reason)
            else:
                self._free(slot)

    def _replace(self, slot: Slot, reason: str) -> None:
        """Start a solver in the place of one that is done for."""
        log.log(logging.DEBUG if reason == "recycled" else logging.WARNING, "a solver is replaced: %s", reason)
        self._slots.discard(slot)
        self.restarts[reason] += 1
        slot.discard()
        if self._closed:
            return
        spare, self._spare = self._spare, None
        if spare is not None and spare.alive:
            self._enter(spare)
        elif spare is not None:
            spare.discard()
            self._spawn()
        self._spawn()

    def _enter(self, slot: Slot) -> None:
        """Take a solver that is up into service, or keep it in reserve."""
        if len(self._slots) < self.workers:
            self._slots.add(slot)
            self._free(slot)
        else:
            self._spare = slot

    def _spawn(self) -> None:
        task = asyncio.get_running_loop().create_task(self._started())
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _started(self) -> None:
        """Start a solver, however often that takes."""
        while not self._closed:
            slot = Slot(self._context)
            try:
                await slot.begin()
            except asyncio.CancelledError:
                slot.discard()
                raise
            except Exception:
                log.exception("a solver did not start")
                slot.discard()
                await asyncio.sleep(PAUSE)
                continue
            self._enter(slot)
            return

    def _overloaded(self, reason: str, detail: str) -> Refusal:
        """Return the refusal: come back when the queue of now will be done."""
        wait = max(1, math.ceil(self._mean * (self.waiting + self.running) / max(1, self.solvers)))
        return Refusal("overloaded", detail, {"reason": reason}, {"Retry-After": str(min(wait, 60))})


class _Crashed(Exception):
    """The solver died under its job."""
