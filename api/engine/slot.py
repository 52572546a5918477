"""One solver process at a time, by a pebble pool of its own: what happens to one solver never touches another.

A pool of several would share one pipe and its locks, and a solver that is killed while it writes would take them along.
"""

import multiprocessing
import os
import signal
from concurrent.futures import Future
from contextlib import suppress
from multiprocessing.context import BaseContext

import pebble

from .jobs import GRACE, Job, Outcome, solve

#: How much solvers stand back behind the event loop, which has little to do but must do it at once.
NICE = 5

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


class Slot:
    """A place for one job at a time. ``begin`` and ``discard`` block: the engine calls them in threads."""

    def __init__(self, ctx: BaseContext) -> None:
        pebble.CONSTS.term_timeout = 0.0  # SIGKILL at once: solvers ignore SIGTERM
        pebble.CONSTS.sleep_unit = 0.05  # how soon a solver that died or overran is noticed, s
        self._pool = pebble.ProcessPool(max_workers=1, initializer=_prepare, context=ctx)
        self.solved = 0
        self.pid = 0

    @property
    def alive(self) -> bool:
        """Whether jobs can be submitted."""
        return bool(self._pool.active)

    def begin(self) -> "Future[int]":
        """Start the solver; its process id comes when it is warm."""
        future: Future[int] = self._pool.schedule(_pid)
        return future

    def submit(self, job: Job, limit: float) -> "Future[Outcome]":
        """Begin a job that is killed if it takes longer than ``limit`` s and its grace."""
        self.solved += 1
        future: Future[Outcome] = self._pool.schedule(solve, args=[job], timeout=limit + GRACE)
        return future

    def discard(self) -> None:
        """Kill the solver; one that is beyond pebble's reach is beyond ours."""
        with suppress(RuntimeError, OSError):
            self._pool.stop()
            self._pool.join()
