"""Failures that were found once, kept."""

import numpy as np
import pytest

from planner import (
    Infeasible,
    InvalidRequest,
    PlannerError,
    PlanRequest,
    Trajectory,
    Unsupported,
    certify,
    compare,
    plan,
)
from planner.types import Demands
from planner.verify import verify


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


L = {"velocity": 1, "acceleration": 1}


@pytest.mark.parametrize("method", ["toppra", "time_optimal_nlp"])
def test_a_dwell_that_the_knots_imply(method):
    path = {"path": {"kind": "linear", "knots": [0, 1, 2, 3]}}
    done = plan(PlanRequest.of([0, 1, 1, 2], limits=L), method, path)
    assert 4 <= done.trajectory.duration <= 4.05
    assert 0 < np.diff(done.waypoint_times)[1] < 1e-4


def test_a_timed_dwell_on_a_scaled_path_does_not_scale_the_rest():
    bounds = [None, {"min": 1}, None]
    done = plan(PlanRequest.of([0, 1, 1, 2], limits=L, segment_durations=bounds), "time_scaled")
    assert done.trajectory.duration < 12 and np.diff(done.waypoint_times)[1] >= 1


def test_jerk_limits_on_some_segments_only():
    done = plan(PlanRequest.of([0, 1, 2], limits=L, segment_limits=[{"jerk": 10}, None]), "ruckig")
    first, second = np.diff(done.waypoint_times)
    assert first > second == pytest.approx(2)
    lopsided = [{"jerk": {"lower": -1, "upper": 10}}, None]
    done = plan(PlanRequest.of([0, 1, 2], limits={**L, "jerk": 10}, segment_limits=lopsided), "ruckig")
    assert [n.code for n in done.notes] == ["jerk_symmetric"] and done.certificate.objective.lower_bound is None


def test_ruckig_between_moving_states_has_gaps_in_its_durations():
    request = PlanRequest.of(
        [-0.15828201440750278, -0.2799354792289275],
        limits={"velocity": 1, "acceleration": 5, "jerk": 10},
        start={"velocity": [-0.2854508509236171]},
        end={"velocity": [-0.4324072487957205]},
        duration={"min": 0.4158060825348307, "max": 0.4158060825348307},
    )
    with pytest.raises(Infeasible):
        plan(request, "ruckig")


def test_a_hold_keeps_what_its_segments_may_take():
    ones = [[1], [1], [1]]
    body = {"limits": L, "duration": {"min": 5}}
    done = plan(PlanRequest.of(ones, segment_durations=[{"min": 1}, {"min": 1, "max": 1}], **body), "trapezoidal")
    np.testing.assert_allclose(np.diff(done.waypoint_times), [4, 1])
    with pytest.raises(Infeasible):
        plan(PlanRequest.of([1, 1], segment_durations=[{"max": 1}], **body), "trapezoidal")


def test_spread_times_keep_segment_durations():
    body = {"duration": {"min": 4, "max": 4}, "segment_durations": [{"max": 0.5}, None]}
    done = plan(PlanRequest.of([0, 1, 5], **body), "linear")
    np.testing.assert_allclose(done.waypoint_times, [0, 0.5, 4])
    with pytest.raises(PlannerError):
        plan(PlanRequest.of([0, 1, 5], **{**body, "segment_durations": [{"max": 0.5}, {"max": 1}]}), "linear")


def test_a_path_that_moves_though_all_waypoints_are_equal():
    polynomial = {"breaks": [0, 1], "coefficients": [[[0]], [[1]], [[-1]]]}
    done = plan(PlanRequest.of([0, 0], limits=L), "toppra", {"path": {"polynomial": polynomial}})
    assert done.certificate.cost["path_length"] == pytest.approx(0.5) and done.trajectory.duration > 1


def test_ramps_shorter_than_the_clock_can_tell():
    done = plan(PlanRequest.of([1.8, 2.0], limits={"velocity": 1e-3, "acceleration": 1e6}), "trapezoidal")
    assert done.trajectory.duration == pytest.approx(200, rel=1e-6) and 0 <= done.certificate.objective.gap < 1e-6


@pytest.mark.parametrize(
    ("breaks", "positions", "slopes"),
    [
        ([0, 1, 1.000000001, 2], [1e6, 1000001, 1000001], [1, 1, 2]),
        ([0, 1e-6, 2e-6, 1e10], [0, 1e-6, 3e-6], [1, 2, 0]),
    ],
)
def test_a_jump_cannot_hide_in_a_tiny_piece(breaks, positions, slopes):
    hostile = Trajectory.from_powers(breaks, np.array([positions, slopes], dtype=float)[:, :, None])
    found = certify(hostile, limits={"acceleration": 0.1})
    assert not found.holds and found.continuity == 0


def test_sent_velocities_are_judged():
    from planner import Recorded

    t = 0.1 * np.arange(50)
    velocity = np.ones((50, 1))
    velocity[25] = 1.5
    found = certify(Recorded.of(t, t[:, None], velocity), limits={"velocity": 1.1})
    assert not found.holds and [c.holds for c in found.checks] == [False, False]
    wild = certify(Recorded.of(t, 0 * t[:, None], 100.0 * (-1) ** np.arange(50)[:, None]), limits={"velocity": 1})
    assert not wild.holds


def test_path_length_of_rounding_noise_ends():
    chebyshev = np.polynomial.Chebyshev.basis(18, domain=[0, 1]).convert(kind=np.polynomial.Polynomial).coef
    found = certify(Trajectory.from_powers([0, 1], chebyshev[:, None, None]))
    assert np.isfinite(found.cost["path_length"])


def test_one_waypoint_alone_can_be_certified():
    line = Trajectory.from_hermite([0, 1], [[0.0], [1.0]])
    assert certify(line, waypoints=[[0.5]]).holds and not certify(line, waypoints=[[1.5]]).holds


def test_hopeless_waypoints_are_looked_for_quickly():
    import time

    rng = np.random.default_rng(0)
    wave = Trajectory.from_hermite(np.arange(4001.0), (np.arange(4001) % 2)[:, None].astype(float))
    started = time.process_time()
    assert not certify(wave, waypoints=[[1.01]] * 30 + rng.normal(size=(10, 1)).tolist()).holds
    assert time.process_time() - started < 10  # a guard against hours, not a measurement


def test_samples_that_fall_on_one_instant():
    from planner import Sampling, sample

    found = sample(Trajectory.from_hermite([1e6, 1e6 + 1e-9], [[0.0], [1.0]]), Sampling.of({"count": 200}))
    assert (np.diff(found.time) > 0).all() and found.time[-1] == 1e6 + 1e-9
    hold = sample(Trajectory.hold([1.0], 0, 0), Sampling.of({"times": [5]}))
    assert hold.time.tolist() == [0, 0]


def test_casadi_is_asked_by_one_thread_at_a_time():
    from concurrent.futures import ThreadPoolExecutor

    request = PlanRequest.of([[0, 0], [1, 2], [2, -1]], limits={"velocity": 3, "acceleration": 8, "jerk": 100})
    with ThreadPoolExecutor(4) as pool:
        made = list(pool.map(lambda _: plan(request, "time_optimal_nlp", {"stations": 30}), range(8)))
    assert len({m.trajectory.coefficients.tobytes() for m in made}) == 1


@pytest.mark.parametrize("count", [10, 30, 100, 1000])
@pytest.mark.parametrize("method", ["ruckig", "toppra", "trapezoidal", "minimum_jerk", "cubic_spline"])
def test_honest_samples_agree_with_themselves(method, count):
    from planner import Recorded

    rng = np.random.default_rng(count)
    for _ in range(4):
        points = rng.normal(size=(4, 2)) + rng.choice([0, 100.0])
        given = {"limits": {"velocity": 2, "acceleration": 5}}
        if method in ("minimum_jerk", "cubic_spline"):
            given = {"times": np.cumsum(rng.uniform(0.5, 1, 4))}
        t = plan(PlanRequest.of(points, **given), method).trajectory
        at = np.linspace(t.start, t.end, count)
        position, velocity, acceleration = t.states(np.clip(at, t.start, t.end), 3)
        noisy = position + 1e-9 * rng.normal(size=position.shape)
        honest = [Recorded.of(at, position, velocity), Recorded.of(at, noisy, velocity)]
        if count >= 100:  # fewer do not resolve the accelerations
            honest.append(Recorded.of(at, position, velocity, acceleration))
            honest.append(Recorded.of(at, position, None, acceleration))
        for recorded in honest:
            found = certify(recorded)
            assert found.holds, [c for c in found.checks if not c.holds]
        if count == 1000:
            assert not certify(Recorded.of(at, position, 0.9 * velocity)).holds


@pytest.mark.parametrize("velocity", [[50, 50, 50], [1, 1, 50], [50, 1, 1]])
def test_sent_velocities_are_judged_at_the_ends_too(velocity):
    from planner import Recorded

    t = np.arange(3.0)
    assert not certify(Recorded.of(t, t[:, None], np.array(velocity, dtype=float)[:, None])).holds


def test_a_jump_cannot_hide_behind_a_clock_of_years():
    chebyshev = np.polynomial.Chebyshev.basis(8, domain=[0, 1]).convert(kind=np.polynomial.Polynomial).coef
    coefficients = np.zeros((9, 2, 1))
    coefficients[:, 0, 0] = chebyshev[::-1]
    coefficients[-1, 1, 0] = 1.0
    hidden = Trajectory(1.7e9 + np.array([0, 0.01, 1]), coefficients)
    assert not certify(hidden, limits={"velocity": 1e6, "acceleration": 1e9}).holds


def test_many_waypoints_that_are_too_fast_are_refused_at_once():
    rng = np.random.default_rng(7)
    request = PlanRequest.of(rng.normal(size=(200, 1)), times=np.arange(200.0), limits={"velocity": 0.5})
    with pytest.raises(Infeasible) as caught:
        plan(request, "minimum_jerk")
    assert caught.value.certified and caught.value.quantity == "velocity"


@pytest.mark.parametrize("bounds", [{"min": 1, "max": 1}, {"min": 0.001}, {"min": 1e-6, "max": 1e-2}])
def test_dwells_on_a_scaled_path_with_jerk(bounds):
    request = PlanRequest.of(
        [0, 0.5, 0.5, 1], limits={"velocity": 1, "acceleration": 2, "jerk": 10}, segment_durations=[None, bounds, None]
    )
    done = plan(request, "time_scaled")
    assert done.certificate.holds
    if bounds["min"] == 0.001:
        assert done.trajectory.duration < 6


def test_steps_of_a_microsecond_on_a_clock_of_days():
    request = PlanRequest.of([1, 2], times=[1e6, 1000000.000001], limits={"acceleration": 1e-3})
    try:
        assert plan(request, "time_scaled").certificate.holds
    except Unsupported as refusal:
        assert refusal.what == "precision"


# -- curves ----------------------------------------------------------------------------------------------------------


def test_a_septic_through_very_uneven_times_is_refused_or_keeps_its_class():
    """The coefficients reach 1e9, and the pieces no longer meet: it had been answered as of class -1."""
    times = [0.0, 0.00204, 0.977512, 1.069224, 1.09351, 1.143439, 1.144646, 1.149897]
    points = [[-1.117], [0.666], [0.292], [-0.946], [0.529], [1.519], [-1.282], [0.061]]
    with pytest.raises(Unsupported, match="precision|rounding"):
        plan(PlanRequest.of(points, times=times), "septic_spline")


def test_a_waypoint_missed_from_the_left_is_missed():
    left, right = Trajectory.hold([0.0], 0.0, 1.0), Trajectory.hold([1e-5], 1.0, 2.0)
    found = verify(
        Trajectory.concatenate([left, right]), Demands(dims=1, waypoints=np.array([[1e-5]]), times=np.array([1.0]))
    )
    assert found.waypoint_error == pytest.approx(1e-5) and not found.holds


@pytest.mark.parametrize(
    ("method", "options", "code"),
    [
        ("nurbs", {"weights": [1, -1, 1, 1, 1]}, "bad_weights"),
        ("nurbs", {"degree": 99}, "bad_degree"),
        ("bspline", {"interpolate": False, "knots": [3, 2, 1]}, "bad_knots"),
        ("bezier", {"degree": 3}, "bad_degree"),
        ("time_scaled", {"path": {"kind": "nurbs", "degree": 77}}, "bad_degree"),
    ],
)
def test_options_count_where_nothing_moves(method, options, code):
    with pytest.raises(InvalidRequest) as caught:
        plan(
            PlanRequest.of([[1, 1]] * 5, limits={"velocity": 1.0} if method == "time_scaled" else None), method, options
        )
    assert caught.value.errors[0].code == code


def test_pieces_of_a_polynomial_leave_no_sliver_beside_a_waypoint():
    """A break that nearly met a waypoint left a piece of 3e-15 s, which was refused as beyond double precision."""
    points = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]]
    done = plan(PlanRequest.of(points, limits={"velocity": 1.0}), "time_scaled", {"path": {"kind": "polynomial"}})
    assert done.certificate.holds and np.diff(done.trajectory.breaks).min() > 1e-3


def test_the_limit_that_binds_is_always_named():
    """(least * span) / span may differ from least in the last bit: then nothing was said."""
    rng = np.random.default_rng(0)
    for _ in range(60):
        points, times = rng.normal(size=(4, 1)), np.cumsum(rng.uniform(0.3, 1, 4))
        done = plan(PlanRequest.of(points, times=times, limits={"velocity": 0.1}), "time_scaled")
        assert [n.code for n in done.notes] == ["binding_limit"]


SHAPES = {
    "line": lambda s: np.stack([s, s], axis=1),
    "ramp": lambda s: np.stack([s, np.sin(7 * s), np.cos(3 * s)], axis=1),
    "parabola": lambda s: np.stack([s * s, 1 - s], axis=1),
    "helix": lambda s: np.stack([np.cos(6 * s), np.sin(6 * s), s], axis=1),
}
SPLINES = [
    ("cubic_hermite", {}),
    ("cubic_spline", {}),
    ("quintic_spline", {}),
    ("septic_spline", {}),
    ("minimum_jerk", {}),
    *[("bspline", {"degree": degree}) for degree in (2, 3, 4, 5)],
]


@pytest.mark.parametrize("count", [6, 16, 31, 61])
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("method", "options"), SPLINES)
def test_plain_shapes_keep_the_class_that_is_promised(method, options, shape, count):
    """The higher derivatives of plain shapes are nothing but rounding, of which jumps must not be made."""
    points = SHAPES[shape](np.linspace(0, 1, count))
    for times in (0.5 * np.arange(count), 1e5 + 0.5 * np.arange(count)):
        done = plan(PlanRequest.of(points, times=times), method, options)
        assert "smoothness_lost" not in [n.code for n in done.notes], done.certificate.continuity
