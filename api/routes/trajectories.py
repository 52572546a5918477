"""``POST /v1/trajectories``: plan a trajectory."""

from fastapi import APIRouter
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response

from planner import InvalidRequest

from ..encode import FORMATS
from ..openapi import operation
from ..reading import decode, parse
from ..ruckig_shape import RuckigBody, own_names, to_plan
from ..schemas import PlanBody
from ..settings import Caps
from ..web import answer, caps_of, read_json
from ..work import Answer, answer_plan

router = APIRouter()


@router.post("/v1/trajectories", **operation("plan"))
async def plan(request: Request) -> Response:
    """Plan a certified trajectory through waypoints."""
    raw, media_type = await read_json(request, FORMATS, known_query=("shape",))
    shapes = request.query_params.getlist("shape")
    if any(shape != "ruckig" for shape in shapes):
        raise InvalidRequest.of("/?shape", "out_of_range", "the only other shape is ruckig")
    work = _plan_ruckig if shapes else _plan
    made = await run_in_threadpool(work, raw, caps_of(request), media_type)
    return answer(made.content, made.media_type, made.seconds)


def _plan(raw: bytes, caps: Caps, media_type: str) -> Answer:
    return answer_plan(parse(PlanBody, decode(raw)), caps, media_type)


def _plan_ruckig(raw: bytes, caps: Caps, media_type: str) -> Answer:
    body = parse(RuckigBody, decode(raw))
    sections = len(body.intermediate_positions or ()) + 1
    try:
        return answer_plan(to_plan(body), caps, media_type)
    except InvalidRequest as error:
        raise own_names(error, sections) from None
