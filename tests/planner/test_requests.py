"""Reading a request: each finding by its pointer and code."""

import numpy as np
import pytest

from planner import InvalidRequest, PlanRequest, Sampling, Trajectory, sample
from planner.errors import TooLarge
from planner.sampling import sample_count

GOOD = {"waypoints": [[0, 0], [1, 1], [2, 0]]}


@pytest.mark.parametrize(
    ("change", "field", "code"),
    [
        ({"waypoints": []}, "/waypoints", "too_few_points"),
        ({"waypoints": [[]]}, "/waypoints", "too_few_points"),
        ({"waypoints": [[1, 2]]}, "/waypoints", "too_few_points"),
        ({"waypoints": [[1, 2], [3]]}, "/waypoints/1", "shape_mismatch"),
        ({"waypoints": [[1, 2], [3, float("nan")]]}, "/waypoints/1/1", "not_finite"),
        ({"waypoints": [[1, 2], [3, 1e308]]}, "/waypoints/1/1", "out_of_range"),
        ({"waypoints": [["1", 2], [3, 4]]}, "/waypoints", "wrong_type"),
        ({"waypoints": [[True, False], [True, True]]}, "/waypoints", "wrong_type"),
        ({"waypoints": "abc"}, "/waypoints", "wrong_type"),
        ({"times": [0, 1]}, "/times", "shape_mismatch"),
        ({"times": [0, 2, 1]}, "/times/2", "not_increasing"),
        ({"times": [0, 1, 1]}, "/times/2", "not_increasing"),
        ({"times": [0, 1e-10, 1]}, "/times/1", "out_of_range"),
        ({"limits": {"velocity": 0}}, "/limits/velocity", "bad_limits"),
        ({"limits": {"velocity": [1, -1]}}, "/limits/velocity", "bad_limits"),
        ({"limits": {"velocity": [1, 1, 1]}}, "/limits/velocity", "shape_mismatch"),
        ({"limits": {"velocity": True}}, "/limits/velocity", "wrong_type"),
        ({"limits": {"velocity": "3"}}, "/limits/velocity", "wrong_type"),
        ({"limits": {"velocity": {"lower": 1, "upper": 2}}}, "/limits/velocity", "bad_limits"),
        ({"limits": {"position": 3}}, "/limits/position", "wrong_type"),
        ({"limits": {"position": {"lower": 1, "upper": 1}}}, "/limits/position", "bad_limits"),
        ({"limits": {"velocity": {"lower": -1, "uper": 2}}}, "/limits/velocity/uper", "unknown_field"),
        ({"limits": {"speed": 1}}, "/limits/speed", "unknown_field"),
        ({"limits": {"velocity_norm": -1}}, "/limits/velocity_norm", "bad_limits"),
        ({"segment_limits": [None]}, "/segment_limits", "shape_mismatch"),
        ({"segment_limits": [{"velocity_norm": 0}, None]}, "/segment_limits/0/velocity_norm", "bad_limits"),
        ({"segment_limits": [None, {"jerk": -1}]}, "/segment_limits/1/jerk", "bad_limits"),
        ({"segment_durations": [{"min": 2, "max": 1}, None]}, "/segment_durations/0", "bad_duration"),
        ({"duration": {"min": -1}}, "/duration/min", "out_of_range"),
        ({"start": {"velocity": [1]}}, "/start/velocity", "shape_mismatch"),
        ({"end": {"speed": [1, 1]}}, "/end/speed", "unknown_field"),
        ({"waypoint_states": [None, {"velocity": [1]}, None]}, "/waypoint_states/1/velocity", "shape_mismatch"),
        ({"waypoint_states": [None]}, "/waypoint_states", "shape_mismatch"),
        ({"tube": [0.1, None]}, "/tube", "out_of_range"),
        ({"tube": [0.1]}, "/tube", "shape_mismatch"),
        ({"waypoint_tolerance": -1}, "/waypoint_tolerance", "out_of_range"),
        ({"joint_names": ["a"]}, "/joint_names", "shape_mismatch"),
        ({"joint_names": ["a", "a"]}, "/joint_names", "conflict"),
        ({"timeout": 0}, "/timeout", "out_of_range"),
        ({"waypoint": 1}, "/waypoint", "unknown_field"),
    ],
)
def test_findings(change, field, code):
    body = {**GOOD, **change}
    with pytest.raises(InvalidRequest) as caught:
        PlanRequest.of(body.pop("waypoints"), **body)
    first = caught.value.errors[0]
    assert (first.field, first.code) == (field, code)
    assert first.reason


def test_all_findings_are_told_at_once():
    with pytest.raises(InvalidRequest) as caught:
        PlanRequest.of([[0], [1]], times=[1, 0], limits={"velocity": -1, "jerk": 0}, duration={"min": 3, "max": 1})
    assert {e.field for e in caught.value.errors} == {"/times/1", "/limits/velocity", "/limits/jerk", "/duration"}


def test_null_limits_limit_nothing():
    request = PlanRequest.of([[0, 0], [1, 1]], limits={"velocity": [None, None], "acceleration": [1, None]})
    assert request.limits.given() == ("acceleration",)
    assert request.limits.acceleration.upper.tolist() == [1, np.inf]


@pytest.mark.parametrize(
    ("value", "field", "code"),
    [
        ({"dt": 0}, "/sampling/dt", "out_of_range"),
        ({"dt": 1, "count": 3}, "/sampling", "conflict"),
        ({"count": 1}, "/sampling/count", "out_of_range"),
        ({"count": 2.5}, "/sampling/count", "out_of_range"),
        ({"times": []}, "/sampling/times", "too_few_points"),
        ({"times": [1, 1]}, "/sampling/times/1", "not_increasing"),
        ({"rate": 1}, "/sampling/rate", "unknown_field"),
    ],
)
def test_sampling_findings(value, field, code):
    with pytest.raises(InvalidRequest) as caught:
        Sampling.of(value)
    assert (caught.value.errors[0].field, caught.value.errors[0].code) == (field, code)


@pytest.mark.parametrize("dt", [0.1, 0.3, 0.5, 1.0, 1 / 3, 2.0, 7.0, 0.1 + 1e-12])
def test_the_last_sample_is_the_end_and_never_doubled(dt):
    t = Trajectory.from_hermite([5, 6], [[0.0], [1.0]])
    found = sample(t, Sampling.of({"dt": dt})).time
    assert found[0] == 5 and found[-1] == 6
    steps = np.diff(found)
    assert (steps > 1e-9).all() and np.allclose(steps[:-1], dt)
    assert len(found) == sample_count(Sampling.of({"dt": dt}), 1.0)


def test_caps_are_decided_before_allocating():
    t = Trajectory.from_hermite([0, 1], [[0.0], [1.0]])
    for sampling in ({"dt": 1e-12}, {"dt": 1e-300}, {"count": 10**9}, {"count": 10**15}):
        with pytest.raises(TooLarge) as caught:
            sample(t, Sampling.of(sampling), most=2_000_000)
        assert caught.value.limit == 2_000_000


def test_default_is_200_samples():
    assert len(sample(Trajectory.from_hermite([0, 1], [[0.0], [1.0]]), Sampling.of(None)).time) == 200
