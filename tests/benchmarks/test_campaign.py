"""The reliability campaigns at a small size: goals are met, and a run that was killed goes on."""

import asyncio
import json
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from benchmarks.campaign import memory, report
from benchmarks.campaign.bodies import Maker
from benchmarks.campaign.mutate import Bender
from benchmarks.campaign.state import State
from benchmarks.campaign.verdict import Verdict
from benchmarks.campaign.wire import Ask, Connection, Reply, http

ROOT = Path(__file__).parents[2]

#: How much looser: a machine that does nothing else keeps all goals.
LOOSER = 10

#: Figures that other work on the machine can spoil: told in the report, and held to a looser bound here.
NOISY = {
    "hostile": {"slowest answer, median"},
    "half_open": {"ratio of the p99"},
    "memory": {"service, MB per 100,000 requests"},
    "overload": {
        "solver: p50 of what was taken / unloaded",
        "solver: p99 of what was taken / unloaded",
        "solver: capacity / goodput",
        "solver: p99 of refusals",
        "solver: recovery",
    },
    "kills": {"capacity back, latest"},
    "hangs": {
        "stopped solvers: 504 after the limit",
        "stopped solvers: next solve done after the limit",
        "native code over the limit: answer",
        "the same, limit in a large body: answer",
    },
    "endings": {"solver of a client that went away is gone after", "ended after its last answer"},
}

NAMES = ("hostile", "fuzz", "memory", "half_open", "overload", "kills", "hangs", "same_bytes", "endings")


@pytest.fixture(scope="module")
def document():
    """The service's own description, without starting it."""
    from api.app import create_app

    return create_app().openapi()


def test_a_request_depends_on_its_seed_only(document):
    bender = Bender(Maker(document))
    for make in (bender.raw, bender.structured):
        for seed in range(200):
            assert make(random.Random(seed)) == make(random.Random(seed))


def test_a_killed_run_goes_on_where_it_was(tmp_path):
    state = State.open("fuzz", 100, 1, tmp_path)
    state.done, state.data["x"] = 40, [1]
    state.fail("wrong", b"raw", seed=1)
    state.figure("some", 1.5, "s", 2)
    state.save()
    again = State.open("fuzz", 100, 1, tmp_path)
    assert (again.done, again.data, again.failed) == (40, {"x": [1]}, 1)
    assert again.figures == state.figures and not again.complete and not again.good
    assert Path(again.failures[0]["replay"]).read_bytes() == b"raw"
    assert State.open("fuzz", 200, 1, tmp_path).done == 0
    assert State.open("fuzz", 100, 1, tmp_path, fresh=True).done == 0
    told = report.write(tmp_path).read_text(encoding="utf-8")
    assert "40 so far" in told and "wrong" in told and "| some | 1.5 s | < 2 | yes |" in told


def test_a_slope_is_told_per_hundred_thousand_requests():
    points = [[i, 100 + 2e-5 * i, 50.0] for i in range(0, 10_000, 500)]
    assert memory.slope(points, 1) == pytest.approx(2.0)
    assert memory.slope(points, 2) == pytest.approx(0.0, abs=1e-9)


def _problem(**changes):
    tree = {"type": "/errors/not_found", "title": "There is nothing here", "status": 404, "detail": "x"}
    return json.dumps({**tree, "request_id": "a", **changes}).encode()


HEADERS = {"content-type": "application/problem+json", "x-request-id": "a"}


@pytest.mark.parametrize(
    ("reply", "fault"),
    [
        (Reply(404, HEADERS, _problem()), ""),
        (Reply(404, HEADERS, _problem(status=400)), "status"),
        (Reply(404, HEADERS, _problem(request_id="b")), "request_id"),
        (Reply(404, HEADERS, _problem(detail="x" * 9000)), "bytes"),
        (Reply(404, {**HEADERS, "content-type": "text/plain"}, b"x"), "Content-Type"),
        (Reply(404, {"content-type": "application/problem+json"}, _problem()), "X-Request-ID"),
        (Reply(500, HEADERS, _problem(status=500, type="/errors/internal", title="Unexpected failure")), "status 500"),
        (Reply(200, {"content-type": "application/json", "x-request-id": "a"}, b'{"status":"ok"}'), ""),
        (Reply(200, {"content-type": "application/json", "x-request-id": "a"}, b'{"status":NaN}'), "JSONDecodeError"),
        (Reply(200, {"content-type": "application/json", "x-request-id": "a"}, b'{"x":1}'), "ValidationError"),
        (Reply(200, {"content-type": "text/csv", "x-request-id": "a"}, b"time,a\n0,1\n1\n"), "ragged"),
        (Reply(broken="reset"), "reset"),
    ],
)
def test_wrong_answers_are_seen(document, reply, fault):
    found = Verdict(document).faults(Ask(http("GET", "/healthz"), "GET", "/healthz"), reply)
    assert bool(found) == bool(fault) and (not fault or any(fault in text for text in found)), found


def test_answers_are_read_whole():
    """In pieces, in chunks, one after the other, and where the connection ends before they do."""
    answers = [
        b"HTTP/1.1 200 OK\r\nContent-Length: 3\r\n\r\nabc",
        b"HTTP/1.1 100 Continue\r\n\r\nHTTP/1.1 201 Created\r\nTransfer-Encoding: chunked\r\n\r\n"
        b"2\r\nab\r\n1\r\nc\r\n0\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nContent-Length: 30\r\n\r\nabc",
    ]

    async def serve(reader, writer):
        for answer in answers:
            await reader.readuntil(b"\r\n\r\n")
            for i in range(0, len(answer), 7):
                writer.write(answer[i : i + 7])
                await writer.drain()
                await asyncio.sleep(0.001)
        writer.close()

    async def run():
        async with await asyncio.start_server(serve, "127.0.0.1", 0) as server:
            connection = Connection(server.sockets[0].getsockname()[1])
            return [await connection.ask(http("GET", "/")) for _ in answers]

    found = asyncio.run(run())
    assert [(r.status, r.body, r.broken) for r in found[:2]] == [(200, b"abc", ""), (201, b"abc", "")]
    assert found[2].broken == "closed"


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """All campaigns in one process of their own; the first one is interrupted as hard as can be."""
    folder = tmp_path_factory.mktemp("campaign")
    command = [sys.executable, "-m", "benchmarks.campaign", "--size", "ci", "--out", str(folder)]
    first = subprocess.Popen([*command, "hostile"], cwd=ROOT, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    kept = folder / "hostile.json"
    until = time.monotonic() + 300
    while not kept.exists() and first.poll() is None and time.monotonic() < until:
        time.sleep(0.05)
    first.send_signal(signal.SIGKILL)
    first.wait()
    before = json.loads(kept.read_text(encoding="utf-8"))["done"]
    done = subprocess.run([*command, *NAMES], cwd=ROOT, capture_output=True, text=True, timeout=900)
    assert (folder / "report.md").exists(), done.stderr
    assert f"hostile: {before} of" in done.stderr and before > 0
    states = {name: json.loads((folder / f"{name}.json").read_text(encoding="utf-8")) for name in NAMES}
    print((folder / "report.md").read_text(encoding="utf-8"))
    return states


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_campaign_runs_to_its_end_without_a_failure(ran, name):
    state = ran[name]
    assert state["done"] >= state["size"]
    assert state["failures"] == []
    missed = {key: figure for key, figure in state["figures"].items() if figure["met"] is False}
    assert set(missed) <= NOISY.get(name, set())
    assert {key: f["value"] for key, f in missed.items() if f["value"] > LOOSER * f["most"]} == {}
