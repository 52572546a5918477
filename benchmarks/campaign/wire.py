"""HTTP/1.1 at the level of bytes: requests as bytes, and a connection that costs a load generator little."""

import asyncio
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import httptools

JSON = "application/json"

#: Seconds after which an answer counts as lost: more than the largest time limit of a request.
LOST = 75.0


@dataclass(frozen=True)
class Ask:
    """A request as bytes.

    Parameters
    ----------
    intact : bool
        Whether it is right as HTTP, so that an answer is owed; else the service may just close the connection.
    patient : bool
        Whether 503 or 504 is a right answer too.
    """

    raw: bytes
    verb: str = "POST"
    path: str = "/"
    intact: bool = True
    patient: bool = False


@dataclass
class Reply:
    """An answer, or why there was none: ``broken`` is reset, closed, garbage or late, else empty."""

    status: int = 0
    headers: dict[str, str] = field(default_factory=dict)
    body: bytes = b""
    seconds: float = 0.0
    broken: str = ""


def http(
    verb: str,
    path: str,
    body: bytes | None = None,
    headers: Mapping[str, str] | None = None,
    chunked: int = 0,
) -> bytes:
    """Return a request as bytes, its body in chunks of so many bytes where that is not 0."""
    lines = {"Host": "127.0.0.1", **({} if body is None else {"Content-Type": JSON}), **(headers or {})}
    if body is not None and chunked:
        lines["Transfer-Encoding"] = "chunked"
        parts = [body[i : i + chunked] for i in range(0, len(body), chunked)]
        body = b"".join(b"%x\r\n%s\r\n" % (len(part), part) for part in parts) + b"0\r\n\r\n"
    elif body is not None:
        lines.setdefault("Content-Length", str(len(body)))
    head = "".join(f"{name}: {value}\r\n" for name, value in lines.items())
    return f"{verb} {path} HTTP/1.1\r\n{head}\r\n".encode("latin-1", "replace") + (body or b"")


class Connection:
    """One connection, one request at a time; opened when it is needed, and again after it was closed."""

    def __init__(self, port: int) -> None:
        self.port = port
        self._line: _Line | None = None
        self._used = 0.0

    async def ask(self, raw: bytes, head: bool = False, patience: float = LOST, end: bool = False) -> Reply:
        """Send a request and return its answer.

        Parameters
        ----------
        head : bool
            The answer has no body whatever its headers say.
        end : bool
            Say that nothing will follow: for requests that are cut short.
        """
        idle = time.perf_counter() - self._used if self._line is not None and self._line.open else 0.0
        reply = await self._ask(raw, head, patience, end)
        if reply.broken in ("closed", "reset") and idle > 1.0 and not reply.status:
            reply = await self._ask(raw, head, patience, end)  # it had been closed for being idle
        return reply

    async def _ask(self, raw: bytes, head: bool, patience: float, end: bool) -> Reply:
        began = time.perf_counter()
        try:
            if self._line is None or not self._line.open:
                loop = asyncio.get_running_loop()
                _, self._line = await loop.create_connection(_Line, "127.0.0.1", self.port)
            reply = await self._line.ask(raw, head, patience, end)
        except OSError as error:
            reply = Reply(broken="reset" if isinstance(error, ConnectionResetError) else f"refused ({error})")
        self._used = time.perf_counter()
        reply.seconds = self._used - began
        if reply.broken or end or reply.headers.get("connection", "").lower() == "close":
            self.close()
        return reply

    def close(self) -> None:
        """Close it at once."""
        if self._line is not None:
            self._line.transport.abort()
            self._line = None


class _Line(asyncio.Protocol):
    """What one TCP connection says, parsed."""

    transport: Any

    def __init__(self) -> None:
        self._answer: asyncio.Future[None] | None = None
        self._reply = Reply()
        self._pieces: list[bytes] = []

    @property
    def open(self) -> bool:
        """Whether something can be sent."""
        return not self.transport.is_closing()

    async def ask(self, raw: bytes, head: bool, patience: float, end: bool) -> Reply:
        """Send a request and return its answer."""
        self._reply, self._pieces, self._head = Reply(), [], head
        self._answer = asyncio.get_running_loop().create_future()
        self._parser = httptools.HttpResponseParser(self)
        self.transport.write(raw)
        if end:
            with suppress(OSError, RuntimeError):
                self.transport.write_eof()
        try:
            await asyncio.wait_for(self._answer, patience)
        except TimeoutError:
            self._reply.broken = "late"
        return self._reply

    # -- called by asyncio -------------------------------------------------------------------------------------------

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the transport."""
        self.transport = transport

    def data_received(self, data: bytes) -> None:
        """Parse what came."""
        if self._answer is None or self._answer.done():
            return  # after the end of a broken request's answer, or the body of an answer to HEAD
        try:
            self._parser.feed_data(data)
        except httptools.HttpParserError:
            self._done("garbage")

    def connection_lost(self, exc: Exception | None) -> None:
        """Settle who waits."""
        self._done("closed" if exc is None else "reset")

    def _done(self, broken: str = "") -> None:
        if self._answer is not None and not self._answer.done():
            self._reply.broken = broken
            self._reply.body = b"".join(self._pieces)
            self._answer.set_result(None)

    # -- called by the parser ----------------------------------------------------------------------------------------

    def on_header(self, name: bytes, value: bytes) -> None:
        """Keep a header."""
        self._reply.headers[name.decode("latin-1").lower()] = value.decode("latin-1")

    def on_headers_complete(self) -> None:
        """Keep the status; an answer to HEAD is complete."""
        self._reply.status = self._parser.get_status_code()
        if self._head:
            self._done()

    def on_body(self, body: bytes) -> None:
        """Keep a piece of the body."""
        self._pieces.append(body)

    def on_message_complete(self) -> None:
        """Settle who waits, unless it is a 100: then an answer is still to come."""
        if self._reply.status == 100:
            self._reply.status = 0
        else:
            self._done()


async def ask(port: int, raw: bytes, **how: Any) -> Reply:
    """Send one request on a connection of its own."""
    connection = Connection(port)
    try:
        return await connection.ask(raw, **how)
    finally:
        connection.close()
