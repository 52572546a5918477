"""Health, versions, caps, named cases, and the explanations of errors."""

import platform
from functools import cache
from importlib import metadata

from fastapi import APIRouter, Depends
from starlette.requests import Request
from starlette.responses import Response

from planner import CASES, __version__

from ..errors import KINDS, Refusal
from ..formats import encoded, offered
from ..media import JSON, MARKDOWN
from ..negotiate import choose
from ..openapi import operation
from ..state import State
from ..web import accepted, caps_of, no_query, respond

router = APIRouter(dependencies=[Depends(no_query)])

#: Whose versions may change an answer.
LIBRARIES = (
    "casadi",
    "fastapi",
    "numba",
    "numpy",
    "orjson",
    "osqp",
    "piqp",
    "pydantic",
    "qpsolvers",
    "ruckig",
    "scipy",
    "toppra",
    "uvicorn",
)


@router.get("/healthz", **operation("healthz"))
async def healthz() -> Response:
    """Tell that the process answers; touches nothing."""
    return Response(b'{"status":"ok"}', media_type=JSON)


@router.get("/readyz", **operation("readyz"))
async def readyz(request: Request) -> Response:
    """Tell whether requests are taken: solvers answer, kernels are warm, and the service is not stopping."""
    state: State = request.app.state.service
    if not state.ready:
        detail = "the service is stopping" if state.draining else "the service is still warming up"
        raise Refusal("overloaded", detail, headers={"Retry-After": "1"})
    return Response(b'{"status":"ready"}', media_type=JSON)


@router.get("/v1/version", **operation("version"))
def version(request: Request) -> Response:
    """Return the versions of the service, of Python and of the libraries."""
    tree = {"version": __version__, "python": platform.python_version(), "libraries": _libraries()}
    return respond(request, tree)


@cache
def _libraries() -> dict[str, str]:
    found = {}
    for name in LIBRARIES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


@router.get("/v1/limits", **operation("limits"))
async def limits(request: Request) -> Response:
    """Return the caps on a request."""
    return respond(request, caps_of(request).listed())


@router.get("/v1/cases", **operation("cases"))
async def cases(request: Request) -> Response:
    """Return named requests to try."""
    tree = [{"name": c.name, "title": c.title, "request": dict(c.request)} for c in CASES.values()]
    return respond(request, tree)


@router.get("/errors/{code}", **operation("explain"))
async def explain(request: Request) -> Response:
    """Explain an error code."""
    code = request.path_params["code"]
    if code not in KINDS:
        raise Refusal("not_found", f"there is no error code {code[:60]!r}", {"known": list(KINDS)})
    kind = KINDS[code]
    media_type = choose(accepted(request), (*offered(whole=False), MARKDOWN))
    if media_type != MARKDOWN:
        tree = {"code": code, "title": kind.title, "status": kind.status, "explanation": kind.explanation}
        return Response(encoded(tree, media_type), media_type=media_type)
    return Response(f"# {kind.title}\n\n`{code}`, status {kind.status}\n\n{kind.explanation}\n", media_type=media_type)
