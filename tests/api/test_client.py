"""The client against the service on a socket of 127.0.0.1, and what both clients share."""

import asyncio
import re
import subprocess
import sys
import time
from datetime import UTC, datetime, timedelta
from email.utils import format_datetime

import httpx2
import numpy as np
import pytest

from api import AsyncClient, Client, Result
from api.client import Given
from api.schemas import MotionBody
from api.wire import problem_error, read_answer, wait_before_retry
from planner import (
    Infeasible,
    InvalidRequest,
    PlannerError,
    Samples,
    TimeLimit,
    TooLarge,
    Trajectory,
    UnknownMethod,
    Unsupported,
)

WAYPOINTS = np.array([[0.0, 0.0], [1.0, 2.0], [2.0, 3.0]])
TIMES = np.array([0.0, 1.0, 2.0])


@pytest.fixture(scope="module")
def url():
    """The address of ``waywright serve`` on a free port."""
    command = [sys.executable, "-m", "api", "serve", "--port", "0"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        address = re.search(r"http://127\.0\.0\.1:\d+", line)
        assert address, line
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            try:
                if httpx2.get(address[0] + "/readyz", trust_env=False).status_code == 200:
                    break
            except httpx2.TransportError:
                pass
            time.sleep(0.1)
        yield address[0]
    finally:
        process.terminate()
        _, errors = process.communicate(timeout=20)
    assert "Traceback" not in errors


@pytest.fixture
def client(url):
    with Client(url) as connection:
        yield connection


def test_plan(client):
    found = client.plan(
        WAYPOINTS,
        times=TIMES,
        limits={"velocity": 3.5, "acceleration": np.array([8.0, 9.0])},
        sampling={"dt": 0.01},
        include=("samples", "polynomial"),
    )
    assert isinstance(found, Result)
    assert (found.method, found.picked_because) == ("minimum_jerk", "times were given")
    assert isinstance(found.samples, Samples) and found.samples.jerk.shape == (201, 2)
    assert isinstance(found.polynomial, Trajectory)
    assert np.abs(found.polynomial(found.samples.time) - found.samples.position).max() < 1e-12
    assert np.array_equal(found.waypoint_times, TIMES)
    assert found.certificate["holds"] and found.solver["status"] == "solved" and found.warnings == ()
    with pytest.raises(AttributeError):
        found.method = "other"


def test_only_what_is_included(client):
    found = client.plan(WAYPOINTS, times=TIMES, method="cubic_spline", options={"boundary": "natural"}, include=())
    assert found.samples is None and found.polynomial is None and found.picked_because is None
    with pytest.raises(ValueError, match="samples"):
        found.plot()


def test_a_hold_keeps_its_polynomial(client):
    limits = {"velocity": 1, "acceleration": 1}
    found = client.plan([[1.0], [1.0]], method="trapezoidal", limits=limits, include=["polynomial"])
    assert found.duration == 0 and found.polynomial is not None


def test_plot(client, tmp_path):
    found = client.plan(WAYPOINTS, times=TIMES, include=("samples", "polynomial"))
    figure = found.plot()
    assert [axes.get_ylabel() for axes in figure.axes] == ["position", "velocity", "acceleration", "jerk"]
    figure.savefig(tmp_path / "x.png")
    assert (tmp_path / "x.png").stat().st_size > 10_000


def test_compare(client):
    methods = ["ruckig", ("minimum_jerk", {}), {"method": "linear"}]
    rows = client.compare(WAYPOINTS, methods, times=TIMES, include=("samples",))
    assert [row["ok"] for row in rows] == [False, True, True]
    assert isinstance(rows[1]["samples"], Samples)
    assert isinstance(problem_error(rows[0]["error"]), Unsupported)
    assert "samples" not in client.compare(WAYPOINTS, ["linear"], times=TIMES)[0]
    (row,) = client.compare(WAYPOINTS, ["linear"], times=TIMES, include=["polynomial"])
    assert isinstance(row["polynomial"], Trajectory) and "samples" not in row


def test_certify(client):
    found = client.plan(WAYPOINTS, times=TIMES, include=("samples", "polynomial"), sampling={"count": 500})
    for trajectory, limits in [
        (found, {"velocity": 4}),
        (found.polynomial, {"velocity": 4}),
        (found.samples, {"velocity": 4}),
        ({"samples": {"time": found.samples.time, "position": found.samples.position}}, {"velocity": 4}),
    ]:
        assert client.certify(trajectory, limits=limits)["holds"]
    assert not client.certify(found, limits={"velocity": 1})["holds"]
    assert client.certify(found, waypoints=WAYPOINTS, times=TIMES, start={"velocity": [0, 0]})["holds"]


def test_methods(client):
    assert "linear" in [entry["id"] for entry in client.methods()]
    assert client.methods("linear")["family"] == "interpolation"
    with pytest.raises(UnknownMethod):
        client.methods("no such?method")


def test_errors_are_the_librarys(client):
    with pytest.raises(InvalidRequest) as invalid:
        client.plan(WAYPOINTS, times=[0, 2, 1])
    assert invalid.value.errors[0].field == "/times/2" and invalid.value.errors_total == 1
    with pytest.raises(UnknownMethod) as unknown:
        client.plan(WAYPOINTS, times=TIMES, method="teleport")
    assert "linear" in unknown.value.known
    with pytest.raises(Unsupported) as unsupported:
        client.plan(WAYPOINTS, times=TIMES, method="linear", limits={"jerk": 1})
    assert unsupported.value.what == "jerk" and unsupported.value.alternatives
    with pytest.raises(Infeasible) as infeasible:
        client.plan([[0], [1]], times=[0, 1], method="minimum_jerk", limits={"velocity": 0.5})
    assert infeasible.value.certified and infeasible.value.quantity == "velocity"
    with pytest.raises(TooLarge):
        client.plan(WAYPOINTS, times=TIMES, sampling={"dt": 1e-12})


def test_what_json_cannot_say_is_refused_here():
    with Client("http://127.0.0.1:1") as nowhere:
        with pytest.raises(InvalidRequest) as caught:
            nowhere.plan(np.array([[0.0], [np.nan]]))
        assert caught.value.errors[0].field == "/waypoints/1/0"
        with pytest.raises(InvalidRequest) as caught:
            nowhere.plan([[0], [1]], limits={"velocity": [1.0, float("inf")]})
        assert caught.value.errors[0].field == "/limits/velocity/1"
        with pytest.raises(httpx2.TransportError):
            nowhere.plan([[0], [1]])


def test_asynchronous(url):
    async def talk():
        async with AsyncClient(url) as client:
            one, two = await asyncio.gather(
                client.plan(WAYPOINTS, times=TIMES), client.plan(WAYPOINTS, times=TIMES, method="linear")
            )
            rows = await client.compare(WAYPOINTS, ["linear"], times=TIMES)
            certificate = await client.certify(one)
            listed = await client.methods()
            with pytest.raises(InvalidRequest):
                await client.plan([[0]])
            return one, two, rows, certificate, listed

    one, two, rows, certificate, listed = asyncio.run(talk())
    assert (one.method, two.method) == ("minimum_jerk", "linear")
    assert rows[0]["ok"] and certificate["holds"] is not None and len(listed) >= 8


def test_the_client_offers_every_field_of_the_contract():
    assert set(Given.__annotations__) == set(MotionBody.model_fields) - {"waypoints", "include"}


def test_a_large_body_on_a_socket(url, problem):
    raw = b'{"waypoints": [' + b" " * 12_000_000 + b"]}"
    headers = {"content-type": "application/json"}
    for content in (raw, (raw[i : i + 65536] for i in range(0, len(raw), 65536))):
        answer = httpx2.post(url + "/v1/trajectories", content=content, headers=headers, trust_env=False)
        assert problem(answer, "too_large")["what"] == "body"
    assert httpx2.get(url + "/healthz", trust_env=False).status_code == 200


def _client(answers):
    """A client whose service gives the answers one after the other."""
    left = iter(answers)
    client = Client("http://service", timeout=2.0)
    client._http = httpx2.Client(base_url="http://service", transport=httpx2.MockTransport(lambda _: next(left)))
    return client


OVERLOADED = {"type": "/errors/overloaded", "title": "busy", "status": 503, "detail": "busy"}


def test_retries():
    busy = httpx2.Response(503, json=OVERLOADED, headers={"retry-after": "0"})
    limited = httpx2.Response(429, json=OVERLOADED | {"type": "/errors/rate_limited"})
    assert _client([busy, limited, httpx2.Response(200, json=[])]).methods() == []
    started = time.monotonic()
    with pytest.raises(PlannerError, match="busy"):
        _client([httpx2.Response(503, json=OVERLOADED, headers={"retry-after": "60"})]).methods()
    assert time.monotonic() - started < 1
    late = {"type": "/errors/timeout", "title": "late", "status": 504, "detail": "late", "seconds": 1.0}
    with pytest.raises(TimeLimit):
        _client([httpx2.Response(504, json=late)]).methods()


def test_waits():
    assert wait_before_retry(500, {}, 0, 10) is None
    assert wait_before_retry(503, {"retry-after": "3"}, 0, 10) == 3
    assert wait_before_retry(503, {"retry-after": "30"}, 0, 10) is None
    assert wait_before_retry(429, {}, 0, 10) == pytest.approx(0.2)
    assert wait_before_retry(429, {"retry-after": "soon"}, 3, 10) == pytest.approx(1.6)
    assert wait_before_retry(503, {"retry-after": "nan"}, 0, 10) == pytest.approx(0.2)
    soon = format_datetime(datetime.now(UTC) + timedelta(seconds=5), usegmt=True)
    assert 3 < wait_before_retry(503, {"retry-after": soon}, 0, 10) <= 5
    assert wait_before_retry(503, {"retry-after": "-5"}, 0, 10) == pytest.approx(0.05)


def test_answers_that_are_not_ours():
    with pytest.raises(PlannerError, match="502"):
        read_answer(502, b"<html>Bad Gateway</html>")
    with pytest.raises(PlannerError, match="not JSON"):
        read_answer(200, b"")
    with pytest.raises(PlannerError, match="418"):
        read_answer(418, b"[]")
    unknown = problem_error({"type": "/errors/teapot", "detail": "short and stout"})
    assert type(unknown) is PlannerError and str(unknown) == "short and stout"
    newer = problem_error({"type": "/errors/too_large", "detail": "big", "what": "x", "limit": 1, "news": 1})
    assert str(newer) == "big"
