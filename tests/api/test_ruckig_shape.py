"""POST /v1/trajectories?shape=ruckig: a body with the names of ruckig's InputParameter."""

import dataclasses
import json
import re
from pathlib import Path

import numpy as np
import pytest

from api.reading import parse, to_request
from api.ruckig_shape import RuckigBody, to_plan
from api.settings import Caps
from planner import from_ruckig
from planner.compat import NAMES

AUTO = ("ruckig", "time_optimal_waypoints")  # what auto may pick under limits on velocity, acceleration and jerk
PLAN = "/v1/trajectories"
BODY = {
    "degrees_of_freedom": 2,
    "current_position": [0, 0],
    "target_position": [1, -2],
    "max_velocity": [1, 2],
    "max_acceleration": [3, 3],
    "max_jerk": [10, 10],
}
OURS = {
    "waypoints": [[0, 0], [1, -2]],
    "limits": {"velocity": [1, 2], "acceleration": [3, 3], "jerk": [10, 10]},
}


def ask(service, **changes):
    return service.post(PLAN + "?shape=ruckig", json=BODY | changes)


def answer(service, **changes):
    response = ask(service, **changes)
    assert response.status_code == 200, response.text[:1000]
    return response.json()


def same(service, changes, ours):
    """Whether both shapes of the request give the same answer."""
    return ask(service, **changes).content == service.post(PLAN, json=OURS | ours).content


def test_the_answer_is_the_plan_answer(service):
    found = answer(service)
    assert found["method"] in AUTO and found["certificate"]["holds"]
    assert [c["quantity"] for c in found["certificate"]["checks"]] == ["velocity", "acceleration", "jerk"]
    assert same(service, {}, {})


@pytest.mark.parametrize(
    "changes, ours",
    [
        ({"current_velocity": [0, 0], "target_acceleration": [0, 0]}, {}),
        ({"current_velocity": [0.1, 0]}, {"start": {"velocity": [0.1, 0]}}),
        ({"target_velocity": [0, -0.1]}, {"end": {"velocity": [0, -0.1]}}),
        ({"intermediate_positions": [[1, 1]]}, {"waypoints": [[0, 0], [1, 1], [1, -2]]}),
        ({"min_velocity": [-1, -1]}, {"limits": OURS["limits"] | {"velocity": {"lower": [-1, -1], "upper": [1, 2]}}}),
        ({"minimum_duration": 9}, {"duration": {"min": 9}}),
        ({"per_section_minimum_duration": [9]}, {"segment_durations": [{"min": 9}]}),
        ({"per_section_max_velocity": [[0.5, 5]]}, {"limits": OURS["limits"] | {"velocity": [0.5, 5]}}),
        ({"per_section_max_velocity": [[0.5, None]]}, {"limits": OURS["limits"] | {"velocity": [0.5, 2]}}),
        (
            {"intermediate_positions": [[1, 1]], "per_section_max_velocity": [[0.5, 0.5], [1, 3]]},
            {
                "waypoints": [[0, 0], [1, 1], [1, -2]],
                "limits": OURS["limits"] | {"velocity": [1, 3]},
                "segment_limits": [{"velocity": [0.5, 0.5]}, None],
            },
        ),
        ({"per_dof_control_interface": ["position"] * 2, "per_dof_synchronization": ["time", "time"]}, {}),
        ({"interrupt_calculation_duration": None, "timeout": 20}, {"timeout": 20}),
        ({"enabled": [True, True], "control_interface": "position", "synchronization": "time"}, {}),
        ({"duration_discretization": "continuous", "sampling": None, "include": None}, {}),
        ({"sampling": {"count": 7}, "include": ["polynomial", "samples"]},) * 2,
        ({"degrees_of_freedom": None}, {}),
    ],
)
def test_it_says_the_same_as_our_shape(service, changes, ours):
    assert same(service, changes, ours)


def test_without_a_jerk_limit(service):
    plain = answer(service, max_jerk=None)
    assert plain["method"] == "ruckig" and "picked_because" not in plain
    ours = OURS | {"limits": {k: v for k, v in OURS["limits"].items() if k != "jerk"}, "method": "ruckig"}
    states = {"current_velocity": [0.1, 0], "target_velocity": [0, -0.2]}
    moving = ask(service, max_jerk=None, **states)
    assert moving.status_code == 200
    state = {"start": {"velocity": [0.1, 0]}, "end": {"velocity": [0, -0.2]}}
    assert moving.content == service.post(PLAN, json=ours | state).content
    assert moving.json()["samples"]["velocity"][-1] == pytest.approx([0, -0.2])
    assert answer(service, max_jerk=[None, None])["method"] == "ruckig"
    assert answer(service)["picked_because"]  # with a jerk limit: auto


@pytest.mark.parametrize(
    "changes, field, code",
    [
        ({"current_position": None}, "/current_position", "wrong_type"),
        ({"degrees_of_freedom": 3}, "/current_position", "shape_mismatch"),
        ({"target_position": [1]}, "/target_position", "shape_mismatch"),
        ({"intermediate_positions": [[1]]}, "/intermediate_positions/0", "shape_mismatch"),
        ({"max_velocity": [0, 1]}, "/max_velocity", "bad_limits"),
        ({"min_velocity": [1, 1]}, "/min_velocity", "bad_limits"),
        ({"max_velocity": [1]}, "/max_velocity", "shape_mismatch"),
        ({"min_acceleration": [-1]}, "/min_acceleration", "shape_mismatch"),
        ({"current_velocity": [1]}, "/current_velocity", "shape_mismatch"),
        ({"per_section_max_velocity": [[1, 1], [1, 1]]}, "/per_section_max_velocity", "shape_mismatch"),
        ({"per_section_max_jerk": [[-1, 1]]}, "/per_section_max_jerk/0", "bad_limits"),
        ({"per_section_minimum_duration": []}, "/per_section_minimum_duration", "shape_mismatch"),
        ({"minimum_duration": -1}, "/minimum_duration", "out_of_range"),
        ({"enabled": [True, False]}, "/enabled/1", "out_of_range"),
        ({"control_interface": "velocity"}, "/control_interface", "out_of_range"),
        ({"synchronization": "none"}, "/synchronization", "out_of_range"),
        ({"duration_discretization": "discrete"}, "/duration_discretization", "out_of_range"),
        ({"per_dof_control_interface": ["position", "velocity"]}, "/per_dof_control_interface/1", "out_of_range"),
        ({"per_dof_synchronization": ["time"]}, "/per_dof_synchronization", "shape_mismatch"),
        ({"interrupt_calculation_duration": 5}, "/interrupt_calculation_duration", "out_of_range"),
        ({"current_velocity": [0]}, "/current_velocity", "shape_mismatch"),
        ({"current_position": [], "target_position": [], "degrees_of_freedom": None}, "/current_position", None),
        ({"waypoints": [[0]]}, "/waypoints", "unknown_field"),
        ({"max_acceleration": None, "max_jerk": None}, "/max_acceleration", "missing"),
    ],
)
def test_errors_point_to_the_callers_fields(service, problem, changes, field, code):
    document = problem(ask(service, **changes), "invalid_request")
    found = [(e["field"], e["code"]) for e in document["errors"]]
    assert (field, code or found[0][1]) in found, document


def test_position_limits_are_kept_or_refused_by_name(service, problem):
    response = ask(service, max_position=[5, 5], min_position=[-5, -5])
    if response.status_code == 200:
        checks = {c["quantity"]: c["holds"] for c in response.json()["certificate"]["checks"]}
        assert checks["position"]
    else:
        assert "position" in problem(response, "unsupported")["what"]
    without = ask(service, max_position=[5, 5], min_position=[-5, -5], max_jerk=None)
    assert "position" in problem(without, "unsupported")["what"]


def test_all_names_are_declared():
    assert set(RuckigBody.model_fields) == {*NAMES, "sampling", "include", "timeout"}


def tree(value):
    """The dataclass as comparable lists."""
    if dataclasses.is_dataclass(value):
        return {f.name: tree(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, tuple):
        return [tree(v) for v in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"max_jerk": None, "current_velocity": [0.1, 0], "target_acceleration": [0, 0.2], "timeout": 3.0},
        {
            "intermediate_positions": [[1, 1], [2, 2]],
            "min_velocity": [-2, -3],
            "max_position": [5, None],
            "min_position": [None, -5],
            "per_section_max_velocity": [[1, 2], [3, 4], [None, 6]],
            "per_section_min_acceleration": [[-1, -2], [-3, -4], [-5, None]],
            "per_section_max_position": [[3, 3], [None, 3], [3, 3]],
            "per_section_minimum_duration": [0, 1.5, 2],
            "minimum_duration": 4,
        },
    ],
)
def test_python_and_http_read_the_same_request(changes):
    body = BODY | changes
    sent, _ = to_request(to_plan(parse(RuckigBody, body)), Caps())
    read = from_ruckig(body)
    if "timeout" not in changes:
        sent = dataclasses.replace(sent, timeout=None)  # the service has a cap of its own
    assert tree(sent) == tree(read)


def test_the_request_of_the_page_is_answered(service):
    page = (Path(__file__).resolve().parents[2] / "docs" / "from_ruckig.md").read_text(encoding="utf-8")
    (url, body), *more = re.findall(r"curl -s 'http://[\d.:]+(\S+)'.*? -d '(.*?)'\n```", page, re.S)
    response = service.post(url, json=json.loads(body))
    assert response.status_code == 200 and response.json()["certificate"]["holds"] and not more
    assert response.json()["samples"]["time"][1] == 0.01
