"""The contract battery: every method × every case. A case says by itself what it needs; a method that honours it all
may not refuse, and one that does not must say so by name and point to others that do."""

import numpy as np
import pytest

from planner import CASES, METHODS, InvalidRequest, NotVerified, PlannerError, PlanRequest, Unsupported, compare, plan
from planner.check import asked_words
from planner.limits import QUANTITIES

POINTS = [[0.0, 0.2, 1.0], [0.4, -0.3, 1.0], [1.1, 0.1, 1.0], [0.7, 0.9, 1.0], [0.7, 0.9, 1.0], [0.1, 0.4, 1.0]]
TIMES = [10.0, 10.5, 11.2, 12.0, 12.3, 13.0]
LOOSE = {"velocity": 4.0, "acceleration": 20.0, "jerk": 400.0}
ASYMMETRIC = {
    "velocity": {"lower": [-0.7, -0.5, -1], "upper": [0.9, 0.8, None]},
    "acceleration": {"lower": -2.0, "upper": [3.0, 2.5, 2.0]},
}
STATE = {"velocity": [0.1, -0.2, 0.0]}
LINE = [[0.0, 0.0, 1.0], [0.5, 1.0, 0.5], [2.0, 4.0, -1.0], [2.5, 5.0, -1.5]]

REQUESTS = {
    **{
        name: {k: v for k, v in c.request.items() if k not in ("sampling", "include", "method", "options")}
        for name, c in CASES.items()
    },
    "times": {"waypoints": POINTS, "times": TIMES},
    "two_points": {"waypoints": [[0.0], [1.0]], "times": [0, 2]},
    "times_velocity": {"waypoints": POINTS, "times": TIMES, "limits": {"velocity": 4.0}},
    "times_limits": {"waypoints": POINTS, "times": TIMES, "limits": LOOSE},
    "times_position": {"waypoints": POINTS, "times": TIMES, "limits": {"position": {"lower": -3, "upper": 3}}},
    "times_segment_limits": {
        "waypoints": POINTS,
        "times": TIMES,
        "limits": LOOSE,
        "segment_limits": [{"velocity": 3.5}, None, {"acceleration": 19.0}, None, None],
    },
    "times_segment_velocity": {
        "waypoints": POINTS,
        "times": TIMES,
        "segment_limits": [{"velocity": 3.5}, None, {"acceleration": 19.0}, None, None],
    },
    "times_duration": {"waypoints": POINTS, "times": TIMES, "duration": {"min": 2, "max": 4}},
    "times_segment_durations": {
        "waypoints": POINTS,
        "times": TIMES,
        "segment_durations": [None, {"min": 0.5}, None, {"min": 0.3, "max": 0.3}, None],
    },
    "duration_only": {"waypoints": POINTS, "duration": {"min": 4, "max": 4}},
    "start_velocity": {"waypoints": POINTS, "times": TIMES, "start": STATE},
    "start_acceleration": {"waypoints": POINTS, "times": TIMES, "start": {"acceleration": [1.0, 0.5, 0.0]}},
    "start_both": {"waypoints": POINTS, "times": TIMES, "start": {**STATE, "acceleration": [1.0, 0.5, 0.0]}},
    "end_velocity": {"waypoints": POINTS, "times": TIMES, "end": STATE},
    "end_acceleration": {"waypoints": POINTS, "times": TIMES, "end": {"acceleration": [1.0, 0.5, 0.0]}},
    "jerk_at_ends": {
        "waypoints": POINTS,
        "times": TIMES,
        "start": {"jerk": [1.0, 0.5, 0.0]},
        "end": {"acceleration": [0.1, 0, 0], "jerk": [1.0, 0.5, 0.0]},
    },
    "even_line": {"waypoints": [[0, 0], [1, 2], [2, 4]], "duration": {"min": 2, "max": 3}},
    "acceleration": {"waypoints": POINTS, "limits": {"acceleration": 3.0}},
    "velocity_acceleration": {"waypoints": POINTS, "limits": {"velocity": 1.0, "acceleration": 3.0}},
    "asymmetric": {"waypoints": POINTS, "limits": ASYMMETRIC},
    "jerk": {"waypoints": POINTS, "limits": {"velocity": 1.0, "acceleration": 3.0, "jerk": 30.0}},
    "position": {
        "waypoints": POINTS,
        "limits": {"acceleration": 3.0, "position": {"lower": [-1, -1, None], "upper": 2.0}},
    },
    "segment_limits": {
        "waypoints": POINTS,
        "limits": {"velocity": 1.0, "acceleration": 3.0},
        "segment_limits": [None, {"velocity": 0.4}, {"acceleration": [1, 1, 1]}, None, None],
    },
    "segment_velocity": {
        "waypoints": POINTS,
        "limits": {"velocity": 1.0},
        "segment_limits": [None, {"velocity": 0.4}, None, None, None],
    },
    "segment_durations": {
        "waypoints": POINTS,
        "limits": {"velocity": 1.0, "acceleration": 3.0},
        "segment_durations": [{"min": 3}, None, None, {"min": 1, "max": 1.5}, None],
    },
    "duration": {
        "waypoints": POINTS,
        "limits": {"velocity": 1.0, "acceleration": 3.0},
        "duration": {"min": 30, "max": 30},
    },
    "moving_ends": {
        "waypoints": POINTS,
        "limits": {"velocity": 1.0, "acceleration": 3.0, "jerk": 30.0},
        "start": {**STATE, "acceleration": [0.5, 0, 0]},
        "end": STATE,
    },
    "moving_along_a_line": {
        "waypoints": LINE,
        "limits": {"velocity": 1.0, "acceleration": 3.0, "jerk": 30.0},
        "start": {"velocity": [0.1, 0.2, -0.1], "acceleration": [0.05, 0.1, -0.05]},
        "end": {"velocity": [0.2, 0.4, -0.2], "acceleration": [-0.1, -0.2, 0.1]},
    },
    "moving_along_a_line_without_jerk": {
        "waypoints": LINE,
        "limits": {"velocity": 1.0, "acceleration": 3.0},
        "start": {"velocity": [0.1, 0.2, -0.1]},
        "end": {"velocity": [0.2, 0.4, -0.2]},
    },
    "jerk_and_all": {
        "waypoints": LINE,
        "limits": {
            "position": {"lower": [-1, -0.5, None], "upper": [3, 5, 1.5]},
            "velocity": {"lower": [-1.0, -2.0, -1.5], "upper": [1.2, 2.0, 1.5]},
            "acceleration": 3.0,
            "jerk": {"lower": -25.0, "upper": [30.0, 30.0, 20.0]},
        },
        "segment_limits": [None, {"velocity": 0.9, "jerk": 15.0}, {"acceleration": [1.5, None, 2.0]}],
        "segment_durations": [{"min": 1.5}, None, {"min": 0.5, "max": 4}],
        "duration": {"min": 9, "max": 9.5},
        "start": {"velocity": [0.1, 0.2, -0.1]},
    },
    "jerk_duration": {
        "waypoints": POINTS,
        "limits": {"velocity": 1.0, "acceleration": 3.0, "jerk": 30.0},
        "duration": {"min": 12, "max": 12},
    },
    "jerk_position": {
        "waypoints": POINTS,
        "limits": {
            "position": {"lower": [-1, -1, None], "upper": 2.0},
            "velocity": 1.0,
            "acceleration": 3.0,
            "jerk": 30.0,
        },
    },
    "jerk_states": {
        "waypoints": POINTS,
        "limits": {"velocity": 1.0, "acceleration": 3.0, "jerk": 30.0},
        "segment_durations": [None, None, None, {"min": 0.4, "max": 0.4}, None],
        "waypoint_states": [None, {"velocity": [0.2, None, 0.0]}, {"velocity": [0, 0, 0]}, None, None, None],
    },
    "still": {"waypoints": [[1, 2, 3]] * 3, "limits": {"velocity": 1.0, "acceleration": 3.0}},
    "still_times": {"waypoints": [[1, 2, 3]] * 3, "times": [0, 1, 2]},
    "mixed_scales": {"waypoints": [[0, 0, 0], [1e6, 1e-9, 1e-16]], "limits": {"velocity": 1e3, "acceleration": 1e4}},
    "tiny_move": {"waypoints": [[0.5], [0.5 + 8e-16]], "limits": {"velocity": 1e-3, "acceleration": 1e6}},
    "tolerance": {"waypoints": POINTS, "times": TIMES, "waypoint_tolerance": 0.1},
    "tube": {"waypoints": POINTS, "times": TIMES, "tube": 0.1},
    "states": {
        "waypoints": POINTS,
        "times": TIMES,
        "waypoint_states": [None, {"velocity": [0, None, 1]}, None, None, None, None],
    },
    "norm": {"waypoints": POINTS, "limits": {"acceleration": 3.0, "velocity_norm": 1.0}},
    "norm_and_all": {
        "waypoints": POINTS,
        "limits": {
            "position": {"lower": -3, "upper": 3},
            "velocity": {"lower": -0.8, "upper": 0.9},
            "acceleration": 3.0,
            "jerk": 30.0,
            "velocity_norm": 1.0,
        },
        "segment_limits": [{"velocity_norm": 0.5}, None, {"acceleration": 1.0}, None, {"jerk": 10.0, "velocity": 0.4}],
        "duration": {"min": 12, "max": 12},
    },
    "torque": {"waypoints": POINTS, "limits": {"acceleration": 3.0, "torque": 1.0}},
    "jerk_at_both_ends": {
        "waypoints": POINTS,
        "times": TIMES,
        "start": {**STATE, "acceleration": [0.2, 0, 0], "jerk": [1.0, 0.5, 0.0]},
        "end": {**STATE, "jerk": [-1.0, 0.5, 0.0]},
    },
    "closed": {"waypoints": [*POINTS[:-1], POINTS[0]], "times": TIMES, "limits": {"velocity": 4.5}},
    "free_states": {
        "waypoints": POINTS,
        "times": TIMES,
        "waypoint_states": [None, {"velocity": [0, None, 0.1]}, {"velocity": [None, 0.5, None]}, None, None, None],
        "waypoint_tolerance": [0.05, 0.0, 0.1],
    },
    "times_norm": {"waypoints": POINTS, "times": TIMES, "limits": {"velocity_norm": 6.0}},
    "times_corridors": {
        "waypoints": POINTS,
        "times": TIMES,
        "limits": {"velocity_norm": 6.0, "acceleration": 60.0},
        "tube": 0.3,
        "waypoint_tolerance": 0.05,
    },
    "robot": {"waypoints": POINTS, "times": TIMES, "robot": {"model": "ur5e"}},
}
#: They need nothing but limits on velocity and acceleration.
TIMING_BY_LIMITS = ("trapezoidal", "ruckig", "time_scaled", "toppra", "time_optimal_path", "time_optimal_nlp")

ROWS = [(m.id, i, dict(v)) for m in METHODS.values() for i, v in enumerate(({}, *m.variants))]


def request_of(name):
    body = dict(REQUESTS[name])
    return PlanRequest.of(body.pop("waypoints"), **body)


def must_accept(request, can):
    """Whether the catalogue's words promise an answer."""
    words = asked_words(request)
    timed = {"times"} if request.duration is not None and request.duration.exact else set()
    sides = all(
        {f"boundary_{n}" for n in getattr(request, s).given()} <= {f"boundary_{n}" for n in getattr(can, s)}
        for s in ("start", "end")
    )
    if request.limits.jerk is None and can.with_jerk & set(request.start.given() + request.end.given()):
        return False
    return words <= set(can.words) and can.requires <= words | timed and sides


def excused(method, options, request):
    """What no honest answer exists for: a periodic spline through open points, uniform scaling with nothing to keep,
    fewer points than a degree needs, Bézier segments that the points do not make or that are not joined as asked, a
    fixed path, or a straight line, entered or left in another direction than its own."""
    if (METHODS[method].path == "fixed" or options.get("straight")) and (request.start.given() or request.end.given()):
        if np.linalg.matrix_rank(np.diff(request.waypoints, axis=0)) > 1:
            return True
    if options.get("boundary") == "periodic":
        return (request.waypoints[0] != request.waypoints[-1]).any() or request.count < 3
    if options.get("ends") == "periodic" and (request.waypoints[0] != request.waypoints[-1]).any():
        return True
    if too_few(method, options, request):
        return True
    if method == "bezier" and "joints" in options and request.count > 2:
        return len({*map(tuple, np.diff(request.waypoints, axis=0))}) > 1
    if method == "time_scaled" and request.times is None and request.duration is None:
        return not {"velocity", "acceleration", "jerk"} & asked_words(request)
    return False


def too_few(method, options, request):
    """B-splines need more control points than their degree, counting a repeated waypoint once where it is merged."""
    kind = {**options, **options.get("path", {"kind": None})}
    chosen = METHODS[method].options.model_validate(options)
    if kind.get("kind", method) not in ("bspline", "nurbs") and method not in ("bspline", "nurbs"):
        return False
    merged = request.times is None and not chosen.control_points
    count = 1 + int(np.diff(request.waypoints, axis=0).any(axis=1).sum()) if merged else request.count
    return count <= kind.get("degree", 3) and (bool(options) or np.ptp(request.waypoints, axis=0).any())


@pytest.mark.parametrize("name", REQUESTS)
@pytest.mark.parametrize(("method", "index", "options"), ROWS, ids=[f"{m}-{i}" for m, i, _ in ROWS])
def test_battery(method, index, options, name):
    request = request_of(name)
    row = METHODS[method]
    can = row.capabilities(row.options.model_validate(options))
    if not must_accept(request, can):
        with pytest.raises((Unsupported, InvalidRequest)) as caught:
            plan(request, method, options)
        if isinstance(caught.value, Unsupported):
            assert caught.value.what
            for other in caught.value.alternatives:
                assert METHODS[other].honours(set(caught.value.what.split(", ")))
        else:
            assert caught.value.errors[0].code in ("missing", "bad_limits")
        return
    if excused(method, options, request):
        with pytest.raises(PlannerError):
            plan(request, method, options)
        return
    first, second = plan(request, method, options), plan(request, method, options)
    certificate = first.certificate
    assert certificate.holds
    for check in certificate.checks:
        assert check.holds, check
        if check.quantity in QUANTITIES[1:]:
            assert check.ratio <= 1 + 1e-9, check
    limited = {q for q in QUANTITIES if getattr(request.limits, q) is not None}
    assert limited <= {c.quantity for c in certificate.checks}
    assert certificate.continuity is None or certificate.continuity >= can.continuity
    if row.options.model_validate(options).control_points:
        assert certificate.waypoint_error is None and first.waypoint_times is None
    else:
        allowed = 0.0 if request.waypoint_tolerance is None else request.waypoint_tolerance.max()
        assert certificate.waypoint_error <= 1e-9 + allowed
        assert first.waypoint_times.shape == (request.count,)
    assert certificate.boundary_error is None or certificate.boundary_error <= 1e-9
    followed = row.path == "fixed" or request.tube is not None or method == "time_optimal_waypoints"
    assert followed == (certificate.path_deviation is not None) or name.startswith("still")
    if row.objective is None:
        assert certificate.objective is None
    elif certificate.objective.lower_bound is not None:
        assert certificate.objective.gap >= -1e-9
    if can.timing == "given" and request.times is not None:
        np.testing.assert_array_equal(first.waypoint_times, request.times)
    assert first.trajectory.coefficients.tobytes() == second.trajectory.coefficients.tobytes()
    assert first.trajectory.breaks.tobytes() == second.trajectory.breaks.tobytes()


@pytest.mark.parametrize("method", METHODS)
def test_every_honoured_word_is_exercised(method):
    """Each capability of a method (in one of its variants) is sent by a case that the method must accept."""
    row = METHODS[method]
    for options in ({}, *row.variants):
        can = row.capabilities(row.options.model_validate(options))
        covered = set()
        for name in REQUESTS:
            request = request_of(name)
            if must_accept(request, can) and not excused(method, dict(options), request):
                covered |= asked_words(request)
        if "periodic" not in (options.get("boundary"), options.get("ends")):
            assert set(can.words) <= covered, set(can.words) - covered


def test_compare_keeps_order_and_turns_refusals_into_rows():
    rows = compare(request_of("velocity_acceleration"))
    assert [r.method for r in rows] == list(METHODS)
    assert {r.method for r in rows if r.plan} == {*TIMING_BY_LIMITS}
    rows = compare(request_of("moving_along_a_line"))
    with_moving_ends = {"ruckig", "time_optimal_path", "time_optimal_waypoints"}
    assert {r.method for r in rows if r.plan} == with_moving_ends
    assert all((r.plan is None) != (r.error is None) for r in rows)


def test_certificate_refuses_a_broken_method(monkeypatch):
    """A method that ignores its limits is caught by verification, not by itself."""
    import dataclasses

    from planner import planning

    cubic = METHODS["cubic_spline"]

    def reckless(request, options):
        return cubic.solve(request, cubic.options())

    row = dataclasses.replace(METHODS["minimum_jerk"], solve=reckless)
    monkeypatch.setitem(planning.METHODS, "minimum_jerk", row)
    request = PlanRequest.of([0, 2, 3], times=[0, 1, 2], limits={"velocity": 2.6})
    with pytest.raises(NotVerified) as caught:
        plan(request, "minimum_jerk")
    report = caught.value.report
    assert not report["holds"]
    assert [c["quantity"] for c in report["checks"] if not c["holds"]] == ["velocity"]
    assert report["checks"][0]["value"] == pytest.approx(75 / 28, rel=1e-12)
