"""The time-optimal baselines against closed forms, against one another, and against fine-grid references."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner import Infeasible, InvalidRequest, PlanRequest, Unsupported, plan
from problems.rest_to_rest import double_integrator, triple_integrator

PATHS = json.loads((Path(__file__).parent.parent / "data" / "paths.json").read_text())["cases"]
CUBIC = [c for c in PATHS if c["request"]["options"].get("path", {}).get("kind", "cubic_spline") == "cubic_spline"]
SHORT = [c for c in CUBIC if len(c["request"]["waypoints"]) <= 10]


def request_of(case, *quantities):
    limits = {k: v for k, v in case["request"]["limits"].items() if k in quantities}
    return PlanRequest.of(case["request"]["waypoints"], limits=limits)


@pytest.mark.parametrize("case", CUBIC, ids=[c["name"] for c in CUBIC])
def test_toppra_is_near_the_fine_grid_optimum(case):
    done = plan(request_of(case, "velocity", "acceleration"), "toppra", case["request"]["options"])
    best = case["reference"]["velocity_acceleration"]["duration_strict"]
    assert best * (1 - 1e-4) <= done.trajectory.duration <= best * 1.012
    assert max(c.ratio for c in done.certificate.checks) <= 1 + 1e-9
    assert done.certificate.path_deviation <= 1e-9


@pytest.mark.parametrize("case", SHORT, ids=[c["name"] for c in SHORT])
def test_the_nonlinear_program_is_near_the_fine_grid_optimum(case):
    done = plan(request_of(case, "velocity", "acceleration"), "time_optimal_nlp", case["request"]["options"])
    best = case["reference"]["velocity_acceleration"]["duration_strict"]
    assert best * (1 - 1e-4) <= done.trajectory.duration <= best * 1.02


JERK = [c for c in SHORT if c["name"] in ("rand7_w5_s1", "rand7_w10_s1")]


@pytest.mark.slow
@pytest.mark.parametrize("case", JERK, ids=[c["name"] for c in JERK])
def test_the_nonlinear_program_with_jerk(case):
    done = plan(request_of(case, "velocity", "acceleration", "jerk"), "time_optimal_nlp", case["request"]["options"])
    best = case["reference"]["with_jerk"]["duration_strict"]
    assert best * (1 - 1e-3) <= done.trajectory.duration <= best * 1.02
    assert done.certificate.continuity == 2


@given(st.integers(0, 2**32 - 1))
def test_ruckig_and_trapezoid_are_the_closed_forms(seed):
    rng = np.random.default_rng(seed)
    d, v, a, j = 10.0 ** rng.uniform(-2, 2, 4)
    limits = {"velocity": v, "acceleration": a}
    expected = float(double_integrator(np.array(d), np.array(v), np.array(a), np.array(a)))
    for method in ("trapezoidal", "ruckig"):
        done = plan(PlanRequest.of([0, d], limits=limits), method)
        # with long cruises limits are capped for the clock: longer by up to a part in 1e6, once seen at 3.3e-8
        assert done.trajectory.duration == pytest.approx(expected, rel=1e-6)
        assert done.certificate.objective.gap <= 1e-9
    expected = float(triple_integrator(*(np.array(x) for x in (d, v, a, j))))
    done = plan(PlanRequest.of([0, d], limits={**limits, "jerk": j}), "ruckig")
    # where cruises are 1e8 times longer than ramps, limits are capped for ruckig's sake: up to some 1e-4 longer
    assert expected * (1 - 1e-9) <= done.trajectory.duration <= expected * (1 + 3e-4)
    assert done.certificate.objective.gap <= 3e-4


def test_triple_integrator_regimes():
    def shortest(*x):
        return float(triple_integrator(*(np.array(float(v)) for v in x)))

    assert shortest(2, 1e3, 1e3, 1) == pytest.approx(4 * np.cbrt(1))  # jerk only: 4 cbrt(d / 2j)
    assert shortest(100, 1e3, 2, 1) == pytest.approx(2 + np.sqrt(4 + 200))  # acceleration reached
    assert shortest(100, 5, 1e3, 1) == pytest.approx(100 / 5 + 2 * np.sqrt(5))  # velocity, not acceleration
    assert shortest(100, 5, 2, 1) == pytest.approx(100 / 5 + 2 + 2.5)  # both


@pytest.mark.parametrize("distance", [1e-16, 8e-16, 1e-9, 1.0, 1e6])
@pytest.mark.parametrize("limit", [1e-3, 1.0, 1e6])
@pytest.mark.parametrize("method", ["trapezoidal", "ruckig", "time_scaled", "toppra", "time_optimal_nlp"])
def test_all_scales(method, distance, limit):
    """Alone, and beside a joint that moves by one: the duration is right to 0.1 % whatever the scale."""
    limits = {"velocity": limit, "acceleration": limit}
    for points in ([[0.0], [distance]], [[0.0, 0.0, 3.0], [distance, 1.0, 3.0]]):
        done = plan(PlanRequest.of(points, limits=limits), method)
        shortest = double_integrator(np.ptp(np.array(points), axis=0), *[np.full(len(points[0]), limit)] * 3).max()
        tolerance = {"time_scaled": 0.6, "toppra": 0.01, "time_optimal_nlp": 0.02}.get(method, 1e-6)
        assert shortest * (1 - 1e-9) <= done.trajectory.duration <= shortest * (1 + tolerance)
        assert done.certificate.waypoint_error <= 1e-9


def test_uniform_scaling_worked_example():
    request = PlanRequest.of([0, 2, 3], times=[0, 1, 2], limits={"velocity": 1, "acceleration": 2})
    done = plan(request, "time_scaled")
    np.testing.assert_allclose(done.waypoint_times, [0, 75 / 28, 75 / 14], rtol=1e-9)
    assert done.trajectory(done.waypoint_times[1], 1)[0] == pytest.approx(2.25 * 28 / 75)
    assert "velocity limit" in done.notes[0].message
    double = plan(PlanRequest.of([0, 2, 3], times=[0, 1, 2], duration={"min": 4}), "time_scaled").trajectory
    assert [double(1.0, m)[0] for m in range(4)] == pytest.approx([0.71875, 1.21875, 0.5625, -1.3125])


def test_uniform_scaling_speeds_up_only_when_asked():
    loose = {"times": [0, 10, 20], "limits": {"velocity": 1, "acceleration": 2}}
    assert plan(PlanRequest.of([0, 2, 3], **loose), "time_scaled").trajectory.duration == 20
    fast = plan(PlanRequest.of([0, 2, 3], **loose), "time_scaled", {"allow_faster": True})
    assert fast.trajectory.duration == pytest.approx(75 / 14)


def test_knots_and_times_together_are_refused():
    request = PlanRequest.of([0, 2, 3], times=[0, 1, 2], limits={"velocity": 1})
    with pytest.raises(InvalidRequest) as caught:
        plan(request, "time_scaled", {"path": {"knots": [0, 1, 2]}})
    assert caught.value.errors[0].code == "conflict"


@pytest.mark.parametrize("method", ["toppra", "time_optimal_nlp"])
def test_corners_are_stopped_at(method):
    request = PlanRequest.of([[0, 0], [1, 0], [1, 1]], limits={"velocity": 10, "acceleration": 4})
    done = plan(request, method, {"path": {"kind": "linear"}})
    assert 2.0 <= done.trajectory.duration <= 2.02  # twice 2 sqrt(1 / 4)
    assert np.abs(done.trajectory(done.waypoint_times[1], 1)).max() <= 1e-9
    assert [n.code for n in done.notes] == ["stops_at_corners"]


@pytest.mark.parametrize("method", ["time_scaled", "toppra", "time_optimal_nlp"])
def test_given_paths(method):
    circle = np.linspace(0, 2 * np.pi, 5)
    points = np.stack([np.cos(circle), np.sin(circle)], axis=1).round(12)
    limits = {"velocity": 1.0, "acceleration": 2.0}
    periodic = {"kind": "cubic_spline", "boundary": "periodic", "knots": circle.tolist()}
    first = plan(PlanRequest.of(points, limits=limits), method, {"path": periodic})
    from planner.curves.cubic import cubic_spline

    curve = cubic_spline(circle, points, "periodic")
    polynomial = {"polynomial": {"breaks": circle.tolist(), "coefficients": curve.powers().tolist()}}
    second = plan(PlanRequest.of(points, limits=limits), method, {"path": polynomial})
    assert second.trajectory.duration == pytest.approx(first.trajectory.duration, rel=1e-6)
    with pytest.raises(InvalidRequest) as caught:
        plan(PlanRequest.of(points + 0.1, limits=limits), method, {"path": polynomial})
    assert caught.value.errors[0].code == "conflict"


@pytest.mark.parametrize("method", ["time_scaled", "toppra", "time_optimal_nlp"])
def test_no_timing_cures_a_path_outside_its_position_limits(method):
    request = PlanRequest.of([0, 1, -1, 0], limits={"acceleration": 1, "position": {"lower": -2, "upper": 1.001}})
    with pytest.raises(Infeasible) as caught:
        plan(request, method, {"path": {"kind": "cubic_spline", "boundary": "natural"}})
    found = caught.value
    assert found.quantity == "position" and found.certified and found.segment in (0, 1, 2)
    assert found.needed > 1.001 and found.bound == 1.001


@pytest.mark.parametrize("method", ["trapezoidal", "ruckig", "time_scaled", "toppra", "time_optimal_nlp"])
def test_durations_are_kept_or_refused(method):
    limits = {"velocity": 1, "acceleration": 2}
    shortest = plan(PlanRequest.of([0, 1, 3], limits=limits), method).trajectory.duration
    for bounds in ({"min": 10, "max": 10}, {"min": 10}, {"max": shortest * 1.01}):
        done = plan(PlanRequest.of([0, 1, 3], limits=limits, duration=bounds), method)
        expected = max(shortest, bounds.get("min", 0))
        assert done.trajectory.duration == pytest.approx(expected, rel=1e-9)
    with pytest.raises(Infeasible) as caught:
        plan(PlanRequest.of([0, 1, 3], limits=limits, duration={"max": shortest * 0.99}), method)
    assert caught.value.minimum_duration == pytest.approx(shortest)


def test_segment_durations_share_the_slack():
    body = {"limits": {"velocity": 1, "acceleration": 2}, "duration": {"min": 20, "max": 20}}
    bounds = [{"max": 2}, None, {"min": 5}]
    done = plan(PlanRequest.of([0, 1, 2, 3], segment_durations=bounds, **body), "ruckig")
    steps = np.diff(done.waypoint_times)
    assert steps[0] == pytest.approx(2) and steps[2] >= 5 and steps.sum() == pytest.approx(20)
    with pytest.raises(Infeasible):
        plan(PlanRequest.of([0, 1, 2, 3], segment_durations=[{"max": 2}] * 3, **body), "ruckig")
    with pytest.raises(Infeasible) as caught:
        plan(
            PlanRequest.of([0, 5, 2, 3], segment_durations=[{"max": 2}, None, None], limits=body["limits"]),
            "trapezoidal",
        )
    assert caught.value.segment == 0 and caught.value.needed == pytest.approx(5.5)


def test_ruckig_takes_and_keeps_states_at_both_ends():
    request = PlanRequest.of(
        [[0, 0], [1, -1], [2, 0]],
        limits={"velocity": 2, "acceleration": 3, "jerk": 20},
        start={"velocity": [1, -0.5], "acceleration": [0.5, 0]},
        end={"velocity": [0.3, 0.2]},
    )
    done = plan(request, "ruckig")
    assert done.trajectory(0.0, 1) == pytest.approx([1, -0.5]) and done.trajectory(0.0, 2) == pytest.approx([0.5, 0])
    assert done.trajectory(done.trajectory.end, 1) == pytest.approx([0.3, 0.2], abs=1e-9)
    with pytest.raises(Unsupported):
        body = {"limits": {"velocity": 2, "acceleration": 3}, "start": {"acceleration": [1]}}
        plan(PlanRequest.of([0, 1], **body), "ruckig")


def test_a_state_that_leads_beyond_a_limit_is_infeasible():
    request = PlanRequest.of(
        [0, 1],
        limits={"velocity": 1, "acceleration": 2, "jerk": 2},
        start={"velocity": [0.9], "acceleration": [1.0]},
    )
    with pytest.raises(Infeasible) as caught:
        plan(request, "ruckig")
    assert caught.value.needed == pytest.approx(0.9 + 1 / 4)  # v0 + a0² / (2 j)


def test_ruckig_refuses_position_limits_by_name():
    with pytest.raises(Unsupported) as caught:
        limits = {"velocity": 1, "acceleration": 1, "position": {"lower": -1, "upper": 2}}
        plan(PlanRequest.of([0, 1], limits=limits), "ruckig")
    assert caught.value.what == "position" and "trapezoidal" in caught.value.alternatives


def test_a_jerk_limit_with_two_sides_is_kept_and_said():
    request = PlanRequest.of([0, 1], limits={"velocity": 1, "acceleration": 1, "jerk": {"lower": -2, "upper": 5}})
    done = plan(request, "ruckig")
    assert [n.code for n in done.notes] == ["jerk_symmetric"]
    assert done.certificate.objective.lower_bound is None
