"""The service's settings, from the environment: caps, which it can lower but never raise, and how the service runs."""

import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Self

#: Bytes of a body over its cap that are read and dropped, so that the client hears the answer.
DRAIN_BYTES = 64 * 2**20

PREFIX = "WAYWRIGHT_"


@dataclass(frozen=True)
class Caps:
    """What one request may cost: bytes of the body, waypoints, joints, samples x joints, seconds."""

    body_bytes: int = 8 * 2**20
    waypoints: int = 10_000
    joints: int = 64
    samples: int = 2_000_000
    timeout: float = 60.0

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] | None = None) -> Self:
        """Read ``WAYWRIGHT_BODY_BYTES``, ``WAYWRIGHT_WAYPOINTS``, … where they are set.

        Raises
        ------
        ValueError
            A value is not a number or is above the built-in cap.
        """
        chosen = _numbers(cls, os.environ if environment is None else environment)
        for f in fields(cls):
            if f.name in chosen and not 0 < chosen[f.name] <= f.default:
                most = f"at most {f.default:,}"
                raise ValueError(f"{PREFIX}{f.name.upper()} must be above 0 and {most}: caps can only be lowered")
        return cls(**chosen)

    def listed(self) -> dict[str, float]:
        """Return the caps as ``GET /v1/limits`` lists them."""
        return asdict(self)


def _cores() -> int:
    return max(2, min(os.cpu_count() or 1, 8))


@dataclass(frozen=True)
class Settings:
    """How the service runs.

    Parameters
    ----------
    caps
        On one request.
    workers
        Solver processes.
    queue
        Requests that may wait for a solver; what comes beyond is refused at once.
    turns
        Quick requests that may wait for their turn on the event loop.
    recycle
        Requests after which a solver is replaced by a new one.
    header_seconds, body_seconds, send_seconds
        What a client may take to send its headers and its body, and how long it may take nothing of its answer.
    drain_seconds
        What requests in flight have to end when the service is told to stop.
    api_keys
        File of hashed keys, read at start; see ``api.keys``.
    api_keys_hashed
        The same lines as the file has, separated by commas; only these, or besides the file's.
    rate
        Requests per key, or per address without keys: ``600/minute``. Empty: no limit.
    cors
        Origins, separated by spaces, whose pages may call the service. Empty: none.
    proxies
        Addresses or networks, separated by commas, whose ``X-Forwarded-For`` is believed. Empty: none.
    log
        ``json``, ``console``, ``off``, or ``auto``: console on a terminal, else JSON.
    """

    caps: Caps = field(default_factory=Caps)
    workers: int = field(default_factory=_cores)
    queue: int = field(default_factory=_cores)
    turns: int = 16
    recycle: int = 1_000
    header_seconds: float = 10.0
    body_seconds: float = 30.0
    send_seconds: float = 30.0
    drain_seconds: float = 65.0
    api_keys: str = ""
    api_keys_hashed: str = ""
    rate: str = ""
    cors: str = ""
    proxies: str = ""
    log: str = "auto"

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] | None = None) -> Self:
        """Read ``WAYWRIGHT_WORKERS``, ``WAYWRIGHT_QUEUE``, … and the caps, where they are set.

        Raises
        ------
        ValueError
            A value is not a number, is not above 0, is above a cap, or a name is not known.
        """
        environment = os.environ if environment is None else environment
        known = {f"{PREFIX}{f.name.upper()}" for f in (*fields(cls), *fields(Caps)) if f.name != "caps"} | _ELSEWHERE
        for name in environment:
            if name.startswith(PREFIX) and name not in known:
                raise ValueError(f"there is no setting {name}; there are {', '.join(sorted(known))}")
        chosen = _numbers(cls, environment)
        for name, value in chosen.items():
            least = 0 if name in ("queue", "turns") else 1 if isinstance(value, int) else 1e-3
            if not isinstance(value, str) and not value >= least:
                raise ValueError(f"{PREFIX}{name.upper()} must be at least {least:g}")
        if chosen.get("log", "auto") not in ("auto", "json", "console", "off"):
            raise ValueError(f"{PREFIX}LOG must be auto, json, console or off")
        return cls(caps=Caps.from_environment(environment), **chosen)


#: Names that other parts of the project read.
_ELSEWHERE = {f"{PREFIX}{name}" for name in ("BROWSER", "EXAMPLES", "RANDOM", "SEEDS")}


def _numbers(cls: type, environment: Mapping[str, str]) -> dict[str, Any]:
    """Return what the environment sets of a dataclass' fields, each in its type.

    Raises
    ------
    ValueError
        A value is not a number where one is needed.
    """
    kinds = {"int": int, "float": float, "str": str, int: int, float: float, str: str}
    chosen: dict[str, Any] = {}
    for f in fields(cls):
        text, kind = environment.get(f"{PREFIX}{f.name.upper()}"), kinds.get(f.type)
        if text is None or kind is None:
            continue
        try:
            chosen[f.name] = kind(text)
        except ValueError:
            raise ValueError(f"{PREFIX}{f.name.upper()} must be a number, not {text!r}") from None
    return chosen


#: For the command line, where the machine is the caller's own: no caps but that on samples, which a typing error in
#: ``dt`` would fill the memory with.
LOCAL = Caps(body_bytes=2**62, waypoints=2**62, joints=2**62, timeout=1e9)
