"""Real sockets, hostile and slow: a server in a thread, without solvers."""

import asyncio
import json
import os
import re
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

import pytest
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from api.app import create_app
from api.errors import KINDS
from api.protocol import HEAD_BYTES, Connection
from api.serving import make_server
from api.settings import Caps, Settings

SHORT = Settings(caps=Caps(body_bytes=100_000), header_seconds=0.4, body_seconds=0.6, send_seconds=0.8)
LIMITS = b"GET /v1/limits HTTP/1.1\r\nHost: x\r\n\r\n"
POST = b"POST /v1/certificates HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"


@dataclass
class Running:
    port: int
    server: object

    def connect(self, timeout: float = 8.0, buffer: int = 0) -> socket.socket:
        connection = socket.socket()
        if buffer:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer)
        connection.settimeout(timeout)
        connection.connect(("127.0.0.1", self.port))
        return connection

    def ask(self, raw: bytes, timeout: float = 8.0) -> bytes:
        """Send bytes and return all that comes back until the service closes or ``timeout`` s pass."""
        with self.connect(timeout) as connection:
            with suppress(OSError):
                connection.sendall(raw)
            return rest(connection)

    def healthy(self) -> float:
        """Check that the service answers, and return the seconds it took."""
        began = time.perf_counter()
        with self.connect() as connection:
            connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")
            assert rest(connection).startswith(b"HTTP/1.1 200 ")
        return time.perf_counter() - began

    @property
    def open(self) -> int:
        return len(self.server.server_state.connections)


def rest(connection: socket.socket) -> bytes:
    found = bytearray()
    with suppress(OSError):
        while chunk := connection.recv(65536):
            found += chunk
    return bytes(found)


@contextmanager
def running(settings: Settings) -> Iterator[Running]:
    app = create_app(settings)

    @app.get("/test/stream")
    async def stream(request: Request) -> Response:
        async def pieces():
            for _ in range(300):
                yield b"x" * 100_000

        return StreamingResponse(pieces())

    @app.get("/test/large")
    async def large(request: Request) -> Response:
        return Response(b"x" * 30_000_000)

    @app.get("/test/slow")
    async def slow(request: Request) -> Response:
        await asyncio.sleep(1.0)
        return Response(b"done")

    server = make_server(app, lifespan=False)
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
        thread.start()
        while not server.started:
            time.sleep(0.01)
        yield Running(listening.getsockname()[1], server)
        server.should_exit = True
        thread.join(10)
        assert not thread.is_alive()


@pytest.fixture(scope="module")
def service() -> Iterator[Running]:
    with running(SHORT) as found:
        yield found


def statuses(raw: bytes) -> list[int]:
    return [int(code) for code in re.findall(rb"HTTP/1\.1 (\d{3}) ", raw)]


def test_uvicorn_has_what_the_connection_builds_on():
    """An upgrade of uvicorn that renames one of these would leave the guards without effect."""
    for name in (
        "connection_made",
        "data_received",
        "on_message_begin",
        "on_url",
        "on_header",
        "on_headers_complete",
        "on_body",
        "on_message_complete",
        "on_response_complete",
        "send_400_response",
    ):
        assert callable(getattr(HttpToolsProtocol, name)), name
    assert issubclass(Connection, HttpToolsProtocol)


HOSTILE = {
    "a header of 100 kB": b"GET /healthz HTTP/1.1\r\nHost: x\r\nX-Long: " + b"x" * 100_000 + b"\r\n\r\n",
    "a header without an end": b"GET /healthz HTTP/1.1\r\nHost: x\r\nX-Long: " + b"x" * 1_000_000,
    "10,000 headers": b"GET /healthz HTTP/1.1\r\nHost: x\r\n"
    + b"".join(b"X-%d: 1\r\n" % i for i in range(10_000))
    + b"\r\n",
    "a path of 100 kB": b"GET /" + b"x" * 100_000 + b" HTTP/1.1\r\nHost: x\r\n\r\n",
    "two lengths": POST + b"Content-Length: 2\r\nContent-Length: 3\r\n\r\n{}x",
    "two equal lengths": POST + b"Content-Length: 2\r\nContent-Length: 2\r\n\r\n{}",
    "length and chunks": POST
    + b"Content-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\nGET /smuggled HTTP/1.1\r\n\r\n",
    "chunks and length": POST + b"Transfer-Encoding: chunked\r\nContent-Length: 5\r\n\r\n0\r\n\r\n",
    "an unknown transfer encoding": POST + b"Transfer-Encoding: gzip, chunked2\r\n\r\n0\r\n\r\n",
    "a negative length": POST + b"Content-Length: -1\r\n\r\n",
    "a length beyond 64 bits": POST + b"Content-Length: 99999999999999999999999\r\n\r\n",
    "garbage for chunks": POST + b"Transfer-Encoding: chunked\r\n\r\nzzz\r\nnonsense",
    "a chunk beyond 64 bits": POST + b"Transfer-Encoding: chunked\r\n\r\nfffffffffffffffff\r\nx",
    "a chunk extension without an end": POST + b"Transfer-Encoding: chunked\r\n\r\n1;" + b"x" * 200_000,
    "a trailer without an end": POST + b"Transfer-Encoding: chunked\r\n\r\n0\r\nX: " + b"x" * 200_000,
    "HTTP/0.9": b"GET /\r\n",
    "HTTP/2": b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    "TLS": bytes.fromhex("16030100c2010000be0303") + os.urandom(190),
    "noise": os.urandom(5000),
    "empty lines": b"\r\n" * 100_000,
    "a folded header": b"GET /healthz HTTP/1.1\r\nHost: x\r\nX: a\r\n b\r\n\r\n",
    "a header without a colon": b"GET /healthz HTTP/1.1\r\nHost x\r\n\r\n",
    "a space before the colon": b"GET /healthz HTTP/1.1\r\nHost : x\r\n\r\n",
    "a zero in a header": b"GET /healthz HTTP/1.1\r\nHost: x\r\nX: a\0b\r\n\r\n",
    "CONNECT": b"CONNECT example.org:443 HTTP/1.1\r\nHost: x\r\n\r\n",
    "another's address": b"GET http://example.org/nothing HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n",
    "a broken address": b"GET http://[::1/ HTTP/1.1\r\nHost: x\r\n\r\n",
    "a star": b"OPTIONS * HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n",
    "a path that is not UTF-8": b"GET /%ff%fe HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n",
    "a raw path": b"GET /\xff\xfe HTTP/1.1\r\nHost: x\r\n\r\n",
    "an unknown verb": b"BREW / HTTP/1.1\r\nHost: x\r\n\r\n",
    "a WebSocket": LIMITS[:-2] + b"Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Key: x\r\n\r\n",
    "h2c": LIMITS[:-2] + b"Connection: Upgrade, HTTP2-Settings\r\nUpgrade: h2c\r\nHTTP2-Settings: AA\r\n\r\n",
}


@pytest.mark.parametrize("raw", HOSTILE.values(), ids=HOSTILE.keys())
def test_what_is_no_proper_request_is_refused_or_closed(service, raw):
    answer = service.ask(raw, timeout=1.0)
    codes = statuses(answer)
    if b"Upgrade: " not in raw:  # an offer to upgrade may be ignored
        assert all(400 <= code < 500 for code in codes), answer[:300]
    assert len(codes) <= 1 and b"Traceback" not in answer
    service.healthy()


def test_the_largest_headers_are_taken(service):
    path = b"/" + b"x" * (HEAD_BYTES - 1000)
    assert statuses(service.ask(b"GET " + path + b" HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")) == [404]


def test_a_lying_length(service):
    assert statuses(service.ask(POST + b"Content-Length: 100\r\n\r\n{}")) == [408]
    more = POST + b"Content-Length: 2\r\nConnection: close\r\n\r\n{}GET /v1/limits HTTP/1.1\r\n\r\n"
    assert statuses(service.ask(more)) == [422]


@pytest.mark.parametrize("path", [b"/v1/limits", b"/", b"/openapi.json", b"/nowhere", b"/v1/certificates"])
def test_head_is_get_without_the_content(service, path):
    asked = [verb + b" " + path + b" HTTP/1.1\r\nHost: x\r\nX-Request-ID: a\r\n" for verb in (b"HEAD", b"GET")]
    close = b"Connection: close\r\n\r\n"
    of_head, of_get = (service.ask(one + close).partition(b"\r\n\r\n") for one in asked)
    assert of_get[2] and not of_head[2]
    changing = re.compile(rb"(?im)^(date|server-timing|traceparent): .*$")
    assert changing.sub(b"", of_head[0]) == changing.sub(b"", of_get[0])
    # and the connection is as good as before
    both = service.ask(asked[0] + b"\r\n" + asked[1] + close)
    assert statuses(both) == statuses(of_get[0]) * 2


def test_pipelined_requests_are_answered_in_order(service):
    many = b"".join(b"GET /nowhere/%d HTTP/1.1\r\nHost: x\r\nX-Request-ID: %d\r\n\r\n" % (i, i) for i in range(50))
    last = LIMITS.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n")
    answer = service.ask(many + last)
    assert statuses(answer) == [404] * 50 + [200]
    assert [int(n) for n in re.findall(rb"x-request-id: (\d+)\r", answer.lower())][:50] == list(range(50))


# -- slow clients ----------------------------------------------------------------------------------------------------


def drip(connection: socket.socket, raw: bytes, pause: float, patience: float) -> float:
    """Send byte by byte until the other side closes; return the seconds that took."""
    began = time.perf_counter()
    connection.settimeout(pause)
    for i in range(len(raw)):
        with suppress(TimeoutError):
            try:
                connection.sendall(raw[i : i + 1])
                if not connection.recv(65536):
                    break
            except (ConnectionError, BrokenPipeError):
                break
        if time.perf_counter() - began > patience:
            break
    return time.perf_counter() - began


@pytest.mark.parametrize("begin", [b"", b"G", LIMITS[:-2], b"\r\n"])
def test_half_sent_headers_are_closed(service, begin):
    began = time.perf_counter()
    assert service.ask(begin) == b""
    assert 0.3 < time.perf_counter() - began < 2.5


@pytest.mark.parametrize("raw", [LIMITS[:30] + b"x" * 1000, b"\r\n" * 500], ids=["headers", "empty lines"])
def test_dripping_headers_are_closed(service, raw):
    with service.connect() as connection:
        assert 0.3 < drip(connection, raw, 0.05, 5.0) < 2.5


def test_half_headers_after_an_answer_are_closed(service):
    began = time.perf_counter()
    assert statuses(service.ask(LIMITS + LIMITS[:20])) == [200]
    assert 0.3 < time.perf_counter() - began < 2.5


@pytest.mark.parametrize("head", [b"Content-Length: 1000\r\n\r\n{", b"Transfer-Encoding: chunked\r\n\r\n1\r\n{\r\n"])
def test_a_stalled_body_is_too_slow(service, head):
    began = time.perf_counter()
    answer = service.ask(POST + head)
    assert 0.5 < time.perf_counter() - began < 2.5
    assert statuses(answer) == [408] and b"connection: close" in answer.lower()
    document = json.loads(answer.partition(b"\r\n\r\n")[2])
    assert document["type"] == "/errors/too_slow" and document["title"] == KINDS["too_slow"].title
    assert document["seconds"] == SHORT.body_seconds and document["request_id"]


def test_a_dripping_body_is_too_slow(service):
    with service.connect() as connection:
        connection.sendall(POST + b"Content-Length: 1000\r\n\r\n")
        assert 0.5 < drip(connection, b" " * 1000, 0.05, 6.0) < 2.5


def test_a_body_that_nobody_reads_is_not_waited_for(service):
    began = time.perf_counter()
    answer = service.ask(b"GET /v1/limits HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\nx")
    assert len(statuses(answer)) == 1
    assert time.perf_counter() - began < 6.0


def test_a_body_over_the_cap_is_heard_out(service):
    raw = b" " * 150_000
    answer = service.ask(POST + b"Content-Length: 150000\r\n\r\n" + raw)
    assert statuses(answer) == [413] and b"connection: close" in answer.lower()


def test_a_client_that_asks_before_it_sends(service):
    with service.connect() as connection:
        connection.sendall(POST + b"Content-Length: 2\r\nExpect: 100-continue\r\nConnection: close\r\n\r\n")
        assert connection.recv(100).startswith(b"HTTP/1.1 100 ")
        connection.sendall(b"{}")
        assert statuses(rest(connection)) == [422]


@pytest.mark.parametrize("path", [b"/test/stream", b"/test/large"])
def test_who_does_not_take_the_answer_is_cut(service, path):
    before = service.open
    with service.connect(buffer=4096) as connection:
        connection.sendall(b"GET " + path + b" HTTP/1.1\r\nHost: x\r\n\r\n")
        connection.recv(1000)
        began = time.perf_counter()
        while service.open > before and time.perf_counter() - began < 8:
            time.sleep(0.05)
        assert 0.5 < time.perf_counter() - began < 3.5
    service.healthy()


def test_who_takes_the_answer_slowly_gets_it(service):
    with service.connect(buffer=65536) as connection:
        connection.sendall(b"GET /test/large HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")
        size, began = 0, time.perf_counter()
        while chunk := connection.recv(2**20):
            size += len(chunk)
            if time.perf_counter() - began < 3.0:  # three times what may pass without progress
                time.sleep(0.1)
    assert size > 30_000_000 and time.perf_counter() - began > 2.5


def test_five_hundred_half_open_connections_hurt_nobody(service):
    alone = sorted(service.healthy() for _ in range(50))
    halves = [service.connect() for _ in range(500)]
    try:
        for half in halves:
            half.sendall(LIMITS[:25])
        beside = sorted(service.healthy() for _ in range(50))
        assert beside[25] < 3 * alone[25] + 0.02 and beside[-1] < 1.0
        time.sleep(1.5)
        assert service.open < 20
    finally:
        for half in halves:
            half.close()


def test_too_many_connections():
    with running(SHORT) as service:
        service.server.config.limits = type(service.server.config.limits)(5, 5, 5, 5, 3)
        held = [service.connect() for _ in range(3)]
        time.sleep(0.2)
        answer = service.ask(b"")
        assert statuses(answer) == [503] and b"retry-after: 1" in answer
        assert json.loads(answer.partition(b"\r\n\r\n")[2])["type"] == "/errors/overloaded"
        for connection in held:
            connection.close()
        time.sleep(0.2)
        service.healthy()


def test_a_stranger_cannot_choose_its_address():
    forwarded = b"GET /v1/limits HTTP/1.1\r\nHost: x\r\nX-Forwarded-For: 192.0.2.%d\r\nConnection: close\r\n\r\n"
    with running(Settings(rate="3/minute")) as service:
        assert [statuses(service.ask(forwarded % i)) for i in range(4)] == [[200]] * 3 + [[429]]
    with running(Settings(rate="3/minute", proxies="127.0.0.1")) as service:
        assert [statuses(service.ask(forwarded % i)) for i in range(4)] == [[200]] * 4


def test_a_refused_body_is_heard_out_as_far_as_the_cap(service):
    keys = "ann " + 64 * "0"
    long = POST + b"Content-Length: 50000000\r\n\r\n" + b" " * 150_000
    with running(Settings(caps=SHORT.caps, body_seconds=0.6, api_keys_hashed=keys)) as service:
        whole = service.ask(POST + b"Content-Length: 90000\r\n\r\n" + b" " * 90_000 + b"GET /healthz HTTP/1.0\r\n\r\n")
        assert statuses(whole) == [401, 200]  # all was read: the connection goes on
        for raw in (
            long,
            POST + b"Content-Length: 5\r\n\r\nx",
            POST + b"Content-Length: 5\r\nExpect: 100-continue\r\n\r\n",
        ):
            answer = service.ask(raw, timeout=4.0)
            assert statuses(answer) == [401] and b"connection: close" in answer.lower()


# -- stopping --------------------------------------------------------------------------------------------------------


def stopping(service: Running) -> tuple[list[int], list[int]]:
    """Tell the server to stop, and return what it answers to a look and to work once it has heard."""
    service.server.handle_exit(15, None)
    body = b"Content-Length: 2\r\nConnection: keep-alive\r\n\r\n{}"
    refused = service.ask(POST + body)
    assert b"connection: close" in refused.lower() and b"the service is stopping" in refused
    return statuses(service.ask(b"GET /readyz HTTP/1.0\r\n\r\n")), statuses(refused)


def test_what_has_begun_is_finished():
    with running(SHORT) as service, service.connect() as slow:
        slow.sendall(b"GET /test/slow HTTP/1.1\r\nHost: x\r\n\r\n")
        time.sleep(0.2)
        assert stopping(service) == ([503], [503])
        answer = rest(slow)
        assert statuses(answer) == [200] and answer.endswith(b"done")
        time.sleep(0.5)
        assert service.server.should_exit and not service.server.cut_short


def test_an_answer_on_its_way_is_finished():
    with running(SHORT) as service, service.connect() as slow:
        slow.sendall(b"GET /test/stream HTTP/1.1\r\nHost: x\r\n\r\n")
        slow.recv(1000)
        assert stopping(service) == ([503], [503])
        answer = rest(slow)
        assert len(answer) > 300 * 100_000 - 1000 and answer.endswith(b"0\r\n\r\n")
    assert not service.server.cut_short


@pytest.mark.parametrize("second", [False, True])
def test_the_end_comes_at_the_latest_in_time_or_at_the_second_signal(second):
    settings = Settings(drain_seconds=60.0 if second else 0.3)
    with running(settings) as service, service.connect() as slow:
        slow.sendall(b"GET /test/slow HTTP/1.1\r\nHost: x\r\n\r\n" + b"GET /test/slow HTTP/1.1\r\nHost: x\r\n\r\n" * 20)
        time.sleep(0.2)
        began = time.perf_counter()
        service.server.handle_exit(15, None)
        if second:
            service.server.handle_exit(15, None)
        rest(slow)
        assert time.perf_counter() - began < 3.0
    assert service.server.cut_short == second
