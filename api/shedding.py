"""Turning work away while there is no room: before it is parsed or routed, since refusing must cost next to nothing."""

import logging
import re
import time
import uuid
from functools import lru_cache

from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from .engine.engine import Engine
from .engine.lanes import QUICK, READ
from .engine.turns import Turns
from .errors import REQUEST_ID, Refusal, problem
from .formats.json import dumps
from .media import PROBLEM
from .state import State
from .web import WORK, problem_response

log = logging.getLogger("waywright.api")

#: The method, wherever it stands in the bytes of a JSON or MessagePack body.
_METHOD = re.compile(rb'"?method"?[\s:]*["\xa0-\xbf]([a-z_]+)')


class Lanes:
    """Which lane is full; which one a body would take is guessed from the method's name in it.

    What is guessed wrongly is refused a little later, by the lane itself.
    """

    def __init__(self, state: State) -> None:
        self.engine, self.turns = state.engine, state.turns

    @property
    def full(self) -> bool:
        """Whether a lane has no room."""
        return self.engine.full or self.turns.full

    def lane(self, data: bytes, begin: int = 0) -> str:
        """Return the lane, ``loop`` or ``solver``, of the body that begins there."""
        found = _METHOD.search(data, begin)
        return "loop" if found and found[1].decode() in QUICK and len(data) - begin <= READ else "solver"

    def refusal(self, lane: str, crowded: bool = False) -> Refusal | None:
        """Return why a lane takes no more; None where it has room. ``crowded``: others are on their way to it."""
        of: Engine | Turns = self.turns if lane == "loop" else self.engine
        return of.refusal() if crowded or of.full else None


class Shed:
    """ASGI middleware: while a lane is full, refuses what would go there. Otherwise it looks at nothing."""

    def __init__(self, app: ASGIApp, state: State) -> None:
        self.app = app
        self.lanes = Lanes(state)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if not self.lanes.full or scope["type"] != "http" or scope["path"] not in WORK or scope["method"] != "POST":
            await self.app(scope, receive, send)
            return
        first = await receive()
        whole = not first.get("more_body", False)  # of a part nobody knows its lane
        refusal = self.lanes.refusal(self.lanes.lane(first.get("body", b""))) if whole else None
        if refusal is None:
            await self.app(scope, _replayed(first, receive), send)
            return
        await problem_response(Request(scope), refusal)(scope, receive, send)


def _replayed(first: Message, receive: Receive) -> Receive:
    """Return a ``receive`` that gives a message again that was received."""
    waiting = [first]

    async def again() -> Message:
        return waiting.pop() if waiting else await receive()

    return again


#: Seconds between lines of the log about requests that the door turned away.
LINES = 1.0

_PLAIN = re.compile(rb"POST (/v1/[a-z]+) HTTP/1\.1\r\n((?:[!#$%&'*+.^_`|~0-9A-Za-z-]+:[^\r\n\0]*\r\n)+)\r\n", re.DOTALL)
_LENGTH = re.compile(rb"^content-length:[ \t]*([0-9]{1,9})[ \t]*\r$", re.IGNORECASE | re.MULTILINE)
_ID = re.compile(rb"^x-request-id:[ \t]*([^\r\n]*?)[ \t]*\r$", re.IGNORECASE | re.MULTILINE)
#: Headers that ask for more than a plain refusal.
_MORE = re.compile(
    rb"^(?:(?:transfer-encoding|expect|origin|upgrade):|connection:(?!\s*keep-alive\s*$))", re.IGNORECASE | re.MULTILINE
)


_HEAD = (
    f"HTTP/1.1 503 Service Unavailable\r\ncontent-type: {PROBLEM}\r\n".encode()
    + b"retry-after: %b\r\nx-request-id: %b\r\ncontent-length: %d\r\n\r\n"
)


@lru_cache(maxsize=256)
def _document(path: str, detail: str, reason: str) -> tuple[bytes, bytes]:
    """Return what of a problem document stands before the request's id, and what after it."""
    document = dumps(problem(Refusal("overloaded", detail, {"reason": reason}), path, "?id?"))
    before, _, after = document.partition(b'"?id?"')
    return before, after


#: Where a request's scope has its ticket.
TICKET = "waywright.ticket"


class Ticket:
    """A place in a lane, from the first byte of a request until its work is done; to be given back once or more."""

    def __init__(self, held: dict[str, int], lane: str) -> None:
        self._held: dict[str, int] | None = held
        self._lane = lane
        held[lane] += 1

    def release(self) -> None:
        """Give it back."""
        if self._held is not None:
            self._held[self._lane] -= 1
            self._held = None


class Door:
    """What the connections ask: a ticket for a request, or a refusal without HTTP parser, task and middleware.

    The lanes themselves see a request only when it has come all the way to them, by which time a hundred others may be
    under way; so those are counted here. Only what is plain is looked at: a whole request in one piece whose headers
    want nothing special. The rest goes the long way, to ``Shed`` and to the lanes. What is turned away has its place in
    the metrics, and in the log a line a second.
    """

    def __init__(self, state: State) -> None:
        self.state = state
        self.lanes = Lanes(state)
        self.room = {"solver": state.engine.workers + state.engine.queue, "loop": 1 + state.turns.queue}
        self.held = dict.fromkeys(self.room, 0)
        self._turned, self._told = 0, 0.0

    def ask(self, data: bytes) -> Ticket | bytes | None:
        """Return a ticket, or the answer to a request that is turned away; None where it is to go the long way."""
        head = _PLAIN.match(data)
        if head is None or head[1].decode() not in WORK or _MORE.search(head[2]):
            return None
        lengths, ids = _LENGTH.findall(head[2]), _ID.findall(head[2])
        if len(lengths) != 1 or len(ids) > 1 or len(data) - head.end() != int(lengths[0]):
            return None
        lane = self.lanes.lane(data, head.end())
        refusal = self.lanes.refusal(lane, self.held[lane] >= self.room[lane])
        if refusal is None:
            return Ticket(self.held, lane)
        sent = ids[0].decode("latin-1") if ids else ""
        request_id = sent if REQUEST_ID.fullmatch(sent) else uuid.uuid4().hex
        path = head[1].decode()
        self._note(path, refusal)
        before, after = _document(path, refusal.detail, refusal.data["reason"])
        body = before + dumps(request_id) + after
        return _HEAD % (refusal.headers["Retry-After"].encode(), request_id.encode(), len(body)) + body

    def _note(self, path: str, refusal: Refusal) -> None:
        metrics = self.state.metrics
        metrics.answered(path, "POST", 503, 0.0)
        metrics.shed(str(refusal.data["reason"]))
        self._turned += 1
        now = time.monotonic()
        if now - self._told >= LINES:
            log.warning("turned away for want of room: %d requests (%s)", self._turned, refusal.data["reason"])
            self._turned, self._told = 0, now
