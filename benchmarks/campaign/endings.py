"""Clients that go away and a service that is stopped: no work for nobody, and no answer lost."""

import asyncio
import json
import time

from .bodies import STEADY, slow
from .service import Service, runs
from .state import State
from .wire import Reply, ask, http

TITLE = "Clients that go away, a service that is stopped"
UNIT = "rounds"
SIZES = {"ci": 2, "campaign": 100}

#: Clients that go away in a round.
DISCONNECTS = 3

#: Goals, s: a solver whose client went away is gone; a service that is stopped has ended, after its last answer.
GONE, ENDED = 0.3, 2.0

#: Time limit of the request that is being solved when the service is stopped, s.
LIMIT = 1.5


def run(service: Service, size: int, seed: int, state: State) -> None:
    """Go away; then stop a service of one's own."""
    for key in ("gone", "ended", "unready", "codes"):
        state.data.setdefault(key, [])
    while state.done < size:
        asyncio.run(_disconnects(service, state))
        own = Service(service.folder / "stopped", **service.settings)
        own.start()
        try:
            asyncio.run(_stopped(own, state))
        finally:
            own.stop()
        state.done += 1
        state.save()
    gone, ended = max(state.data["gone"], default=None), max(state.data["ended"], default=None)
    state.figure("solver of a client that went away is gone after", gone, "s", GONE)
    state.figure("ended after its last answer", ended, "s", ENDED)
    codes = sorted(set(state.data["codes"]))
    state.figure("exit codes", ", ".join(map(str, codes)), goal="0", met=codes == [0])
    told = sorted({str(status) for status in state.data["unready"]})
    state.figure("/readyz while it stops", ", ".join(told), goal="503", met=told == ["503"])
    state.save()


async def _disconnects(service: Service, state: State) -> None:
    raw = http("POST", "/v1/trajectories", json.dumps(slow(20.0)).encode())
    for _ in range(DISCONNECTS):
        await asyncio.to_thread(service.settle)
        _, writer = await asyncio.open_connection("127.0.0.1", service.port)
        writer.write(raw)
        solver = await asyncio.to_thread(service.busy_solver)
        if solver is None:
            state.fail("no solver was seen at work")
            writer.transport.abort()
            continue
        writer.transport.abort()
        began = time.perf_counter()
        while runs(solver) and time.perf_counter() - began < 5.0:
            await asyncio.sleep(0.005)
        state.data["gone"].append(round(time.perf_counter() - began, 4))
        reply = Reply()
        for _ in range(100):
            reply = await ask(service.port, http("POST", "/v1/trajectories", json.dumps(STEADY).encode()))
            if reply.status == 200:
                break
            await asyncio.sleep(0.05)
        if reply.status != 200:
            state.fail(f"after a client went away a right request got {reply.status} {reply.body[:200]!r}")


async def _stopped(own: Service, state: State) -> None:
    """Stop it while it solves: a request that ends by its own limit, and one that is answered."""
    family = [*own.solvers()]
    long = http("POST", "/v1/trajectories", json.dumps(slow(LIMIT)).encode())
    short = http("POST", "/v1/comparisons", json.dumps({**_comparison(), "timeout": 10.0}).encode())
    tasks = [asyncio.create_task(ask(own.port, raw)) for raw in (long, short)]
    await asyncio.sleep(0.15)
    own.terminate()
    await asyncio.sleep(0.1)
    state.data["unready"].append((await ask(own.port, http("GET", "/readyz"))).status or "nobody answers")
    replies = await asyncio.gather(*tasks)
    answered = time.perf_counter()
    for name, reply, status in zip(("long", "short"), replies, (504, 200), strict=True):
        if reply.status != status:
            what = f"{reply.status or 'no answer'} {reply.broken} {reply.body[:200]!r}, not {status}"
            state.fail(f"stopped while it solved a {name} request: {what}")
    code = await asyncio.to_thread(own.wait, 30.0)
    state.data["codes"].append(-999 if code is None else code)
    state.data["ended"].append(round(time.perf_counter() - answered, 3))
    await asyncio.sleep(0.3)
    if any(runs(p) for p in family):
        state.fail("a solver outlived the service")
    if own.tracebacks():
        state.fail(f"{own.tracebacks()} tracebacks in the log: see {own.log}")


def _comparison() -> dict[str, object]:
    """Return a comparison that takes a solver some tenths of a second."""
    return {**{k: v for k, v in STEADY.items() if k not in ("method", "sampling")}, "methods": "all"}
