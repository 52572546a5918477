"""``POST /v1/certificates``: judge anyone's trajectory."""

from fastapi import APIRouter
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response

from .. import encode
from ..judging import certificate
from ..openapi import operation
from ..reading import decode, parse
from ..schemas import CertifyBody
from ..settings import Caps
from ..web import caps_of, read_json

router = APIRouter()


@router.post("/v1/certificates", **operation("certify"))
async def certify(request: Request) -> Response:
    """Judge a trajectory against limits, waypoints and end states; 200 also where it does not hold."""
    raw, media_type = await read_json(request)
    content = await run_in_threadpool(_certify, raw, caps_of(request))
    return Response(content, media_type=media_type)


def _certify(raw: bytes, caps: Caps) -> bytes:
    return encode.dumps(certificate(parse(CertifyBody, decode(raw)), caps))
