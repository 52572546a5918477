"""The same request gives the same bytes: from any process, alone or among others, before and after harm."""

import asyncio
import hashlib
import json
import random
import re
from contextlib import suppress

import psutil

from planner import CASES

from .bodies import Maker
from .fuzz import document
from .service import Service
from .state import State
from .wire import Ask, Connection, Reply, http

TITLE = "The same request gives the same bytes"
UNIT = "requests"
SIZES = {"ci": 50, "campaign": 5_000}

CHUNK = 25
CLIENTS = 3

FORMATS = (
    "application/json",
    "text/csv",
    "application/vnd.ros2.joint-trajectory+json",
    "application/msgpack",
    "application/x-npz",
    "application/vnd.apache.arrow.stream",
    "application/vnd.plotly+json",
)

#: What is different by right: when it was, how long it took, and which request it was.
_OWN = ("date", "server-timing", "x-request-id", "connection", "keep-alive", "traceparent")
_MILLISECONDS = re.compile(rb'"compute_ms":[-+0-9.eE]+')


def requests(document: dict, size: int, seed: int) -> list[Ask]:
    """Return all named cases in several formats, then random requests."""
    found = []
    for i, case in enumerate(CASES.values()):
        for accept in {FORMATS[0], FORMATS[1 + i % (len(FORMATS) - 1)]}:
            raw = http("POST", "/v1/trajectories", json.dumps(dict(case.request)).encode(), _headers(accept))
            found.append(Ask(raw, path="/v1/trajectories"))
    maker = Maker(document)
    for i in range(size):
        rng = random.Random(f"{seed}-{i}")
        path, body = maker.make(rng)
        raw = http("POST", path, json.dumps(body).encode(), _headers(rng.choice((*FORMATS[:1] * 4, *FORMATS))))
        found.append(Ask(raw, path=path))
    return found[:size]


def _headers(accept: str) -> dict[str, str]:
    return {"Accept": accept, "X-Request-ID": "same", "Content-Type": "application/json"}


def run(service: Service, size: int, seed: int, state: State) -> None:
    """Post each request to two services in many circumstances."""
    rounds = state.data.setdefault("rounds", {})
    with Service(service.folder / "second", **service.settings) as second:
        while state.done < size:
            todo = requests(asyncio.run(document(service)), size, seed)[state.done : state.done + CHUNK]
            if state.data.get("pid") == second.pid:
                second.restart()
            state.data["pid"] = second.pid
            asyncio.run(_chunk(service, second, todo, state, rounds))
            state.done += len(todo)
            state.save()
    state.figure("requests", state.done)
    state.figure("answers compared", sum(rounds.values()))
    state.figure("circumstances", ", ".join(f"{name}: {count}" for name, count in rounds.items()))
    state.figure("answers of 200", f"{state.data.get('answered', 0)} of {state.done} requests")
    state.save()


async def _chunk(service: Service, second: Service, todo: list[Ask], state: State, rounds: dict[str, int]) -> None:
    """Compare with what an idle service answers at first."""
    right: dict[bytes, str] = {}

    async def round_of(name: str, where: Service, clients: int = 1) -> None:
        waiting = iter(todo)

        async def client() -> None:
            connection = Connection(where.port)
            for asked in waiting:
                reply = await _settled(connection, asked.raw)
                rounds[name] = rounds.get(name, 0) + 1
                digest = fingerprint(reply)
                if right.setdefault(asked.raw, digest) != digest or reply.status == 500:
                    state.fail(f"{name}: {digest[:80]} instead of {right[asked.raw][:80]}", asked.raw)
                if name == "first" and reply.status == 200:
                    state.data["answered"] = state.data.get("answered", 0) + 1
            connection.close()

        await asyncio.gather(*(client() for _ in range(clients)))

    await round_of("first", service)
    await round_of("second process, just started", second)
    await asyncio.gather(round_of("among others", service, CLIENTS), round_of("among others", second, CLIENTS))
    for solver in service.solvers():
        with suppress(psutil.Error):
            solver.kill()
    await asyncio.sleep(0.5)
    await round_of("solvers killed", service)
    await round_of("second process, in use", second)


async def _settled(connection: Connection, raw: bytes) -> Reply:
    """Return an answer that is no refusal for want of solvers."""
    for _ in range(200):
        reply = await connection.ask(raw)
        if reply.status != 503:
            break
        await asyncio.sleep(0.05)
    return reply


def fingerprint(reply: Reply) -> str:
    """Return what must be the same: the status, the headers but a few, and the body but computing times."""
    body = _MILLISECONDS.sub(b'"compute_ms":0', reply.body)
    kept = {name: value for name, value in reply.headers.items() if name not in _OWN}
    if body != reply.body:
        kept.pop("content-length", None)
        body = body.replace(b" ", b"")
    told = json.dumps(sorted(kept.items())).encode()
    return f"{reply.status or reply.broken} {hashlib.sha256(told + body).hexdigest()} {len(body)} bytes {told.decode()}"
