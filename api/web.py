"""The HTTP side of reading a request and of writing an answer."""

from collections.abc import Mapping, Sequence

from starlette.requests import Request
from starlette.responses import Response

from planner import FieldError, InvalidRequest, PlannerError, TooLarge, pointer

from . import encode
from .errors import MEDIA_TYPE, Refusal, problem
from .negotiate import choose
from .settings import DRAIN_BYTES, Caps


def caps_of(request: Request) -> Caps:
    """Return the caps of the app that the request came to."""
    caps: Caps = request.app.state.caps
    return caps


def request_id_of(request: Request) -> str | None:
    """Return the id that the envelope gave the request."""
    found: str | None = request.scope.get("state", {}).get("request_id")
    return found


async def read_json(
    request: Request, formats: Sequence[str] = (encode.JSON,), known_query: Sequence[str] = ()
) -> tuple[bytes, str]:
    """Return the body's bytes and the format of the answer.

    The body is read in any case, so that a client that sends before it listens hears why it was refused.

    Raises
    ------
    TooLarge, InvalidRequest, Refusal
    """
    raw = await _body(request, caps_of(request).body_bytes)
    _refuse_media_type(request)
    _refuse_query(request, known_query)
    return raw, choose(request.headers.get("accept"), formats)


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


def _refuse_media_type(request: Request) -> None:
    available = {"available": [encode.JSON]}
    media_type = request.headers.get("content-type", "").split(";")[0].strip().lower()
    if media_type != encode.JSON:
        said = f"the body's Content-Type is {media_type[:100]!r}" if media_type else "the body has no Content-Type"
        raise Refusal("unsupported_media_type", f"{said}; {encode.JSON} is read here", available)
    coding = request.headers.get("content-encoding", "identity").strip().lower()
    if coding != "identity":
        detail = f"the body's Content-Encoding is {coding[:100]!r}; send it without one"
        raise Refusal("unsupported_media_type", detail, available)


def respond(request: Request, tree: object) -> Response:
    """Return data as JSON, where the client accepts that."""
    media_type = choose(request.headers.get("accept"), (encode.JSON,))
    return Response(encode.dumps(tree), media_type=media_type)


def answer(content: bytes, media_type: str, seconds: Mapping[str, float]) -> Response:
    """Return an encoded answer with the times spent on it in its ``Server-Timing`` header."""
    timing = ", ".join(f"{name};dur={1e3 * spent:.3f}" for name, spent in seconds.items())
    kind = f"{media_type}; charset=utf-8" if media_type.startswith("text/") else media_type
    return Response(content, headers={"Server-Timing": timing, "Content-Type": kind})


def problem_response(request: Request, error: PlannerError | Refusal) -> Response:
    """Return the problem document of an error."""
    document = problem(error, request.url.path, request_id_of(request))
    headers = dict(error.headers) if isinstance(error, Refusal) else {}
    if isinstance(error, TooLarge) and error.what == "body":
        headers["Connection"] = "close"  # what was not read must not be taken for the next request
    headers["Content-Type"] = MEDIA_TYPE
    return Response(encode.dumps(document), status_code=document["status"], headers=headers)
