"""Polylines with rounded corners: how far they leave the polyline, how smooth they are, and what that saves."""

import numpy as np
import pytest

from planner import InvalidRequest, PlanRequest, Unsupported, plan
from planner.curves.rounded import rounded_polyline

LIMITS = {"velocity": 1.0, "acceleration": 3.0, "jerk": 40.0}


def distance(points, polyline):
    """Return how far points are from a polyline in the largest joint, by dense sampling of it."""
    share = np.linspace(0.0, 1.0, 2001)[:, None]
    line = np.concatenate([a + share * (b - a) for a, b in zip(polyline[:-1], polyline[1:], strict=True)])
    return np.array([np.abs(line - p).max(axis=1).min() for p in points])


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("tolerance", [1e-3, 0.03, 10.0])
def test_within_the_tolerance_and_smooth(seed, tolerance):
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(int(rng.integers(2, 7)), int(rng.integers(1, 5)) + 1))
    curve, knots = rounded_polyline(points, tolerance)
    at = np.linspace(0.0, curve.end, 400)
    step = float(np.linalg.norm(np.diff(points, axis=0), axis=1).max()) / 2000
    assert distance(curve(at), points).max() <= tolerance + step
    assert np.abs(curve(knots) - points).max() <= tolerance * (1 + 1e-12)
    np.testing.assert_allclose(curve(knots[[0, -1]]), points[[0, -1]], atol=1e-12)
    turns = np.diff(points, axis=0) / np.linalg.norm(np.diff(points, axis=0), axis=1)[:, None]
    if ((turns[1:] * turns[:-1]).sum(axis=1) > -0.9).all():
        for order in (0, 1, 2):
            assert np.abs(curve.jumps(order)).max(initial=0.0) <= 1e-9 * curve.extrema(order + 1).peak(order).max()


@pytest.mark.parametrize("jerk", [False, True])
def test_corners_are_passed_without_a_stop(jerk):
    points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [2.0, 2.0], [1.5, 2.1], [0.0, 0.0]]
    limits = {k: v for k, v in LIMITS.items() if jerk or k != "jerk"}
    durations = []
    for tolerance in (None, 0.01, 0.05):
        options = {"path": {"kind": "linear"}, "corner_tolerance": tolerance}
        done = plan(PlanRequest.of(points, limits=limits), "time_optimal_path", options)
        durations.append(done.trajectory.duration)
        assert done.certificate.holds
        if tolerance is None:
            assert done.certificate.path_deviation <= 1e-12
            continue
        assert done.certificate.path_deviation == pytest.approx(tolerance, rel=0.5)
        told = {c.quantity: c for c in done.certificate.checks}
        assert told["tube"].ratio == pytest.approx(1.0) and told["tube"].bound == tolerance
        assert told["waypoint_tolerance"].holds
        speed = np.linalg.norm(done.trajectory(done.waypoint_times[1:-1], 1), axis=1)
        assert speed.min() > 0.01 and not any(n.code == "stops_at_corners" for n in done.notes)
        miss = np.abs(done.trajectory(done.waypoint_times) - points).max(axis=1)
        assert miss.max() <= tolerance * (1 + 1e-9)
    assert durations[0] > durations[1] > durations[2]


def test_turns_back_stay_stops():
    points = [[0.0, 0.0], [1.0, 0.0], [0.2, 0.0]]
    options = {"path": {"kind": "linear"}, "corner_tolerance": 0.1}
    done = plan(PlanRequest.of(points, limits={"velocity": 1.0, "acceleration": 3.0}), "time_optimal_path", options)
    assert [n.code for n in done.notes] == ["stops_at_corners"]
    assert np.abs(done.trajectory(done.waypoint_times) - points).max() <= 1e-12


@pytest.mark.parametrize(
    "path", [{"kind": "cubic_spline"}, {"kind": "linear", "knots": [0.0, 1.0, 2.0]}, {"kind": "bezier"}]
)
def test_other_paths_are_refused(path):
    request = PlanRequest.of([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], limits=LIMITS)
    with pytest.raises(InvalidRequest) as caught:
        plan(request, "time_optimal_path", {"path": path, "corner_tolerance": 0.1})
    assert [(e.field, e.code) for e in caught.value.errors] == [("/options/corner_tolerance", "conflict")]


def test_other_paths_are_refused_where_nothing_moves():
    with pytest.raises(InvalidRequest) as caught:
        plan(PlanRequest.of([[1.0], [1.0]], limits=LIMITS), "time_optimal_path", {"corner_tolerance": 0.1})
    assert caught.value.errors[0].field == "/options/corner_tolerance"


@pytest.mark.parametrize("tolerance", [0.0, -1.0, float("inf")])
def test_a_tolerance_is_a_width(tolerance):
    request = PlanRequest.of([[0.0], [1.0]], limits=LIMITS)
    with pytest.raises((InvalidRequest, Unsupported)) as caught:
        plan(request, "time_optimal_path", {"path": {"kind": "linear"}, "corner_tolerance": tolerance})
    assert caught.value.errors[0].field == "/options/corner_tolerance"
