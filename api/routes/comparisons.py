"""``POST /v1/comparisons``: the same request with several methods."""

from functools import partial
from typing import Any

from fastapi import APIRouter
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response

from .. import encode
from ..errors import problem
from ..openapi import operation
from ..reading import decode, parse
from ..schemas import CompareBody
from ..settings import Caps
from ..web import caps_of, read_json, request_id_of
from ..work import ProblemOf, comparison

router = APIRouter()


@router.post("/v1/comparisons", **operation("compare"))
async def compare(request: Request) -> Response:
    """Plan the same request with several methods; one that refuses is a row like any other."""
    raw, media_type = await read_json(request)
    row_problem = partial(problem, instance=request.url.path, request_id=request_id_of(request))
    content = await run_in_threadpool(_compare, raw, caps_of(request), row_problem)
    return Response(content, media_type=media_type)


def _compare(raw: bytes, caps: Caps, row_problem: ProblemOf) -> bytes:
    rows: dict[str, Any] = comparison(parse(CompareBody, decode(raw)), caps, row_problem)
    return encode.dumps(rows)
