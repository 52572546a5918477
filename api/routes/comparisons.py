"""``POST /v1/comparisons``: the same request with several methods."""

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from ..openapi import operation
from ..solving import solved

router = APIRouter()


@router.post("/v1/comparisons", **operation("compare"))
async def compare(request: Request) -> Response:
    """Plan the same request with several methods; one that refuses is a row like any other."""
    return await solved(request, "compare")
