"""Ten times more than the service can do: what it takes it does in time, the rest it refuses at once."""

import asyncio
import json
import time
from typing import Any

import numpy as np
import psutil

from .bodies import QUICK, STEADY
from .service import Service, spent
from .state import State
from .wire import Connection, Reply, http

TITLE = "Overload, ten times the capacity"
UNIT = "s"
SIZES = {"ci": 10, "campaign": 600}

#: Seconds of overload from one save to the next.
CHUNK = 10

TIMES = 10.0

#: Goals: latency of what is taken over the unloaded median, share of the peak, seconds to a refusal and to recovery.
LATENCY, GOODPUT, REFUSAL, RECOVERY = 6.0, 0.8, 0.05, 1.0

#: Connections at most; one that is due when all are busy is counted as not offered.
CONNECTIONS = 400

LANES: dict[str, dict[str, Any]] = {"solver": STEADY, "event loop": QUICK}


def run(service: Service, size: int, seed: int, state: State) -> None:
    """Overload each lane, chunk after chunk; only that of the solvers has goals."""
    chunks: dict[str, list[dict[str, float]]] = state.data.setdefault("chunks", {lane: [] for lane in LANES})
    while state.done < size:
        seconds = min(CHUNK, size - state.done)
        for lane, body in LANES.items():
            raw = http("POST", "/v1/trajectories", json.dumps(body).encode())
            chunks[lane].append(asyncio.run(_overload(service, raw, seconds if lane == "solver" else 4, state)))
        state.done += seconds
        state.save()
    for lane, rows in chunks.items():
        middle = {key: float(np.median([row[key] for row in rows])) for key in rows[0]}
        goals = lane == "solver"

        def figure(name: str, value: float, unit: str, most: float, goals: bool = goals, lane: str = lane) -> None:
            state.figure(f"{lane}: {name}", value, unit, most if goals else None)

        state.figure(f"{lane}: capacity", middle["capacity"], "1/s")
        state.figure(f"{lane}: offered", middle["offered"], "1/s")
        state.figure(f"{lane}: unloaded p50", 1e3 * middle["unloaded"], "ms")
        figure("p50 of what was taken / unloaded", middle["p50"] / middle["unloaded"], "", LATENCY)
        figure("p99 of what was taken / unloaded", middle["p99"] / middle["unloaded"], "", LATENCY)
        figure("capacity / goodput", middle["capacity"] / max(middle["goodput"], 1e-9), "", 1 / GOODPUT)
        figure("p99 of refusals", middle["refusal"], "s", REFUSAL)
        figure("recovery", middle["recovery"], "s", RECOVERY)
        shares = f"{middle['service']:.2f} and {middle['generator']:.2f}"
        state.figure(f"{lane}: shares of a hardware thread that service and generator had", shares)
        state.figure(f"{lane}: the service's own computing time per request, taken or refused", middle["cost"], "ms")
        state.figure(f"{lane}: refused", sum(row["refused"] for row in rows), "requests")
    state.save()


async def _overload(service: Service, raw: bytes, seconds: float, state: State) -> dict[str, float]:
    unloaded = [reply.seconds for _, reply in await _closed(service.port, raw, 1, 1.5)]
    best = await _closed(service.port, raw, 2 * int(service.settings["workers"]), 3.0)  # type: ignore[call-overload]
    capacity = sum(reply.status == 200 for _, reply in best) / 3.0
    clocks, wall = _clocks(service), time.perf_counter()
    found, ended = await _open(service.port, raw, TIMES * capacity, seconds)
    clock = [b - a for a, b in zip(clocks, _clocks(service), strict=True)]
    wall = time.perf_counter() - wall
    recovered = await _recovery(service.port, raw, ended, 2 * float(np.median(unloaded)))
    taken = [waited for waited, reply in found if reply.status == 200]
    refused = [waited for waited, reply in found if reply.status == 503]
    for _, reply in found:
        if reply.status not in (200, 503) or (reply.status == 503 and "retry-after" not in reply.headers):
            state.fail(f"under overload: {reply.status} {reply.broken} {reply.body[:200]!r}", raw)
    return {
        "capacity": capacity,
        "offered": len(found) / seconds,
        "unloaded": float(np.median(unloaded)),
        "p50": float(np.percentile(taken or [np.inf], 50)),
        "p99": float(np.percentile(taken or [np.inf], 99)),
        "goodput": len(taken) / seconds,
        "refused": len(refused),
        "refusal": float(np.percentile(refused or [0.0], 99)),
        "recovery": recovered,
        "service": clock[0] / wall,
        "generator": clock[1] / wall,
        "cost": 1e3 * clock[0] / max(len(found), 1),
    }


def _clocks(service: Service) -> tuple[float, float]:
    """Return the computing time of the service's own process and of this one, s: who of them had no more to give."""
    return spent(psutil.Process(service.pid)), time.process_time()


async def _closed(port: int, raw: bytes, clients: int, seconds: float) -> list[tuple[float, Reply]]:
    """Return what clients get that ask again as soon as they are answered."""
    until = time.perf_counter() + seconds
    found: list[tuple[float, Reply]] = []

    async def client() -> None:
        connection = Connection(port)
        while time.perf_counter() < until:
            reply = await connection.ask(raw)
            found.append((reply.seconds, reply))
        connection.close()

    await asyncio.gather(*(client() for _ in range(clients)))
    return found


async def _open(port: int, raw: bytes, rate: float, seconds: float) -> tuple[list[tuple[float, Reply]], float]:
    """Return what requests get that come at a rate whatever becomes of those before, and when the last was sent.

    A request waits from the moment when it was due.
    """
    free, made = [Connection(port) for _ in range(CONNECTIONS)], 0
    found: list[tuple[float, Reply]] = []
    tasks: set[asyncio.Task[None]] = set()
    began = time.perf_counter()

    async def one(due: float, connection: Connection) -> None:
        reply = await connection.ask(raw)
        reply.body = reply.body[:200]
        found.append((time.perf_counter() - due, reply))
        free.append(connection)

    while (now := time.perf_counter() - began) < seconds:
        while made < now * rate:
            if free:
                task = asyncio.create_task(one(began + made / rate, free.pop()))
                tasks.add(task)
                task.add_done_callback(tasks.discard)
            made += 1
        await asyncio.sleep(0.002)
    ended = time.perf_counter()
    await asyncio.gather(*tasks)
    for connection in free:
        connection.close()
    return found, ended


async def _recovery(port: int, raw: bytes, since: float, most: float) -> float:
    """Return the seconds until five answers in a row have a median below ``most``."""
    connection, last = Connection(port), []
    while time.perf_counter() - since < 30.0:
        began = time.perf_counter()
        reply = await connection.ask(raw)
        last = [*last[-4:], (began, reply.seconds if reply.status == 200 else np.inf)]
        if len(last) == 5 and float(np.median([s for _, s in last])) < most:
            break
        if reply.status == 503:
            await asyncio.sleep(0.01)
    connection.close()
    return max(last[0][0] - since, 0.0)
