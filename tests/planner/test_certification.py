"""Anyone's trajectory: exact for polynomials, by divided differences for samples."""

import time

import numpy as np
import pytest

from planner import InvalidRequest, PlanRequest, Recorded, Trajectory, certify, plan

LIMITS = {"velocity": 2.0, "acceleration": 6.0, "jerk": 60.0}


@pytest.fixture(scope="module")
def ruckig_plan():
    request = PlanRequest.of([[0, 0], [1, -0.5], [0.3, 0.8]], limits=LIMITS)
    return plan(request, "ruckig")


def test_our_own_answers_hold(ruckig_plan):
    points = [[0, 0], [1, -0.5], [0.3, 0.8]]
    rest = {"velocity": [0, 0], "acceleration": [0, 0]}
    timed = certify(
        ruckig_plan.trajectory, limits=LIMITS, waypoints=points, times=ruckig_plan.waypoint_times, start=rest, end=rest
    )
    untimed = certify(ruckig_plan.trajectory, limits=LIMITS, waypoints=points)
    assert timed.holds and untimed.holds and timed.basis == "exact"
    assert untimed.waypoint_error <= 1e-6


def test_limits_and_order_are_judged(ruckig_plan):
    tighter = certify(ruckig_plan.trajectory, limits={**LIMITS, "jerk": 59.9})
    assert not tighter.holds and [c.holds for c in tighter.checks] == [True, True, False]
    backwards = certify(ruckig_plan.trajectory, waypoints=[[0.3, 0.8], [1, -0.5], [0, 0]])
    assert not backwards.holds and backwards.waypoint_error > 0.1
    missed = certify(ruckig_plan.trajectory, waypoints=[[0, 0], [1, -0.4], [0.3, 0.8]])
    assert not missed.holds and 0.01 < missed.waypoint_error < 0.1


def test_passing_twice_counts_in_order():
    there_and_back = Trajectory.from_powers([0, 2], np.array([[[0.0]], [[2.0]], [[-1.0]]]))  # 2t - t²: 0, 1, 0
    assert certify(there_and_back, waypoints=[[0], [0.75], [1], [0.75], [0]]).holds
    assert not certify(there_and_back, waypoints=[[0], [1], [0.75], [1]]).holds
    assert certify(there_and_back, waypoints=[[0], [0.75], [0.75], [0]]).holds


def test_thousands_of_waypoints_take_seconds():
    rng = np.random.default_rng(0)
    times = np.cumsum(rng.uniform(0.5, 1, 2000))
    points = rng.normal(size=(2000, 3))
    curve = Trajectory.from_hermite(times, points, rng.normal(size=(2000, 3)))
    started = time.process_time()
    assert certify(curve, waypoints=points).holds
    assert time.process_time() - started < 20  # it was minutes when every waypoint searched the whole curve


def test_samples_by_divided_differences(ruckig_plan):
    t = np.linspace(0, ruckig_plan.trajectory.end, 2000)
    derivatives = [ruckig_plan.trajectory(t, m) for m in range(3)]
    honest = certify(Recorded.of(t, *derivatives), limits=LIMITS, waypoints=[[0, 0], [0.3, 0.8]])
    assert honest.basis == "finite_differences" and honest.holds
    assert honest.cost["path_length"] == pytest.approx(ruckig_plan.certificate.cost["path_length"], rel=1e-4)
    assert [c.quantity for c in honest.checks][-2:] == ["sent_velocity", "sent_acceleration"]
    tight = certify(Recorded.of(t, derivatives[0]), limits={"velocity": 1.5})
    assert not tight.holds and abs(tight.checks[0].value) == pytest.approx(2, rel=1e-3)
    lying = certify(Recorded.of(t, derivatives[0], 0.9 * derivatives[1]))
    assert not lying.holds and not lying.checks[0].holds


def test_a_difference_never_overstates():
    """A divided difference is a value of the derivative somewhere in between: below the true peak, always."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        curve = Trajectory([0, 1], rng.normal(size=(6, 1, 1)))
        t = np.unique(np.concatenate([[0, 1], rng.uniform(0, 1, 8)]))
        found = certify(Recorded.of(t, curve(t))).peaks
        for m, quantity in enumerate(("position", "velocity", "acceleration", "jerk")):
            assert found[quantity][0] <= curve.extrema(4).peak(m)[0] * (1 + 1e-9)


def test_two_samples_say_nothing_of_acceleration():
    c = certify(Recorded.of([0, 1], [[0], [1]]), limits={"velocity": 2, "acceleration": 1})
    assert [row.holds for row in c.checks] == [True, False] and c.checks[1].value is None and not c.holds


@pytest.mark.parametrize(
    ("samples", "field", "code"),
    [
        ({"time": [0], "position": [[0]]}, "time", "too_few_points"),
        ({"time": [0, 0], "position": [[0], [1]]}, "time/1", "not_increasing"),
        ({"time": [0, 1], "position": [[0], [1], [2]]}, "position", "shape_mismatch"),
        ({"time": [0, 1], "position": [[0], [1]], "velocity": [[0, 1], [1, 1]]}, "velocity", "shape_mismatch"),
        ({"time": [0, 1], "position": [[0], [float("inf")]]}, "position/1/0", "not_finite"),
    ],
)
def test_bad_samples(samples, field, code):
    with pytest.raises(InvalidRequest) as caught:
        Recorded.of(**samples)
    found = caught.value.errors[0]
    assert (found.field, found.code) == (f"/trajectory/samples/{field}", code)


def test_what_cannot_be_looked_at_is_refused(ruckig_plan):
    with pytest.raises(InvalidRequest):
        certify(ruckig_plan.trajectory, limits={"tip_speed": 1.0})
    with pytest.raises(InvalidRequest):
        certify(Recorded.of([0, 1], [[0], [1]]), limits={"torque": 1.0})
    with pytest.raises(InvalidRequest):
        certify(ruckig_plan.trajectory, times=[0, 1])


def record(dt, blur, start=0.0):
    """A recorded motion from rest to rest, three joints in 2 s, from time ``start`` on."""
    motion = plan(PlanRequest.of([[0, 1, -2], [1, 0.3, 2]], times=[0, 2]), "minimum_jerk").trajectory
    time = np.arange(start, 2 + dt / 2, dt)
    return Recorded.of(time, blur(motion(np.clip(time, 0, 2))))


@pytest.mark.parametrize("dt", [1e-3, 4e-3, 2e-2])
@pytest.mark.parametrize(
    "blur",
    [
        lambda q: q,
        lambda q: q + np.random.default_rng(0).normal(size=q.shape) * 1e-9,
        lambda q: q + np.random.default_rng(1).normal(size=q.shape) * 1e-8,
        lambda q: np.round(q, 6),
        lambda q: q.astype(np.float32).astype(float),
    ],
    ids=["exact", "noise 1e-9", "noise 1e-8", "six decimals", "float32"],
)
def test_honest_records_of_rests_hold_and_others_do_not(dt, blur):
    rest = {"velocity": [0, 0, 0]}
    assert certify(record(dt, blur), start=rest, end=rest).holds
    assert not certify(record(dt, blur, start=0.2), start=rest).holds
    assert certify(record(dt, blur, start=0.2), end=rest).holds
    assert not certify(record(dt, blur), start={"velocity": [0.05, 0, 0]}).holds


@pytest.mark.parametrize("gap", [1e-3, 1e-9, 1e-30, 1e-60])
def test_a_tiny_step_at_the_end_excuses_nothing(gap):
    """Samples close together say little about a velocity; that must neither hide one nor break the judge."""
    moving = record(1e-2, lambda q: q, start=0.5)
    time = np.concatenate([[0.0, gap], moving.time[1:] - 0.5])
    position = np.concatenate([moving.position[:1], moving.position[:1], moving.position[1:]])
    rest = {"velocity": [0, 0, 0]}
    assert not certify(Recorded.of(time, position), start=rest).holds
    few = Recorded.of([0.0, gap, 1.0], [[0.0], [0.0], [1.0]])
    certify(few, start={"velocity": [0], "acceleration": [0]}, end={"velocity": [0]})


def test_the_norm_of_the_velocity(ruckig_plan):
    t = np.linspace(0, ruckig_plan.trajectory.end, 4000)
    speed = float(np.linalg.norm(ruckig_plan.trajectory(t, 1), axis=1).max())
    plain = Recorded.of(t, ruckig_plan.trajectory(t))
    sent = Recorded.of(t, ruckig_plan.trajectory(t), ruckig_plan.trajectory(t, 1))
    for trajectory, close in ((ruckig_plan.trajectory, 1e-6), (sent, 1e-9), (plain, 1e-4)):
        for factor, holds in ((1.001, True), (0.999, False)):
            found = certify(trajectory, limits={"velocity_norm": speed * factor})
            (row,) = [c for c in found.checks if c.quantity == "velocity_norm"]
            assert found.holds == row.holds == holds and row.joint is None
            assert row.value == pytest.approx(speed, rel=close) and row.ratio == row.value / row.bound
    wild = Recorded.of(t, ruckig_plan.trajectory(t), 2 * ruckig_plan.trajectory(t, 1))
    assert not certify(wild, limits={"velocity_norm": speed * 1.5}).checks[0].holds
