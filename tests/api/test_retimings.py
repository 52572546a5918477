"""POST /v1/retimings: anyone's trajectory, the same path with the best timing."""

import asyncio
import csv
import io
import json
import threading
import time

import numpy as np
import pytest
import uvicorn

from api import AsyncClient, Client
from api.__main__ import main
from api.answers import PlanReply
from api.app import create_app
from api.formats import FORMATS
from planner import Infeasible, InvalidRequest, PlanRequest, Recorded, Trajectory, plan, sample
from planner.types import Sampling

RETIME = "/v1/retimings"
ROS2 = "application/vnd.ros2.joint-trajectory+json"
LIMITS = {"velocity": 2, "acceleration": 5}
POSITION = [[0, 0], [1, 2], [2, 3], [1, 1]]
SAMPLES = {"time": [0, 1, 2, 3.5], "position": POSITION}
BEND = {"breaks": [0, 1, 3], "coefficients": [[[0, 0], [1, 1]], [[1, 0], [1, 2]], [[0, 1], [0, -1]]]}
POINTS = [
    {"positions": p, "velocities": [], "accelerations": [], "effort": [], "time_from_start": {"sec": i, "nanosec": 5}}
    for i, p in enumerate(POSITION)
]
MESSAGE = {
    "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
    "joint_names": ["shoulder", "elbow"],
    "points": POINTS,
}
KINDS = {"polynomial": {"polynomial": BEND}, "samples": {"samples": SAMPLES}, "ros2": MESSAGE}


def body(trajectory, **given):
    return {"trajectory": trajectory, "limits": LIMITS, **given}


def retime(service, trajectory, **given):
    response = service.post(RETIME, json=body(trajectory, **given))
    assert response.status_code == 200, response.text[:1000]
    PlanReply.model_validate(response.json())
    return response.json()


def codes(answer):
    return [w["code"] for w in answer["warnings"]]


@pytest.mark.parametrize("kind", KINDS)
def test_the_answer_is_a_plan(service, kind):
    found = retime(service, KINDS[kind], include=["samples", "polynomial"])
    certificate = found["certificate"]
    assert certificate["holds"] and certificate["basis"] == "exact"
    assert {c["quantity"]: c["bound"] for c in certificate["checks"]}.keys() == {"velocity", "acceleration"}
    assert certificate["waypoint_error"] < 1e-9 and certificate["path_deviation"] < 1e-9
    assert certificate["boundary_error"] < 1e-9 and certificate["objective"]["name"] == "duration"
    assert len(found["samples"]["time"]) == 200 and found["samples"]["time"][-1] == found["duration"]
    assert max(c["ratio"] if c["ratio"] > 0 else -c["ratio"] for c in certificate["checks"]) > 0.99
    assert found["waypoint_times"][0] == 0 and found["waypoint_times"][-1] == found["duration"]
    assert "picked_because" not in found and found["method"] == "time_optimal_path"


def test_samples_are_passed_at_the_waypoint_times(service):
    found = retime(service, {"samples": SAMPLES}, include=["polynomial"])
    pieces = found["polynomial"]
    motion = Trajectory.from_powers(pieces["breaks"], pieces["coefficients"])
    assert np.abs(motion(found["waypoint_times"]) - POSITION).max() < 1e-9
    assert found["duration"] < 3.5
    assert "samples" not in found


def test_the_path_of_a_polynomial_is_followed(service):
    found = retime(service, {"polynomial": BEND}, sampling={"dt": 0.01})
    path = Trajectory.from_powers(BEND["breaks"], BEND["coefficients"])
    curve = path(np.linspace(0, 3, 20_001))
    for row in found["samples"]["position"][::7]:
        assert np.linalg.norm(curve - row, axis=1).min() < 2e-4
    assert len(found["waypoint_times"]) == 3  # its breaks


@pytest.mark.parametrize("kind", KINDS)
def test_a_jerk_limit_is_kept(service, kind):
    polynomial = {"polynomial": {"breaks": [0, 2], "coefficients": [[[0, 0]], [[1, 0]], [[0, 1]]]}}
    trajectory = polynomial if kind == "polynomial" else KINDS[kind]
    found = retime(service, trajectory, limits={**LIMITS, "jerk": 50})
    rows = {c["quantity"]: c for c in found["certificate"]["checks"]}
    assert rows["jerk"]["holds"] and found["certificate"]["holds"]
    assert found["duration"] > retime(service, trajectory)["duration"]


def test_a_ros_2_message_has_names_and_may_have_no_times(service):
    response = service.post(RETIME, json=body(MESSAGE), headers={"accept": ROS2})
    again = response.json()
    assert again["joint_names"] == ["shoulder", "elbow"]
    timed = service.post(RETIME, json=body(again, sampling={"count": 20}), headers={"accept": ROS2})
    assert timed.status_code == 200 and len(timed.json()["points"]) == 20
    untimed = [{"positions": p} for p in POSITION]
    found = retime(service, {"joint_names": ["a", "b"], "points": untimed})
    assert found["duration"] == retime(service, {"samples": SAMPLES})["duration"]
    assert retime(service, {"points": untimed}, joint_names=["a", "b"])["duration"] == found["duration"]


def test_what_was_planned_is_not_slowed_by_much(service):
    limits = {"velocity": 1.5, "acceleration": 4}
    first = service.post("/v1/trajectories", json={"waypoints": POSITION, "limits": limits, "method": "toppra"}).json()
    samples = {k: first["samples"][k] for k in ("time", "position", "velocity", "acceleration")}
    found = retime(service, {"samples": samples}, limits=limits)
    assert found["duration"] < 1.01 * first["duration"]
    assert "accelerations_unused" in codes(found)


def test_equal_neighbours_are_merged(service):
    doubled = {"time": [0, 1, 2, 3, 4, 5], "position": [POSITION[i] for i in (0, 1, 1, 2, 3, 3)]}
    found, once = retime(service, {"samples": doubled}), retime(service, {"samples": SAMPLES})
    assert codes(found) == ["samples_merged"]
    times = found["waypoint_times"]
    assert times[1] == times[2] and times[4] == times[5] and len(times) == 6
    assert found["duration"] == pytest.approx(once["duration"])


def test_nothing_moves(service):
    for trajectory in (
        {"samples": {"time": [0, 1], "position": [[1, 2], [1, 2]]}},
        {"polynomial": {"breaks": [0, 4], "coefficients": [[[1, 2]], [[0, 0]]]}},
        {"polynomial": {"breaks": [0, 0], "coefficients": [[[1, 2]]]}},
    ):
        found = retime(service, trajectory)
        assert found["duration"] == 0 and found["certificate"]["holds"]
        assert found["samples"]["position"] == [[1, 2], [1, 2]]


def noisy(seed, tolerance, count=1500):
    rng = np.random.default_rng(seed)
    waypoints = rng.uniform(-1, 1, (4, 3))
    smooth = plan(PlanRequest.of(waypoints, times=[0, 1, 2, 3]), "minimum_jerk").trajectory
    time = np.linspace(0, 3, count)
    noise = np.clip(rng.normal(size=(count, 3)) * tolerance / 3, -tolerance, tolerance)
    return {"time": time.tolist(), "position": (smooth(time) + noise).tolist()}


@pytest.mark.parametrize("tolerance", [0.01, 0.001])
def test_noisy_dense_samples_are_smoothed(service, tolerance):
    samples = noisy(7, tolerance)
    found = retime(service, {"samples": samples}, tolerance=tolerance, include=["samples", "polynomial"])
    row = found["certificate"]["checks"][-1]
    assert row["quantity"] == "tolerance" and row["bound"] == tolerance and row["holds"]
    assert 0 < found["certificate"]["path_deviation"] == row["value"] <= tolerance
    assert found["samples"]["position"][0] == pytest.approx(samples["position"][0], abs=1e-12)
    assert found["samples"]["position"][-1] == pytest.approx(samples["position"][-1], abs=1e-12)
    assert found["waypoint_times"] == [0, found["duration"]]
    pieces = found["polynomial"]
    motion = Trajectory.from_powers(pieces["breaks"], pieces["coefficients"])
    dense = motion(np.linspace(motion.start, motion.end, 30_000))
    apart = [np.abs(dense - q).max(axis=1).min() for q in np.array(samples["position"])[::23]]
    assert max(apart) < 1.01 * tolerance
    assert found["duration"] < 3.2  # of the path itself; that of the noise takes many times longer


def test_samples_within_the_tolerance_of_one_position(service):
    rng = np.random.default_rng(0)
    position = np.concatenate([[[1.0]], 1 + rng.uniform(-0.01, 0.01, (50, 1)), [[1.0]]])
    samples = {"time": list(range(52)), "position": position.tolist()}
    found = retime(service, {"samples": samples}, tolerance=0.02)
    assert found["duration"] == 0 and found["certificate"]["path_deviation"] < 0.01


def test_a_tolerance_of_nothing_passes_every_sample(service):
    found = retime(service, {"samples": SAMPLES}, tolerance=0)
    assert codes(found) == ["not_smoothed"] and len(found["waypoint_times"]) == 4
    assert found["certificate"]["path_deviation"] < 1e-9


def test_what_moves_at_an_end_is_told(service):
    assert codes(retime(service, {"polynomial": BEND})) == ["starts_and_ends_at_rest"]
    rates = {"velocity": [[1, 0], [1, 1], [0, 1], [-1, 0]]}
    assert "starts_and_ends_at_rest" in codes(retime(service, {"samples": SAMPLES | rates}))


POINT = {"positions": [0, 0], "time_from_start": {"sec": 0}}


@pytest.mark.parametrize(
    "changes, field, code",
    [
        ({"trajectory": None}, "/trajectory", "wrong_type"),
        ({"trajectory": {}}, "/trajectory", "conflict"),
        ({"trajectory": {"samples": SAMPLES, "polynomial": BEND}}, "/trajectory", "conflict"),
        ({"trajectory": {"samples": SAMPLES, "joint_names": ["a", "b"]}}, "/trajectory/joint_names", "conflict"),
        ({"trajectory": {"spline": 1}}, "/trajectory/spline", "unknown_field"),
        ({"limits": None}, "/limits", "wrong_type"),
        ({"limits": {}}, "/limits/acceleration", "missing"),
        ({"limits": {"acceleration": [1, None]}}, "/limits/acceleration", "bad_limits"),
        ({"limits": {"acceleration": [1, 2, 3]}}, "/limits/acceleration", "shape_mismatch"),
        ({"limits": {"acceleration": -1}}, "/limits/acceleration", "bad_limits"),
        ({"tolerance": -1}, "/tolerance", "out_of_range"),
        ({"tolerance": [0.1, 0.2]}, "/tolerance", "wrong_type"),
        ({"tolerance": 0.1, "trajectory": {"polynomial": BEND}}, "/tolerance", "conflict"),
        ({"method": "toppra"}, "/method", "unknown_field"),
        ({"sampling": {"dt": 0}}, "/sampling/dt", "out_of_range"),
        ({"sampling": {"times": [0, 1e6]}}, "/sampling/times/1", "out_of_range"),
        ({"timeout": 1000}, "/timeout", "out_of_range"),
        ({"joint_names": ["a"]}, "/joint_names", "shape_mismatch"),
        ({"joint_names": ["a", "b"], "trajectory": MESSAGE}, "/joint_names", "conflict"),
        ({"duration": {"min": 3, "max": 2}}, "/duration", "bad_duration"),
        ({"include": ["everything"]}, "/include/0", "out_of_range"),
        ({"trajectory": {"samples": {"time": [0], "position": [[0]]}}}, "/trajectory/samples/time", "too_few_points"),
        (
            {"trajectory": {"samples": {**SAMPLES, "time": [0, 1, 1, 2]}}},
            "/trajectory/samples/time/2",
            "not_increasing",
        ),
        (
            {"trajectory": {"samples": {**SAMPLES, "position": [[0, 0], [1, 1], [2, 2], [3]]}}},
            "/trajectory/samples/position/3",
            "shape_mismatch",
        ),
        (
            {"trajectory": {"samples": {**SAMPLES, "position": [[0, 0], [1, 1], [2, 2], [3, 1e10]]}}},
            "/trajectory/samples/position/3/1",
            "out_of_range",
        ),
        (
            {"trajectory": {"samples": {**SAMPLES, "velocity": [[0, 0]]}}},
            "/trajectory/samples/velocity",
            "shape_mismatch",
        ),
        (
            {"trajectory": {"polynomial": {**BEND, "breaks": [0, 1, 1]}}},
            "/trajectory/polynomial/breaks/2",
            "not_increasing",
        ),
        ({"trajectory": {"points": []}}, "/trajectory/points", "too_few_points"),
        (
            {"trajectory": {"points": [POINT, POINT | {"positions": [1]}]}},
            "/trajectory/points/1/positions",
            "shape_mismatch",
        ),
        (
            {"trajectory": {"points": [POINT, POINT | {"time_from_start": {"sec": 2}}, POINT]}},
            "/trajectory/points/2/time_from_start",
            "not_increasing",
        ),
        (
            {"trajectory": {"points": [*POINTS[:3], POINTS[3] | {"velocities": [1, 2]}]}},
            "/trajectory/points/3/velocities",
            "shape_mismatch",
        ),
        ({"trajectory": {"points": [POINT | {"effort": [1]}]}}, "/trajectory/points/0/effort", "out_of_range"),
        ({"trajectory": MESSAGE | {"joint_names": ["a"]}}, "/trajectory/joint_names", "shape_mismatch"),
    ],
)
def test_requests_that_are_wrong(service, problem, changes, field, code):
    response = service.post(RETIME, json=body({"samples": SAMPLES}) | changes)
    document = problem(response, "invalid_request")
    assert (field, code) in [(e["field"], e["code"]) for e in document["errors"]], document


def test_fields_that_are_missing(service, problem):
    document = problem(service.post(RETIME, json={}), "invalid_request")
    assert {(e["field"], e["code"]) for e in document["errors"]} == {("/trajectory", "missing"), ("/limits", "missing")}


@pytest.mark.parametrize(
    "limit, what",
    [({"torque": 1}, "torque"), ({"tip_speed": 1}, "tip_speed")],
)
def test_limits_that_are_not_honoured(service, problem, limit, what):
    document = problem(service.post(RETIME, json=body({"samples": SAMPLES}, limits=LIMITS | limit)), "unsupported")
    assert what in document["what"] and document["alternatives"] == []


def test_infeasible(service, problem):
    narrow = {**LIMITS, "position": {"lower": -1, "upper": 2.5}}
    document = problem(service.post(RETIME, json=body({"samples": SAMPLES}, limits=narrow)), "infeasible")
    assert (document["quantity"], document["joint"]) == ("position", 1)
    for trajectory in ({"samples": SAMPLES}, {"polynomial": BEND}):
        document = problem(service.post(RETIME, json=body(trajectory, duration={"max": 0.5})), "infeasible")
        assert document["quantity"] == "duration" and document["needed"] > 0.5


def test_a_duration_is_kept(service):
    found = retime(service, {"samples": SAMPLES}, duration={"min": 9, "max": 9})
    assert found["duration"] == pytest.approx(9, rel=1e-9)
    assert [c["quantity"] for c in found["certificate"]["checks"]][-1] == "duration"


@pytest.mark.parametrize(
    "changes",
    [
        {"trajectory": {"samples": {"time": list(range(10_001)), "position": [[i] for i in range(10_001)]}}},
        {"trajectory": {"points": [{"positions": [i]} for i in range(10_001)]}},
        {"trajectory": {"samples": {"time": [0, 1], "position": [[0] * 65, [1] * 65]}}},
        {"trajectory": {"polynomial": {"breaks": list(range(10_001)), "coefficients": [[[0]] * 10_000]}}},
        {"sampling": {"count": 10**9}},
        {"sampling": {"dt": 1e-9}},
    ],
    ids=["samples", "points", "joints", "breaks", "count", "dt"],
)
def test_more_than_the_caps_allow(service, problem, changes):
    problem(service.post(RETIME, json=body({"samples": SAMPLES}) | changes), "too_large")


def test_formats_headers_and_digest(service, problem):
    asked = body({"samples": SAMPLES}, joint_names=["a", "b"])
    response = service.post(RETIME, json=asked, headers={"x-request-id": "me"})
    assert response.headers["x-request-id"] == "me"
    for name in ("validate", "pose", "solve", "verify", "encode"):
        assert f"{name};dur=" in response.headers["server-timing"]
    text = service.post(RETIME, json=asked, headers={"accept": "text/csv"}).text
    rows = list(csv.reader(io.StringIO(text)))
    assert rows[0][:3] == ["time", "position_a", "position_b"] and len(rows) == 201
    message = service.post(RETIME, json=asked, headers={"accept": ROS2}).json()
    assert message["joint_names"] == ["a", "b"] and len(message["points"]) == 200
    problem(service.post(RETIME, json=asked, headers={"accept": "image/png"}), "not_acceptable")
    problem(service.post(RETIME, json=asked | {"include": []}, headers={"accept": "text/csv"}), "invalid_request")
    problem(service.post(RETIME + "?shape=ruckig", json=asked), "invalid_request")
    problem(service.post(RETIME, content=b"[1", headers={"content-type": "application/json"}), "invalid_request")
    problem(service.get(RETIME), "method_not_allowed")
    digests = {retime(service, {"samples": SAMPLES}, **more)["digest"] for more in ({}, {"tolerance": 0.5}, {})}
    assert len(digests) == 2


@pytest.mark.parametrize("kind", KINDS)
def test_the_same_request_gives_the_same_bytes(service, kind):
    asked = body(KINDS[kind], include=["samples", "polynomial"])
    first, second = (service.post(RETIME, json=asked).content for _ in range(2))
    assert first == second
    smooth = body({"samples": noisy(3, 0.01, 300)}, tolerance=0.01)
    assert service.post(RETIME, json=smooth).content == service.post(RETIME, json=smooth).content


def test_the_document_describes_it(service):
    operation = service.get("/openapi.json").json()["paths"][RETIME]["post"]
    example = operation["requestBody"]["content"]["application/json"]["example"]
    assert service.post(RETIME, json=example).status_code == 200
    assert set(operation["responses"]["200"]["content"]) == set(FORMATS)


def test_command_line(tmp_path, capsys, service):
    file, out = tmp_path / "request.json", tmp_path / "answer.json"
    file.write_text(json.dumps(body({"samples": SAMPLES})))
    assert main(["retime", str(file)]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("method: ") and "\ncertified (exact)" in printed
    assert main(["retime", str(file), "--out", str(out)]) == 0
    assert out.read_bytes() == service.post(RETIME, json=body({"samples": SAMPLES})).content
    assert main(["retime", str(file), "--out", str(tmp_path / "x.yaml")]) == 2
    file.write_text(json.dumps(body({})))
    assert main(["retime", str(file)]) == 2
    assert "/trajectory" in capsys.readouterr().err
    file.write_text(json.dumps(body({"samples": SAMPLES}, duration={"max": 0.1})))
    assert main(["retime", str(file)]) == 3


@pytest.fixture(scope="module")
def url():
    server = uvicorn.Server(uvicorn.Config(create_app(), host="127.0.0.1", port=0, log_level="error"))
    thread = threading.Thread(target=server.run)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    server.should_exit = True
    thread.join()


def test_client(url):
    with Client(url) as client:
        first = client.plan(POSITION, times=[0, 1, 2, 4], include=("samples", "polynomial"))
        for motion in (first, first.polynomial, first.samples, {"samples": SAMPLES}, MESSAGE):
            found = client.retime(motion, limits=LIMITS, sampling={"dt": 0.01})
            assert found.certificate["holds"] and found.duration < 4
            assert np.abs(found.samples.position[-1] - POSITION[-1]).max() < 1e-9
        near = client.retime(first.samples, limits=LIMITS, tolerance=0.05, include=("polynomial",))
        assert near.samples is None and 0 < near.certificate["path_deviation"] <= 0.05
        with pytest.raises(Infeasible):
            client.retime(first, limits=LIMITS, duration={"max": 0.1})
        with pytest.raises(InvalidRequest):
            client.retime(first, limits=LIMITS, tolerance=0.1)


def test_async_client(url):
    async def both():
        async with AsyncClient(url) as client:
            return await asyncio.gather(*(client.retime({"samples": SAMPLES}, limits=LIMITS) for _ in range(2)))

    first, second = asyncio.run(both())
    assert first.digest == second.digest and first.certificate["holds"]


def test_the_library_gives_the_same(service):
    from planner import retime as by_library

    made = by_library(Recorded.of(**SAMPLES), limits=LIMITS)
    found = retime(service, {"samples": SAMPLES})
    assert made.trajectory.duration == found["duration"]
    samples = sample(made.trajectory, Sampling.of(None))
    assert np.array_equal(samples.position, found["samples"]["position"])
