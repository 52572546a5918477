"""A bare handler of the same framework: ``python -m benchmarks.service.bare`` serves ready arrays and prints its port.

It parses the body, checks nothing, plans nothing, and encodes arrays of the same shapes with the same encoder under the
same keys: what is left is what a service in this framework cannot do without.
"""

import socket
import sys
from typing import Any

import numpy as np
import orjson
import ormsgpack
import uvicorn
from fastapi import FastAPI
from starlette.requests import Request
from starlette.responses import Response

from api.memory import give_back

from .costs import COUNT, JOINTS


def arrays(count: int = COUNT, joints: int = JOINTS) -> dict[str, Any]:
    """Return samples of no particular motion."""
    random = np.random.default_rng(7)
    orders = ("position", "velocity", "acceleration", "jerk")
    return {"time": np.linspace(0, 9.5, count), **{name: random.normal(size=(count, joints)) for name in orders}}


def app() -> FastAPI:
    """Return the service."""
    bare, samples = FastAPI(openapi_url=None), arrays()

    @bare.post("/v1/trajectories")
    async def answer(request: Request) -> Response:
        orjson.loads(await request.body())
        if request.headers.get("accept") == "application/msgpack":
            packed = ormsgpack.packb({"samples": samples}, option=ormsgpack.OPT_SERIALIZE_NUMPY)
            return Response(packed, media_type="application/msgpack")
        content = orjson.dumps({"samples": samples}, option=orjson.OPT_SERIALIZE_NUMPY)
        return Response(content, media_type="application/json")

    @bare.get("/readyz")
    async def ready() -> Response:
        return Response(b"{}")

    return bare


def main() -> None:
    """Serve until interrupted, as the service itself is served."""
    give_back()  # as the service does: the allocator's setting is worth as much here
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        print(f"bare handler at http://127.0.0.1:{listening.getsockname()[1]}", flush=True)
        config = uvicorn.Config(app(), log_level="warning", access_log=False)
        uvicorn.Server(config).run(sockets=[listening])


if __name__ == "__main__":
    sys.exit(main())
