"""What goes around every request: its id, HEAD, and an answer even where the code failed."""

import logging
import uuid

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import ClientDisconnect, Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from .errors import REQUEST_ID, Refusal
from .solving import Gone
from .web import problem_response

log = logging.getLogger("waywright.api")


class Envelope:
    """ASGI middleware: takes or makes the request id, echoes it, and turns what nobody caught into a problem.

    HEAD is answered as GET is, without the content (RFC 9110, 9.3.2).
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass an HTTP request on, enveloped; anything else untouched."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        sent = Headers(scope=scope).get("x-request-id", "")
        request_id = sent if REQUEST_ID.fullmatch(sent) else uuid.uuid4().hex
        scope.setdefault("state", {})["request_id"] = request_id
        started = False
        bare = scope["method"] == "HEAD"
        inner = {**scope, "method": "GET"} if bare else scope  # a copy: the server goes by its own

        async def send_enveloped(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                MutableHeaders(scope=message)["X-Request-ID"] = request_id
            elif bare:
                message = {**message, "body": b""}
            await send(message)

        try:
            await self.app(inner, receive, send_enveloped)
        except (ClientDisconnect, Gone):
            log.debug("request %s: the client went away", request_id)  # its line in the log says so too
        except Exception:
            log.exception("request %s failed", request_id)
            if started:
                raise
            error = Refusal("internal", "something failed that should not have; the log has the details")
            await problem_response(Request(inner), error)(inner, receive, send_enveloped)
        finally:
            if "route" in inner:  # for the log and the metrics
                scope["route"] = inner["route"]
