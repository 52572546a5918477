"""Requests that are turned away for want of room: early, cheaply, and as problems like any other."""

import asyncio
import json
import logging

import ormsgpack
import pytest

from api.app import create_app
from api.errors import KINDS
from api.serving import make_server
from api.settings import Settings
from api.shedding import Door, Lanes, Ticket

QUICK = {"waypoints": [[0], [1]], "times": [0, 1], "method": "linear"}
SLOW = {"waypoints": [[0], [1]], "limits": {"velocity": 1, "acceleration": 1}}


def raw(body=SLOW, *headers, path="/v1/trajectories", verb="POST", length=None):
    content = body if isinstance(body, bytes) else json.dumps(body).encode()
    size = len(content) if length is None else length
    lines = [f"{verb} {path} HTTP/1.1", "Host: here", "content-type: application/json", f"Content-Length: {size}"]
    return "\r\n".join([*lines, *headers, "", ""]).encode("latin-1") + content


@pytest.fixture
def app():
    """A service without room: it has no solvers and lets nobody wait."""
    return create_app(Settings(queue=0, turns=0))


@pytest.fixture
def door(app):
    return Door(app.state.service)


def parsed(answer):
    head, _, body = answer.partition(b"\r\n\r\n")
    status, *lines = head.decode("latin-1").split("\r\n")
    return status, dict(line.split(": ", 1) for line in lines), json.loads(body)


def test_a_refusal_is_a_problem_with_id_and_retry_after(door):
    status, headers, document = parsed(door.ask(raw(SLOW, "X-Request-ID: job \\ 7")))
    assert status == "HTTP/1.1 503 Service Unavailable"
    assert headers["content-type"] == "application/problem+json" and int(headers["retry-after"]) >= 1
    assert document["request_id"] == headers["x-request-id"] == "job \\ 7"
    assert (document["status"], document["title"]) == (503, KINDS["overloaded"].title)
    assert (document["reason"], document["instance"]) == ("queue_full", "/v1/trajectories")
    made = parsed(door.ask(raw(QUICK, "Connection: keep-alive")))[2]
    assert made["reason"] == "loop_busy" and len(made["request_id"]) == 32


@pytest.mark.parametrize(
    "data",
    [
        raw(verb="GET"),
        raw(path="/v1/limits"),
        raw(path="/v1/trajectories/x"),
        raw(length=3),
        raw(length=10_000),
        raw(SLOW, "Content-Length: 5"),
        raw(SLOW, "Transfer-Encoding: chunked"),
        raw(SLOW, "Expect: 100-continue"),
        raw(SLOW, "Origin: https://elsewhere.org"),
        raw(SLOW, "Connection: close"),
        raw(SLOW, "X-Request-ID: a", "X-Request-ID: b"),
        raw(SLOW, " folded: header"),
        raw(SLOW) + raw(SLOW),
        raw(SLOW)[:-1],
        raw(SLOW)[:40],
        raw(SLOW).replace(b"HTTP/1.1", b"HTTP/1.0"),
        raw(SLOW).replace(b"\r\n", b"\n"),
        b"",
        b"\x16\x03\x01",
    ],
    ids=range(19),
)
def test_what_is_not_plain_goes_the_long_way(door, data):
    assert door.ask(data) is None


def test_only_the_full_lane_is_shut():
    for settings, shut, taken in ((Settings(queue=0), SLOW, QUICK), (Settings(queue=5, turns=0), QUICK, SLOW)):
        lanes = Lanes(create_app(settings).state.service)
        for written in (lambda body: json.dumps(body).encode(), lambda body: ormsgpack.packb(body)):
            assert lanes.full and lanes.refusal(lanes.lane(written(shut)))
            assert not lanes.refusal(lanes.lane(written(taken)))
    assert not Lanes(create_app(Settings(queue=1)).state.service).full


def test_what_is_turned_away_is_counted_and_told_once_a_second(app, door, caplog):
    with caplog.at_level(logging.WARNING, "waywright.api"):
        for _ in range(50):
            assert door.ask(raw())
    assert len(caplog.records) == 1
    text = asyncio.run(app.state.service.metrics.text()).decode()
    assert 'waywright_shed_total{reason="queue_full"} 50.0' in text
    assert 'waywright_requests_total{route="/v1/trajectories",status="503",verb="POST"} 50.0' in text


def test_those_under_way_count_before_the_lane_sees_them():
    state = create_app(Settings(workers=2, queue=1, turns=2)).state.service
    door = Door(state)
    for body, most in ((SLOW, 3), (QUICK, 3)):
        tickets = [door.ask(raw(body)) for _ in range(most)]
        assert all(isinstance(ticket, Ticket) for ticket in tickets)
        assert isinstance(door.ask(raw(body)), bytes)
        tickets[0].release()
        tickets[0].release()  # once is enough, twice does no harm
        assert isinstance(door.ask(raw(body)), Ticket) and isinstance(door.ask(raw(body)), bytes)


def test_over_a_connection_and_the_next_request_is_served(app):
    async def main():
        server = make_server(app, lifespan=False)
        server.config.load()
        loop = asyncio.get_running_loop()
        protocol = server.config.http_protocol_class
        listening = await loop.create_server(
            lambda: protocol(config=server.config, server_state=server.server_state, app_state={}), "127.0.0.1", 0
        )
        reader, writer = await asyncio.open_connection(*listening.sockets[0].getsockname())
        answers = []
        for data in (raw(), raw(QUICK), raw(SLOW, "Expect: 200-ok"), raw(b"", path="/v1/limits", verb="GET"), raw()):
            writer.write(data)
            head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), 5)
            size = int(next(line for line in head.lower().split(b"\r\n") if line.startswith(b"content-length"))[15:])
            answers.append((head.split()[1], json.loads(await reader.readexactly(size)).get("reason")))
        writer.close()
        listening.close()
        return answers

    full, busy = (b"503", "queue_full"), (b"503", "loop_busy")
    assert asyncio.run(main()) == [full, busy, full, (b"200", None), full]
