"""``GET /v1/methods``: what each method does, needs and honours."""

from functools import cache
from typing import Any

from fastapi import APIRouter, Depends
from starlette.requests import Request
from starlette.responses import Response

from planner import describe_method, list_methods

from ..openapi import operation
from ..web import no_query, respond

router = APIRouter(dependencies=[Depends(no_query)])


@router.get("/v1/methods", **operation("methods"))
def methods(request: Request) -> Response:
    """List the methods in order of presentation."""
    return respond(request, _rows())


@cache
def _rows() -> list[dict[str, Any]]:
    """Return the catalogue, which does not change: to make its schemas takes a tenth of a second."""
    return list_methods()


@router.get("/v1/methods/{id}", **operation("method"))
def method(request: Request) -> Response:
    """Describe one method."""
    return respond(request, describe_method(request.path_params["id"]))
