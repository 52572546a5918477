"""``POST /v1/retimings``: anyone's trajectory, the same path with the best timing."""

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from ..openapi import operation
from ..solving import solved

router = APIRouter()


@router.post("/v1/retimings", **operation("retime"))
async def retime(request: Request) -> Response:
    """Run through a trajectory's path as fast as the limits allow."""
    return await solved(request, "retime", whole=True)
