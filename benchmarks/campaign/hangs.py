"""Solvers that hang: their requests end as timeouts, and their places are free soon after."""

import asyncio
import json
import signal
import time
from contextlib import suppress

import psutil

from .bodies import STEADY, slow
from .service import Service, runs, spent
from .state import State
from .wire import Reply, ask, http

TITLE = "Solvers that hang"
UNIT = "rounds"
SIZES = {"ci": 10, "campaign": 500}

#: Time limit of the requests, s, and what may be added until the client knows and the place is free.
LIMIT, GRACE = 0.5, 0.25

#: How long may be waited until all solvers are seen at work, s.
SEEN = 0.4


def run(service: Service, size: int, seed: int, state: State) -> None:
    """Stop all solvers at work; then let native code run over a limit."""
    for key in ("told", "free", "overrun", "overrun large"):
        state.data.setdefault(key, [])
    while state.done < size:
        asyncio.run(_stopped(service, state))
        asyncio.run(_overrun(service, state))
        state.done += 1
        state.save()
    names = {
        "told": "stopped solvers: 504 after the limit",
        "free": "stopped solvers: next solve done after the limit",
        "overrun": "native code over the limit: answer",
        "overrun large": "the same, limit in a large body: answer",
    }
    for key, name in names.items():
        worst = max(state.data[key], default=None)
        state.figure(name, worst, "s", GRACE)
    state.save()


async def _stopped(service: Service, state: State) -> None:
    """Send a long solve to each solver, stop them all, and see when a further request is answered."""
    workers = int(str(service.settings["workers"]))
    await asyncio.to_thread(service.settle)
    steady = http("POST", "/v1/trajectories", json.dumps(STEADY).encode())
    usual = min([(await _asked(service, steady)).seconds for _ in range(3)])
    raw = http("POST", "/v1/trajectories", json.dumps(slow(LIMIT)).encode())
    before = {p.pid: spent(p) for p in service.solvers()}
    began = time.perf_counter()
    tasks = [asyncio.create_task(ask(service.port, raw)) for _ in range(workers)]
    victims: list[psutil.Process] = []
    while len(victims) < workers and time.perf_counter() - began < SEEN:
        await asyncio.sleep(0.03)
        # a spare solver, where there is one, has nothing to do and is left alone
        victims = [p for p in service.solvers() if spent(p) - before.get(p.pid, 0.0) >= 0.02]
    if len(victims) < workers:
        state.fail(f"only {len(victims)} of {workers} solvers were seen at work")
    for victim in victims:
        with suppress(psutil.Error):
            victim.send_signal(signal.SIGSTOP)
    further = await ask(service.port, steady)
    free = time.perf_counter() - began
    replies = await asyncio.gather(*tasks)
    for reply in replies:
        if reply.status != 504:
            state.fail(f"a stopped solver's request got {reply.status} {reply.broken} {reply.body[:200]!r}", raw)
    if further.status != 200:
        state.fail(f"after stopped solvers, a right request got {further.status} {further.body[:200]!r}", steady)
    state.data["told"].append(round(max(reply.seconds for reply in replies) - LIMIT, 4))
    state.data["free"].append(round(max(free - usual, 0.0) - LIMIT, 4))
    for _ in range(100):
        if not any(runs(victim) for victim in victims):
            break
        await asyncio.sleep(0.05)
    else:
        state.fail("a stopped solver is still there five seconds later")


async def _overrun(service: Service, state: State) -> None:
    """Ask for what keeps native code busy for far longer than the limit, in a small body and in a large one."""
    limit = 0.2
    body = slow(limit)
    spaced = json.dumps(body, indent=500)  # too many bytes to be read on the event loop
    for key, text in (("overrun", json.dumps(body)), ("overrun large", spaced)):
        raw = http("POST", "/v1/trajectories", text.encode())
        reply = await _asked(service, raw)
        if reply.status != 504:
            state.fail(f"{key}: {reply.status} {reply.broken} {reply.body[:200]!r}", raw)
        state.data[key].append(round(reply.seconds - limit, 4))


async def _asked(service: Service, raw: bytes) -> Reply:
    """Return the answer of an idle service: while a solver is being replaced, it is asked again."""
    for _ in range(100):
        reply = await ask(service.port, raw)
        if reply.status != 503 or b"crashed" in reply.body:
            break
        await asyncio.sleep(0.05)
    return reply
