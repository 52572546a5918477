"""Messages between the service and one solver, over a pair of sockets: the length in eight bytes, then a pickle."""

import asyncio
import pickle
import socket
import struct
from typing import Any, cast

HEAD = struct.Struct("<Q")


def packed(message: Any) -> bytes:
    """Return a message as it is sent."""
    content = pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
    return HEAD.pack(len(content)) + content


def tell(line: socket.socket, message: Any) -> None:
    """Send a message from the solver; blocks until the service has taken it."""
    line.sendall(packed(message))


class Line(asyncio.Protocol):
    """The service's end: an answer is waited for before the next message is sent."""

    def __init__(self) -> None:
        self._transport: asyncio.Transport | None = None
        self._heard = bytearray()
        self._answer: asyncio.Future[Any] | None = None

    @property
    def open(self) -> bool:
        """Whether the solver has not gone."""
        return self._transport is not None and not self._transport.is_closing()

    def answer(self) -> "asyncio.Future[Any]":
        """Return the future of the solver's next message; ``EOFError`` if it ends before."""
        self._answer = asyncio.get_running_loop().create_future()
        if not self.open:
            self._answer.set_exception(EOFError("the solver is gone"))
        return self._answer

    def tell(self, message: Any) -> None:
        """Send a message; returns at once."""
        if self._transport is not None:
            self._transport.write(packed(message))

    def close(self) -> None:
        """Send and hear no more."""
        if self._transport is not None:
            self._transport.abort()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin."""
        self._transport = cast(asyncio.Transport, transport)

    def data_received(self, data: bytes) -> None:
        """Gather a message; it is whole when as much is there as its head says."""
        self._heard += data
        if len(self._heard) < HEAD.size or len(self._heard) < HEAD.size + HEAD.unpack_from(self._heard)[0]:
            return
        message, self._heard = memoryview(self._heard)[HEAD.size :], bytearray()
        if self._answer is not None and not self._answer.done():
            self._answer.set_result(pickle.loads(message))

    def connection_lost(self, error: Exception | None) -> None:
        """Tell whoever waits."""
        if self._answer is not None and not self._answer.done():
            self._answer.set_exception(EOFError("the solver is gone"))
