"""Connections that lose patience: uvicorn's protocol on httptools, with time limits and a cap on headers.

uvicorn itself waits without an end for the rest of a request's headers, and for a client that takes its answer. The
server looks at all connections a few times a second (``Connection.look``): no timers, tasks or threads of their own.
"""

import asyncio
import re
import struct
from dataclasses import dataclass
from typing import Any

import uvicorn
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from .shedding import TICKET, Door, Ticket

try:
    import fcntl
    import termios
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

#: Bytes of a request's line and headers, and what one header counts besides its own length.
HEAD_BYTES = 65_536
HEADER_BYTES = 32

#: Seconds after its time at which a body that the service does not read ends the connection.
MARGIN = 2.0

#: An offer to go on in another protocol, as clients make that know HTTP/2. It is not taken up, and the parser, which
#: would drop the body that follows, does not see it.
_UPGRADE = re.compile(rb"\A([A-Z]+ [^\r\n]*\r\n(?:[^\r\n]+\r\n)*?)upgrade:", re.IGNORECASE)

_HEAD, _BODY, _DONE = "head", "body", "done"

_FULL = (
    b"HTTP/1.1 503 Service Unavailable\r\ncontent-type: application/problem+json\r\nretry-after: 1\r\n"
    b"connection: close\r\ncontent-length: %d\r\n\r\n%s"
)
_FULL_BODY = (
    b'{"type":"/errors/overloaded","title":"The service cannot take this now","status":503,'
    b'"detail":"too many connections are open"}'
)


@dataclass(frozen=True)
class Limits:
    """Seconds for headers, for a body, without any of the answer taken, and without a request; connections."""

    header: float
    body: float
    send: float
    idle: float
    connections: int


class Config(uvicorn.Config):
    """uvicorn's configuration, the limits of its connections, and the door that is shut while there is no room."""

    limits: Limits
    door: Door


class _TooLarge(Exception):
    """The headers are over the cap; the parser stops."""


class Connection(HttpToolsProtocol):
    """A connection, which knows since when it waits for what."""

    def __init__(
        self,
        config: uvicorn.Config,
        server_state: Any,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, app_state, _loop)
        assert isinstance(config, Config)
        self.limits, self.door = config.limits, config.door
        self._between = True  # nothing has come of a request that is not there in full
        self._ticket: Ticket | None = None
        self._phase = _HEAD
        self._since = self._moved = self.loop.time()
        self._unsent = 0
        self._head = 0
        self._unparsed = 0
        self._parsed = False

    # -- what the server asks ----------------------------------------------------------------------------------------

    def look(self, now: float) -> None:
        """End the connection if the client has had its time."""
        unsent = self.transport.get_write_buffer_size()
        if unsent:
            unsent += self._in_flight()
        if unsent != self._unsent or not unsent:
            self._unsent, self._moved = unsent, now
        if now - self._moved > self.limits.send:
            self.transport.abort()  # closing would wait for the client, too
        elif not self.transport.is_closing() and self._overdue(now):
            self.transport.close()

    def _in_flight(self) -> int:
        """Return the bytes that the kernel holds; it asks for more only once a good part of them is gone."""
        if fcntl is None:
            return 0
        try:
            held = fcntl.ioctl(self.transport.get_extra_info("socket").fileno(), termios.TIOCOUTQ, bytes(4))
        except (OSError, ValueError):  # not that kind of socket, or closed
            return 0
        return int(struct.unpack("i", held)[0])

    def _overdue(self, now: float) -> bool:
        if self.flow.read_paused:  # it is the service that does not read
            self._since = now
        waited = now - self._since
        if self._phase == _BODY:
            return waited > self.limits.body + MARGIN
        if self.cycle is not None and not self.cycle.response_complete:
            return False
        return waited > (self.limits.header if self._phase == _HEAD else self.limits.idle)

    # -- what comes from the client ----------------------------------------------------------------------------------

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin, unless there are too many."""
        super().connection_made(transport)
        if len(self.connections) > self.limits.connections:
            transport.write(_FULL % (len(_FULL_BODY), _FULL_BODY))
            transport.close()

    def data_received(self, data: bytes) -> None:
        """Parse what came; what leads to nothing, like a header without an end, is bounded."""
        if self.transport.is_closing():
            return
        if self._between and (self.cycle is None or self.cycle.response_complete):
            self._leave()
            asked = self.door.ask(data)
            if isinstance(asked, bytes):
                self._unset_keepalive_if_required()
                self._enter(_DONE)
                self.transport.write(asked)
                return
            self._ticket = asked
        self._parsed = False
        super().data_received(_UPGRADE.sub(rb"\1x-pgrad:", data) if self._between else data)
        self._unparsed = 0 if self._parsed else self._unparsed + len(data)
        if self._unparsed > HEAD_BYTES and not self.transport.is_closing():
            self.send_400_response("More than 64 KiB that are not a request.")

    def on_message_begin(self) -> None:
        """Note that headers begin."""
        super().on_message_begin()
        self._between = False
        self._enter(_HEAD)
        self._head = 0

    def on_url(self, url: bytes) -> None:
        """Count the bytes."""
        self._count(len(url))
        super().on_url(url)

    def on_header(self, name: bytes, value: bytes) -> None:
        """Count the bytes, of trailers as well."""
        self._count(len(name) + len(value) + HEADER_BYTES)
        super().on_header(name, value)

    def on_headers_complete(self) -> None:
        """Note that the body begins."""
        self._enter(_BODY)
        if self._ticket is not None:
            self.scope[TICKET] = self._ticket  # type: ignore[literal-required]
        super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        """Note that something came of the body."""
        self._parsed = True
        super().on_body(body)

    def on_message_complete(self) -> None:
        """Note that nothing is missing."""
        self._enter(_DONE)
        self._between = True
        super().on_message_complete()

    def on_response_complete(self) -> None:
        """Count the time without a request from here."""
        if self._phase != _BODY:
            self._since = self.loop.time()
        self._leave()
        super().on_response_complete()

    def connection_lost(self, exc: Exception | None) -> None:
        """Give back what was held."""
        self._leave()
        super().connection_lost(exc)

    def _leave(self) -> None:
        if self._ticket is not None:
            self._ticket.release()
            self._ticket = None

    def _enter(self, phase: str) -> None:
        self._phase, self._since, self._parsed = phase, self.loop.time(), True

    def _count(self, size: int) -> None:
        self._head += size
        if self._head > HEAD_BYTES:
            raise _TooLarge
