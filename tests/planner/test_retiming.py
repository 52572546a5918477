"""Retiming: the same path, within a tolerance where one is given, at its best timing."""

import os

import numpy as np
import pytest

from planner import (
    Infeasible,
    InvalidRequest,
    PlanRequest,
    Recorded,
    TimeLimit,
    Trajectory,
    Unsupported,
    plan,
    retime,
)
from planner.deadline import Deadline
from planner.fitting import smoothed
from planner.retiming import USUAL

LIMITS = {"velocity": 2.0, "acceleration": 5.0}
WAYPOINTS = np.array([[0.0, 0.0], [1, 2], [2, 3], [1, 1]])


@pytest.fixture(scope="module")
def motion():
    """A smooth motion that starts and ends at rest."""
    return plan(PlanRequest.of(WAYPOINTS, times=[0, 1, 2, 3.5]), "minimum_jerk").trajectory


def codes(made):
    return [note.code for note in made.notes]


def seeds(default):
    first, last = (int(x) for x in os.environ.get("WAYWRIGHT_SEEDS", f"0:{default}").split(":"))
    return range(first, last)


def test_a_straight_line_takes_as_long_as_it_must():
    """Of length 1 under velocity 2 and acceleration 5: 2 sqrt(1/5) is too fast, 1/2 + 2/5 = 0.9 is the optimum."""
    line = plan(PlanRequest.of([[0.0], [1.0]], times=[0, 7]), "minimum_jerk").trajectory
    assert retime(line, limits=LIMITS).trajectory.duration == pytest.approx(0.9, rel=2e-3)
    for count in (2, 3, 10, 300):
        time = np.linspace(0, 7, count)
        made = retime(Recorded.of(time, line(time)), limits=LIMITS)
        assert made.trajectory.duration == pytest.approx(0.9, rel=2e-3)


def test_a_polynomial_is_followed_exactly(motion):
    made = retime(motion, limits=LIMITS)
    assert made.certificate.holds and made.certificate.path_deviation < 1e-9
    assert np.abs(made.trajectory(made.waypoint_times) - WAYPOINTS).max() < 1e-9
    elsewhere = motion.scaled(1e4).shifted(-1e6)
    assert retime(elsewhere, limits=LIMITS).trajectory.duration == pytest.approx(made.trajectory.duration, rel=1e-3)


def test_never_slower_than_the_own_timing_slowed(motion):
    for jerk in ({}, {"jerk": 40.0}):
        for path in (motion, plan(PlanRequest.of(WAYPOINTS, limits=LIMITS | {"jerk": 40.0}), "ruckig").trajectory):
            request = PlanRequest.of(path(path.breaks), limits=LIMITS | jerk)
            polynomial = {"breaks": path.breaks.tolist(), "coefficients": path.powers().tolist()}
            scaled = plan(request, "time_scaled", {"path": {"polynomial": polynomial}})
            made = retime(path, limits=LIMITS | jerk)
            assert made.trajectory.duration <= scaled.trajectory.duration * (1 + 1e-12)
            assert made.method in ("time_scaled", USUAL)


def test_a_rational_curve_stays_one():
    arc = plan(PlanRequest.of([[1, 0], [1, 1], [0, 1]]), "nurbs", {"degree": 2, "weights": [1, 0.5**0.5, 1]}).trajectory
    made = retime(arc, limits=LIMITS)
    assert made.trajectory.rational and made.certificate.holds
    times = np.linspace(0, made.trajectory.duration, 50)
    assert np.abs(np.linalg.norm(made.trajectory(times), axis=1) - 1).max() < 1e-12


@pytest.mark.parametrize("rates", [0, 1, 2])
@pytest.mark.parametrize("count", [5, 40, 400])
def test_samples_are_passed_and_the_path_between_them_is_the_motions(motion, count, rates):
    time = np.linspace(0, 3.5, count)
    recorded = Recorded.of(time, *motion.states(time, rates + 1))
    made = retime(recorded, limits=LIMITS)
    assert len(made.waypoint_times) == count
    assert np.abs(made.trajectory(made.waypoint_times) - recorded.position).max() < 1e-9
    assert made.certificate.holds and made.certificate.path_deviation < 1e-9
    if count > 5:
        dense = motion(np.linspace(0, 3.5, 20_001))
        between = made.trajectory(np.linspace(0, made.trajectory.duration, 300))
        off = max(np.linalg.norm(dense - q, axis=1).min() for q in between)
        assert off < (1e-3 if count == 40 else 4e-4)  # all of the latter is the grid's
        assert made.trajectory.duration == pytest.approx(retime(motion, limits=LIMITS).trajectory.duration, rel=5e-3)


def test_velocities_are_tangents():
    """Of a quarter circle known at its ends only, by the tangents."""
    made = retime(Recorded.of([0, 1], [[1, 0], [0, 1]], [[0, 3], [-3, 0]]), limits=LIMITS)
    assert codes(made) == ["starts_and_ends_at_rest"]
    rates = made.trajectory(np.array([1e-3, made.trajectory.duration - 1e-3]), 1)
    assert np.abs(rates[0, 0] / rates[0, 1]) < 0.01 and np.abs(rates[1, 1] / rates[1, 0]) < 0.01
    straight = retime(Recorded.of([0, 1], [[1, 0], [0, 1]]), limits=LIMITS)
    assert made.certificate.cost["path_length"] > 1.01 * straight.certificate.cost["path_length"]


def test_times_have_no_part(motion):
    time = np.linspace(0, 3.5, 30)
    one, other = (retime(Recorded.of(t, motion(time)), limits=LIMITS) for t in (time, np.exp(time)))
    assert np.array_equal(one.trajectory.coefficients, other.trajectory.coefficients)


def test_back_and_forth_does_not_overshoot():
    u = np.linspace(0, 1, 60)
    there = 10 * u**3 - 15 * u**4 + 6 * u**5
    both = np.concatenate([there, there[-2::-1]])[:, None]
    made = retime(Recorded.of(np.arange(119), both), limits=LIMITS)
    assert made.trajectory.extrema(1).high[0].max() <= 1 + 1e-9
    assert made.trajectory.duration == pytest.approx(1.8, rel=5e-3)


def noisy(rng):
    """Dense samples of a random motion: the smooth ones and the noise's size."""
    dims, count = int(rng.integers(1, 5)), int(rng.integers(200, 1500))
    waypoints = rng.normal(size=(int(rng.integers(2, 6)), dims)) * 10.0 ** rng.uniform(-1, 2)
    times = np.cumsum(rng.uniform(0.5, 2, len(waypoints)))
    smooth = plan(PlanRequest.of(waypoints, times=times), "minimum_jerk").trajectory
    size = 10.0 ** rng.uniform(-4, -2) * float(np.ptp(waypoints, axis=0).max())
    position = smooth(np.linspace(smooth.start, smooth.end, count))
    if rng.random() < 0.3:  # it stands still for a while
        position = np.insert(position, count // 2, np.repeat(position[[count // 2]], 200, axis=0), axis=0)
    return position, size


def test_noisy_samples_are_smoothed_within_the_tolerance():
    for seed in seeds(25):
        print("seed", seed)  # shown where a case fails
        rng = np.random.default_rng(seed)
        smooth, size = noisy(rng)
        noise = rng.normal(size=smooth.shape) / 3 if seed % 2 else rng.uniform(-1, 1, smooth.shape)
        position = smooth + size * np.clip(noise, -1, 1)
        tolerance = size * rng.uniform(1.2, 4)
        unit = float(np.ptp(smooth, axis=0).max())
        limits = {"velocity": unit, "acceleration": 4 * unit} | ({"jerk": 40 * unit} if seed % 3 == 0 else {})
        recorded = Recorded.of(np.arange(len(position)) * 0.01, position)
        made = retime(recorded, limits=limits, tolerance=tolerance, timeout=60)
        assert "not_smoothed" not in codes(made)
        row = made.certificate.checks[-1]
        assert made.certificate.holds and row.quantity == "tolerance" and row.bound == tolerance
        assert made.certificate.path_deviation == row.value <= tolerance
        ends = made.trajectory([made.trajectory.start, made.trajectory.end])
        assert np.abs(ends - position[[0, -1]]).max() < 1e-9 * unit
        dense = made.trajectory(np.linspace(0, made.trajectory.end, 20_001))
        # each joint's largest step of the dense samples bounds what they miss of the path
        step = np.abs(np.diff(dense, axis=0)).max()
        apart = max(np.abs(dense - q).max(axis=1).min() for q in position[:: max(len(position) // 40, 1)])
        assert apart <= tolerance + step
        assert len(made.options.path.polynomial.breaks) - 1 < len(position) / 2


def test_a_smoothed_path_comes_in_samples_order():
    u = np.linspace(0, 2 * np.pi, 500)
    eight = np.stack([np.sin(u), np.sin(2 * u)], axis=1)
    curve, at = smoothed(eight, 0.01, Deadline(None))
    assert (np.diff(at) >= 0).all() and at[0] == curve.start and at[-1] == curve.end
    assert np.abs(curve(at) - eight).max() <= 0.01
    assert curve.pieces <= 32


def test_a_smoother_path_is_shorter_in_time():
    rng = np.random.default_rng(5)
    u = np.linspace(0, 3, 300)
    taught = Recorded.of(u, np.stack([u, np.sin(u)], axis=1) + rng.uniform(-0.01, 0.01, (300, 2)))
    durations = [retime(taught, limits=LIMITS, tolerance=t).trajectory.duration for t in (0.0, 0.011, 0.05)]
    assert durations[0] > 2 * durations[1] and durations[1] > durations[2]


@pytest.mark.parametrize("limits", [LIMITS, LIMITS | {"jerk": 40.0}])
def test_a_rounded_record_is_told_and_its_tolerance_helps(limits):
    u = np.linspace(0, 3, 600)
    exact = np.stack([u, np.sin(u)], axis=1)

    def retimed(position, **given):
        return retime(Recorded.of(u, position), limits=limits, **given)

    smooth, coarse = retimed(exact), retimed(np.round(exact, 4))
    told = [n.message for n in coarse.notes if n.code == "rounded"]
    assert len(told) == 1 and "tolerance 0.0001 " in told[0]
    helped = retimed(np.round(exact, 4), tolerance=1e-4)
    assert helped.trajectory.duration < 1.1 * smooth.trajectory.duration < coarse.trajectory.duration
    for quiet in (smooth, helped, retimed(np.round(exact, 9))):
        assert "rounded" not in codes(quiet)


def test_what_cannot_be_smoothed_is_passed():
    jumps = np.random.default_rng(0).uniform(-1, 1, (40, 2))
    made = retime(Recorded.of(range(40), jumps), limits=LIMITS, tolerance=1e-9)
    assert codes(made) == ["not_smoothed"] and len(made.waypoint_times) == 40
    assert made.certificate.checks[-1].quantity == "tolerance" and made.certificate.path_deviation < 1e-9


def test_what_had_no_part_is_told(motion):
    time = np.linspace(0, 3.5, 100)
    recorded = Recorded.of(time, *motion.states(time, 3))
    assert codes(retime(recorded, limits=LIMITS, tolerance=0.01)) == ["accelerations_unused", "velocities_unused"]


def test_refusals(motion):
    with pytest.raises(InvalidRequest) as told:
        retime(motion, limits=LIMITS, tolerance=0.1)
    assert told.value.errors[0].field == "/tolerance"
    with pytest.raises(InvalidRequest) as told:
        retime(motion, limits={"velocity": 1})
    assert told.value.errors[0].field == "/limits/acceleration"
    with pytest.raises(InvalidRequest) as told:
        retime(Recorded.of([0, 1], [[0], [1]]), limits=LIMITS, tolerance=-1)
    assert (told.value.errors[0].field, told.value.errors[0].code) == ("/tolerance", "out_of_range")
    with pytest.raises(Unsupported) as refused:
        retime(motion, limits=LIMITS | {"torque": 1})
    assert refused.value.alternatives == ()
    with pytest.raises(Infeasible):
        retime(motion, limits=LIMITS, duration={"max": 1})
    with pytest.raises(TimeLimit) as late:
        retime(motion, limits=LIMITS, timeout=1e-9)
    assert late.value.seconds == 1e-9


def test_fields_are_those_of_the_request():
    steep = Trajectory.from_powers([0, 1e-9, 1], np.array([[[0.0], [0.0]], [[0], [0]], [[0], [1]]]))
    try:
        retime(steep, limits=LIMITS)
    except InvalidRequest as error:
        assert all(e.field.startswith("/trajectory") for e in error.errors)
    except Unsupported:
        pass
