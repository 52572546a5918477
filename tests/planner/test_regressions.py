"""Failures that were found once, kept."""

import numpy as np
import pytest

from planner import Infeasible, PlannerError, PlanRequest, Trajectory, Unsupported, certify, compare, plan


def test_ruckig_with_jerk_limits_on_some_joints():
    """Joints without a jerk limit step their acceleration; only the others start and end with none."""
    limits = {"acceleration": 6.44, "velocity": [100, 1, 1e6], "jerk": [None, None, 1.74]}
    request = PlanRequest.of([[-2.1, 0.56, -2.91], [0.2, 2.77, -1.22]], limits=limits)
    done = plan(request, "ruckig")
    assert done.trajectory(0.0, 2)[2] == 0
    with pytest.raises(Unsupported):
        plan(PlanRequest.of([[0, 0, 0], [1, 1, 1]], limits=limits, start={"acceleration": [0, 0, 0]}), "ruckig")


def test_a_hold_is_stretched_to_its_least_duration():
    request = PlanRequest.of([[0.4], [0.4]], times=[5, 6.8], duration={"min": 2.0}, limits={"velocity": 1})
    done = plan(request, "time_scaled")
    assert done.trajectory.duration == pytest.approx(2.0) and done.trajectory.start == 5
    with pytest.raises(Infeasible):
        plan(PlanRequest.of([[0.4], [0.4]], times=[5, 6.8], duration={"max": 1.0}), "time_scaled")


def test_noise_in_a_joint_that_rests_is_no_jump():
    """An exact spline from elsewhere, whose still joint carries rounding of its position, is certified."""
    rng = np.random.default_rng(2)
    times = np.cumsum(rng.uniform(0.3, 1, 9))
    curve = Trajectory.from_hermite(times, *[rng.normal(size=(9, 2)) for _ in range(3)])
    noise = rng.normal(size=curve.coefficients.shape) * 1e-15
    noise[:, :, 0] = 0
    still = np.where([True, False], curve.coefficients, 0) + noise
    still[-1, :, 1] -= 1.57
    assert certify(Trajectory(times, still), limits={"jerk": 1e6}).holds


@pytest.mark.parametrize(
    ("method", "body"),
    [
        ("minimum_jerk", {"waypoints": [-1.4, -1.4, -2.6, -2.8], "times": [-5, -4.1, -2.8, -1.6],
                          "limits": {"velocity": {"lower": -1e6, "upper": 1e-9}, "acceleration": 1e6, "jerk": 1e6}}),
        ("minimum_jerk", {"waypoints": [-0.69, 1e-9], "times": [0, 1e-6], "limits": {"jerk": 1e-9}}),
        ("minimum_jerk", {"waypoints": [-2.4, 1e9, 0.0], "times": [0, 1.5, 1000001.5]}),
        ("cubic_spline", {"waypoints": [0.9, -1, -0.18], "times": [0, 1e-6, 1000000.000001]}),
        ("trapezoidal", {"waypoints": [-0.9, -2.9], "limits": {"acceleration": 1.3, "velocity": 1e-6}}),
        ("ruckig", {"waypoints": [1.1, -1e9, 0.3], "limits": {"acceleration": 1, "velocity": 1e-6, "jerk": 1e6}}),
        ("ruckig", {"waypoints": [1e9, 1e9, 0.8], "limits": {"velocity": 1.7, "acceleration": 1e-300}}),
        ("toppra", {"waypoints": [0, 1e-300], "limits": {"acceleration": 0.4}}),
        ("time_optimal_nlp", {"waypoints": [0, 1, 1e9], "limits": {"acceleration": 1e-300}}),
        ("toppra", {"waypoints": [0, -1, 1e9, 1e-300, 1e9, 1, -1e9], "limits": {"acceleration": 1e6, "velocity": 1e9}}),
    ],
)  # fmt: skip
def test_extremes_are_answered_or_refused_by_name(method, body):
    """Scales beyond double precision or beyond a library are refusals of the caller's request, never failures."""
    given = dict(body)
    try:
        done = plan(PlanRequest.of(given.pop("waypoints"), **given), method)
        assert done.certificate.holds
    except PlannerError as error:
        assert error.code in ("unsupported", "infeasible", "invalid_request")


def test_one_broken_method_costs_the_others_nothing(monkeypatch, caplog):
    import dataclasses

    from planner import METHODS, comparison

    def broken(request, options):
        raise ZeroDivisionError

    monkeypatch.setitem(comparison.METHODS, "linear", dataclasses.replace(METHODS["linear"], solve=broken))
    rows = compare(PlanRequest.of([0, 1], times=[0, 1]), ["linear", "minimum_jerk"])
    assert rows[0].error.code == "solver_failed" and rows[1].plan.certificate.holds
    assert "failed unexpectedly" in caplog.text


def test_toppra_on_a_path_with_one_tiny_gap():
    """Speeds ten orders apart on one path are too much for toppra's tolerances: stretches are timed one by one."""
    points = np.array([[24.0, -18, -21], [8, -44, -38], [61, 78, 60], [13, 7, 22], [-70, -66, 16]])
    points = np.concatenate([points, points[-1:] + 8.4e-8])
    limits = {"velocity": [9.1, 31, 34], "acceleration": [39, 21, 41]}
    done = plan(PlanRequest.of(points, limits=limits), "toppra")
    slow = plan(PlanRequest.of(points, limits=limits), "time_scaled")
    assert done.certificate.holds and done.trajectory.duration < 0.7 * slow.trajectory.duration
