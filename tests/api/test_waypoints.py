"""time_optimal_waypoints over HTTP: picked for limits with jerk, its certificate, ruckig's shape, the same bytes."""

import numpy as np
import pytest

from api.answers import PlanReply
from planner import METHODS

PLAN = "/v1/trajectories"
METHOD = "time_optimal_waypoints"
BODY = {
    "waypoints": [[0, 0], [1, 0.5], [0.4, 1.2], [0, 0]],
    "limits": {"velocity": [1, 1.5], "acceleration": {"lower": -3, "upper": 4}, "jerk": 30},
    "include": ["samples", "polynomial"],
}
RUCKIG = {
    "degrees_of_freedom": 2,
    "current_position": [0, 0],
    "current_velocity": [0.2, 0],
    "intermediate_positions": [[1, 0.5], [0.4, 1.2]],
    "target_position": [0, 0],
    "max_velocity": [1, 1.5],
    "max_acceleration": [3, 3],
    "max_jerk": [30, 30],
}


def answer(service, body, url=PLAN):
    first, second = (service.post(url, json=body) for _ in range(2))
    assert first.status_code == 200, first.text[:1000]
    assert first.content == second.content
    found = first.json()
    PlanReply.model_validate(found)
    return found


def test_auto_picks_it(service):
    found = answer(service, BODY)
    assert found["method"] == METHOD
    assert found["picked_because"] == "no times, but velocity, acceleration and jerk limits were given"
    certificate = found["certificate"]
    assert certificate["holds"] and certificate["continuity"] == 2
    assert [c["quantity"] for c in certificate["checks"]] == ["velocity", "acceleration", "jerk"]
    assert all(c["ratio"] <= 1 + 1e-12 for c in certificate["checks"])
    assert isinstance(certificate["path_deviation"], float) and certificate["path_deviation"] > 0
    objective = certificate["objective"]
    assert (objective["name"], objective["bound_scope"]) == ("duration", "all")
    assert objective["value"] == found["duration"] == pytest.approx(found["waypoint_times"][-1])
    assert 0 < objective["lower_bound"] <= found["duration"]
    assert found["solver"]["name"] == "interior_point" and found["solver"]["status"] == "solved"
    assert found["samples"]["position"][0] == [0, 0] and len(found["polynomial"]["coefficients"]) == 4
    by_id = answer(service, BODY | {"method": METHOD})
    assert "picked_because" not in by_id and by_id["samples"] == found["samples"]


def test_options(service, problem):
    straight = answer(service, BODY | {"options": {"straight": True, "effort": "best"}})
    assert straight["certificate"]["path_deviation"] < 1e-12
    assert straight["certificate"]["objective"]["bound_scope"] == "method"
    smooth = answer(service, BODY | {"options": {"smoothness": 0.5}})
    free = answer(service, BODY)
    assert smooth["duration"] == pytest.approx(1.5 * free["duration"], rel=1e-9)
    assert smooth["certificate"]["cost"]["squared_jerk"] < free["certificate"]["cost"]["squared_jerk"]
    document = problem(service.post(PLAN, json=BODY | {"options": {"effort": "most"}}), "invalid_request")
    assert document["errors"][0]["field"] == "/options/effort"
    moving = BODY | {"start": {"velocity": [0.1, -0.1]}, "options": {"straight": True}}
    document = problem(service.post(PLAN, json=moving), "invalid_request")
    assert [(e["field"], e["code"]) for e in document["errors"]] == [("/start/velocity", "bad_boundary")]


def test_refusals_say_what_would_do(service, problem):
    state = {"velocity": [0.95, 0], "acceleration": [3.5, 0]}
    document = problem(service.post(PLAN, json=BODY | {"start": state}), "infeasible")
    named = {k: document[k] for k in ("joint", "quantity", "bound", "certified")}
    assert named == {"joint": 0, "quantity": "velocity", "bound": 1, "certified": True}
    assert document["needed"] == pytest.approx(0.95 + 3.5**2 / 60)
    document = problem(service.post(PLAN, json=BODY | {"duration": {"max": 1.0}}), "infeasible")
    assert document["minimum_duration"] == pytest.approx(answer(service, BODY)["duration"])


def test_ruckigs_shape_with_waypoints_between(service):
    found = answer(service, RUCKIG, PLAN + "?shape=ruckig")
    assert found["method"] == METHOD and found["certificate"]["holds"]
    assert np.allclose(found["samples"]["velocity"][0], [0.2, 0], atol=1e-12)
    assert len(found["waypoint_times"]) == 4
    plain = answer(service, {k: v for k, v in RUCKIG.items() if k != "intermediate_positions"}, PLAN + "?shape=ruckig")
    assert plain["duration"] < found["duration"]


def test_the_catalogue_lists_it(service):
    row = next(m for m in service.get("/v1/methods").json() if m["id"] == METHOD)
    assert row["requires"] == ["velocity", "acceleration", "jerk"] and row["continuity"] == 2
    assert "waypoint_states" in row["honours"] and row["path"] == "free" and row["timing"] == "chosen"
    variant = next(v for v in row["variants"] if v["options"] == {"straight": True})
    assert set(row["honours"]) - set(variant["honours"]) == {"waypoint_states"}
    assert set(row["options"]["properties"]) == {"effort", "smoothness", "straight"} and METHOD in METHODS
