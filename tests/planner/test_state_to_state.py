"""Legs by ruckig in batches: the same as one by one, exact on their clock, and what becomes of those without answer."""

from types import SimpleNamespace

import numpy as np
import pytest

from planner import PlanRequest
from planner.deadline import Deadline
from planner.errors import TimeLimit
from planner.limits import Limit
from planner.timing.state_to_state import Legs, joined, profiles, shortest, slowed
from planner.timing.stop_plan import stop_durations, stop_plan
from planner.waypoints.realisation import realise


def random_legs(seed, count=12, dims=4, jerk=10.0):
    rng = np.random.default_rng(seed)
    p, v, a = rng.normal(size=(3, count + 1, dims))
    size = np.ones((count, dims))
    v, a = 0.3 * np.tanh(v), 0.2 * np.tanh(a)
    limits = Limit(-1.2 * size, size), Limit(-2.0 * size, 3.0 * size)
    return Legs(p[:-1], v[:-1], a[:-1], p[1:], v[1:], a[1:], *limits, jerk * size, np.zeros(count))


def in_order(legs, index):
    return legs.chosen(np.asarray(index, dtype=np.int64))


def test_a_batch_is_each_leg_of_its_own():
    legs = random_legs(1)
    legs.least[[2, 5]] = 9.0, 7.0
    legs.jerk[3], legs.jerk[4, 1] = np.inf, np.inf
    legs.a0[3:5], legs.a1[3:5] = 0.0, 0.0
    legs.p1[6], legs.v0[6], legs.v1[6], legs.a0[6], legs.a1[6] = legs.p0[6], 0.0, 0.0, 0.0, 0.0
    legs.p1[7] = legs.p0[7] + 1e6
    durations, phases = profiles(legs)
    assert not np.isnan(durations).any() and durations[[2, 5, 6]] == pytest.approx([9.0, 7.0, 0.0])
    np.testing.assert_array_equal(shortest(legs), durations)
    for i in range(len(legs)):
        alone, own = profiles(in_order(legs, [i]))
        assert alone[0] == durations[i]
        np.testing.assert_array_equal(own[0], phases[i])


@pytest.mark.parametrize("jerk", [10.0, np.inf])
@pytest.mark.parametrize("seed", range(5))
def test_the_phases_end_in_the_state_asked(seed, jerk):
    legs = random_legs(seed, jerk=jerk)
    if not np.isfinite(jerk):
        legs.a0[:], legs.a1[:] = 0.0, 0.0
    durations, phases = profiles(legs)
    np.testing.assert_allclose(phases[:, :, :, 0].sum(axis=2), durations[:, None] + np.zeros((1, 4)), rtol=1e-12)
    t, p, v, a, j = np.moveaxis(phases[:, :, -2], 2, 0)
    np.testing.assert_allclose(p + t * (v + t * (a / 2 + t * j / 6)), legs.p1 - legs.p0, atol=1e-11)
    np.testing.assert_allclose(v + t * (a + t * j / 2), legs.v1, atol=1e-11)


def test_the_joined_motion_keeps_its_limits_to_rounding():
    legs = random_legs(3, count=60)
    durations, phases = profiles(legs)
    whole, times = joined(durations, phases, legs.p0)
    assert times[-1] > 60.0 and np.isin(times, whole.breaks).all()
    for order, limit in ((2, 3.0), (3, 10.0)):
        found = whole.extrema(4)
        assert found.high[order].max() <= limit * (1 + 1e-12)
    np.testing.assert_allclose(whole(times[:-1]), legs.p0, atol=1e-13)
    for order, allowed in ((0, 1e-12), (1, 1e-12), (2, 1e-11)):  # ruckig's own ends
        assert np.abs(whole.jumps(order)).max() < allowed


def test_scales_far_apart_and_legs_without_answer():
    legs = random_legs(4, count=3)
    for x in (legs.v0, legs.a0, legs.v1, legs.a1):
        x[:2] = 0.0
    legs.p1[0] = legs.p0[0] + [1e-16, 1e6, 1.0, 0.0]
    legs.v1[2, 0] = 5.0  # beyond the limit
    durations, _ = profiles(legs)
    assert np.isnan(durations).tolist() == [False, False, True]
    assert np.isnan(shortest(legs)).tolist() == [False, False, True]


def test_slowed():
    legs = random_legs(5, count=2)
    for x in (legs.v0, legs.a0, legs.v1, legs.a1):
        x[:] = 0.0
    durations, phases = profiles(legs)
    factor = np.array([1.0, 2.5])
    fast, _ = joined(durations, phases, legs.p0)
    slow, times = joined(durations * factor, slowed(phases, factor), legs.p0)
    u = np.linspace(0, 1, 50)
    np.testing.assert_allclose(
        slow(times[1] + u * (slow.end - times[1])), fast(durations[0] + u * (fast.end - durations[0])), atol=1e-12
    )


def test_nothing_moves():
    whole, times = joined(np.zeros(1), np.zeros((1, 2, 3, 5)), np.array([[1.0, 2.0]]))
    assert whole.duration == 0.0 and times.tolist() == [0.0, 0.0] and whole(0.0).tolist() == [1.0, 2.0]


def test_stop_durations_and_the_deadline():
    limits = {"velocity": 1.0, "acceleration": 2.0, "jerk": 10.0}
    request = PlanRequest.of([[0.0], [1.0], [1.0], [-2.0]], limits=limits)
    made = stop_plan(request, Deadline(None))
    np.testing.assert_allclose(stop_durations(request), np.diff(made.times), rtol=1e-14)
    assert made.times[1] == made.times[2]
    with pytest.raises(TimeLimit):
        stop_plan(request, Deadline(-1.0))


LIMITS = {"velocity": 1.0, "acceleration": 2.0, "jerk": 10.0}
SLOW = 10.0  # s


def through(end, limits, own=False, duration=SLOW):
    """One segment from 0 to 1 that starts at rest and ends with the velocity given; its own piece is a line."""
    own_phases = np.array([[[[duration, 0.0, 1.0 / duration, 0.0, 0.0], [0.0, 1.0, 1.0 / duration, 0.0, 0.0]]]])
    spline = SimpleNamespace(
        durations=np.array([duration]),
        velocity=np.array([[0.0], [end]]),
        acceleration=np.zeros((2, 1)),
        phases=lambda nodes: own_phases,
    )
    request = PlanRequest.of([[0.0], [1.0]], limits=limits, end={"velocity": [end]})
    return realise(request, SimpleNamespace(joints=np.array([0])), None, spline, own, Deadline(None))


def test_by_ruckig_where_that_is_shorter_and_keeps_the_limits():
    assert through(0.5, LIMITS).by_ruckig == 1
    assert through(0.5, LIMITS, own=True).by_ruckig == 0
    assert through(0.5, LIMITS, duration=1.0).by_ruckig == 0  # ruckig takes longer
    assert through(2.0, LIMITS).by_ruckig == 0  # no answer
    made = through(0.5, LIMITS, own=True)
    assert made.trajectory.duration == SLOW and made.trajectory(5.0) == pytest.approx(0.5)


def test_positions_outside_of_their_limits_keep_the_own_pieces():
    assert through(-0.5, LIMITS).by_ruckig == 1
    highest = through(-0.5, LIMITS).trajectory.extrema(1).high.max()
    assert highest > 1.0
    for room, used in ((1e-6, 1), (-1e-6, 0)):
        position = {"lower": [-1.0], "upper": [highest + room]}
        assert through(-0.5, {**LIMITS, "position": position}).by_ruckig == used
