"""What once went wrong with ``time_optimal_waypoints``, each with the numbers that were found."""

import numpy as np
import pytest

from planner import Infeasible, PlanRequest, Unsupported, plan

METHOD = "time_optimal_waypoints"
LIMITS = {"velocity": 3.0, "acceleration": 8.0, "jerk": 100.0}
W = [[0.0, 0.0], [1.0, 2.0], [2.0, 3.0]]


def made(points, limits=LIMITS, options=None, **given):
    return plan(PlanRequest.of(points, limits=limits, **given), METHOD, options)


def duration(*args, **given):
    return made(*args, **given).trajectory.duration


@pytest.mark.parametrize("side", ["start", "end"])
def test_an_end_at_its_velocity_limit(side):
    """Was 2.80745 with stops: the program's own margin left the state no room."""
    assert duration([[0], [2], [3], [5]], **{side: {"velocity": [3.0]}}) == pytest.approx(1.8941667, rel=1e-6)


def test_a_waypoint_passed_at_the_velocity_limit():
    """Was refused as infeasible."""
    states = [None, {"velocity": [3.0]}, None, None]
    assert duration([[0], [2], [3], [5]], waypoint_states=states) == pytest.approx(2.1216667, rel=1e-6)
    states = [None, {"velocity": [3.0, 3.0], "acceleration": [0.0, 0.0]}, None]
    assert duration([[0, 0], [1, 2], [3, 3]], waypoint_states=states) < 1.79


def test_waypoints_on_position_limits():
    """Was 3.5718 with stops: position limits at the least and the largest waypoint left nothing inside."""
    points = np.random.default_rng(3).uniform(-1, 1, (6, 3))
    box = {"position": {"lower": points.min(axis=0), "upper": points.max(axis=0)}}
    assert duration(points, {**LIMITS, **box}) < 2.66
    found = made(points, {**LIMITS, **box}).trajectory.extrema(1)
    assert (found.low[0] >= points.min(axis=0) - 1e-9).all() and (found.high[0] <= points.max(axis=0) + 1e-9).all()


def test_a_hard_braking_start_does_not_raise_the_bound():
    """Was 15.17 s for a motion of 0.18 s: the distance covered has a hump."""
    done = made(
        [[0.0], [0.0999720]],
        {"velocity": 20, "acceleration": 10, "jerk": 1.0001},
        start={"velocity": [1.0], "acceleration": [-5.0]},
        end={"velocity": [0.1162], "acceleration": [-4.82]},
    )
    assert done.trajectory.duration == pytest.approx(0.18, rel=1e-4)
    assert done.certificate.objective.lower_bound <= done.trajectory.duration


def test_limits_beyond_double_precision_are_refused():
    """Was a division by zero."""
    tiny = dict.fromkeys(("velocity", "acceleration", "jerk"), 1e-300)
    with pytest.raises(Unsupported) as caught:
        made([[0, 0], [1, 2], [0, 0], [1, 2]], tiny)
    assert caught.value.what == "precision"


@pytest.mark.parametrize("jerk", [1e5, 1e7, 1e9])
def test_jerk_limits_beyond_all_use(jerk):
    """Was 9.307: ruckig's own answer broke the acceleration limit by rounding, and what was left was slower."""
    points = [[0, 0], [1, 2], [0, 0], [1, 2]]
    assert duration(points, {"velocity": 1, "acceleration": 1, "jerk": jerk}) <= 9.0 * (1 + 1e-5)


def test_smoothness_goes_no_further_than_the_bounds():
    """Both were refused, the second as certified."""
    limits = {"velocity": 3, "acceleration": [8, 10], "jerk": 100}
    shortest = duration(W, limits, {"straight": True})
    done = made(W, limits, {"straight": True, "smoothness": 0.5}, duration={"max": 1.1 * shortest})
    assert done.trajectory.duration == pytest.approx(1.1 * shortest, rel=1e-9)
    exact = [{"min": 1, "max": 1}] * 2
    assert duration(W, limits, {"smoothness": 0.1}, segment_durations=exact) == pytest.approx(2.0, rel=1e-9)


def test_straight_lines_that_may_be_longer_take_what_others_may_not():
    """Was refused as certified."""
    given = {"duration": {"min": 3, "max": 3}, "segment_durations": [{"max": 1.2}, None]}
    done = made(W, {"velocity": 3, "acceleration": [8, 10], "jerk": 100}, {"straight": True}, **given)
    assert done.trajectory.duration == pytest.approx(3.0, rel=1e-9)
    assert done.certificate.path_deviation < 1e-12


def test_straight_motion_rests_where_a_segment_has_no_length():
    """Left the lines by 0.67 while it waited."""
    given = {"segment_durations": [None, {"min": 2}, None]}
    done = made([[0, 0], [1, 2], [1, 2], [3, 3]], LIMITS, {"straight": True}, **given)
    assert done.certificate.path_deviation < 1e-12


def test_a_state_that_leads_off_the_straight_line_is_refused():
    with pytest.raises(Infeasible, match="along the straight line"):
        made([[0, 0], [1, 2], [2, 0]], options={"straight": True}, start={"velocity": [-0.1, -0.2]})


def test_a_segment_that_may_take_no_time():
    """Was an invalid_request that named a field nobody had sent."""
    with pytest.raises(Infeasible) as caught:
        made(W, segment_durations=[None, {"max": 0}])
    assert caught.value.certified and caught.value.segment == 1 and caught.value.quantity == "segment_duration"


def test_a_loop_from_a_waypoint_to_itself():
    """Was refused as infeasible: nothing told how long it might take."""
    states = [None, {"velocity": [0.5, 0.5]}, {"velocity": [0.0, 0.5]}, None]
    assert duration([[0, 0], [1, 2], [1, 2], [3, 3]], waypoint_states=states) < 2.4


def test_smoothness_is_a_wish():
    """Was refused: of such a length between moving ends no motion was found."""
    done = made(
        [[-0.0635009], [0.704254], [-0.0635009]],
        {
            "velocity": 0.641505255300358,
            "acceleration": {"lower": -0.477158, "upper": 1.0233018},
            "jerk": 12.474523,
        },
        {"smoothness": 0.01},
        start={"velocity": [-0.641505255300358]},
        end={"velocity": [0.406509]},
    )
    assert [n.code for n in done.notes] in ([], ["not_smoothed"])


def test_longer_durations_between_moving_ends():
    """Were refused: the smooth program came to its end only but for rounding."""
    way = np.array([1.0, 2.0, -1.0])
    points = np.array([0.0, 0.4, 1.0, 1.5])[:, None] * way
    ends = {"start": {"velocity": 0.2 * way, "acceleration": 0.1 * way}, "end": {"velocity": 0.3 * way}}
    for seconds in (3.3, 4.0, 6.0, 30.0):
        done = made(
            points,
            {"velocity": 1, "acceleration": 2, "jerk": 10},
            duration={"min": seconds, "max": seconds},
            **ends,
        )
        assert done.trajectory.duration == pytest.approx(seconds, rel=1e-9)


@pytest.mark.parametrize("effort", ["fast", "default", "best"])
def test_an_axis_that_touches_its_limit_is_judged(effort):
    """Verification found no worst place: the badness of the touching one was lost to rounding."""
    limits = {"position": {"lower": 0, "upper": [1, 0.4]}, "velocity": 1, "acceleration": 4, "jerk": 40}
    points = [[0, 0], [0.5, 0.38], [0.98, 0.2], [0.6, 0.02], [0.1, 0.3], [0, 0]]
    assert made(points, limits, {"effort": effort}).certificate.holds


def test_a_program_that_comes_to_no_end_still_shows_the_way():
    """Was 5.517 with stops: the interior point circles, but its durations and states are good."""
    points = [3.383111143718432, -4.832805596435578, -2.578384232367631]
    points += [2.349973756287157, 2.3166960433248303, 1.882027013303647]
    limits = {"velocity": 5.621526028746649, "acceleration": 21.496622794894865, "jerk": 59.23966275145628}
    assert duration(np.array(points)[:, None], limits) < 4.2


def test_near_duplicates_on_the_way():
    """Was 3.9317 with stops where 3.2 would do: over so small a part of the way, positions hardly tell jerks."""
    points = [[0, 0], [1, 1], [1 + 1e-5, 1 + 1e-5], [2, 2.5]]
    assert duration(points, {"velocity": 1, "acceleration": 2, "jerk": 10}) < 3.3
