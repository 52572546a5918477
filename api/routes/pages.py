"""The pages: ``/`` plans by the public API, ``/docs`` is Swagger UI; both work without a network; and their icon.

What is not ours comes from installed wheels, of which nothing is imported: plotly.js and Swagger UI.
"""

import hashlib
from dataclasses import dataclass
from functools import cache
from importlib import util
from pathlib import Path

from fastapi import APIRouter, Depends
from starlette.requests import Request
from starlette.responses import Response

from ..errors import Refusal
from ..web import no_query

router = APIRouter(dependencies=[Depends(no_query)], include_in_schema=False)

#: Nothing but what this host serves itself is loaded, run, or asked; ``data:`` and ``blob:`` are
#: pictures in the style sheet and those that the page makes.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)

#: Addresses are relative, so that the page works behind a proxy that serves it further down.
PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Waywright: the HTTP API</title>
<link rel="icon" type="image/svg+xml" href="favicon.ico">
<link rel="stylesheet" href="docs/swagger-ui.css">
</head>
<body>
<div id="swagger-ui"></div>
<noscript>This page needs JavaScript; openapi.json says the same.</noscript>
<script src="docs/swagger-ui-bundle.js"></script>
<script src="docs/start.js"></script>
</body>
</html>
"""

#: No validator: it would be another host's.
START = """SwaggerUIBundle({
  url: "openapi.json",
  dom_id: "#swagger-ui",
  deepLinking: true,
  validatorUrl: null,
  tryItOutEnabled: true,
  displayRequestDuration: true,
  presets: [SwaggerUIBundle.presets.apis],
  layout: "BaseLayout",
});
"""

_TYPES = {
    "css": "text/css; charset=utf-8",
    "html": "text/html; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "svg": "image/svg+xml",
}

#: The files of ``/``.
_OURS = Path(__file__).resolve().parent.parent / "page"

#: Where in which wheel the others are, and the extra that installs it.
_WHEELS = {
    "plotly.min.js": ("plotly", "package_data"),
    "swagger-ui-bundle.js": ("fastapi_offline", "static"),
    "swagger-ui.css": ("fastapi_offline", "static"),
}


@dataclass(frozen=True)
class File:
    """What a path of the pages serves."""

    content: bytes
    media_type: str
    tag: str

    @classmethod
    def of(cls, content: bytes, media_type: str) -> "File":
        """Return a file with the tag of its content."""
        return cls(content, media_type, f'"{hashlib.sha256(content).hexdigest()[:32]}"')


_DOCS = File.of(PAGE.encode(), _TYPES["html"])
_START = File.of(START.encode(), _TYPES["js"])


def _typed(path: Path) -> File:
    return File.of(path.read_bytes(), _TYPES[path.suffix[1:]])


@cache
def _page() -> dict[str, File]:
    """Return the page's files by their names, from a listing: no name from outside ever becomes a path."""
    return {path.name: _typed(path) for path in sorted(_OURS.iterdir()) if path.suffix[1:] in _TYPES}


@cache
def _installed(name: str) -> File | None:
    """Return a file of a wheel; None where it is not installed."""
    wheel, folder = _WHEELS[name]
    spec = util.find_spec(wheel)
    if spec is None or not spec.submodule_search_locations:
        return None
    path = Path(spec.submodule_search_locations[0], folder, name)
    return _typed(path) if path.is_file() else None


def _wanted(name: str) -> File:
    """Return a file of a wheel.

    Raises
    ------
    Refusal
        It is not installed.
    """
    file = _installed(name)
    if file is None:
        raise Refusal("not_found", f"the page needs {_WHEELS[name][0]}: pip install 'waywright[service]'")
    return file


def _served(request: Request, file: File, seconds: int) -> Response:
    """Return a file, or that the copy that the client has is still good; it asks again after ``seconds``."""
    headers = {
        "ETag": file.tag,
        "Cache-Control": f"public, max-age={seconds}" if seconds else "no-cache",
        "Content-Security-Policy": POLICY,
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        "Cross-Origin-Resource-Policy": "same-origin",
    }
    held = [tag.strip().removeprefix("W/") for tag in request.headers.get("if-none-match", "").split(",")]
    if file.tag in held:
        return Response(status_code=304, headers=headers)
    return Response(file.content, headers={**headers, "Content-Type": file.media_type})


@router.get("/")
async def page(request: Request) -> Response:
    """Return the page that plans."""
    return _served(request, _page()["index.html"], 0)


@router.get("/page/{name}")
def page_file(request: Request) -> Response:
    """Return a file of that page."""
    name = request.path_params["name"]
    if name == "plotly.min.js":
        return _served(request, _wanted(name), 86_400)
    if name not in _page():
        raise _nothing(request)
    return _served(request, _page()[name], 0)


@router.get("/docs")
async def docs(request: Request) -> Response:
    """Return the page that shows the OpenAPI document and tries it out."""
    _wanted("swagger-ui-bundle.js")
    return _served(request, _DOCS, 0)


@router.get("/docs/{name}")
async def docs_file(request: Request) -> Response:
    """Return a file of that page."""
    name = request.path_params["name"]
    if name == "start.js":
        _wanted("swagger-ui-bundle.js")
        return _served(request, _START, 0)
    if name not in ("swagger-ui.css", "swagger-ui-bundle.js"):
        raise _nothing(request)
    return _served(request, _wanted(name), 86_400)


def _nothing(request: Request) -> Refusal:
    return Refusal("not_found", f"there is nothing at {request.url.path[:200]}")


@router.get("/favicon.ico")
async def favicon(request: Request) -> Response:
    """Return the icon of all pages."""
    return _served(request, _page()["icon.svg"], 86_400)
