"""``waywright serve``: the service on a socket of this machine, until it is told to stop."""

import asyncio
import ipaddress
import socket
from types import FrameType

import uvicorn

from .access import trusted
from .app import Service, create_app
from .engine.slot import end_fork_server
from .memory import give_back
from .observe.logs import configured
from .protocol import Config, Connection, Limits
from .settings import Settings
from .shedding import Door

#: Connections that may wait to be accepted; the kernel may have a lower cap.
BACKLOG = 2048

#: Connections at once. Each costs some kB and a file descriptor.
CONNECTIONS = 10_000

#: File descriptors that are left for everything else.
SPARE = 200

#: Seconds that a connection may stay open without a request.
IDLE = 10

#: Ticks of the server, of 0.1 s, between two looks at the connections.
TICKS = 3

#: Seconds for what is left in buffers to be sent when the service stops.
FLUSH = 1.0


class Misconfigured(ValueError):
    """A setting, or the address with these settings, is refused."""


class Server(uvicorn.Server):
    """uvicorn's server, which looks at its connections, and goes on while it ends what it has begun.

    Its own way to stop is to close the door first, so that nobody can be told why, and to end by the signal.
    """

    def __init__(self, config: Config, app: Service) -> None:
        super().__init__(config)
        self.state = app.state.service
        self.patience = self.state.settings.drain_seconds
        self._deadline: float | None = None
        self.cut_short = False

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Take no new work from the first signal on; end at once at the second."""
        if self.state.draining:
            self.cut_short = self.force_exit = self.should_exit = True
        self.state.draining = True

    async def on_tick(self, counter: int) -> bool:
        """Look at the connections, and whether it is time to stop."""
        now = asyncio.get_running_loop().time()
        if counter % TICKS == 0:
            for connection in list(self.server_state.connections):
                if isinstance(connection, Connection):
                    connection.look(now)
        if self.state.draining:
            self._deadline = now + self.patience if self._deadline is None else self._deadline
            if now >= self._deadline or not (self.server_state.tasks or self.state.busy):
                self.config.timeout_graceful_shutdown = max(FLUSH, self._deadline - now)  # type: ignore[assignment]
                self.should_exit = True
        return await super().on_tick(counter)


def make_server(app: Service, lifespan: bool = True) -> Server:
    """Return a server of an app, with the patience of its settings."""
    settings: Settings = app.state.service.settings
    proxies = trusted(settings.proxies)
    config = Config(
        app,
        http=Connection,
        ws="none",
        lifespan="on" if lifespan else "off",
        backlog=BACKLOG,
        timeout_keep_alive=IDLE,
        server_header=False,
        access_log=False,
        log_config=None,  # `configured` makes the log
        proxy_headers=bool(proxies),
        forwarded_allow_ips=proxies,
        log_level="error",  # what a stranger sends is no reason to fill the log
    )
    most = _room()
    config.limits = Limits(settings.header_seconds, settings.body_seconds, settings.send_seconds, IDLE, most)
    config.door = Door(app.state.service)
    return Server(config, app)


def _room() -> int:
    """Return how many connections there is room for, having asked for all the file descriptors that may be had."""
    try:
        import resource
    except ImportError:  # Windows
        return CONNECTIONS
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = CONNECTIONS + SPARE
    if soft != resource.RLIM_INFINITY and soft < wanted:
        most = wanted if hard == resource.RLIM_INFINITY else min(hard, wanted)
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
        return max(most - SPARE, SPARE)
    return CONNECTIONS


def serve(host: str, port: int, settings: Settings, insecure: bool = False) -> int:
    """Serve until told to stop; prints where. Returns an exit code: 0, or 1 where a second signal cut it short.

    Raises
    ------
    Misconfigured
        A setting is wrong, or others could reach the service and need no key, which is not said to be meant.
    OSError
        The address is taken or is not one of this machine.
    """
    give_back()
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
    except (OSError, OverflowError, UnicodeError) as error:
        raise OSError(0, str(error), f"{host}:{port}") from None
    try:
        app = create_app(settings)
    except ValueError as error:
        raise Misconfigured(str(error)) from None
    if not (app.state.keyed or insecure or _is_loopback(str(address[0]))):
        raise Misconfigured(
            f"{host} can be reached from other machines and no keys are set: give --api-keys FILE (waywright key NAME "
            "makes one), or --insecure if anybody may use the service"
        )
    with socket.socket(family, socket.SOCK_STREAM) as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind(address)
            listening.listen(BACKLOG)
        except OSError as error:
            raise OSError(error.errno, error.strerror, f"{host}:{port}") from None
        bound = listening.getsockname()[1]
        name = f"[{host}]" if ":" in host else host
        print(f"Waywright is at http://{name}:{bound}", flush=True)
        server = make_server(app)
        with configured(settings):
            server.run(sockets=[listening])
            end_fork_server()
    return 0 if server.started and not server.cut_short else 1


def _is_loopback(address: str) -> bool:
    return ipaddress.ip_address(address.partition("%")[0]).is_loopback
