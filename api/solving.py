"""A posted body becomes an answer: read, put into its lane, solved, encoded."""

import asyncio
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import suppress

from pydantic import BaseModel
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from planner import InvalidRequest, PlannerError, pick

from .draft import WHOLE
from .engine import jobs, lanes
from .engine.engine import Solved
from .engine.jobs import Failed, Job
from .errors import Refusal
from .formats import FORMATS, offered
from .reading import to_request
from .schemas import PlanBody
from .shedding import TICKET
from .state import State
from .web import caps_of, problem_response, read_body, request_id_of, timing_of, typed


async def solved(request: Request, kind: str, whole: bool = False, known_query: tuple[str, ...] = ()) -> Response:
    """Answer a request of one kind of job.

    Parameters
    ----------
    whole : bool
        Whether the answer is one plan, so that it comes in the formats of samples too.

    Raises
    ------
    PlannerError, Refusal
        The request was refused before any work.
    """
    state: State = request.app.state.service
    raw, coding, media_type = await read_body(request, offered(whole), known_query)
    began = time.perf_counter()  # the time that the client takes to send is not ours
    shapes = request.query_params.getlist("shape")
    if any(shape != "ruckig" for shape in shapes):
        raise InvalidRequest.of("/?shape", "out_of_range", "the only other shape is ruckig")
    job = Job(
        f"{kind}_ruckig" if shapes else kind,
        raw,
        coding,
        media_type,
        caps_of(request),
        request.url.path,
        request_id_of(request),
    )
    body = _glance(job)
    read = time.perf_counter() - began
    request.scope["state"]["asked"] = job.kind, body  # for the log and the metrics
    if body is not None and lanes.at_once(body):
        async with state.turns:
            queued = time.perf_counter() - began - read
            found = Solved(jobs.run(job, body), queued)
            request.scope["state"]["worked"] = time.perf_counter() - began - read - queued
            response = await _response(request, job, found, read)
    else:
        found = await _out_of_loop(request, job, jobs.limit_of(body, job.caps))
        if TICKET in request.scope:  # its solver is free: who takes his time to read the answer keeps nobody out
            request.scope[TICKET].release()
        request.scope["state"]["worked"] = time.perf_counter() - began - read - found.queued
        response = await _response(request, job, found, read)
    return response


def _glance(job: Job) -> BaseModel | None:
    """Return the body; None if it takes long to read. What it refuses is refused without waiting."""
    if not lanes.short(job.raw, job.coding):
        return None
    body = jobs.read(job)
    if isinstance(body, PlanBody) and not lanes.at_once(body):
        given, _ = to_request(body, job.caps)
        pick(given, body.method or "auto")
    return body


async def _out_of_loop(request: Request, job: Job, limit: float) -> Solved:
    """Solve a job in the engine, unless the client goes away."""
    state: State = request.app.state.service
    work = asyncio.ensure_future(state.engine.solve(job, limit))
    gone = asyncio.ensure_future(_gone(request))
    try:
        await asyncio.wait((work, gone), return_when=asyncio.FIRST_COMPLETED)
        if not work.done():
            raise Gone
        return work.result()
    finally:
        for task in (work, gone):
            task.cancel()
            with suppress(asyncio.CancelledError, Refusal):
                await task


async def _gone(request: Request) -> None:
    while (await request.receive())["type"] != "http.disconnect":
        pass


class Gone(Exception):
    """The client went away before the answer was there."""


async def _response(request: Request, job: Job, found: Solved, read: float) -> Response:
    """Encode an outcome: in one piece, or where it is large, in pieces between which others are served."""
    outcome = found.outcome
    request.scope["state"]["solved"] = found
    if isinstance(outcome, Failed):
        return problem_response(request, outcome.document)
    seconds = {"queue": found.queued, **outcome.seconds}
    seconds["validate"] = seconds.get("validate", 0.0) + read
    pieces = FORMATS[job.media_type].write(outcome)
    headers = {"Content-Type": typed(job.media_type)}
    try:
        if outcome.numbers <= WHOLE:
            started = time.perf_counter()
            content = b"".join(pieces)
            seconds["encode"] = seconds.get("encode", 0.0) + time.perf_counter() - started
            return Response(content, headers={**headers, **timing_of(seconds)})
        first = next(pieces)
    except PlannerError as error:
        return problem_response(request, error)
    if request.scope["http_version"] == "1.0":  # which knows no chunks
        content = b"".join([piece async for piece in _between_others(first, pieces)])
        return Response(content, headers={**headers, **timing_of(seconds)})
    return StreamingResponse(_between_others(first, pieces), headers={**headers, **timing_of(seconds)})


async def _between_others(first: bytes, pieces: Iterator[bytes]) -> AsyncIterator[bytes]:
    yield first
    for piece in pieces:
        await asyncio.sleep(0)
        yield piece
