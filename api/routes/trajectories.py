"""``POST /v1/trajectories``: plan a trajectory."""

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from ..openapi import operation
from ..solving import solved

router = APIRouter()


@router.post("/v1/trajectories", **operation("plan"))
async def plan(request: Request) -> Response:
    """Plan a certified trajectory through waypoints."""
    return await solved(request, "plan", whole=True, known_query=("shape",))
