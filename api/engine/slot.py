"""One solver process at a time, by a pebble pool of its own: what happens to one solver never touches another.

A pool of several would share one pipe and its locks, and a solver that is killed while it writes would take them along.
The pool starts and kills; jobs and outcomes go over a pair of sockets, since its threads and polls cost a millisecond.
"""

import asyncio
import multiprocessing
import os
import pickle
import signal
import socket
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from functools import partial
from multiprocessing.context import BaseContext

import pebble

from .beside import beside
from .jobs import Job, Outcome, solve
from .line import HEAD, Line, tell

#: How much solvers stand back behind the event loop, which has little to do but must do it at once.
NICE = 5

#: Seconds within which a pool knows how its solver ended.
SURE = 1.0

_PRELOADED = "api.engine.zygote"

#: One thread each: solvers are many, and answers shall not depend on the number of cores.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def context() -> BaseContext:
    """Return how solvers are started: from a fork server that is warm, or where there is none, anew. Never by fork."""
    for name in _THREADS:
        os.environ.setdefault(name, "1")
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    found = multiprocessing.get_context("forkserver")
    found.set_forkserver_preload([_PRELOADED])
    return found


def end_fork_server() -> None:
    """Kill the fork server at the end: solvers that it still starts would find nobody, and say so at length."""
    with suppress(ImportError, AttributeError, OSError):
        from multiprocessing import forkserver

        pid = getattr(forkserver._forkserver, "_forkserver_pid", None)
        if pid is not None:
            os.kill(pid, signal.SIGKILL)


def _prepare() -> None:
    """Make a new solver ready; one that was forked from the warm server is."""
    from .warm import warm

    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # pebble's own handler would wait for native code to return
    if hasattr(os, "nice"):
        os.nice(NICE)
    warm()


def _pid() -> int:
    return os.getpid()


def _serve(line: socket.socket) -> None:
    """Solve one job after the other, until the service is gone; this is all that a solver does."""
    tell(line, os.getpid())
    with line, line.makefile("rb") as heard:
        while head := heard.read(HEAD.size):
            tell(line, solve(pickle.loads(heard.read(*HEAD.unpack(head)))))


class Slot:
    """A place for one job at a time, on one event loop."""

    def __init__(self, ctx: BaseContext) -> None:
        pebble.CONSTS.term_timeout = 0.0  # SIGKILL at once: solvers ignore SIGTERM
        pebble.CONSTS.sleep_unit = 0.05  # how soon it is known how a solver ended, s
        self._pool = pebble.ProcessPool(max_workers=1, initializer=_prepare, context=ctx)
        self._line = Line()
        self._life: Future[None] | None = None
        self.solved = 0
        self.pid = 0

    @property
    def alive(self) -> bool:
        """Whether jobs can be submitted."""
        return self._line.open

    async def begin(self) -> None:
        """Start the solver, and wait until it is warm.

        Raises
        ------
        RuntimeError
            It ended before.
        """
        here, there = socket.socketpair()
        with there:  # until the solver has its own: when that closes, the solver is no more
            await asyncio.get_running_loop().create_connection(lambda: self._line, sock=here)
            pid = self._line.answer()
            try:
                self._life = life = await beside(partial(self._pool.schedule, _serve, args=[there]))
                while not pid.done():
                    await asyncio.wait((pid,), timeout=0.1)
                    if life.done():
                        raise RuntimeError("the solver ended before it was warm") from life.exception()
                self.pid = await pid
            finally:
                pid.cancel()

    async def solve(self, job: Job) -> Outcome:
        """Solve a job.

        Raises
        ------
        EOFError
            The solver ended.
        """
        self.solved += 1
        answer = self._line.answer()
        self._line.tell(job)
        outcome: Outcome = await answer
        return outcome

    async def exit_code(self) -> int | None:
        """Return how a solver ended that is no more: the number of a signal, negative; None if nobody knows."""
        if self._life is None:
            return None
        with suppress(TimeoutError, CancelledError):  # nobody knows yet; it was told to
            error = await beside(partial(self._life.exception, SURE))
            return error.exitcode if isinstance(error, pebble.ProcessExpired) else None
        return None

    def discard(self) -> "asyncio.Future[None]":
        """Kill the solver; one that is beyond pebble's reach is beyond ours."""
        self._line.close()
        return beside(self._stop)

    def _stop(self) -> None:
        with suppress(RuntimeError, OSError):
            self._pool.stop()
            self._pool.join()
