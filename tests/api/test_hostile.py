"""Whatever is sent: a 4xx problem document under 8 kB that names the field and the reason, and soon."""

import gzip
import json
import time
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

PLAN = "/v1/trajectories"
JSON = {"content-type": "application/json"}
GOOD: dict[str, Any] = {"waypoints": [[0, 0], [1, 2], [2, 3]], "times": [0, 1, 2], "method": "minimum_jerk"}
NAN, INF = float("nan"), float("inf")


def post(service, body, path=PLAN, **headers):
    raw = body if isinstance(body, bytes) else json.dumps(body).encode()
    started = time.perf_counter()
    response = service.post(path, content=raw, headers={**JSON, **headers})
    assert time.perf_counter() - started < 5.0
    return response


# (name, changes to a good request, expected pointer, expected code)
FIELDS = [
    ("no waypoints", {"waypoints": None}, "/waypoints", "wrong_type"),
    ("empty", {"waypoints": []}, "/waypoints", "too_few_points"),
    ("empty rows", {"waypoints": [[], []]}, "/waypoints", "too_few_points"),
    ("one waypoint", {"waypoints": [[0, 0]], "times": None}, "/waypoints", "too_few_points"),
    ("ragged", {"waypoints": [[0, 0], [1], [2, 3]]}, "/waypoints/1", "shape_mismatch"),
    ("flat", {"waypoints": [0, 1, 2]}, "/waypoints/0", "wrong_type"),
    ("NaN", {"waypoints": [[0, 0], [1, NAN], [2, 3]]}, "/waypoints/1/1", "not_finite"),
    ("Infinity", {"times": [0, 1, INF]}, "/times/2", "not_finite"),
    ("-Infinity", {"limits": {"velocity": -INF}}, "/limits/velocity", "not_finite"),
    ("1e308", {"waypoints": [[0, 0], [1, 1e308], [2, 3]]}, "/waypoints/1/1", "out_of_range"),
    ("boolean", {"waypoints": [[0, 0], [True, 2], [2, 3]]}, "/waypoints/1/0", "wrong_type"),
    ("string", {"waypoints": [[0, 0], ["1", 2], [2, 3]]}, "/waypoints/1/0", "wrong_type"),
    ("null inside", {"waypoints": [[0, 0], [None, 2], [2, 3]]}, "/waypoints/1/0", "wrong_type"),
    ("huge integer", {"waypoints": [[0, 0], [10**400, 2], [2, 3]]}, "/waypoints/1/0", "wrong_type"),
    ("falling times", {"times": [0, 2, 1]}, "/times/2", "not_increasing"),
    ("repeated times", {"times": [0, 1, 1]}, "/times/2", "not_increasing"),
    ("too close times", {"times": [0, 1, 1 + 1e-12]}, "/times/2", "out_of_range"),
    ("number of times", {"times": [0, 1]}, "/times", "shape_mismatch"),
    ("large time", {"times": [0, 1, 1e12]}, "/times/2", "out_of_range"),
    ("zero limit", {"limits": {"velocity": 0}}, "/limits/velocity", "bad_limits"),
    ("negative limit", {"limits": {"jerk": [1, -1]}}, "/limits/jerk", "bad_limits"),
    ("length of limit", {"limits": {"velocity": [1]}}, "/limits/velocity", "shape_mismatch"),
    ("string limit", {"limits": {"velocity": "3"}}, "/limits/velocity", "wrong_type"),
    ("string in limit", {"limits": {"velocity": [1, "3"]}}, "/limits/velocity/1", "wrong_type"),
    ("empty range", {"limits": {"velocity": {}}}, "/limits/velocity", "missing"),
    ("range upside down", {"limits": {"position": {"lower": 2, "upper": 1}}}, "/limits/position", "bad_limits"),
    ("plain position limit", {"limits": {"position": 3}}, "/limits/position", "wrong_type"),
    ("unknown limit", {"limits": {"speed": 3}}, "/limits/speed", "unknown_field"),
    ("unknown side", {"limits": {"velocity": {"top": 3}}}, "/limits/velocity/top", "unknown_field"),
    ("unknown field", {"colour": "red"}, "/colour", "unknown_field"),
    ("tag-like field", {"#list": 1}, "/#list", "unknown_field"),
    ("unknown option", {"options": {"ordre": 3}}, "/options/ordre", "unknown_field"),
    ("wrong option", {"options": {"backend": "abacus"}}, "/options/backend", "out_of_range"),
    ("options a list", {"options": []}, "/options", "wrong_type"),
    ("method a number", {"method": 3}, "/method", "wrong_type"),
    ("start of wrong length", {"start": {"velocity": [1]}}, "/start/velocity", "shape_mismatch"),
    ("segment limits", {"segment_limits": [None]}, "/segment_limits", "shape_mismatch"),
    ("duration", {"duration": {"min": 3, "max": 2}}, "/duration", "bad_duration"),
    ("negative duration", {"duration": {"min": -3}}, "/duration/min", "out_of_range"),
    ("duration and times", {"duration": {"max": 1}}, "/duration", "conflict"),
    ("joint names", {"joint_names": ["a"]}, "/joint_names", "shape_mismatch"),
    ("same joint names", {"joint_names": ["a", "a"]}, "/joint_names", "conflict"),
    ("two samplings", {"sampling": {"dt": 1, "count": 3}}, "/sampling", "conflict"),
    ("dt zero", {"sampling": {"dt": 0}}, "/sampling/dt", "out_of_range"),
    ("dt negative", {"sampling": {"dt": -1}}, "/sampling/dt", "out_of_range"),
    ("one sample", {"sampling": {"count": 1}}, "/sampling/count", "out_of_range"),
    ("half a sample", {"sampling": {"count": 2.5}}, "/sampling/count", "wrong_type"),
    ("boolean samples", {"sampling": {"count": True}}, "/sampling/count", "wrong_type"),
    ("sampling outside", {"sampling": {"times": [0, 9]}}, "/sampling/times/1", "out_of_range"),
    ("sampling falls", {"sampling": {"times": [1, 0]}}, "/sampling/times/1", "not_increasing"),
    ("unknown include", {"include": ["everything"]}, "/include/0", "out_of_range"),
    ("timeout", {"timeout": 61}, "/timeout", "out_of_range"),
    ("timeout zero", {"timeout": 0}, "/timeout", "out_of_range"),
]


@pytest.mark.parametrize("changes, field, code", [row[1:] for row in FIELDS], ids=[row[0] for row in FIELDS])
def test_a_wrong_field_is_named(service, problem, changes, field, code):
    document = problem(post(service, GOOD | changes), "invalid_request")
    assert (field, code) in [(e["field"], e["code"]) for e in document["errors"]], document
    assert all(e["reason"] for e in document["errors"])
    assert document["errors_total"] >= len(document["errors"])


@pytest.mark.parametrize(
    "raw",
    [
        b"",
        b"{",
        b"{'a': 1}",
        b'{"waypoints": [[0], [1]], "waypoints": [[0], [2]]}',
        b'{"waypoints": "\\ud800"}',
        b'{"waypoints": "\xff\xfe"}',
        b"\xef\xbb\xbf{}",
        b"[" * 100_000,
        b'{"options": ' * 100_000,
        b"[" * 100_000 + b"]" * 100_000,
        b"1" + b"0" * 10_000,
        json.dumps(GOOD).encode() + b" x",
        json.dumps(GOOD).encode("utf-16"),
    ],
    ids=lambda raw: repr(raw[:20]),
)
def test_what_is_not_json(service, problem, raw):
    document = problem(post(service, raw), "invalid_request")
    assert [(e["field"], e["code"]) for e in document["errors"]] == [("", "not_json")]


@pytest.mark.parametrize("raw", [b"null", b"3", b'"text"', b"[]", b"true"])
@pytest.mark.parametrize("path", [PLAN, "/v1/comparisons", "/v1/certificates", "/v1/retimings", PLAN + "?shape=ruckig"])
def test_json_that_is_no_object(service, problem, raw, path):
    document = problem(post(service, raw, path), "invalid_request")
    assert document["errors"][0]["code"] == "wrong_type"


def test_overflowing_numbers(service, problem):
    document = problem(post(service, b'{"waypoints": [[0], [1e999]]}'), "invalid_request")
    assert [(e["field"], e["code"]) for e in document["errors"]] == [("/waypoints/1/0", "not_finite")]


def test_unknown_method(service, problem):
    document = problem(post(service, GOOD | {"method": "teleport"}), "unknown_method")
    assert "minimum_jerk" in document["known"]


@pytest.mark.parametrize(
    "changes, what",
    [
        ({"method": "linear", "limits": {"jerk": 1}}, "jerk"),
        ({"method": "ruckig", "limits": {"velocity": 1, "acceleration": 1}}, "times"),
        ({"limits": {"torque": 1}}, "torque"),
        ({"method": "cubic_spline", "tube": 0.1}, "tube"),
        ({"method": "linear", "waypoint_states": [None, {"velocity": [0, None]}, None]}, "waypoint_states"),
        ({"robot": {"model": "ur5e"}}, "robot"),
    ],
)
def test_what_a_method_does_not_honour(service, problem, changes, what):
    document = problem(post(service, GOOD | changes), "unsupported")
    assert what in document["what"]
    assert document["method"] == changes.get("method", "minimum_jerk")
    assert isinstance(document["alternatives"], list)


@pytest.mark.parametrize(
    "changes",
    [
        {"sampling": {"dt": 1e-12}},
        {"sampling": {"count": 10**9}},
        {"sampling": {"count": 10**18}},
        {"waypoints": [[0] * 65, [1] * 65, [2] * 65]},
        {"waypoints": [[i] for i in range(10_001)], "times": list(range(10_001))},
        {"times": None, "duration": {"min": 5, "max": 5}, "sampling": {"dt": 1e-9}},
    ],
    ids=["dt", "count", "count beyond int64", "joints", "waypoints", "duration"],
)
def test_more_than_the_caps_allow(service, problem, changes):
    started = time.perf_counter()
    document = problem(post(service, GOOD | changes), "too_large")
    assert time.perf_counter() - started < 2.0  # parsing, and collecting garbage in a process that has run all tests
    assert document["what"] and document["limit"] and document["hint"]


def test_tiny_steps_where_the_method_chooses_the_duration(service, problem):
    body = {"waypoints": [[0], [1]], "limits": {"velocity": 1, "acceleration": 1}, "method": "trapezoidal"}
    problem(post(service, body | {"sampling": {"dt": 1e-12}}), "too_large")


@pytest.mark.parametrize("chunked", [False, True])
def test_a_body_over_the_cap(service, problem, chunked):
    raw = b'{"waypoints": [' + b" " * 12_000_000 + b"]}"
    content = (raw[i : i + 65536] for i in range(0, len(raw), 65536)) if chunked else raw
    document = problem(service.post(PLAN, content=content, headers=JSON), "too_large")
    assert document["what"] == "body"


@pytest.mark.parametrize("path", [PLAN, "/v1/comparisons", "/v1/certificates"])
@pytest.mark.parametrize(("count", "what"), [(10_000_000, "body"), (300_000, "waypoints")])
def test_millions_of_waypoints(service, problem, path, count, what):
    """Ten million are more than a body may hold; 300,000 fit, and are counted and refused before any work."""
    started = time.perf_counter()
    extra = {PLAN: b"}", "/v1/comparisons": b',"methods":"all"}', "/v1/certificates": b',"trajectory":%s}'}[path]
    extra = extra.replace(b"%s", b'{"polynomial":{"breaks":[0,1],"coefficients":[[[0]]]}}')
    raw = b'{"waypoints":[' + b"[0]," * (count - 1) + b"[1]]" + extra
    document = problem(service.post(path, content=raw, headers=JSON), "too_large")
    assert document["what"] == what and document["status"] == 413
    assert time.perf_counter() - started < 15  # beside the warm-up, which may be compiling


@pytest.mark.parametrize("path", [PLAN, "/v1/comparisons", "/v1/certificates", "/v1/retimings"])
@pytest.mark.parametrize(
    "headers",
    [
        {"content-type": "text/plain"},
        {"content-type": "application/x-www-form-urlencoded"},
        {"content-type": "application/jsonp"},
        {"content-type": ""},
        {"content-type": "application/json", "content-encoding": "gzip"},
        {"content-type": "application/json", "content-encoding": "br"},
    ],
)
def test_types_that_are_not_read(service, problem, headers, path):
    raw = gzip.compress(json.dumps(GOOD).encode())
    document = problem(service.post(path, content=raw, headers=headers), "unsupported_media_type")
    assert document["available"] == ["application/json", "application/msgpack"]


def test_no_content_type_at_all(service, problem):
    request = service.build_request("POST", PLAN, content=json.dumps(GOOD))
    request.headers.pop("content-type", None)
    problem(service.send(request), "unsupported_media_type")


def test_json_with_parameters_is_read(service):
    headers = {"content-type": "Application/JSON; charset=utf-8", "content-encoding": "identity"}
    assert service.post(PLAN, content=json.dumps(GOOD), headers=headers).status_code == 200


@pytest.mark.parametrize(
    "body",
    [
        {"waypoints": [["x"] * 64] * 1000},
        {"waypoints": [["x"] * 64_000]},
        GOOD | {"times": ["x"] * 64_000},
        GOOD | {"limits": {"velocity": ["x"] * 64_000}},
        GOOD | {"segment_limits": [{"speed": 1}] * 10_000},
    ],
    ids=["rows", "one row", "times", "limits", "segments"],
)
def test_very_many_bad_numbers(service, problem, body):
    started = time.perf_counter()
    problem(post(service, body), "invalid_request")
    assert time.perf_counter() - started < 0.5


def test_very_many_unknown_keys(service, problem):
    keys = {f"key{i}": i for i in range(100_000)}
    started = time.perf_counter()
    document = problem(post(service, GOOD | keys), "invalid_request")
    assert time.perf_counter() - started < 3.0  # a second where nothing else is compiling
    assert len(document["errors"]) == 20
    assert document["errors_total"] == 100_000
    for body in (GOOD | {"limits": keys}, GOOD | {"options": keys}, GOOD | {"sampling": keys}):
        problem(post(service, body), "invalid_request")


def test_very_long_names_and_values(service, problem):
    long = "ü" * 1_000_000
    for body in (GOOD | {long: 1}, GOOD | {"method": long}, GOOD | {"options": {long: 1}}, GOOD | {"include": [long]}):
        problem(post(service, body))
    problem(post(service, GOOD, PLAN + "?" + "x" * 3000 + "=1"), "invalid_request")
    problem(service.get("/v1/methods/" + "x" * 5000), "unknown_method")
    problem(service.get("/" + "x" * 50_000), "not_found")


@pytest.mark.parametrize("path", [PLAN, "/v1/comparisons", "/v1/certificates", "/v1/retimings"])
def test_unknown_query_parameters(service, problem, path):
    document = problem(post(service, GOOD, path + "?verbose=1"), "invalid_request")
    assert [(e["field"], e["code"]) for e in document["errors"]] == [("/?verbose", "unknown_field")]


def test_unknown_shape(service, problem):
    document = problem(post(service, GOOD, PLAN + "?shape=round"), "invalid_request")
    assert document["errors"][0]["field"] == "/?shape"


def test_extreme_but_legal_requests_are_answered_or_refused(service, problem):
    for changes in (
        {"waypoints": [[-1e9, 1e9], [1e9, -1e9], [0, 0]], "times": [0, 1e-9, 2e-9]},
        {"times": [-1e11, 0, 1e11]},
        {"waypoints": [[0, 0], [1e-300, 0], [0, 1e-300]]},
        {"limits": {"velocity": 1e-9, "acceleration": 1e-9, "jerk": 1e-9}},
        {"limits": {"velocity": 1e9, "acceleration": 1e9, "jerk": 1e9}},
    ):
        response = post(service, GOOD | changes)
        if response.status_code != 200:
            assert problem(response)["status"] < 500, (changes, response.text)


LEAF = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=5),
    st.sampled_from([0, 1, 2, -1, 1e9, 1e308, NAN, INF, 10**30, "1", "all", "auto", "linear"]),
)
VALUE = st.recursive(
    LEAF,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.dictionaries(
            st.sampled_from(["velocity", "lower", "upper", "min", "max", "dt", "count", "method", "x", "#list"]),
            inner,
            max_size=3,
        ),
    ),
    max_leaves=8,
)
NAMES = [
    "waypoints",
    "times",
    "method",
    "options",
    "limits",
    "segment_limits",
    "segment_durations",
    "duration",
    "start",
    "end",
    "waypoint_states",
    "waypoint_tolerance",
    "tube",
    "robot",
    "joint_names",
    "sampling",
    "include",
    "timeout",
    "methods",
    "trajectory",
]


@given(st.dictionaries(st.sampled_from(NAMES), VALUE, max_size=3), st.sampled_from([PLAN, "/v1/comparisons"]))
def test_any_field_may_hold_anything(service, problem, changes, path):
    base = GOOD if path == PLAN else {k: v for k, v in GOOD.items() if k != "method"} | {"methods": ["linear"]}
    response = post(service, base | changes, path)
    if response.status_code != 200:
        document = problem(response)
        assert document["status"] < 500
        if document["status"] == 422 and "errors" in document:
            assert all(e["field"].startswith("/") or e["field"] == "" for e in document["errors"])


@given(st.binary(max_size=60))
def test_any_bytes(service, problem, raw):
    assert problem(post(service, raw))["status"] in (413, 422)


@given(VALUE)
def test_any_trajectory_to_judge(service, problem, value):
    response = post(service, {"trajectory": value}, "/v1/certificates")
    if response.status_code != 200:
        assert problem(response)["status"] < 500
