"""POST /v1/trajectories: the contract's example, formats, sampling, and the same bytes for the same request."""

import csv
import io
import json
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from api.answers import PlanReply
from api.formats import FORMATS
from planner import CASES, METHODS

PLAN = "/v1/trajectories"
ROS2 = "application/vnd.ros2.joint-trajectory+json"
EXAMPLE = {
    "waypoints": [[0, 0], [1, 2], [2, 3]],
    "times": [0, 1, 2],
    "method": "auto",
    "options": {},
    "limits": {"velocity": 3.5, "acceleration": [8, None], "jerk": 60},
    "sampling": {"dt": 0.01},
    "include": ["samples", "polynomial"],
}


def plan(service, body, status=200, **headers):
    response = service.post(PLAN, json=body, headers=headers)
    assert response.status_code == status, response.text[:2000]
    return response


def test_the_contracts_example(service):
    answer = plan(service, EXAMPLE).json()
    PlanReply.model_validate(answer)
    assert list(answer) == [
        "method",
        "picked_because",
        "duration",
        "waypoint_times",
        "samples",
        "polynomial",
        "certificate",
        "solver",
        "warnings",
        "digest",
    ]
    assert (answer["method"], answer["picked_because"]) == ("minimum_jerk", "times were given")
    assert answer["duration"] == 2.0
    assert answer["waypoint_times"] == [0, 1, 2]
    certificate = answer["certificate"]
    assert list(certificate) == [
        "holds",
        "basis",
        "checks",
        "waypoint_error",
        "boundary_error",
        "continuity",
        "path_deviation",
        "cost",
        "objective",
    ]
    assert certificate["holds"] is True and certificate["basis"] == "exact"
    expected = [
        ("velocity", 1, 0, 0.790054, 3.190263, 3.5, 0.911504),
        ("acceleration", 0, 0, 0.422650, 2.886751, 8.0, 0.360844),
        ("jerk", 1, 0, 0.0, 42.5, 60.0, 0.708333),
    ]
    for check, (quantity, joint, segment, at, value, bound, ratio) in zip(certificate["checks"], expected, strict=True):
        assert (check["quantity"], check["joint"], check["segment"], check["holds"]) == (quantity, joint, segment, True)
        numbers = [check[k] for k in ("time", "value", "bound", "ratio")]
        assert numbers == pytest.approx([at, value, bound, ratio], abs=1e-6)
    assert certificate["waypoint_error"] <= 1e-12
    assert certificate["continuity"] == 4
    assert certificate["path_deviation"] is None
    assert certificate["cost"] == pytest.approx({"squared_jerk": 452.5, "path_length": 3.673136}, abs=1e-6)
    objective = certificate["objective"]
    assert objective["name"] == "squared_jerk" and objective["bound_scope"] == "method"
    assert [objective["value"], objective["lower_bound"]] == pytest.approx([452.5, 452.5])
    assert abs(objective["gap"]) < 1e-9
    assert "kkt" in objective
    assert answer["solver"]["status"] == "solved"
    assert answer["warnings"] == []
    assert len(answer["digest"]) == 64


def test_the_polynomial_gives_the_samples(service):
    answer = plan(service, EXAMPLE).json()
    breaks, powers = (np.array(answer["polynomial"][k]) for k in ("breaks", "coefficients"))
    times = np.array(answer["samples"]["time"])
    assert len(times) == 201 and times[-1] == 2.0
    piece = np.clip(np.searchsorted(breaks, times, side="right") - 1, 0, len(breaks) - 2)
    local = (times - breaks[piece])[:, None]
    position = sum(powers[k][piece] * local**k for k in range(len(powers)))
    assert np.abs(position - answer["samples"]["position"]).max() < 1e-12


@pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
def test_every_case_is_answered(service, case):
    answer = plan(service, dict(case.request)).json()
    PlanReply.model_validate(answer)
    assert answer["certificate"]["holds"]


@pytest.mark.parametrize("accept", ["*/*", "text/csv", ROS2])
def test_the_same_request_gives_the_same_bytes(service, accept):
    first, second = (plan(service, EXAMPLE, accept=accept).content for _ in range(2))
    assert first == second


def test_the_digest_knows_what_is_the_same_request(service):
    def digest(**changes):
        return plan(service, EXAMPLE | changes).json()["digest"]

    plain = digest()
    assert digest(method=None, options=None, start=None, limits={**EXAMPLE["limits"], "position": None}) == plain
    assert digest(include=["polynomial", "samples", "samples"]) == plain
    assert digest(waypoints=[[0.0, 0.0], [1.0, 2.0], [2.0, 3.0]]) == plain
    assert digest(segment_limits=None, duration=None, robot=None) == plain
    others = [
        digest(method="minimum_jerk"),
        digest(sampling={"dt": 0.02}),
        digest(sampling=None),
        digest(include=["samples"]),
        digest(waypoints=[[0, 0], [1, 2], [2, 3.5]]),
        digest(limits=None),
    ]
    assert len({plain, *others}) == 7


def test_include(service):
    assert "samples" in plan(service, EXAMPLE | {"include": None}).json()
    only = plan(service, EXAMPLE | {"include": ["polynomial"], "sampling": None}).json()
    assert "samples" not in only and "polynomial" in only
    neither = plan(service, EXAMPLE | {"include": []}).json()
    assert "samples" not in neither and "polynomial" not in neither
    bound = plan(service, EXAMPLE | {"include": ["bound"]}).json()
    assert bound["certificate"]["objective"]["lower_bound"] is not None


def test_default_sampling_and_picked_because(service):
    answer = plan(service, {k: EXAMPLE[k] for k in ("waypoints", "times")} | {"method": "linear"}).json()
    assert "picked_because" not in answer
    assert len(answer["samples"]["time"]) == 200


def test_sampling_at_times(service):
    times = [0.25, 0.5, 1.75]
    assert plan(service, EXAMPLE | {"sampling": {"times": times}}).json()["samples"]["time"] == times


def test_a_hold(service):
    body = {"waypoints": [[1, 2], [1, 2]], "limits": {"velocity": 1, "acceleration": 1, "jerk": 1}}
    answer = plan(service, body | {"sampling": {"dt": 0.1}, "include": ["samples", "polynomial"]}).json()
    assert answer["duration"] == 0
    assert answer["polynomial"]["breaks"] == [0, 0]
    assert answer["samples"]["position"] == [[1, 2], [1, 2]]
    assert len(plan(service, body, accept=ROS2).json()["points"]) == 1
    assert len(plan(service, body, accept="text/csv").text.splitlines()) == 3


def test_csv(service):
    response = plan(service, EXAMPLE, accept="text/csv")
    assert response.headers["content-type"] == "text/csv; charset=utf-8"
    assert response.text.endswith("\n") and "\r" not in response.text
    header, *rows = list(csv.reader(io.StringIO(response.text)))
    assert header == ["time"] + [f"{q}_{i}" for q in ("position", "velocity", "acceleration", "jerk") for i in (1, 2)]
    samples = plan(service, EXAMPLE).json()["samples"]
    assert [float(row[0]) for row in rows] == samples["time"]
    assert [[float(x) for x in row[3:5]] for row in rows] == samples["velocity"]
    assert [[float(x) for x in row[7:9]] for row in rows] == samples["jerk"]


def test_joint_names(service):
    names = ['a "b"', "c,d"]
    text = plan(service, EXAMPLE | {"joint_names": names}, accept="text/csv").text
    assert next(csv.reader(io.StringIO(text)))[1:3] == [f"position_{name}" for name in names]
    assert plan(service, EXAMPLE | {"joint_names": names}, accept=ROS2).json()["joint_names"] == names


def test_ros2(service):
    body = EXAMPLE | {"times": [5, 6, 7.0000000004], "sampling": {"dt": 0.3}}
    response = plan(service, body, accept=ROS2)
    assert response.headers["content-type"] == ROS2
    message = response.json()
    assert message["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    assert message["joint_names"] == ["joint_1", "joint_2"]
    times = [p["time_from_start"]["sec"] * 10**9 + p["time_from_start"]["nanosec"] for p in message["points"]]
    assert times[:2] == [0, 300_000_000] and times[-1] == 2_000_000_000
    assert all(0 <= p["time_from_start"]["nanosec"] < 10**9 for p in message["points"])
    assert np.all(np.diff(times) > 0)
    assert set(message["points"][0]) == {"positions", "velocities", "accelerations", "time_from_start"}


def test_ros2_counts_from_the_trajectorys_start(service):
    def elapsed(**changes):
        points = plan(service, EXAMPLE | changes, accept=ROS2).json()["points"]
        return [p["time_from_start"]["sec"] + 1e-9 * p["time_from_start"]["nanosec"] for p in points]

    assert elapsed(sampling={"times": [0.5, 0.75]}) == [0.5, 0.75]
    assert elapsed(times=[10, 11, 12], sampling={"times": [10.5, 12]}) == [0.5, 2]
    assert elapsed(times=[10, 11, 12], sampling={"dt": 1}) == [0, 1, 2]
    assert elapsed(times=[-1, 0, 1], sampling={"dt": 1}) == [0, 1, 2]


def test_ros2_refuses_samples_on_one_nanosecond(service, problem):
    body = EXAMPLE | {"sampling": {"times": [0, 1e-10, 1]}}
    document = problem(service.post(PLAN, json=body, headers={"accept": ROS2}), "invalid_request")
    assert document["errors"][0]["field"] == "/sampling"
    far = {"waypoints": [[0], [1]], "times": [0, 1e10], "method": "linear"}
    problem(service.post(PLAN, json=far, headers={"accept": ROS2}), "invalid_request")


def test_formats_of_samples_need_samples(service, problem):
    response = service.post(PLAN, json=EXAMPLE | {"include": ["polynomial"]}, headers={"accept": "text/csv"})
    assert problem(response, "invalid_request")["errors"][0]["field"] == "/include"


@pytest.mark.parametrize("accept", ["application/yaml", "image/png", "text/html", "application/json;q=0, image/png"])
def test_formats_that_are_not_there(service, problem, accept):
    document = problem(service.post(PLAN, json=EXAMPLE, headers={"accept": accept}), "not_acceptable")
    assert document["available"] == list(FORMATS)


@pytest.mark.parametrize("accept", ["application/json", "*/*", "application/*", "text/html,*/*;q=0.8", ""])
def test_json_is_the_default(service, accept):
    assert plan(service, EXAMPLE, accept=accept).headers["content-type"] == "application/json"


@pytest.mark.parametrize("accept", ["application/json", "text/csv", ROS2])
def test_server_timing(service, accept):
    entries = plan(service, EXAMPLE, accept=accept).headers["server-timing"].split(", ")
    spent = {name: float(value.removeprefix("dur=")) for name, value in (entry.split(";") for entry in entries)}
    assert set(spent) == {"validate", "queue", "pose", "solve", "verify", "encode"}
    assert all(value >= 0 for value in spent.values())


def test_infeasible_tells_what_would_do(service, problem):
    body = {"waypoints": [[0], [1]], "times": [0, 1], "limits": {"velocity": 0.5}, "method": "minimum_jerk"}
    document = problem(service.post(PLAN, json=body), "infeasible")
    assert (document["quantity"], document["joint"], document["certified"]) == ("velocity", 0, True)
    assert document["needed"] >= 1.0


@pytest.mark.parametrize("method", METHODS)
def test_nothing_says_nan(service, method):
    body = {"waypoints": [[0, 0], [1, 2], [2, 3]], "method": method, "include": ["samples", "polynomial"]}
    limits = {"velocity": 2, "acceleration": 3}
    for extra in ({"times": [0, 1, 2]}, {"limits": limits}):
        response = service.post(PLAN, json=body | extra)
        assert response.status_code in (200, 422)
        json.loads(response.content, parse_constant=pytest.fail)


WAYPOINT = st.lists(st.floats(-100, 100).map(lambda x: round(x, 3)), min_size=2, max_size=2)


@given(
    st.lists(WAYPOINT, min_size=2, max_size=6),
    st.lists(st.floats(0.1, 3), min_size=5, max_size=5),
    st.sampled_from(["linear", "cubic_spline", "minimum_jerk"]),
)
def test_answers_pass_through_their_waypoints(service, waypoints, steps, method):
    times = np.concatenate([[0.0], np.cumsum(steps)])[: len(waypoints)].tolist()
    body = {"waypoints": waypoints, "times": times, "method": method, "sampling": {"times": times}}
    answer = plan(service, body).json()
    assert answer["certificate"]["holds"]
    reached = np.array(answer["samples"]["position"])
    assert np.abs(reached - waypoints).max() <= 1e-6 * max(1, np.ptp(waypoints))


def test_encoding_is_quick():
    from api.formats.json import dumps

    random = np.random.default_rng(1)
    samples = {"time": np.arange(1000) * 1e-3, **{str(i): random.normal(size=(1000, 7)) for i in range(4)}}
    spent = []
    for _ in range(20):
        started = time.perf_counter()
        dumps(samples)
        spent.append(time.perf_counter() - started)
    assert min(spent) < 4e-3  # about 1 ms; the margin is for slow machines


def test_reading_is_quick():
    from api.reading import decode, parse, to_request
    from api.schemas import PlanBody
    from api.settings import Caps

    raw = json.dumps(EXAMPLE).encode()
    spent = []
    for _ in range(50):
        started = time.perf_counter()
        to_request(parse(PlanBody, decode(raw)), Caps())
        spent.append(time.perf_counter() - started)
    assert min(spent) < 1e-3


def test_the_worked_cubic_spline_comes_out_of_the_service(service):
    """(0, 0), (1, 2), (2, 3) clamped at rest: every figure follows by hand."""
    body = {
        "waypoints": [[0], [2], [3]],
        "times": [0, 1, 2],
        "method": "cubic_spline",
        "sampling": {"times": [0, 0.5, 1, 1.5, 2]},
        "include": ["samples", "polynomial"],
    }
    answer = plan(service, body).json()
    powers = np.array(answer["polynomial"]["coefficients"])[:, :, 0]
    np.testing.assert_allclose(powers.T, [[0, 0, 3.75, -1.75], [2, 2.25, -1.5, 0.25]], atol=1e-9)
    samples = {k: np.array(v).reshape(5, -1)[:, 0] for k, v in answer["samples"].items()}
    np.testing.assert_allclose(samples["position"], [0, 0.71875, 2, 2.78125, 3], atol=1e-9)
    np.testing.assert_allclose(samples["velocity"], [0, 2.4375, 2.25, 0.9375, 0], atol=1e-9)
    np.testing.assert_allclose(samples["acceleration"][[0, 2, 4]], [7.5, -3, -1.5], atol=1e-9)
    np.testing.assert_allclose(samples["jerk"], [-10.5, -10.5, 1.5, 1.5, 1.5], atol=1e-9)
    assert answer["certificate"]["cost"]["squared_jerk"] == pytest.approx(10.5**2 + 1.5**2)
    natural = plan(service, {**body, "options": {"boundary": "natural"}}).json()
    assert natural["samples"]["position"][1][0] == pytest.approx(1.09375, abs=1e-9)
    given = {**body, "start": {"velocity": [1]}, "end": {"velocity": [-0.5]}}
    powers = np.array(plan(service, given).json()["polynomial"]["coefficients"])[:, :, 0]
    np.testing.assert_allclose(powers.T, [[0, 1, 1.875, -0.875], [2, 2.125, -0.75, -0.375]], atol=1e-9)
