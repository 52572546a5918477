"""``POST /v1/certificates``: judge anyone's trajectory."""

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from ..openapi import operation
from ..solving import solved

router = APIRouter()


@router.post("/v1/certificates", **operation("certify"))
async def certify(request: Request) -> Response:
    """Judge a trajectory against limits, waypoints and end states; 200 also where it does not hold."""
    return await solved(request, "certify")
