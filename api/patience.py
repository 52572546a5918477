"""Bodies that do not come: ASGI middleware that waits for a body so long, and then answers 408."""

import asyncio

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from .errors import Refusal


class Patience:
    """ASGI middleware: a body is there ``seconds`` after its request began, or reading it raises a refusal.

    The total counts, not the pause between two pieces: a body that drips is as slow as one that stalls.
    """

    def __init__(self, app: ASGIApp, seconds: float) -> None:
        self.app = app
        self.seconds = seconds

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass an HTTP request on with a body that comes in time; anything else untouched."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        deadline = asyncio.get_running_loop().time() + self.seconds
        complete = started = False

        async def receive_in_time() -> Message:
            nonlocal complete
            if complete:  # what is left to hear is that the client has gone
                return await receive()
            try:
                async with asyncio.timeout_at(deadline):
                    message = await receive()
            except TimeoutError:
                if started:  # nobody can be told any more
                    return {"type": "http.disconnect"}
                detail = f"the body was not there after {self.seconds:g} s"
                raise Refusal("too_slow", detail, {"seconds": self.seconds}, {"Connection": "close"}) from None
            complete = not message.get("more_body", False)
            return message

        async def send_noted(message: Message) -> None:
            nonlocal started
            started = started or message["type"] == "http.response.start"
            await send(message)

        await self.app(scope, receive_in_time, send_noted)
