"""POST /v1/comparisons: a method that refuses is a row, never a failed comparison."""

import pytest

from api.answers import ComparisonReply
from planner import METHODS

COMPARE = "/v1/comparisons"
BODY = {"waypoints": [[0, 0], [1, 2], [2, 3]], "times": [0, 1, 2]}


def rows(service, body):
    response = service.post(COMPARE, json=body)
    assert response.status_code == 200, response.text[:1000]
    ComparisonReply.model_validate(response.json())
    return response.json()["rows"]


def test_rows_come_in_the_order_asked(service):
    asked = ["ruckig", {"method": "minimum_jerk", "options": {}}, "linear", "linear", "auto"]
    found = rows(service, BODY | {"methods": asked})
    assert [row["method"] for row in found] == ["ruckig", "minimum_jerk", "linear", "linear", "minimum_jerk"]
    assert [row["ok"] for row in found] == [False, True, True, True, True]
    refused, answered = found[:2]
    assert refused["duration"] is refused["certificate"] is refused["peaks"] is refused["cost"] is None
    assert refused["error"]["type"] == "/errors/unsupported"
    assert (refused["error"]["status"], refused["error"]["instance"]) == (422, COMPARE)
    assert "error" not in answered and "samples" not in answered and "polynomial" not in answered
    assert answered["duration"] == 2.0
    assert answered["cost"]["squared_jerk"] == pytest.approx(452.5)
    assert answered["peaks"]["jerk"][1] == pytest.approx(42.5)
    assert set(answered["peaks"]) >= {"velocity", "acceleration", "jerk"}
    assert answered["compute_ms"] >= 0


def test_what_jumps_has_no_peak(service):
    (row,) = rows(service, BODY | {"methods": ["linear"]})
    assert row["peaks"]["velocity"] == pytest.approx([1, 2])
    assert row["peaks"]["acceleration"] == [0, None]  # the second joint jumps from 2 to 1
    assert row["cost"]["squared_jerk"] is None


def test_all_methods_in_the_catalogues_order(service):
    found = rows(service, BODY | {"methods": "all", "include": []})
    assert [row["method"] for row in found] == list(METHODS)
    assert all("samples" not in row for row in found)
    assert {row["method"] for row in found if row["ok"]} >= {"linear", "cubic_spline", "minimum_jerk", "time_scaled"}


@pytest.mark.parametrize(
    "include, held",
    [
        (None, set()),
        ([], set()),
        (["samples"], {"samples"}),
        (["polynomial"], {"polynomial"}),
        (["polynomial", "samples"], {"samples", "polynomial"}),
    ],
)
def test_rows_hold_what_is_included(service, include, held):
    asked = BODY | {"include": include, "sampling": {"count": 7}}
    refused, row = rows(service, asked | {"methods": ["ruckig", "minimum_jerk"]})
    assert held == {"samples", "polynomial"} & set(row)
    assert not {"samples", "polynomial"} & set(refused)
    answer = service.post("/v1/trajectories", json=asked | {"include": ["samples", "polynomial"]}).json()
    assert all(row[name] == answer[name] for name in held)


def test_a_bound_in_a_row(service):
    (row,) = rows(service, BODY | {"methods": ["minimum_jerk"], "include": ["bound"]})
    assert row["certificate"]["objective"]["lower_bound"] is not None


def test_the_request_id_is_in_the_rows_problem(service):
    response = service.post(COMPARE, json=BODY | {"methods": ["ruckig"]}, headers={"x-request-id": "row 7"})
    assert response.json()["rows"][0]["error"]["request_id"] == "row 7"


def test_the_same_but_for_the_time_taken(service):
    def once():
        response = service.post(COMPARE, json=BODY | {"methods": ["linear", "ruckig"]}, headers={"x-request-id": "x"})
        return [{k: v for k, v in row.items() if k != "compute_ms"} for row in response.json()["rows"]]

    assert once() == once()


def test_options_of_a_row_are_its_own(service):
    choice = {"method": "cubic_spline", "options": {"boundary": "no such"}}
    found = rows(service, BODY | {"methods": [choice, "cubic_spline"]})
    assert [row["ok"] for row in found] == [False, True]
    assert found[0]["error"]["errors"][0]["field"].startswith("/options/boundary")


def test_an_unknown_method_is_the_whole_requests_fault(service, problem):
    problem(service.post(COMPARE, json=BODY | {"methods": ["linear", "teleport"]}), "unknown_method")


@pytest.mark.parametrize(
    "changes, field, code",
    [
        ({}, "/methods", "missing"),
        ({"methods": []}, "/methods", "out_of_range"),
        ({"methods": ["linear"] * 65}, "/methods", "out_of_range"),
        ({"methods": "some"}, "/methods", "out_of_range"),
        ({"methods": [3]}, "/methods/0", "wrong_type"),
        ({"methods": [{"options": {}}]}, "/methods/0/method", "missing"),
        ({"methods": [{"method": "linear", "colour": 1}]}, "/methods/0/colour", "unknown_field"),
        ({"methods": "all", "method": "linear"}, "/method", "unknown_field"),
        ({"methods": "all", "options": {}}, "/options", "unknown_field"),
        ({"methods": "all", "times": [0, 1]}, "/times", "shape_mismatch"),
    ],
)
def test_a_comparison_that_is_wrong(service, problem, changes, field, code):
    document = problem(service.post(COMPARE, json=BODY | changes), "invalid_request")
    assert (field, code) in [(e["field"], e["code"]) for e in document["errors"]], document


def test_rows_share_the_cap_on_samples(service, problem):
    body = BODY | {"methods": ["linear"] * 10}
    problem(service.post(COMPARE, json=body | {"sampling": {"count": 200_000}, "include": ["samples"]}), "too_large")


def test_too_many_samples_for_one_row(service):
    body = {"waypoints": [[0], [1]], "limits": {"velocity": 1, "acceleration": 1}, "sampling": {"dt": 1e-9}}
    (row,) = rows(service, body | {"methods": ["trapezoidal"], "include": ["samples"]})
    assert row["error"]["type"] == "/errors/too_large"


def test_only_trees(service, problem):
    response = service.post(COMPARE, json=BODY | {"methods": "all"}, headers={"accept": "text/csv"})
    assert problem(response, "not_acceptable")["available"] == ["application/json", "application/msgpack"]
