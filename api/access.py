"""Who is served: API keys, rate limits, nothing new while the service stops, and pages of which origins may call."""

import ipaddress
import re

from fastapi import FastAPI
from starlette.datastructures import Headers, MutableHeaders
from starlette.middleware.cors import CORSMiddleware
from starlette.requests import ClientDisconnect, Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from .errors import Refusal
from .keys import Keys
from .patience import Patience
from .rates import Rate, caller_of
from .settings import Settings
from .state import State
from .web import problem_response

#: Paths that need no key, and beginnings of such paths.
OPEN = frozenset({"/", "/healthz", "/readyz", "/openapi.json", "/docs", "/favicon.ico"})
OPEN_UNDER = ("/errors/", "/docs/", "/page/")

#: Paths that do not count: who looks after the service looks often.
UNCOUNTED = frozenset({"/healthz", "/readyz"})

#: Verbs of requests that are no work, and are answered while the service stops.
_LOOKS = frozenset({"GET", "HEAD", "OPTIONS"})

#: What pages of other origins may send and see.
_CORS_SENT = ("Content-Type", "X-API-Key", "X-Request-ID", "Idempotency-Key", "Last-Event-ID")
_CORS_SEEN = ("X-Request-ID", "Server-Timing", "RateLimit", "RateLimit-Policy", "Retry-After")
_ORIGIN = re.compile(r"https?://(\[[0-9a-f:.]+\]|[a-z0-9.-]+)(:[0-9]{1,5})?")

_CHALLENGE = {"WWW-Authenticate": 'ApiKey realm="waywright"'}


def is_open(path: str) -> bool:
    """Return whether a path is served without a key."""
    return path in OPEN or path.startswith(OPEN_UNDER)


def guard(app: FastAPI, settings: Settings, state: State) -> bool:
    """Put the guards before an app: origins, patience, then access. Returns whether keys are needed.

    Raises
    ------
    ValueError
        A setting is wrong, or the keys file cannot be read.
    """
    keys = Keys.read(settings.api_keys, settings.api_keys_hashed)
    rate = Rate(settings.rate) if settings.rate.strip() else None
    trusted(settings.proxies)
    app.add_middleware(Access, state=state, keys=keys, rate=rate)
    app.add_middleware(Patience, seconds=settings.body_seconds)
    origins = _origins(settings.cors)
    if origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=origins,
            allow_methods=("GET", "HEAD", "POST", "DELETE"),
            allow_headers=_CORS_SENT,
            expose_headers=_CORS_SEEN,
        )
    return keys is not None


def _origins(text: str) -> list[str]:
    origins = text.split()
    for origin in origins:
        if not _ORIGIN.fullmatch(origin) and origins != ["*"]:
            example = "https://robots.example.org, or * alone for any"
            raise ValueError(f"WAYWRIGHT_CORS holds origins like {example}, separated by spaces, not {origin!r}")
    return origins


def trusted(text: str) -> list[str]:
    """Return the addresses and networks of the setting ``proxies``.

    Raises
    ------
    ValueError
        Something else is among them; so is ``*``, as then any stranger could choose its address.
    """
    found = [part.strip() for part in text.split(",") if part.strip()]
    for part in found:
        try:
            ipaddress.ip_network(part)
        except ValueError:
            raise ValueError(
                f"WAYWRIGHT_PROXIES holds addresses or networks, separated by commas, not {part!r}"
            ) from None
    return found


class Access:
    """ASGI middleware: refuses who has no key, who asks too often, and new work while the service stops.

    Parameters
    ----------
    keys
        Those that are admitted; None admits everybody.
    rate
        Per key, or per address where there is none; None: no limit.
    """

    def __init__(self, app: ASGIApp, state: State, keys: Keys | None, rate: Rate | None) -> None:
        self.app = app
        self.state = state
        self.keys = keys
        self.rate = rate

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on who is admitted."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        seen: dict[str, str] = {}
        refusal = await self._refusal(scope, seen)

        async def send_seen(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(seen)
            await send(message)

        passing = send_seen if seen else send
        if refusal is None:
            await self.app(scope, receive, passing)
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 1008, "reason": refusal.detail[:100]})
        elif await _heard_out(scope, receive, self.state.settings.caps.body_bytes, refusal):
            await problem_response(Request(scope), refusal)(scope, receive, passing)

    async def _refusal(self, scope: Scope, seen: dict[str, str]) -> Refusal | None:
        """Return why a request is refused, if it is; notes headers of its answer in ``seen``."""
        path = scope["path"]
        if self.state.draining and scope.get("method") not in _LOOKS:
            headers = {"Retry-After": "1", "Connection": "close"}
            return Refusal("overloaded", "the service is stopping", {"reason": "stopping"}, headers)
        owner = self._owner(scope)
        if owner is not None:
            scope.setdefault("state", {})["key"] = owner  # a name; the key itself goes nowhere
        if self.rate is not None and path not in UNCOUNTED:
            standing = await self.rate.take(f"key {owner}" if owner else caller_of(scope.get("client")))
            seen.update(standing.headers)
            if not standing.admitted:
                whose = f"of the key {owner}" if owner else "of this address"
                return Refusal("rate_limited", f"the requests {whose} are over {self.state.settings.rate}")
        if self.keys is None or owner is not None or is_open(path):
            return None
        has = any(name == b"x-api-key" for name, _ in scope["headers"])
        detail = "the key in X-API-Key is not known here" if has else "the header X-API-Key is missing"
        return Refusal("unauthorized", detail, headers=_CHALLENGE)

    def _owner(self, scope: Scope) -> str | None:
        if self.keys is None:
            return None
        sent = [value.strip() for name, value in scope["headers"] if name == b"x-api-key"]
        return self.keys.owner(sent[0]) if len(sent) == 1 else None


async def _heard_out(scope: Scope, receive: Receive, most: int, refusal: Refusal) -> bool:
    """Read and drop the body of a refused request, so that a client that sends first hears why; False if it left.

    What remains unread must not be taken for the next request: then the connection ends with the answer.
    """
    unread = Headers(scope=scope).get("expect", "").lower() == "100-continue"  # it asks before it sends: spare it
    size = 0
    while not unread:
        try:
            message = await receive()
        except Refusal:  # too slow
            unread = True
            break
        except ClientDisconnect:
            return False
        if message["type"] == "http.disconnect":
            return False
        if not message.get("more_body", False):
            break
        size += len(message.get("body", b""))
        unread = size > most
    if unread:
        refusal.headers["Connection"] = "close"
    return True
