"""What a request costs the service: process time beside a bare handler's, and the time that the solver processes add.

Both run as processes of their own and are asked in turn over one connection each. What counts is the process time of
the server, which one core can spend but once: its inverse is the requests a second at which the core is full. Clock
times hold the client's work too.
"""

import contextlib
import http.client
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from random import Random
from statistics import median
from typing import Any

import psutil

from api.engine.lanes import READ

#: Samples and joints of the answer.
COUNT, JOINTS = 1000, 7

#: Requests of a round; the rounds of both servers take turns.
EACH = 25

FORMATS = {"MessagePack": "application/msgpack", "JSON": "application/json"}


@dataclass(frozen=True)
class Cost:
    """Medians over the rounds, ms a request: process time of the server and the clock; ``goal`` for the ratio."""

    what: str
    ours_ms: float
    theirs_ms: float | None
    clock_ms: float
    goal: float | None

    @property
    def ratio(self) -> float | None:
        """Our requests a second and core as a share of the bare handler's."""
        return None if self.theirs_ms is None else self.theirs_ms / self.ours_ms


def body(method: str = "cubic_spline", count: int = COUNT) -> dict[str, Any]:
    """Return a plan of 20 waypoints and 7 joints."""
    random, points = Random(7), 20
    waypoints = [[random.uniform(-2, 2) for _ in range(JOINTS)] for _ in range(points)]
    times = [0.5 * i for i in range(points)]
    return {"waypoints": waypoints, "times": times, "method": method, "sampling": {"count": count}}


def measure(rounds: int = 15) -> list[Cost]:
    """Return a row a format, and one for what the way to a solver and back adds."""
    with served("api", "serve", "--port", "0") as ours, served("benchmarks.service.bare") as bare:
        costs = [_beside_bare(name, kind, ours, bare, rounds) for name, kind in FORMATS.items()]
        return [*costs, _pool(ours, rounds)]


def _beside_bare(name: str, kind: str, ours: "Server", bare: "Server", rounds: int) -> Cost:
    raw, headers = json.dumps(body()).encode(), {"Content-Type": "application/json", "Accept": kind}
    spent: dict[Server, list[tuple[float, float]]] = {ours: [], bare: []}
    for turn in range(rounds + 1):
        for server, found in spent.items():
            cost = server.ask(raw, headers, EACH)
            if turn:  # the first warms up
                found.append(cost)
    process = {server: median(c[0] for c in found) for server, found in spent.items()}
    goal = 0.6 if name == "MessagePack" else 0.7
    clock = median(c[1] for c in spent[ours])
    return Cost(f"cubic spline, {COUNT} samples, {name}", process[ours], process[bare], clock, goal)


def _pool(ours: "Server", rounds: int) -> Cost:
    """Measure the same plan on the event loop and in a solver; few samples, so that little else varies.

    A solver gets it through ``?shape=ruckig`` or a large body, never by its own choice: here bodies are padded with
    blanks, one to the last size that is read on the event loop, one by a byte more, so that reading costs both the
    same.
    """
    plain = json.dumps(body(count=10) | {"include": ["samples"]}).encode()
    small, large = (plain[:-1] + b" " * (size - len(plain)) + b"}" for size in (READ, READ + 1))
    headers = {"Content-Type": "application/json"}
    added = []
    for turn in range(rounds + 1):
        inline, pooled = (ours.middle(raw, headers, EACH) for raw in (small, large))
        if turn:
            added.append(pooled - inline)
    return Cost("added by a solver process (clock)", median(added), None, median(added), 0.3)


class Server:
    """A process that serves, and one connection to it."""

    def __init__(self, process: "subprocess.Popen[str]", port: int) -> None:
        self.process = psutil.Process(process.pid)
        self.address = f"http://127.0.0.1:{port}"
        self.connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)

    def ask(self, raw: bytes, headers: dict[str, str], times: int) -> tuple[float, float]:
        """Return the process time of the server and the clock time, ms a request."""
        cpu, began = self._cpu(), time.perf_counter()
        for _ in range(times):
            self._once(raw, headers)
        return 1e3 * (self._cpu() - cpu) / times, 1e3 * (time.perf_counter() - began) / times

    def middle(self, raw: bytes, headers: dict[str, str], times: int) -> float:
        """Return the median clock time of a request, ms."""
        found = []
        for _ in range(times):
            began = time.perf_counter()
            self._once(raw, headers)
            found.append(1e3 * (time.perf_counter() - began))
        return median(found)

    def _once(self, raw: bytes, headers: dict[str, str]) -> None:
        self.connection.request("POST", "/v1/trajectories", raw, headers)
        answer = self.connection.getresponse()
        content = answer.read()
        if answer.status != 200:
            raise RuntimeError(f"{answer.status}: {content[:300]!r}")

    def _cpu(self) -> float:
        """Return the process time so far, s, as finely as the kernel counts it."""
        with contextlib.suppress(OSError), open(f"/proc/{self.process.pid}/schedstat", encoding="ascii") as file:
            found = sum(self._thread(t) for t in os.listdir(f"/proc/{self.process.pid}/task"))
            return found or 1e-9 * float(file.read().split()[0])
        times = self.process.cpu_times()
        return float(times.user + times.system)

    def _thread(self, thread: str) -> float:
        with open(f"/proc/{self.process.pid}/task/{thread}/schedstat", encoding="ascii") as file:
            return 1e-9 * float(file.read().split()[0])


@contextlib.contextmanager
def served(*module: str) -> Iterator[Server]:
    """Run a module that prints where it serves, until it is ready and as long as it is wanted."""
    with subprocess.Popen(
        [sys.executable, "-m", *module], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        try:
            assert process.stdout is not None
            found = re.search(r":(\d+)\s*$", process.stdout.readline())
            if found is None:
                raise RuntimeError(f"{' '.join(module)} did not say where it serves")
            server = Server(process, int(found[1]))
            _wait(server)
            yield server
        finally:
            process.terminate()


def _wait(server: Server, patience: float = 300.0) -> None:
    end = time.monotonic() + patience
    while time.monotonic() < end:
        try:
            server.connection.request("GET", "/readyz")
            answer = server.connection.getresponse()
            answer.read()
            if answer.status == 200:
                return
        except ConnectionError:  # it does not listen yet
            server.connection.close()
        time.sleep(0.2)
    raise RuntimeError("the service did not become ready")
