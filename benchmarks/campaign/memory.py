"""Memory over many requests, good and bad, on every lane: it stays where it is once everything has been used."""

import asyncio
import json
import random
import time

import numpy as np

from .bodies import QUICK, STEADY, Maker
from .fuzz import document
from .mutate import Bender
from .service import Service
from .state import State
from .wire import Connection, http

TITLE = "Memory"
UNIT = "requests"
SIZES = {"ci": 20_000, "campaign": 2_000_000}

CHUNK = 500
CONNECTIONS = 8

#: Of the requests, those that are bent at random; of the others, those that a solver answers, and up to where those
#: that are refused reach. The rest are quick plans.
BENT, SOLVED, BAD = 0.05, 0.02, 0.7

#: MB per 100,000 requests.
GOAL = 1.0

#: Requests that may still fill caches and pools: they count for nothing.
WARM = 0.3


def run(service: Service, size: int, seed: int, state: State) -> None:
    """Send, and look at the memory every few hundred requests."""
    points: list[list[float]] = state.data.setdefault("points", [])
    if state.done and state.data.get("pid") != service.pid:
        points.clear()  # what was measured before was another process
        state.data["from"] = state.done
    state.data["pid"] = service.pid
    while state.done < size:
        count = min(CHUNK, size - state.done)
        asyncio.run(_chunk(service, seed, state.done, count, state))
        state.done += count
        service.tracebacks()
        points.append([state.done, *service.memory()])
        if len(points) > 2_000:
            del points[1::2]
        state.save()
    own, solvers = (slope(points, column) for column in (1, 2))
    state.figure("service, MB per 100,000 requests", own, "MB", GOAL)
    state.figure("the same in the last third: does it flatten?", slope(points, 1, 2 / 3), "MB")
    # every solver is replaced after some hundred requests, so that it is a saw: the figure has no goal of its own
    state.figure("solvers, MB per 100,000 requests", solvers, "MB")
    state.figure("service, first and last", f"{points[0][1]:.1f} to {points[-1][1]:.1f}", "MB")
    state.figure("solvers, first and last", f"{points[0][2]:.1f} to {points[-1][2]:.1f}", "MB")
    state.save()


def slope(points: list[list[float]], column: int, warm: float = WARM) -> float:
    """Return the least-squares slope after the warm-up, per 100,000 requests."""
    kept = np.array(points[int(warm * len(points)) :])
    if len(kept) < 3:
        return 0.0
    return float(1e5 * np.polyfit(kept[:, 0], kept[:, column], 1)[0])


async def _chunk(service: Service, seed: int, begin: int, count: int, state: State) -> None:
    bender = Bender(Maker(await document(service)))
    rng = random.Random(f"{seed}-{begin}")
    quick, steady = (http("POST", "/v1/trajectories", json.dumps(body).encode()) for body in (QUICK, STEADY))
    bad = http("POST", "/v1/trajectories", b'{"waypoints": [[0], [NaN]], "x": 1}')
    look = http("GET", "/v1/methods")
    waiting = iter(range(count))

    async def client() -> None:
        connection = Connection(service.port)
        for _ in waiting:
            kind = rng.random()
            if kind < BENT:
                asked = bender.raw(rng)
                await connection.ask(asked.raw, head=asked.verb == "HEAD", end=not asked.intact)
                continue
            kind = rng.random()
            raw, right = (steady, 200) if kind < SOLVED else (bad, 422) if kind < BAD else (quick, 200)
            raw = look if rng.random() < 0.02 else raw
            reply = await connection.ask(raw)
            if reply.status not in (right, 200, 503):
                state.fail(f"{reply.status} {reply.broken} {reply.body[:200]!r}", raw)
        connection.close()

    await asyncio.gather(*(client() for _ in range(CONNECTIONS)))
    time.sleep(0.05)
