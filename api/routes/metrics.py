"""``GET /metrics``: what a Prometheus scrapes."""

from fastapi import APIRouter, Depends
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response

from ..observe.metrics import CONTENT_TYPE, Metrics
from ..openapi import operation
from ..web import no_query

router = APIRouter(dependencies=[Depends(no_query)])


@router.get("/metrics", response_class=PlainTextResponse, **operation("metrics"))
async def metrics(request: Request) -> Response:
    """Return the service's metrics in Prometheus' text format."""
    found: Metrics = request.app.state.service.metrics
    return Response(await found.text(), headers={"Content-Type": CONTENT_TYPE})
