"""``waywright serve``: the service on a socket of this machine."""

import socket

import uvicorn

from .app import create_app


def serve(host: str, port: int) -> int:
    """Serve until interrupted; prints where. Returns an exit code.

    Raises
    ------
    OSError
        The address is taken or is not one of this machine.
    """
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
    except (OSError, OverflowError) as error:
        raise OSError(0, str(error), f"{host}:{port}") from None
    with socket.socket(family, socket.SOCK_STREAM) as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind(address)
        except OSError as error:
            raise OSError(error.errno, error.strerror, f"{host}:{port}") from None
        bound = listening.getsockname()[1]
        name = f"[{host}]" if ":" in host else host
        print(f"Waywright is at http://{name}:{bound}", flush=True)
        config = uvicorn.Config(create_app(), log_level="warning", timeout_graceful_shutdown=5)
        server = uvicorn.Server(config)
        server.run(sockets=[listening])
    return 0 if server.started else 1
