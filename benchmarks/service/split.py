"""What a request's time goes into, as the service tells in Server-Timing. In process: no network is between."""

import re
import time
from dataclasses import dataclass
from statistics import median

PARTS = ("validate", "queue", "pose", "solve", "verify", "encode")


@dataclass(frozen=True)
class Split:
    """Medians in ms: the whole request as its sender sees it, and the parts that the service reports."""

    request: str
    method: str
    total: float
    validate: float
    queue: float
    pose: float
    solve: float
    verify: float
    encode: float

    @property
    def rest(self) -> float:
        """What no part accounts for: reading the body, routing, and this test's own client."""
        return self.total - sum(getattr(self, part) for part in PARTS)


def measure(
    rounds: int = 30, names: tuple[str, ...] = ("contract_example", "ur5e_acceleration", "ur5e_jerk")
) -> list[Split]:
    """Return a row a request; the requests are the library's named cases, with the method left to ``auto``."""
    from starlette.testclient import TestClient

    from api.app import create_app
    from planner import CASES

    splits = []
    with TestClient(create_app()) as client:
        while client.get("/readyz").status_code != 200:  # it is still compiling
            time.sleep(0.1)
        for name in names:
            totals: list[float] = []
            parts: list[dict[str, float]] = []
            for _ in range(rounds):
                began = time.perf_counter()
                answer = client.post("/v1/trajectories", json=CASES[name].request)
                totals.append(1e3 * (time.perf_counter() - began))
                answer.raise_for_status()
                parts.append(_parts(answer.headers["server-timing"]))
            middle = {part: median(p.get(part, 0.0) for p in parts) for part in PARTS}
            splits.append(Split(name, answer.json()["method"], median(totals), **middle))
    return splits


def _parts(header: str) -> dict[str, float]:
    return {name: float(ms) for name, ms in re.findall(r"(\w+)\s*;\s*dur=([0-9.eE+-]+)", header)}
