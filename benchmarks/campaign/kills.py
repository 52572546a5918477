"""Solvers killed while they solve: nothing is lost, nothing is wrong, and a new one is there within two seconds."""

import asyncio
import json
import random
import time
from contextlib import suppress

import psutil

from planner import CASES

from .bodies import SOLVED, STEADY
from .service import Service, spent
from .state import State
from .wire import Connection, ask, http

TITLE = "Solvers killed while they solve"
UNIT = "kills"
SIZES = {"ci": 20, "campaign": 1_000}

#: Kills from one save to the next.
CHUNK = 5

CLIENTS = 4

#: Seconds until all solvers work again.
GOAL = 2.0


def requests() -> list[bytes]:
    """Return plans that a solver makes."""
    bodies = [dict(CASES[name].request) for name in SOLVED] + [STEADY]
    return [http("POST", "/v1/trajectories", json.dumps(body).encode()) for body in bodies]


def run(service: Service, size: int, seed: int, state: State) -> None:
    """Kill and measure, while clients ask and compare."""
    for key in ("back", "missed"):
        state.data.setdefault(key, [])
    counts = state.data.setdefault("answers", {})
    while state.done < size:
        before = state.done
        asyncio.run(_chunk(service, min(CHUNK, size - state.done), random.Random(f"{seed}-{state.done}"), state))
        state.save()
        if state.done == before:
            state.fail("no solver could be killed while it was busy")
            break
    back = sorted(state.data["back"]) or [float("inf")]
    state.figure("kills of a busy solver", len(state.data["back"]))
    state.figure("answers meanwhile", ", ".join(f"{count} x {key}" for key, count in sorted(counts.items())))
    state.figure("capacity back, median", back[len(back) // 2], "s")
    state.figure("capacity back, latest", back[-1], "s", GOAL)
    state.save()


async def unharmed(service: Service, raws: list[bytes]) -> dict[bytes, bytes]:
    """Return the bytes of each request's answer while nothing else happens."""
    found = {}
    for raw in raws:
        reply = await ask(service.port, raw)
        assert reply.status == 200, f"{reply.status} {reply.body[:300]!r}"
        found[raw] = reply.body
    return found


async def _chunk(service: Service, kills: int, rng: random.Random, state: State) -> None:
    right = await unharmed(service, requests())
    counts, stopping = state.data["answers"], asyncio.Event()

    async def client() -> None:
        connection = Connection(service.port)
        while not stopping.is_set():
            raw = rng.choice(list(right))
            reply = await connection.ask(raw)
            counts[str(reply.status or reply.broken)] = counts.get(str(reply.status or reply.broken), 0) + 1
            if reply.status == 503 and "retry-after" in reply.headers:
                await asyncio.sleep(0.02)
            elif reply.status != 200:
                state.fail(f"{reply.status} {reply.broken} {reply.body[:200]!r}", raw)
            elif reply.body != right[raw]:
                state.fail("other bytes than unharmed", raw)
        connection.close()

    clients = [asyncio.create_task(client()) for _ in range(CLIENTS)]
    for _ in range(kills):
        await asyncio.sleep(rng.uniform(0.05, 0.3))
        took = await asyncio.to_thread(_kill, service)
        if took is not None:
            state.data["back"].append(round(took, 4))
            state.done += 1
            if took == float("inf"):
                state.fail("a solver that was killed was not replaced within 30 s")
    stopping.set()
    await asyncio.gather(*clients)


def _kill(service: Service) -> float | None:
    """Kill a busy solver and return the seconds until all solvers work; None if none was busy."""
    victim = service.busy_solver()
    if victim is None:
        return None
    with suppress(psutil.Error):
        victim.kill()
    began = time.perf_counter()
    first: dict[int, float] = {}
    while time.perf_counter() - began < 30.0:
        alive = {p.pid: spent(p) for p in service.solvers() if p.pid != victim.pid}
        for pid, seconds in alive.items():
            first.setdefault(pid, seconds)
        # each has computed since: the clients' work, for there is always some
        if sum(seconds - first[pid] >= 0.02 for pid, seconds in alive.items()) >= int(str(service.settings["workers"])):
            return time.perf_counter() - began
        time.sleep(0.01)
    return float("inf")
