"""The HTTP side of reading a request and of writing an answer."""

from collections.abc import Mapping, Sequence
from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from planner import FieldError, InvalidRequest, PlannerError, TooLarge, pointer

from .errors import Refusal, problem
from .formats import encoded, offered
from .formats.json import dumps
from .media import PROBLEM
from .negotiate import choose
from .reading import READ
from .settings import DRAIN_BYTES, Caps

#: The paths whose requests are work.
WORK = frozenset({"/v1/trajectories", "/v1/comparisons", "/v1/certificates", "/v1/retimings"})


def caps_of(request: Request) -> Caps:
    """Return the caps of the app that the request came to."""
    caps: Caps = request.app.state.service.settings.caps
    return caps


def request_id_of(request: Request) -> str | None:
    """Return the id that the envelope gave the request."""
    found: str | None = request.scope.get("state", {}).get("request_id")
    return found


async def read_body(
    request: Request, formats: Sequence[str], known_query: Sequence[str] = ()
) -> tuple[bytes, str, str]:
    """Return the body's bytes, its media type, and the format of the answer.

    The body is read in any case, so that a client that sends before it listens hears why it was refused.

    Raises
    ------
    TooLarge, InvalidRequest, Refusal
    """
    raw = await _body(request, caps_of(request).body_bytes)
    coding = _media_type(request)
    _refuse_query(request, known_query)
    return raw, coding, choose(accepted(request), formats)


async def no_query(request: Request) -> None:
    """Refuse query parameters: a dependency of the routes that take none.

    Raises
    ------
    InvalidRequest
    """
    _refuse_query(request, ())


def _refuse_query(request: Request, known: Sequence[str]) -> None:
    unknown = [name for name in request.query_params if name not in known]
    if unknown:
        raise InvalidRequest(
            [FieldError(pointer((f"?{name[:60]}",)), "unknown_field", "there is no such parameter") for name in unknown]
        )


async def _body(request: Request, most: int) -> bytes:
    """Return the body; over the cap it is dropped as it comes, up to a point."""
    chunks: list[bytes] = []
    size = 0
    async for chunk in request.stream():
        size += len(chunk)
        if size <= most:
            chunks.append(chunk)
        else:
            chunks.clear()
        if size > DRAIN_BYTES:
            break
    if size > most:
        raise TooLarge("body", most, "send fewer waypoints, or split the request; the cap is in bytes")
    return b"".join(chunks)


def _media_type(request: Request) -> str:
    available = {"available": list(READ)}
    media_type = _joined(request, "content-type").split(";")[0].strip().lower()
    if media_type not in READ:
        said = f"the body's Content-Type is {media_type[:100]!r}" if media_type else "the body has no Content-Type"
        raise Refusal("unsupported_media_type", f"{said}; {' and '.join(READ)} are read here", available)
    coding = (_joined(request, "content-encoding") or "identity").strip().lower()
    if coding != "identity":
        detail = f"the body's Content-Encoding is {coding[:100]!r}; send it without one"
        raise Refusal("unsupported_media_type", detail, available)
    return media_type


def _joined(request: Request, name: str) -> str:
    """Return a header; lines of the same name are one, with commas (RFC 9110, section 5.2)."""
    return ", ".join(request.headers.getlist(name))


def accepted(request: Request) -> str | None:
    """Return what the client accepts."""
    return _joined(request, "accept") or None


def respond(request: Request, tree: object) -> Response:
    """Return data in the format that the client prefers, of those that any data comes in."""
    media_type = choose(accepted(request), offered(whole=False))
    return Response(encoded(tree, media_type), media_type=media_type)


def typed(media_type: str) -> str:
    """Return the Content-Type of a format."""
    return f"{media_type}; charset=utf-8" if media_type.startswith("text/") else media_type


def timing_of(seconds: Mapping[str, float]) -> dict[str, str]:
    """Return the header that tells the times spent."""
    return {"Server-Timing": ", ".join(f"{name};dur={1e3 * spent:.3f}" for name, spent in seconds.items())}


def problem_response(request: Request, error: PlannerError | Refusal | Mapping[str, Any]) -> Response:
    """Return the problem document of an error, or one made already."""
    document = error if isinstance(error, Mapping) else problem(error, request.url.path, request_id_of(request))
    request.scope.setdefault("state", {})["problem"] = document  # for the log and the metrics
    headers = dict(error.headers) if isinstance(error, Refusal) else {}
    if isinstance(error, TooLarge) and error.what == "body":
        headers["Connection"] = "close"  # what was not read must not be taken for the next request
    headers["Content-Type"] = PROBLEM
    return Response(dumps(document), status_code=document["status"], headers=headers)
