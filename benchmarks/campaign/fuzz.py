"""Requests that are bent at random: whatever comes, an answer of the contract, and never a 500."""

import asyncio
import os
import random
import re
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import orjson

from .bodies import Maker
from .mutate import Bender
from .service import ROOT, Service
from .state import State
from .verdict import Verdict
from .wire import Ask, Connection, ask, http

TITLE = "Bent requests"
UNIT = "requests"
SIZES = {"ci": 5_000, "campaign": 1_000_000}

#: Requests from one save to the next.
CHUNK = 2_000

#: Connections that send at the same time, and how often they try again where the service is busy.
CONNECTIONS = 8
TRIES = 200

#: Of the requests, how many are bent in their tree; the others in their bytes, which is cheaper.
STRUCTURED = 0.3

#: Cases of schemathesis for each operation; few, for it is slow.
EXAMPLES = {"ci": 20, "campaign": 1_000}


async def document(service: Service) -> dict:
    """Return the service's OpenAPI document."""
    reply = await ask(service.port, http("GET", "/openapi.json"))
    return orjson.loads(reply.body)


def make(bender: Bender, seed: int, index: int) -> Ask:
    """Return the request of an index: the seed and the index are the whole recipe."""
    rng = random.Random(f"{seed}-{index}")
    return bender.structured(rng) if rng.random() < STRUCTURED else bender.raw(rng)


def run(service: Service, size: int, seed: int, state: State) -> None:
    """Send until so many were sent, and note what was wrong."""
    counts = Counter(state.data.get("statuses", {}))
    lanes: list[float] = state.data.setdefault("seconds", [])
    while state.done < size:
        began, todo = time.perf_counter(), min(CHUNK, size - state.done)
        counts += asyncio.run(_chunk(service, range(state.done, state.done + todo), seed, state))
        lanes.append(round(time.perf_counter() - began, 2))
        state.done += todo
        state.data["statuses"] = dict(sorted(counts.items()))
        service.tracebacks()
        if not service.alive:
            state.fail("the service ended")
            service.restart()
        state.save()
    rate = size / max(sum(lanes), 1e-9)
    state.figure("statuses", ", ".join(f"{count} x {status}" for status, count in sorted(counts.items())))
    state.figure("requests per second", round(rate), "1/s")
    state.figure("rejects per second", round(asyncio.run(_rejects(service, seed))), "1/s", goal="> 1000")
    if "schemathesis" not in state.data:
        state.data["schemathesis"] = _schemathesis(service, seed, state)
    state.figure("schemathesis", state.data["schemathesis"])
    state.figure("tracebacks in the log", service.tracebacks(), most=1)
    state.save()


async def _chunk(service: Service, indices: range, seed: int, state: State) -> Counter[str]:
    described = await document(service)
    bender, verdict = Bender(Maker(described)), Verdict(described)
    counts: Counter[str] = Counter()
    waiting = iter(indices)

    async def client() -> None:
        connection = Connection(service.port)
        for index in waiting:
            asked = make(bender, seed, index)
            for _ in range(TRIES):
                reply = await connection.ask(asked.raw, head=asked.verb == "HEAD", end=not asked.intact)
                if reply.status != 503 or verdict.faults(asked, reply):
                    break
                counts["503, tried again"] += 1
                await asyncio.sleep(0.02)
            counts[str(reply.status or reply.broken)] += 1
            for fault in verdict.faults(asked, reply):
                state.fail(fault, asked.raw, seed=seed, index=index)
        connection.close()

    await asyncio.gather(*(client() for _ in range(CONNECTIONS)))
    return counts


async def _rejects(service: Service, seed: int, count: int = 3_000) -> float:
    """Return how many bodies that are not JSON are refused in a second: the least that a request can cost."""
    rng = random.Random(seed)
    raws = [http("POST", "/v1/trajectories", rng.randbytes(50)) for _ in range(50)]
    began = time.perf_counter()

    async def client() -> None:
        connection = Connection(service.port)
        for i in range(count // 8):
            await connection.ask(raws[i % len(raws)])
        connection.close()

    await asyncio.gather(*(client() for _ in range(8)))
    return count / (time.perf_counter() - began)


#: What the contract asks for and schemathesis would call a failure: fields that are right alone but not together are
#: refused (422), unknown methods are 404s, and TRACE is the server's own business.
_EXCLUDED = "positive_data_acceptance,negative_data_rejection,missing_required_header,unsupported_method"


#: Which 5xx are right.
_CONFIG = Path(__file__).with_name("schemathesis.toml")


def _schemathesis(service: Service, seed: int, state: State) -> str:
    """Run schemathesis on the service's own document; return its summary."""
    examples = EXAMPLES["ci" if state.size < SIZES["campaign"] else "campaign"]
    command = [sys.executable, "-m", "schemathesis.cli", "--config-file", str(_CONFIG), "run"]
    command += [f"{service.url}/openapi.json"]
    command += ["--max-examples", str(examples), "--seed", str(seed), "--exclude-checks", _EXCLUDED]
    command += ["--request-timeout", "70", "--no-color", "--phases", "examples,fuzzing"]
    told = {**os.environ, "PYTHONPATH": str(ROOT), "SCHEMATHESIS_HOOKS": "benchmarks.campaign.hooks"}
    try:
        done = subprocess.run(
            command, cwd=state.folder, env=told, capture_output=True, text=True, timeout=60 + 20 * examples
        )
    except subprocess.TimeoutExpired:
        return "stopped: it took too long"
    said = done.stdout + done.stderr
    log = state.folder / "schemathesis.txt"
    log.write_text(said, encoding="utf-8")
    if done.returncode:
        state.fail(f"schemathesis, exit code {done.returncode}: see {log}", seed=seed)
    found = re.search(r"(\d+) generated.*", said)
    return found[0][:100] if found else said.strip().splitlines()[-1][:100] if said.strip() else "said nothing"
