"""Connections that never finish their requests: whoever does is served as if they were not there."""

import asyncio
import json

import numpy as np

from .bodies import QUICK
from .service import Service
from .state import State
from .wire import Connection, http

TITLE = "500 connections that never finish"
UNIT = "pairs of rounds"
SIZES = {"ci": 3, "campaign": 100}

HALF_OPEN = 500
REQUESTS = 400

#: p99 with them over p99 without.
GOAL = 2.0

_WHOLE = http("POST", "/v1/trajectories", json.dumps(QUICK).encode())
_HALVES = (_WHOLE[:40], _WHOLE[:-100], b"", b"GET / HT", _WHOLE + _WHOLE[:60])


def run(service: Service, size: int, seed: int, state: State) -> None:
    """Measure without and with them, in turn."""
    for key in ("without", "with"):
        state.data.setdefault(key, [])
    state.data.setdefault("held", [])
    while state.done < size:
        asyncio.run(_pair(service, state))
        state.done += 1
        state.save()
    p99 = {key: float(np.percentile(state.data[key], 99)) for key in ("without", "with")}
    p50 = {key: float(np.percentile(state.data[key], 50)) for key in ("without", "with")}
    state.figure("p50 without and with", " and ".join(f"{1e3 * p50[k]:.2f}" for k in p50), "ms")
    state.figure("p99 without and with", " and ".join(f"{1e3 * p99[k]:.2f}" for k in p99), "ms")
    ratio = p99["with"] / p99["without"]
    state.figure("ratio of the p99", ratio, "", GOAL)
    state.figure("half-open connections after a round", min(state.data["held"]), "")
    state.save()


async def _pair(service: Service, state: State) -> None:
    for key in ("without", "with"):
        halves = []
        if key == "with":
            for i in range(HALF_OPEN):
                reader, writer = await asyncio.open_connection("127.0.0.1", service.port)
                writer.write(_HALVES[i % len(_HALVES)])
                halves.append((reader, writer))
            await asyncio.sleep(0.3)
        connection, seconds = Connection(service.port), []
        for _ in range(REQUESTS):
            reply = await connection.ask(_WHOLE)
            seconds.append(reply.seconds)
            if reply.status != 200:
                state.fail(f"{key} them: {reply.status} {reply.broken}")
        connection.close()
        state.data[key] = [*state.data[key], *(round(s, 6) for s in seconds)][-40_000:]
        if key == "with":
            state.data["held"].append(sum(not reader.at_eof() for reader, _ in halves))
        for _, writer in halves:
            writer.transport.abort()
    await asyncio.sleep(0.2)
