"""What lives as long as the service: its solvers, its turns on the event loop, and whether it is ready."""

import asyncio
import gc
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from .engine.beside import beside
from .engine.engine import Engine
from .engine.turns import Turns
from .engine.warm import warm_quick
from .observe.metrics import Metrics
from .settings import Settings

#: Seconds between looks whether the first solver is up.
LOOK = 0.05

#: Seconds between looks whether idle solvers live.
TEND = 0.5


class State:
    """The service's parts; ``running`` starts and stops them on the event loop."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.engine = Engine(settings.workers, settings.queue, settings.recycle)
        self.turns = Turns(settings.turns)
        self.metrics = Metrics(self)
        self.draining = False
        self._warm = False

    @property
    def ready(self) -> bool:
        """Whether requests are taken."""
        return self._warm and self.engine.ready and not self.draining

    @property
    def busy(self) -> bool:
        """Whether something is being solved."""
        return bool(self.engine.running or self.engine.waiting or self.turns.waiting)

    @asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Run from here to there."""
        self.engine.start()
        warming = asyncio.create_task(self._warm_up())
        probing = asyncio.create_task(self.metrics.lag.run())
        tending = asyncio.create_task(self._tend())
        try:
            yield
        finally:
            self.draining = True
            warming.cancel()
            probing.cancel()
            tending.cancel()
            await self.engine.stop()

    async def _tend(self) -> None:
        while True:
            await asyncio.sleep(TEND)
            self.engine.tend()

    async def _warm_up(self) -> None:
        """Load this process' own kernels once the first solver is up: by then they are compiled."""
        while not self.engine.ready:
            await asyncio.sleep(LOOK)
        await beside(warm_quick)
        gc.collect()
        gc.freeze()  # what is loaded stays: looking through all of it again would hold up the event loop
        self._warm = True
