"""Quick work on the event loop: one piece of it at a time, others served in between, and few that wait."""

import asyncio

from ..errors import Refusal


class Turns:
    """A lock whose queue is bounded; each holder runs in a turn of the event loop of its own.

    Raises
    ------
    Refusal
        On entering: ``overloaded``, where as many wait as may.
    """

    def __init__(self, queue: int) -> None:
        self.queue = queue
        self.waiting = 0
        self._lock = asyncio.Lock()

    @property
    def full(self) -> bool:
        """Whether as many wait as may."""
        return self.waiting >= self.queue

    def refusal(self) -> Refusal:
        """Return why one more is refused."""
        detail = f"{self.queue} requests wait for their turn already, which is all that may"
        return Refusal("overloaded", detail, {"reason": "loop_busy"}, {"Retry-After": "1"})

    async def __aenter__(self) -> None:
        if self.full:
            raise self.refusal()
        self.waiting += 1
        try:
            await self._lock.acquire()
        finally:
            self.waiting -= 1
        try:
            await asyncio.sleep(0)  # so that work already in the loop is done first, and the next one has to wait
        except BaseException:
            self._lock.release()
            raise

    async def __aexit__(self, *error: object) -> None:
        self._lock.release()
