"""The service: ``create_app()`` makes it; ``waywright serve`` runs it."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from planner import PlannerError, __version__

from .access import guard
from .errors import Refusal
from .middleware import Envelope
from .observe import telemetry
from .observe.middleware import Observe
from .openapi import components, secured
from .routes import certificates, comparisons, discovery, methods, metrics, pages, retimings, trajectories
from .settings import Settings
from .shedding import Shed
from .state import State
from .web import problem_response


class Service(FastAPI):
    """FastAPI whose OpenAPI document holds our own models of bodies and answers."""

    def openapi(self) -> dict[str, Any]:
        """Return the OpenAPI 3.1 document."""
        if self.openapi_schema is None:
            document = super().openapi()
            document.setdefault("components", {}).setdefault("schemas", {}).update(components())
            if self.state.keyed:
                secured(document)
            self.openapi_schema = document
        return self.openapi_schema


def create_app(settings: Settings | None = None) -> Service:
    """Return the service as an ASGI application.

    Parameters
    ----------
    settings : Settings
        By default those of the environment.

    Raises
    ------
    ValueError
        A setting is wrong.
    """
    settings = Settings.from_environment() if settings is None else settings
    spans = telemetry.config()
    app = Service(
        title="Waywright",
        version=__version__,
        summary="Waypoints and limits in, a certified trajectory out",
        description="Seconds, metres, radians; unknown fields are refused; nothing given is ignored.",
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        lifespan=_lifespan,
        telemetry=spans,
    )
    app.state.service = State(settings)
    app.add_middleware(Shed, state=app.state.service)
    app.state.keyed = guard(app, settings, app.state.service)
    app.add_middleware(Envelope)
    # the last is the outermost
    app.add_middleware(Observe, metrics=app.state.service.metrics, spans=spans["tracing"])
    app.add_exception_handler(PlannerError, _refused)
    app.add_exception_handler(Refusal, _refused)
    app.add_exception_handler(HTTPException, _http_error)
    for module in (trajectories, comparisons, certificates, retimings, methods, discovery, metrics, pages):
        app.include_router(module.router)
    return app


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    async with app.state.service.running():
        yield


async def _refused(request: Request, error: Exception) -> Response:
    assert isinstance(error, (PlannerError, Refusal))
    return problem_response(request, error)


async def _http_error(request: Request, error: Exception) -> Response:
    """Turn what the framework itself refuses into a problem: unknown paths and verbs."""
    assert isinstance(error, HTTPException)
    path = request.url.path[:200]
    if error.status_code == 404:
        refusal = Refusal("not_found", f"there is nothing at {path}")
    elif error.status_code == 405:
        verbs = (error.headers or {}).get("Allow", "").split(", ")
        verbs += ["HEAD"] if "GET" in verbs and "HEAD" not in verbs else []  # answered by the middleware
        allowed = ", ".join(verbs)
        detail = f"{path} does not take {request.method[:20]}; it takes {allowed}"
        refusal = Refusal("method_not_allowed", detail, {"allowed": verbs}, {"Allow": allowed})
    else:
        phrase = HTTPStatus(error.status_code).phrase
        code = "internal" if error.status_code >= 500 else "invalid_request"
        refusal = Refusal(code, f"the request was refused: {phrase}")
    return problem_response(request, refusal)
