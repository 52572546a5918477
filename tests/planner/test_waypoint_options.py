"""time_optimal_waypoints: durations asked, states at waypoints, smoothness, straight lines."""

import numpy as np
import pytest

from planner import Infeasible, InvalidRequest, PlanRequest, Unsupported, plan
from planner.limits import QUANTITIES
from planner.options import Options

METHOD = "time_optimal_waypoints"
LIMITS = {"velocity": 1.0, "acceleration": 2.0, "jerk": 10.0}
POINTS = np.random.default_rng(42).uniform(-1, 1, (5, 3))
MOVING = {
    "start": {"velocity": [0.3, -0.2, 0.0], "acceleration": [0.5, 0.0, -0.4]},
    "end": {"velocity": [-0.1, 0.4, 0.2]},
}
STRAIGHT = {"straight": True}


def request(points=POINTS, **given):
    return PlanRequest.of(points, **({"limits": LIMITS} | given))


def made(asked, **options):
    done = plan(asked, METHOD, options)
    found = done.certificate
    assert found.holds and found.waypoint_error <= 1e-9 and found.boundary_error <= 1e-9
    assert found.continuity in (None, 2, 3)
    for check in found.checks:
        if check.quantity in QUANTITIES[1:]:
            assert check.ratio <= 1 + 1e-12, check
    assert 0 <= found.objective.lower_bound <= found.objective.value * (1 + 1e-12)
    assert done.stats.name in ("interior_point", "stop_plan")
    return done


def seconds(asked, **options):
    return made(asked, **options).trajectory.duration


def jerk_of(done, limits=LIMITS):
    """Return the squared jerk, each joint's relative to its limit: what a longer motion makes least."""
    t = done.trajectory
    h = np.diff(t.breaks)
    jerk = t(t.breaks[:-1] + 0.5 * h, 3) / np.array(limits["jerk"])  # constant on each piece
    return float((h[:, None] * jerk**2).sum())


# -- options -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "options",
    [{"effort": "high"}, {"smoothness": -0.1}, {"smoothness": 11}, {"straight": 1}, {"pieces": 3}, {"effort": None}],
)
def test_bad_options(options):
    with pytest.raises(InvalidRequest) as caught:
        plan(request(), METHOD, options)
    assert all(e.field.startswith("/options/") for e in caught.value.errors)
    assert issubclass(type(plan(request(POINTS[:2]), METHOD).options), Options)


# -- the whole duration ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("factor", [1.0001, 1.01, 1.1, 2.0, 10.0, 100.0])
def test_longer_motions_exactly(factor, moving):
    """From moving ends too, which no slower clock could serve."""
    ends = MOVING if moving else {}
    shortest = seconds(request(**ends))
    for asked in ({"min": factor * shortest}, {"min": factor * shortest, "max": factor * shortest}):
        done = made(request(duration=asked, **ends))
        assert done.trajectory.duration == pytest.approx(factor * shortest, rel=1e-9)
        assert {c.quantity for c in done.certificate.checks} >= {"duration"}
        assert done.certificate.objective.lower_bound == pytest.approx(factor * shortest, rel=1e-9)


def test_bounds_that_do_not_bind_change_nothing():
    free = made(request())
    shortest = free.trajectory.duration
    for asked in ({"min": 0.5 * shortest}, {"max": 1.5 * shortest}, {"min": 0.1, "max": 100}, {"max": shortest}):
        same = made(request(duration=asked))
        assert same.trajectory.coefficients.tobytes() == free.trajectory.coefficients.tobytes()


def test_too_short_is_refused_with_what_would_do():
    shortest = seconds(request())
    for part, certified in ((0.5, True), (0.99, False)):  # certified below what every motion needs
        with pytest.raises(Infeasible) as caught:
            plan(request(duration={"max": part * shortest}), METHOD)
        found = caught.value
        assert (found.quantity, found.bound) == ("duration", pytest.approx(part * shortest))
        assert found.minimum_duration == pytest.approx(shortest, rel=1e-9) and found.certified is certified
    assert seconds(request(duration={"max": found.minimum_duration})) <= found.minimum_duration * (1 + 1e-9)


@pytest.mark.parametrize("ends", [{}, MOVING], ids=["rest", "moving"])
def test_longer_is_gentler(ends):
    """The squared jerk falls with the duration: from rest to rest at least like an even slowing, 1 / T^5."""
    shortest, last, before = seconds(request(**ends)), 1.0, np.inf
    for factor in (1.05, 1.2, 1.5, 2.0, 3.0):
        found = jerk_of(made(request(duration={"min": factor * shortest}, **ends)))
        assert found < before * (1.0 if ends else 1.01 * (last / factor) ** 5)
        last, before = factor, found


def test_two_points_with_time_to_spare():
    """Without a limit in the way the least squared jerk is the quintic's, 720 d² / T⁵.

    Twelve pieces of constant jerk cannot do with less than 1 + 5 / 144 of it.
    """
    done = made(request([[0.0], [1.0]], duration={"min": 20.0, "max": 20.0}))
    assert done.certificate.cost["squared_jerk"] == pytest.approx(720 / 20.0**5, rel=0.04)
    assert done.trajectory(10.0, 0)[0] == pytest.approx(0.5, abs=1e-3)


# -- the segments' durations -------------------------------------------------------------------------------------------


def test_exact_durations_of_segments():
    free = np.diff(made(request()).waypoint_times)
    for i in range(4):
        for factor in (1.3, 4.0):
            asked = [None] * 4
            asked[i] = {"min": factor * free[i], "max": factor * free[i]}
            done = made(request(segment_durations=asked))
            assert np.diff(done.waypoint_times)[i] == pytest.approx(factor * free[i], rel=1e-9)
            assert done.trajectory.duration <= free.sum() * 1.001 + factor * free[i]
    each = [{"min": 1.5 * h, "max": 1.5 * h} for h in free]
    done = made(request(segment_durations=each))
    assert np.diff(done.waypoint_times) == pytest.approx(1.5 * free, rel=1e-9)


def test_least_and_largest_durations_of_segments():
    free = np.diff(made(request()).waypoint_times)
    done = made(request(segment_durations=[{"min": 2.5}, None, {"min": 0.01}, None]))
    assert np.diff(done.waypoint_times)[0] >= 2.5 * (1 - 1e-9)
    assert done.trajectory.duration <= seconds(request()) + 2.5
    for i in range(4):
        asked = [None] * 4
        asked[i] = {"max": 0.98 * free[i]}
        done = made(request(segment_durations=asked))
        assert np.diff(done.waypoint_times)[i] <= 0.98 * free[i] * (1 + 1e-9)
        assert done.trajectory.duration >= free.sum() * (1 - 1e-3)


def test_durations_of_segments_that_are_too_short():
    with pytest.raises(Infeasible) as caught:
        plan(request(segment_durations=[None, {"max": 1e-2}, None, None]), METHOD)
    assert caught.value.quantity in ("segment_duration", "velocity")
    slow = [{"max": 10.0}] * 4
    with pytest.raises(Infeasible) as caught:
        plan(request(segment_durations=slow, duration={"min": 41.0}), METHOD)
    assert caught.value.quantity == "duration" and caught.value.needed == pytest.approx(40.0)


def test_both_kinds_of_durations():
    asked = [{"min": 1.0, "max": 3.0}, None, {"min": 2.5, "max": 2.5}, {"max": 6.0}]
    done = made(request(segment_durations=asked, duration={"min": 12.0, "max": 12.0}))
    steps = np.diff(done.waypoint_times)
    assert steps.sum() == pytest.approx(12.0, rel=1e-9) and steps[2] == pytest.approx(2.5, rel=1e-9)
    assert steps[0] <= 3.0 * (1 + 1e-9) and steps[3] <= 6.0 * (1 + 1e-9)


# -- states at waypoints -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("effort", ["fast", "default", "best"])
def test_a_stop_at_a_waypoint(effort):
    rest = {"velocity": [0, 0, 0], "acceleration": [0, 0, 0]}
    done = made(request(waypoint_states=[None, None, rest, None, None]), effort=effort)
    at = done.waypoint_times[2]
    assert np.abs([done.trajectory(at, 1), done.trajectory(at, 2)]).max() <= 1e-9
    halves = seconds(request(POINTS[:3]), effort=effort) + seconds(request(POINTS[2:]), effort=effort)
    assert done.trajectory.duration == pytest.approx(halves, rel=2e-3)


def test_the_velocity_of_one_joint():
    asked = [None, {"velocity": [None, 0.25, None]}, None, {"velocity": [0.1, None, None]}, None]
    done = made(request(waypoint_states=asked))
    assert done.trajectory(done.waypoint_times[1], 1)[1] == pytest.approx(0.25, abs=1e-9)
    assert done.trajectory(done.waypoint_times[3], 1)[0] == pytest.approx(0.1, abs=1e-9)
    assert done.trajectory.duration >= seconds(request()) * (1 - 1e-3)
    free = made(request())
    at = free.waypoint_times
    own = [None, *({"velocity": free.trajectory(at[i], 1).tolist()} for i in (1, 2, 3)), None]
    assert seconds(request(waypoint_states=own)) == pytest.approx(free.trajectory.duration, rel=1e-3)


def test_an_acceleration_at_a_waypoint_and_states_at_the_ends():
    asked = [{"velocity": [0.2, None, None]}, None, {"acceleration": [0.5, None, -0.5]}, None, None]
    done = made(request(waypoint_states=asked, duration={"min": 10.0}))
    assert done.trajectory(done.waypoint_times[2], 2)[[0, 2]] == pytest.approx([0.5, -0.5], abs=1e-9)
    assert done.trajectory(0.0, 1) == pytest.approx([0.2, 0, 0], abs=1e-9)
    assert done.trajectory.duration == pytest.approx(10.0, rel=1e-9)


def test_states_at_waypoints_that_cannot_be():
    beyond = [None, {"velocity": [1.5, None, None]}, None, None, None]
    with pytest.raises(Infeasible) as caught:
        plan(request(waypoint_states=beyond), METHOD)
    assert caught.value.certified and caught.value.needed == pytest.approx(1.5)
    leads = [None, {"velocity": [0.95, None, None], "acceleration": [1.9, None, None]}, None, None, None]
    with pytest.raises(Infeasible) as caught:
        plan(request(waypoint_states=leads), METHOD)
    assert caught.value.certified and caught.value.needed == pytest.approx(0.95 + 1.9**2 / 20)


# -- smoothness --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ends", [{}, MOVING], ids=["rest", "moving"])
def test_smoothness_lengthens_exactly_and_lowers_the_jerk(ends):
    shortest, before = made(request(**ends)), None
    for share in (0.001, 0.01, 0.05, 0.2, 1.0, 10.0):
        done = made(request(**ends), smoothness=share)
        assert done.trajectory.duration == pytest.approx((1 + share) * shortest.trajectory.duration, rel=1e-9)
        found = jerk_of(done)
        assert found < (jerk_of(shortest) if before is None else before)
        before = found
        asked = made(request(duration={"min": done.trajectory.duration}, **ends))
        assert asked.certificate.cost["squared_jerk"] == pytest.approx(done.certificate.cost["squared_jerk"], rel=1e-4)


def test_smoothness_and_a_largest_duration():
    shortest = seconds(request())
    done = made(request(duration={"max": 1.1 * shortest}), smoothness=0.5)
    assert done.trajectory.duration == pytest.approx(1.1 * shortest, rel=1e-9)
    done = made(request(duration={"min": 2 * shortest}), smoothness=0.5)
    assert done.trajectory.duration == pytest.approx(2 * shortest, rel=1e-9)
    assert seconds(request(), smoothness=0.0) == shortest


def test_smoothness_keeps_position_limits():
    box = {"lower": POINTS.min() - 0.02, "upper": POINTS.max() + 0.02}
    for share in (0.05, 0.5):
        made(request(limits={**LIMITS, "position": box}), smoothness=share)


def test_the_unit_of_a_joint_does_not_change_its_share():
    unit = np.array([1e-3, 1.0, 50.0])
    limits = {q: x * unit for q, x in LIMITS.items()}
    plain = made(request(), smoothness=0.2)
    other = made(request(POINTS * unit, limits=limits), smoothness=0.2)
    assert other.trajectory.duration == pytest.approx(plain.trajectory.duration, rel=1e-4)
    assert jerk_of(other, limits) == pytest.approx(jerk_of(plain), rel=1e-2)


# -- straight lines ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(6))
def test_two_points(seed):
    rng = np.random.default_rng(seed)
    dims = int(rng.integers(1, 8))
    limits = {
        "velocity": rng.uniform(0.3, 2, dims),
        "acceleration": rng.uniform(0.5, 5, dims),
        "jerk": rng.uniform(3, 40, dims),
    }
    points = rng.uniform(-1, 1, (2, dims))
    done = made(request(points, limits=limits), **STRAIGHT)
    assert done.certificate.path_deviation < 1e-12
    assert done.trajectory.duration >= seconds(request(points, limits=limits)) * (1 - 1e-3)
    way = np.abs(points[1] - points[0])  # along the line: each limit over its joint's share
    line = {q: float((x / way).min()) for q, x in limits.items()}
    alone = plan(request([[0.0], [1.0]], limits=line), "ruckig").trajectory.duration
    assert done.trajectory.duration == pytest.approx(alone, rel=1e-6)
    assert done.certificate.objective.bound_scope == "method" and done.certificate.objective.gap <= 1e-6


@pytest.mark.parametrize("effort", ["fast", "default", "best"])
def test_a_polyline(effort):
    """Stops at the corners: the sum of its lines. What lies on a line is passed."""
    done = made(request(), effort=effort, **STRAIGHT)
    assert done.certificate.path_deviation < 1e-12
    assert np.abs(done.trajectory(done.waypoint_times, 1)).max() <= 1e-9
    each = [seconds(request(POINTS[i : i + 2]), effort=effort, **STRAIGHT) for i in range(4)]
    assert np.diff(done.waypoint_times) == pytest.approx(each, rel=1e-9)
    middle = np.insert(POINTS, 2, 0.3 * POINTS[1] + 0.7 * POINTS[2], axis=0)
    more = made(request(middle), effort=effort, **STRAIGHT)
    assert more.certificate.path_deviation < 1e-12
    assert more.trajectory.duration == pytest.approx(done.trajectory.duration, rel=2e-3)
    assert done.trajectory.duration > seconds(request(), effort=effort)


def test_back_along_the_same_line():
    points = np.array([[0.0, 0.0], [1.0, 2.0], [0.25, 0.5], [2.0, 4.0]])
    done = made(request(points), **STRAIGHT)
    assert done.certificate.path_deviation < 1e-12
    assert done.trajectory.duration <= plan(request(points), "ruckig").trajectory.duration * (1 + 1e-9)


def test_along_a_line_with_moving_ends():
    way = np.array([1.0, 2.0, -1.0])
    points = np.array([0.0, 0.4, 1.0, 1.5])[:, None] * way
    ends = {"start": {"velocity": 0.2 * way, "acceleration": 0.1 * way}, "end": {"velocity": 0.3 * way}}
    done = made(request(points, **ends), **STRAIGHT)
    assert done.certificate.path_deviation < 1e-12
    assert done.trajectory(0.0, 1) == pytest.approx(0.2 * way, abs=1e-12)
    assert done.trajectory(done.trajectory.end, 1) == pytest.approx(0.3 * way, abs=1e-9)
    free = seconds(request(points, **ends))
    assert done.trajectory.duration == pytest.approx(free, rel=5e-3)
    longer = made(request(points, duration={"min": 1.5 * free}, **ends), **STRAIGHT)
    assert longer.trajectory.duration == pytest.approx(1.5 * free, rel=1e-9)
    assert longer.certificate.path_deviation < 1e-12


@pytest.mark.parametrize(
    ("side", "name"), [("start", "velocity"), ("end", "velocity"), ("start", "acceleration"), ("end", "acceleration")]
)
def test_states_off_the_line_are_refused(side, name):
    with pytest.raises(InvalidRequest) as caught:
        plan(request(**{side: {name: [0.1, 0.2, -0.1]}}), METHOD, STRAIGHT)
    assert [(e.field, e.code) for e in caught.value.errors] == [(f"/{side}/{name}", "bad_boundary")]


def test_straight_takes_no_states_at_waypoints():
    states = [None, {"velocity": [0, 0, 0]}, None, None, None]
    with pytest.raises(Unsupported) as caught:
        plan(request(waypoint_states=states), METHOD, STRAIGHT)
    assert caught.value.what == "waypoint_states"


def test_straight_with_position_and_segment_limits():
    box = {"lower": POINTS.min(axis=0), "upper": POINTS.max(axis=0)}
    own = [{"velocity": 0.3}, None, {"acceleration": 0.5}, {"jerk": 2.0}]
    done = made(request(limits={**LIMITS, "position": box}, segment_limits=own), **STRAIGHT)
    assert done.certificate.path_deviation < 1e-12
    steps, each = np.diff(done.waypoint_times), np.diff(made(request(), **STRAIGHT).waypoint_times)
    assert steps[1] == pytest.approx(each[1], rel=1e-6) and (steps[[0, 2, 3]] > each[[0, 2, 3]]).all()


def test_straight_with_durations_and_smoothness():
    plain = made(request(), **STRAIGHT)
    shortest = plain.trajectory.duration
    for factor in (1.001, 1.5, 20.0):
        done = made(request(duration={"min": factor * shortest, "max": factor * shortest}), **STRAIGHT)
        assert done.trajectory.duration == pytest.approx(factor * shortest, rel=1e-9)
        assert done.certificate.path_deviation < 1e-12
        assert jerk_of(done) < jerk_of(plain)
    smooth = made(request(), smoothness=0.3, **STRAIGHT)
    assert smooth.trajectory.duration == pytest.approx(1.3 * shortest, rel=1e-9)
    assert smooth.certificate.path_deviation < 1e-12
    asked = [None, {"min": 5.0, "max": 5.0}, None, {"min": 3.0}]
    done = made(request(segment_durations=asked), **STRAIGHT)
    assert np.diff(done.waypoint_times)[1] == pytest.approx(5.0, rel=1e-9)
    with pytest.raises(Infeasible) as caught:
        plan(request(duration={"max": 0.9 * shortest}), METHOD, STRAIGHT)
    assert caught.value.minimum_duration == pytest.approx(shortest, rel=1e-9)


def test_straight_through_duplicates():
    points = np.repeat(POINTS, [1, 2, 1, 1, 2], axis=0)
    done = made(request(points), **STRAIGHT)
    assert done.trajectory.duration == pytest.approx(seconds(request(), **STRAIGHT), rel=1e-9)
    dwell = [None, {"min": 0.7}, None, None, None, None]
    held = made(request(points, segment_durations=dwell), **STRAIGHT)
    assert held.certificate.path_deviation < 1e-12
    assert held.trajectory.duration == pytest.approx(done.trajectory.duration + 0.7, rel=1e-9)
