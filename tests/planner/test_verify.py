"""Verification: what it must catch, in figures that follow by hand."""

import numpy as np
import pytest

from planner import InvalidRequest, Trajectory
from planner.limits import Boundary, DurationBounds, Limits
from planner.types import Demands, Followed
from planner.verify import path_length, verify

SPLINE = Trajectory.from_powers([0, 1, 2], np.array([[[0], [2]], [[0], [2.25]], [[3.75], [-1.5]], [[-1.75], [0.25]]]))


def demands(**given):
    given.setdefault("waypoints", np.array([[0.0], [2.0], [3.0]]))
    if "limits" in given:
        given["limits"] = Limits.of(given["limits"], 1)
    return Demands(dims=1, **given)


AT = np.array([0.0, 1.0, 2.0])


def test_the_worked_spline():
    c = verify(
        SPLINE,
        demands(limits={"velocity": 3, "acceleration": 8, "jerk": 11, "position": {"lower": -2, "upper": 4}}),
        AT,
    )
    position, velocity, acceleration, jerk = c.checks
    assert (velocity.value, velocity.time) == pytest.approx((75 / 28, 5 / 7), rel=1e-12)
    assert (acceleration.value, acceleration.time, acceleration.segment) == pytest.approx((7.5, 0, 0))
    assert (jerk.value, jerk.bound) == pytest.approx((-10.5, -11))
    assert (position.value, position.ratio, position.bound) == pytest.approx((3, 2 / 3, 4))
    assert c.holds and c.continuity == 2 and c.waypoint_error == 0
    assert c.cost["squared_jerk"] == pytest.approx(10.5**2 + 1.5**2)
    assert c.cost["path_length"] == pytest.approx(3)  # monotone


@pytest.mark.parametrize(
    ("limits", "holds"),
    [
        ({"velocity": 75 / 28}, True),
        ({"velocity": 75 / 28 * (1 - 5e-7)}, True),
        ({"velocity": 75 / 28 * (1 - 2e-6)}, False),
        ({"acceleration": {"lower": -2.9, "upper": 8}}, False),
        ({"acceleration": {"lower": -3.1, "upper": 8}}, True),
        ({"position": {"upper": 2.9}}, False),
        ({"position": {"lower": -0.1}}, True),
    ],
)
def test_limits_are_judged_at_the_extrema(limits, holds):
    assert verify(SPLINE, demands(limits=limits), AT).holds is holds


def test_one_sided_position_has_no_ratio():
    row = verify(SPLINE, demands(limits={"position": {"upper": 4}}), AT).checks[0]
    assert row.ratio is None and row.value == 3 and row.bound == 4


def test_a_missed_waypoint_is_caught():
    c = verify(SPLINE, demands(waypoints=np.array([[0.0], [2.1], [3.0]])), AT)
    assert not c.holds and c.waypoint_error == pytest.approx(0.1 / 3)
    assert not verify(SPLINE, demands(), np.array([0.0, 1.1, 2.0])).holds
    assert verify(SPLINE, demands(), np.array([0.0, 1.0, 2.5])).waypoint_error == np.inf
    assert verify(SPLINE, demands(), np.array([1.0, 0.0, 2.0])).waypoint_error == np.inf


def test_the_callers_times_count_not_the_methods():
    assert not verify(SPLINE, demands(times=np.array([0.0, 1.2, 2.0])), AT).holds


def test_boundary_states():
    rest = Boundary(velocity=np.zeros(1))
    assert verify(SPLINE, demands(start=rest, end=rest), AT).boundary_error == pytest.approx(0, abs=1e-12)
    c = verify(SPLINE, demands(start=Boundary(velocity=np.array([0.1]), acceleration=np.array([7.5]))), AT)
    assert not c.holds and c.boundary_error == pytest.approx(0.1 / (75 / 28))


def test_jumps_make_the_next_derivative_unbounded():
    line = Trajectory.from_hermite(AT, [[0], [2], [3]])
    c = verify(line, demands(limits={"velocity": 5, "acceleration": 1e9, "jerk": 1e9}), AT)
    velocity, acceleration, jerk = c.checks
    assert velocity.holds and not acceleration.holds and not jerk.holds and not c.holds
    assert acceleration.value is None and acceleration.ratio is None and acceleration.time == 1
    assert c.continuity == 0 and c.cost["squared_jerk"] is None
    assert c.peaks["velocity"] == (2.0,) and c.peaks["acceleration"] == (None,)
    broken = Trajectory([0, 1, 2], np.array([[[0.0], [1.0]]]))
    c = verify(broken, Demands(dims=1, limits=Limits.of({"velocity": 1}, 1)))
    assert c.continuity == -1 and c.checks[0].value is None and not c.holds


def test_rounding_is_no_jump():
    rng = np.random.default_rng(0)
    times = np.cumsum(rng.uniform(1e-4, 1, 50))
    data = [rng.normal(size=(50, 3)) for _ in range(3)]
    data[0][:, 1] = 1e5 + 1e-12 * data[0][:, 1]
    data[1][:, 1] = data[2][:, 1] = 0
    assert verify(Trajectory.from_hermite(times, *data), Demands(dims=3)).continuity == 2


def test_segment_limits_count_on_their_segment_only():
    whole = {"velocity": 3}
    tight = Limits.of({"velocity": 2.3}, 1)
    assert verify(SPLINE, demands(limits=whole, segment_limits=(None, tight)), AT).holds
    c = verify(SPLINE, demands(limits=whole, segment_limits=(tight, None)), AT)
    assert not c.holds and c.checks[0].bound == 2.3 and c.checks[0].segment == 0
    one_piece = Trajectory.from_powers([0, 2], np.array([[[0.0]], [[0.0]], [[1.0]]]))  # v = 2t, no break at 1
    c = verify(one_piece, Demands(dims=1, waypoints=np.array([[0.0], [1.0], [4.0]]), segment_limits=(tight, None)), AT)
    assert c.holds and c.checks[0].value == pytest.approx(2.0)


def test_durations():
    assert verify(SPLINE, demands(duration=DurationBounds(2, 2)), AT).holds
    c = verify(SPLINE, demands(duration=DurationBounds(2.1, 3)), AT)
    assert not c.holds and (c.checks[-1].value, c.checks[-1].bound) == (2, 2.1)
    c = verify(SPLINE, demands(segment_durations=(None, DurationBounds(0, 0.9))), AT)
    assert not c.holds and c.checks[-1].quantity == "segment_duration" and c.checks[-1].segment == 1


def test_a_false_claim_about_the_path_is_caught():
    curve = Trajectory.from_hermite([0, 1, 2], [[0, 0], [1, 1], [2, 0]])
    law = Trajectory.from_hermite([0, 4], [[0], [2]])
    honest = curve.compose(law)
    assert verify(honest, Demands(dims=2), path=Followed(curve, law)).path_deviation < 1e-12
    other = Trajectory.from_hermite([0, 2, 4], [[0, 0], [1, 1.01], [2, 0]])
    c = verify(other, Demands(dims=2), path=Followed(curve, law))
    assert not c.holds and c.path_deviation == pytest.approx(0.01)
    back = Trajectory.from_hermite([0, 2, 3, 4], [[0], [1.5], [1], [2]])
    assert verify(honest, Demands(dims=2), path=Followed(curve, back)).path_deviation == np.inf
    with pytest.raises(InvalidRequest, match="runs backwards"):
        curve.compose(back)


def test_path_length_through_rests_and_kinks():
    there_and_back = Trajectory.from_powers([0, 2], np.array([[[0.0]], [[2.0]], [[-1.0]]]))
    assert path_length(there_and_back) == pytest.approx(2, rel=1e-9)
    circle = np.linspace(0, 2 * np.pi, 201)
    points = np.stack([np.cos(circle), np.sin(circle)], axis=1)
    rates = np.stack([-np.sin(circle), np.cos(circle)], axis=1)
    assert path_length(Trajectory.from_hermite(circle, points, rates)) == pytest.approx(2 * np.pi, rel=1e-7)
    assert path_length(Trajectory.hold([1.0], 0, 0)) == 0


@pytest.mark.parametrize("order", [1, 2])
def test_a_closed_motion_must_close(order):
    """Asked of a curve whose derivatives differ at the ends, that is found; of a periodic spline it holds."""
    from planner.curves import cubic_spline

    times, points = np.array([0.0, 1, 2, 3]), np.array([[0.0], [1], [-1], [0]])
    closed = verify(cubic_spline(times, points, "periodic"), Demands(1, closed=order))
    assert closed.holds and closed.boundary_error <= 1e-12
    natural = cubic_spline(times, points, "clamped", 1.0, 0.0) if order == 1 else cubic_spline(times, points)
    assert not verify(natural, Demands(1, closed=order)).holds
