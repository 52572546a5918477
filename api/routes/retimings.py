"""``POST /v1/retimings``: anyone's trajectory, the same path with the best timing."""

from fastapi import APIRouter
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response

from ..encode import FORMATS
from ..openapi import operation
from ..reading import decode, parse
from ..schemas import RetimeBody
from ..settings import Caps
from ..web import answer, caps_of, read_json
from ..work import Answer, answer_retiming

router = APIRouter()


@router.post("/v1/retimings", **operation("retime"))
async def retime(request: Request) -> Response:
    """Run through a trajectory's path as fast as the limits allow."""
    raw, media_type = await read_json(request, FORMATS)
    made = await run_in_threadpool(_retime, raw, caps_of(request), media_type)
    return answer(made.content, made.media_type, made.seconds)


def _retime(raw: bytes, caps: Caps, media_type: str) -> Answer:
    return answer_retiming(parse(RetimeBody, decode(raw)), caps, media_type)
