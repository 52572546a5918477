"""The command: where it listens, and how it ends. One process for all, whose start takes as long as its kernels."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Thread
from typing import IO

import httpx2
import psutil
import pytest

from api.__main__ import main
from api.serving import _is_loopback

ROOT = Path(__file__).parents[2]
LONG = {
    "waypoints": [[0, 0], [1, 2], [2, 0], [3, 1]],
    "method": "time_optimal_nlp",
    "options": {"stations": 1000},
    "limits": {"velocity": 1, "acceleration": 2, "jerk": 10},
    "include": ["polynomial"],
}


def test_other_machines_are_not_let_in_without_keys(capsys, monkeypatch):
    monkeypatch.delenv("WAYWRIGHT_API_KEYS", raising=False)
    for host in ("0.0.0.0", "::"):
        assert main(["serve", "--host", host, "--port", "0"]) == 2
        said = capsys.readouterr().err
        assert "--api-keys" in said and "--insecure" in said and said.count("\n") == 1


def test_loopback():
    for address in ("127.0.0.1", "127.9.9.9", "::1", "::1%lo"):
        assert _is_loopback(address)
    for address in ("0.0.0.0", "::", "192.168.0.1", "10.0.0.1", "fe80::1%eth0", "2001:db8::1"):
        assert not _is_loopback(address)


def test_wrong_settings_are_one_line(capsys, monkeypatch, tmp_path):
    for name, value in (
        ("RATE", "often"),
        ("CORS", "example.org"),
        ("PROXIES", "*"),
        ("API_KEYS", str(tmp_path / "x")),
    ):
        with monkeypatch.context() as patch:
            patch.setenv(f"WAYWRIGHT_{name}", value)
            assert main(["serve", "--port", "0"]) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1 and "Traceback" not in said and said.startswith("waywright: ")
    assert main(["serve", "--api-keys", ""]) == 2
    capsys.readouterr()


@contextmanager
def serving(
    *arguments: str, stderr: IO[str] | None = None, **settings: str
) -> Iterator[tuple[subprocess.Popen[str], httpx2.Client]]:
    environment = os.environ | {f"WAYWRIGHT_{name.upper()}": value for name, value in settings.items()}
    environment["NO_PROXY"] = environment["no_proxy"] = "127.0.0.1"
    command = [sys.executable, "-m", "api", "serve", "--port", "0", *arguments]
    environment.setdefault("WAYWRIGHT_LOG", "off")
    process = subprocess.Popen(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, stderr=stderr, text=True)
    try:
        assert process.stdout is not None
        url = re.search(r"http://\S+", process.stdout.readline())[0]
        url = url.replace("0.0.0.0", "127.0.0.1")
        with httpx2.Client(base_url=url, timeout=60, trust_env=False) as client:
            yield process, client
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def until_ready(client: httpx2.Client) -> None:
    deadline = time.monotonic() + 240
    while time.monotonic() < deadline:
        try:
            if client.get("/readyz").status_code == 200:
                return
        except httpx2.TransportError:
            pass
        time.sleep(0.1)
    raise AssertionError("not ready in time")


@pytest.fixture(scope="module")
def service() -> Iterator[tuple[subprocess.Popen[str], httpx2.Client]]:
    with serving(workers="2", queue="2", header_seconds="1", body_seconds="1") as found:
        until_ready(found[1])
        yield found


class Asking(Thread):
    """A request in a thread of its own, with a connection of its own."""

    def __init__(self, client: httpx2.Client, path: str, body: object) -> None:
        super().__init__(daemon=True)
        self.url, self.body, self.answer, self.error = f"{str(client.base_url).rstrip('/')}{path}", body, None, None
        self.start()

    def run(self) -> None:
        try:
            self.answer = httpx2.post(self.url, json=self.body, timeout=90, trust_env=False)
        except httpx2.TransportError as error:
            self.error = error


def test_it_answers(service):
    _, client = service
    body = {"waypoints": [[0], [1]], "times": [0, 1], "method": "linear"}
    response = client.post("/v1/trajectories", json=body)
    assert response.status_code == 200 and "server" not in response.headers
    for path in ("/healthz", "/v1/limits", "/docs", "/openapi.json"):
        assert client.get(path).status_code == 200


def test_slow_clients_are_told_or_closed(service):
    _, client = service
    address = (client.base_url.host, client.base_url.port)
    head = b"POST /v1/trajectories HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: 9\r\n\r\n"
    for raw, answer in ((b"GET / HT", b""), (head + b"{", b"HTTP/1.1 408 ")):
        with socket.create_connection(address, timeout=8) as connection:
            connection.sendall(raw)
            assert connection.recv(65536)[: len(answer) or 1] == answer


@contextmanager
def solving(process: subprocess.Popen[str], client: httpx2.Client, asking: Asking) -> Iterator[None]:
    """Hold the solvers once one of them is at work, so that it is at work for as long as the test needs."""
    while "waywright_solvers_busy 0.0\n" in client.get("/metrics").text:
        assert asking.is_alive(), asking.answer and asking.answer.text[:300]
    children = psutil.Process(process.pid).children()
    solvers = [one for child in children if any("forkserver" in w for w in child.cmdline()) for one in child.children()]
    assert solvers
    for each in solvers:
        with suppress(psutil.Error):
            each.suspend()
    try:
        yield
    finally:
        for each in solvers:
            with suppress(psutil.Error):
                each.resume()


def test_sigterm_lets_what_has_begun_finish(service):
    """The last test of the process."""
    process, client = service
    asking = Asking(client, "/v1/trajectories", LONG)
    with solving(process, client, asking):
        assert asking.is_alive(), asking.answer and asking.answer.text[:300]
        process.send_signal(signal.SIGTERM)
        until = time.monotonic() + 10
        while client.get("/readyz").status_code != 503 and time.monotonic() < until:
            time.sleep(0.01)
        refused = client.post("/v1/trajectories", json=LONG)
        assert refused.status_code == 503 and refused.headers["connection"] == "close"
        assert json.loads(refused.content)["reason"] == "stopping"
        assert asking.is_alive()
    asking.join(90)
    assert asking.answer is not None and asking.answer.status_code == 200, asking.answer and asking.answer.text[:300]
    assert process.wait(10) == 0


@pytest.mark.slow
@pytest.mark.parametrize("sig", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.parametrize("ready", [False, True])
def test_a_signal_ends_an_idle_service_at_once_and_without_a_word(sig, ready, tmp_path):
    with open(tmp_path / "said", "w+") as said, serving(stderr=said) as (process, client):
        if ready:
            until_ready(client)
        while True:
            try:
                assert client.get("/healthz").status_code == 200
                break
            except httpx2.ConnectError:
                time.sleep(0.1)
        began = time.monotonic()
        process.send_signal(sig)
        assert process.wait(15) == 0
        assert time.monotonic() - began < (3 if ready else 6)
        said.seek(0)
        assert not said.read()


@pytest.mark.slow
@pytest.mark.parametrize("second", [False, True])
def test_the_end_comes_in_time_or_at_the_second_signal(second):
    with serving(drain_seconds="60" if second else "1") as (process, client):
        until_ready(client)
        asking = Asking(client, "/v1/trajectories", LONG)
        with solving(process, client, asking):
            began = time.monotonic()
            process.send_signal(signal.SIGTERM)
            if second:
                time.sleep(0.3)
                process.send_signal(signal.SIGTERM)
            assert process.wait(20) == (1 if second else 0)
            assert time.monotonic() - began < 8
        asking.join(10)
        assert asking.answer is None or asking.answer.status_code >= 500


@pytest.mark.slow
def test_keys_let_other_machines_in(tmp_path, capsys):
    assert main(["key", "ann"]) == 0
    key, line = re.findall(r": (.*)\n", capsys.readouterr().out)
    file = tmp_path / "keys"
    file.write_text(line + "\n")
    with serving("--host", "0.0.0.0", "--api-keys", str(file)) as (_, client):
        until_ready(client)
        assert client.get("/v1/limits").status_code == 401
        assert client.get("/v1/limits", headers={"X-API-Key": key}).status_code == 200
