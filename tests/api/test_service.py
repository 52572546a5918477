"""What is true of every answer: ids, problems, discovery, health, and the OpenAPI document."""

import time

import pytest
from starlette.testclient import TestClient

from api import answers
from api.app import create_app
from api.errors import KINDS
from api.settings import Caps, Settings
from planner import CASES, METHODS, __version__

PATHS = {
    "/v1/trajectories": "post",
    "/v1/comparisons": "post",
    "/v1/certificates": "post",
    "/v1/retimings": "post",
    "/v1/methods": "get",
    "/v1/methods/{id}": "get",
    "/v1/cases": "get",
    "/v1/limits": "get",
    "/v1/version": "get",
    "/healthz": "get",
    "/readyz": "get",
    "/metrics": "get",
    "/errors/{code}": "get",
}
LATER = ("replans", "robots", "kinematics", "orientations", "poses", "filters", "batches", "motions/fit")


@pytest.mark.parametrize("path", ["/v1/limits", "/nowhere", "/healthz", "/openapi.json"])
def test_a_request_id_is_echoed_or_made(service, path):
    assert service.get(path, headers={"x-request-id": "job 7/ä".encode("latin-1")}).headers["x-request-id"] != "job 7/ä"
    assert service.get(path, headers={"x-request-id": "job 7/a~"}).headers["x-request-id"] == "job 7/a~"
    assert service.get(path, headers={"x-request-id": "x" * 128}).headers["x-request-id"] == "x" * 128
    assert len(service.get(path, headers={"x-request-id": "x" * 129}).headers["x-request-id"]) == 32
    assert len(service.get(path).headers["x-request-id"]) == 32


def test_problems_carry_the_id_and_the_path(service, problem):
    document = problem(service.get("/nowhere", headers={"x-request-id": "me"}), "not_found")
    assert (document["request_id"], document["instance"]) == ("me", "/nowhere")


@pytest.mark.parametrize("path", [f"/v1/{name}" for name in LATER] + ["/redoc", "/v1/limits/"])
def test_paths_not_built_are_not_found(service, problem, path):
    problem(service.get(path), "not_found")
    problem(service.post(path, json={}), "not_found")


@pytest.mark.parametrize("path, verb", PATHS.items())
def test_other_verbs_are_refused(service, problem, path, verb):
    wrong = "delete" if verb == "post" else "post"
    response = service.request(wrong, path.format(id="linear", code="timeout"))
    document = problem(response, "method_not_allowed")
    taken = {"post": ["POST"], "get": ["GET", "HEAD"]}[verb]
    assert response.headers["allow"] == ", ".join(taken)
    assert document["allowed"] == taken


def test_methods(service, problem):
    listed = service.get("/v1/methods").json()
    assert [entry["id"] for entry in listed] == list(METHODS)
    for entry in listed:
        answers.MethodReply.model_validate(entry)
        assert service.get(f"/v1/methods/{entry['id']}").json() == entry
        assert set(entry["requires"]) <= set(entry["honours"])
    problem(service.get("/v1/methods/teleport"), "unknown_method")


def test_discovery(service):
    version = service.get("/v1/version").json()
    answers.VersionReply.model_validate(version)
    assert version["version"] == __version__
    assert "numpy" in version["libraries"]
    limits = service.get("/v1/limits").json()
    expected = {"body_bytes": 8388608, "waypoints": 10000, "joints": 64, "samples": 2000000, "timeout": 60.0}
    assert limits == expected
    cases = service.get("/v1/cases").json()
    assert [case["name"] for case in cases] == list(CASES)
    for case in cases:
        answers.CaseReply.model_validate(case)


@pytest.mark.parametrize("path", [path for path, verb in PATHS.items() if verb == "get"])
def test_unknown_query_parameters_are_refused(service, problem, path):
    response = service.get(path.format(id="linear", code="timeout") + "?colour=red&x")
    document = problem(response, "invalid_request")
    found = [(e["field"], e["code"]) for e in document["errors"]]
    assert found == [("/?colour", "unknown_field"), ("/?x", "unknown_field")]
    assert service.get(path.format(id="linear", code="timeout") + "?").status_code in (200, 503)


def test_discovery_is_json_only(service, problem):
    for path in ("/v1/methods", "/v1/methods/linear", "/v1/cases", "/v1/limits", "/v1/version"):
        problem(service.get(path, headers={"accept": "text/csv"}), "not_acceptable")


@pytest.mark.parametrize("code", KINDS)
def test_every_error_explains_itself(service, code):
    page = service.get(f"/errors/{code}")
    answers.ExplanationReply.model_validate(page.json())
    assert page.json()["status"] == KINDS[code].status
    text = service.get(f"/errors/{code}", headers={"accept": "text/markdown"})
    assert text.headers["content-type"].startswith("text/markdown")
    assert KINDS[code].title in text.text and f"`{code}`" in text.text


def test_no_other_errors_are_explained(service, problem):
    problem(service.get("/errors/teapot"), "not_found")


def test_health(service):
    assert service.get("/healthz").json() == {"status": "ok"}
    deadline = time.monotonic() + 60
    while (answer := service.get("/readyz")).status_code == 503 and time.monotonic() < deadline:
        time.sleep(0.1)
    assert answer.status_code == 200 and answer.json() == {"status": "ready"}


def test_not_ready_before_the_warm_up(problem):
    answer = TestClient(create_app()).get("/readyz")  # its start-up has not run
    assert problem(answer, "overloaded")
    assert answer.headers["retry-after"] == "1"


def test_what_fails_unexpectedly_leaks_nothing(problem, caplog):
    app = create_app()

    def broken() -> None:
        raise RuntimeError("the password is 1234")

    app.add_api_route("/broken", broken)
    response = TestClient(app).get("/broken", headers={"x-request-id": "seven"})
    document = problem(response, "internal")
    assert "1234" not in response.text and document["request_id"] == "seven"
    assert "1234" in caplog.text and "seven" in caplog.text


def test_lower_caps_count(problem):
    caps = Caps(body_bytes=300, waypoints=3, joints=2, samples=100, timeout=1.0)
    low = TestClient(create_app(Settings(caps)))
    good = {"waypoints": [[0], [1]], "times": [0, 1], "method": "linear", "sampling": {"count": 100}}

    def ask(**changes):
        return low.post("/v1/trajectories", json=good | changes)

    assert ask().status_code == 200
    problem(ask(waypoints=[[0], [1], [2], [3]]), "too_large")
    problem(ask(waypoints=[[0] * 3, [1] * 3]), "too_large")
    problem(ask(sampling={"count": 101}), "too_large")
    problem(ask(joint_names=["x" * 300]), "too_large")
    problem(ask(timeout=2), "invalid_request")
    assert low.get("/v1/limits").json()["body_bytes"] == 300


def _walk(value):
    yield value
    for inner in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        yield from _walk(inner)


def test_openapi(service):
    document = service.get("/openapi.json").json()
    assert document["openapi"].startswith("3.1")
    assert {path: next(iter(operations)) for path, operations in document["paths"].items()} == PATHS
    schemas = document["components"]["schemas"]
    for node in _walk(document):
        if isinstance(node, dict) and isinstance(node.get("$ref"), str):
            prefix, name = node["$ref"].rsplit("/", 1)
            assert prefix == "#/components/schemas" and name in schemas
    for name, schema in schemas.items():
        assert schema.get("description"), name
        for field, inner in schema.get("properties", {}).items():
            assert inner.get("description"), (name, field)
    ids = set()
    for operations in document["paths"].values():
        for verb, operation in operations.items():
            ids.add(operation["operationId"])
            assert operation["summary"] and operation["description"] and operation["tags"]
            media_type = "text/plain" if operation["operationId"] == "metrics" else "application/json"
            assert media_type in operation["responses"]["200"]["content"]
            for status, answer in operation["responses"].items():
                assert "X-Request-ID" in answer["headers"]
                if status != "200":
                    assert answer["content"] == {
                        "application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}
                    }
            assert "422" in operation["responses"]
            if verb == "post":
                assert operation["requestBody"]["required"] is True
                assert {"406", "413", "415", "422", "504"} <= set(operation["responses"])
    assert len(ids) == len(PATHS)


def test_the_documents_fields_are_the_contracts(service):
    schemas = service.get("/openapi.json").json()["components"]["schemas"]
    plan = schemas["PlanBody"]
    assert plan["required"] == ["waypoints"] and plan["additionalProperties"] is False
    assert set(plan["properties"]) == {
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
        "wrap",
        "robot",
        "joint_names",
        "sampling",
        "include",
        "timeout",
    }
    assert set(schemas["CompareBody"]["properties"]) == set(plan["properties"]) - {"method", "options"} | {"methods"}
    assert set(schemas["CertifyBody"]["properties"]) == {"trajectory", "limits", "waypoints", "times", "start", "end"}


def test_the_documents_examples_are_answered(service):
    document = service.get("/openapi.json").json()
    for path, operations in document["paths"].items():
        if "post" in operations:
            example = operations["post"]["requestBody"]["content"]["application/json"]["example"]
            assert service.post(path, json=example).status_code == 200
