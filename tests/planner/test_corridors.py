"""Norms, tolerances, tubes and states at waypoints: against dense samples and membership found in another way."""

import numpy as np
import pytest
from hypothesis import given, note
from hypothesis import strategies as st
from scipy.optimize import linprog

from planner import Trajectory
from planner.limits import Limits, WaypointStates
from planner.pieces import from_bernstein
from planner.types import Demands
from planner.verify import verify

SEEDS = st.integers(0, 2**32 - 1)


def motion(seed, dims=3, rational=False, order=2):
    """Return a spline through random waypoints at random times, with joints that rest here and there."""
    note(f"seed {seed}")
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 6))
    points = rng.normal(size=(n, dims)) * 10.0 ** rng.uniform(-2, 2)
    points[:, rng.random(dims) < 0.2] = 0.7
    if rng.random() < 0.3:
        points[int(rng.integers(1, n))] = points[0]
    at = rng.uniform(-5, 5) + np.concatenate([[0.0], np.cumsum(rng.uniform(0.2, 2, n - 1))])
    size = np.ptp(points, axis=0)
    states = [rng.normal(size=(n, dims)) * size * rng.uniform(0, 3) for _ in range(order)]
    curve = Trajectory.from_hermite(at, points, *states)
    if rational:
        inner = points[:-1] + size * rng.normal(size=(2, n - 1, dims))
        control = np.concatenate([points[None, :-1], inner, points[None, 1:]])
        weights = rng.uniform(0.3, 3, (4, n - 1))
        curve = Trajectory(at, from_bernstein(control * weights[:, :, None]), from_bernstein(weights))
    return rng, curve, points, at


def dense(curve, at, count=4001):
    t = np.union1d(np.linspace(curve.start, curve.end, count), at)
    segment = np.clip(np.searchsorted(at, t, side="right") - 1, 0, len(at) - 2)
    return t, segment


def row(certificate, quantity):
    (found,) = [c for c in certificate.checks if c.quantity == quantity]
    return found


# -- norm ------------------------------------------------------------------------------------------------------------


@given(SEEDS, st.booleans())
def test_the_norm_is_exact(seed, rational):
    rng, curve, points, at = motion(seed, int(np.random.default_rng(seed).integers(1, 7)), rational)
    t, segment = dense(curve, at)
    speed = np.linalg.norm(curve(t, 1), axis=1)
    bound = max(float(speed.max()), 1e-3) * rng.uniform(0.7, 1.3)
    own = [None if rng.random() < 0.5 else Limits(velocity_norm=bound * rng.uniform(0.5, 2)) for _ in at[1:]]
    limits = Limits.of({"velocity_norm": bound} if rng.random() < 0.7 else {}, curve.dims)
    found = verify(curve, Demands(curve.dims, limits, points, at, tuple(own)))
    each = np.full(len(own), np.inf if limits.velocity_norm is None else bound)
    each = np.minimum(each, [np.inf if o is None else o.velocity_norm for o in own])
    assert found.basis == ("enclosure" if rational else "exact")
    if not np.isfinite(each).any():
        assert not found.checks
        return
    worst = row(found, "velocity_norm")
    seen = (speed / each[segment]).max()
    assert worst.joint is None and worst.bound == each[worst.segment]
    assert seen * (1 - 1e-9) <= worst.ratio + 1e-9  # joints that rest do so but for rounding
    sides = np.linalg.norm(curve([max(np.nextafter(worst.time, -9e9), curve.start), worst.time], 1), axis=1)
    assert np.abs(sides - worst.value).min() <= 1e-7 * worst.value + 1e-9 * bound
    assert at[worst.segment] <= worst.time <= at[worst.segment + 1]
    assert worst.holds == (worst.ratio <= 1 + 1e-6)


def test_the_norm_of_a_circle_is_its_speed():
    half = 0.5**0.5
    control = np.array([[[1.0, 0.0]], [[half, half]], [[0.0, 1.0]]])  # homogeneous, of a quarter of the unit circle
    quarter = Trajectory([0, 2], from_bernstein(control), from_bernstein(np.array([[1.0], [half], [1.0]])))
    t = np.linspace(0, 2, 20001)
    seen = np.linalg.norm(quarter(t, 1), axis=1).max()
    worst = row(verify(quarter, Demands(2, Limits.of({"velocity_norm": seen}, 2))), "velocity_norm")
    assert worst.holds and worst.value == pytest.approx(seen, rel=1e-8)
    assert worst.value >= seen * (1 - 1e-12)
    tight = verify(quarter, Demands(2, Limits.of({"velocity_norm": seen * (1 - 3e-6)}, 2)))
    assert not tight.holds and tight.basis == "enclosure"


def test_a_jump_has_no_norm():
    broken = Trajectory([0, 1, 2], np.array([[[0.0, 0.0], [1.0, 0.0]]]))
    worst = row(verify(broken, Demands(2, Limits.of({"velocity_norm": 1e9}, 2))), "velocity_norm")
    assert (worst.value, worst.ratio, worst.time, worst.holds) == (None, None, 1.0, False)


@pytest.mark.parametrize("size", [1e-200, 1e-90, 1e-9, 1e9, 1e90])
def test_norms_of_any_size(size):
    line = Trajectory.from_hermite([0, 1], np.array([[0, 0], [3.0, 4.0]]) * size)
    found = verify(line, Demands(2, Limits(velocity_norm=5 * size))).checks[0]
    assert found.holds and found.ratio == pytest.approx(1)


def test_beyond_floating_point_nothing_is_held():
    line = Trajectory.from_hermite([0, 1], np.array([[0, 0], [1e160, 1e160]]))
    with np.errstate(all="ignore"):
        demands = Demands(2, Limits(velocity_norm=1e250), np.zeros((2, 2)), tube=np.ones(2))
        found = verify(line, demands, np.array([0.0, 1.0]))
    assert not row(found, "velocity_norm").holds and not row(found, "tube").holds and not found.holds


# -- tolerance -------------------------------------------------------------------------------------------------------


@given(SEEDS)
def test_tolerances(seed):
    rng, curve, points, at = motion(seed, 2)
    tolerance = np.where(rng.random(2) < 0.2, 0.0, rng.uniform(0, 0.3, 2)) * max(np.ptp(points), 1e-3)
    asked = points.copy()
    off = tolerance * rng.uniform(-1.2, 1.2, (len(at) - 2, 2))
    asked[1:-1] += off
    found = verify(curve, Demands(2, waypoints=asked, times=at, waypoint_tolerance=tolerance))
    worst = row(found, "waypoint_tolerance")
    excess = np.maximum(np.abs(off) - tolerance, 0).max(initial=0.0)
    span = max(1.0, np.ptp(asked, axis=0).max())
    assert worst.holds == found.holds == (excess <= 1e-6 * span)
    assert found.waypoint_error == pytest.approx(excess / span, abs=1e-9)
    if len(at) == 2:
        assert (worst.value, worst.joint, worst.segment) == (0.0, None, None)
        return
    assert worst.time == at[worst.segment] and worst.bound == tolerance[worst.joint]
    missed = abs(points[worst.segment, worst.joint] - asked[worst.segment, worst.joint])
    assert worst.value == pytest.approx(missed, abs=1e-9 * span)
    if worst.bound > 0:
        assert worst.ratio == worst.value / worst.bound
    if worst.holds and (tolerance > 0).any():
        assert worst.ratio == pytest.approx((np.abs(off) / np.maximum(tolerance, 1e-300)).max(), abs=1e-6)


def test_the_ends_stay_exact():
    line = Trajectory.from_hermite([0, 1, 2], [[0.1], [1], [2]])
    demands = Demands(1, waypoints=np.array([[0.0], [1.2], [2]]), waypoint_tolerance=np.ones(1))
    found = verify(line, demands, np.array([0.0, 1.0, 2.0]))
    assert row(found, "waypoint_tolerance").holds and not found.holds
    assert found.waypoint_error == pytest.approx(0.05)


def test_waypoints_at_unknown_times_hold_no_tolerance_and_no_tube():
    line = Trajectory.from_hermite([0, 1], [[0.0], [1.0]])
    demands = Demands(1, waypoints=np.array([[0.0], [1.0]]), waypoint_tolerance=np.ones(1), tube=np.ones(1))
    for at in (None, np.array([0.0, 3.0]), np.array([0.0, 0.5, 1.0])):
        found = verify(line, demands, at)
        assert [c.holds for c in found.checks] == [False, False] and not found.holds and found.path_deviation is None


# -- tube ------------------------------------------------------------------------------------------------------------


def widths_needed(offset, step, tube):
    """Return the least factor by which each tube must be widened to hold the offsets (M, D), by a linear program."""
    dims = len(step)
    rows = np.concatenate([np.stack([-step, -tube], axis=1), np.stack([step, -tube], axis=1)])
    found = []
    for x in offset:
        # |x - s step| <= f tube, 0 <= s <= 1, in the variables s and f
        done = linprog([0, 1], rows, np.concatenate([-x, x]), bounds=[(0, 1), (0, None)], method="highs")
        assert done.status == 0, (done.message, dims)
        found.append(done.x[1])
    return np.array(found)


@given(SEEDS, st.integers(1, 4), st.booleans())
def test_the_tube_is_exact(seed, dims, rational):
    rng, curve, points, at = motion(seed, dims, rational)
    tube = rng.uniform(0.05, 1.0, dims) * max(np.ptp(points), 1e-3)
    found = verify(curve, Demands(dims, waypoints=points, times=at, tube=tube))
    worst = row(found, "tube")
    t, segment = dense(curve, at, 61)
    offset, step = curve(t) - points[segment], np.diff(points, axis=0)[segment]
    seen = np.concatenate([widths_needed(offset[k : k + 1], step[k], tube) for k in range(len(t))])
    span = max(1.0, np.ptp(points, axis=0).max())
    slack = 1e-6 * span / tube.min()
    assert seen.max() <= worst.ratio + slack  # every sample lies in the tube times the ratio
    told = curve(worst.time) - points[worst.segment]
    needed = widths_needed(told[None], (points[worst.segment + 1] - points[worst.segment]), tube)
    assert needed[0] == pytest.approx(worst.ratio, rel=1e-6, abs=slack)  # and where it is told, none less will do
    assert worst.bound == tube[worst.joint] and worst.value == pytest.approx(worst.ratio * worst.bound)
    if worst.ratio < 1:
        assert worst.holds and found.holds
    if (worst.ratio - 1) * tube.min() > 1e-5 * span:
        assert not worst.holds and not found.holds


@given(SEEDS, st.integers(1, 5))
def test_intervals_agree_at_many_samples(seed, dims):
    """Membership by intersecting, sample by sample, the intervals of s that each joint leaves."""
    rng, curve, points, at = motion(seed, dims)
    tube = rng.uniform(0.0, 0.5, dims) * max(np.ptp(points), 1e-3)
    worst = row(verify(curve, Demands(dims, waypoints=points, times=at, tube=tube)), "tube")
    t, segment = dense(curve, at)
    x, step = curve(t) - points[segment], np.diff(points, axis=0)[segment]

    def inside(factor, extra):
        wide = factor * tube + extra
        with np.errstate(all="ignore"):
            one, two = (x - wide) / step, (x + wide) / step
        moving = step != 0
        low = np.where(moving, np.minimum(one, two), np.where(np.abs(x) <= wide, -np.inf, np.inf)).max(axis=1)
        high = np.where(moving, np.maximum(one, two), np.inf).min(axis=1)
        return np.maximum(low, 0) <= np.minimum(high, 1)

    span = max(1.0, np.ptp(points, axis=0).max())
    if worst.holds:
        assert inside(1.0, 1.1e-6 * span).all()
    else:
        place = int(np.argmin(np.abs(t - worst.time)))
        beyond = (worst.ratio - 1) if worst.ratio is not None else worst.value
        if beyond > 0.05 and abs(t[place] - worst.time) < 1e-3:  # a sample near enough to be out too
            assert not inside(1.0, 0.0).all()
    if worst.ratio is not None and worst.holds:
        assert inside(worst.ratio, 1e-9 * span).all()


def test_a_tube_without_width_is_a_line():
    points = np.array([[0.0, 0.0, 1.0], [1.0, -2.0, 1.0], [4.0, 2.0, 1.0]])
    law = Trajectory.from_hermite([0, 1, 3], [[0.0], [1.0], [2.0]], np.zeros((3, 1)), np.zeros((3, 1)))
    straight = Trajectory.from_hermite([0, 1, 2], points).compose(law)
    at, none = np.array([0.0, 1.0, 3.0]), np.zeros(3)
    found = verify(straight, Demands(3, waypoints=points, times=at, tube=none))
    worst = row(found, "tube")
    assert found.holds and worst.ratio is None and worst.bound == 0 and worst.value <= 1e-12
    assert found.path_deviation <= 1e-12
    bent = Trajectory.from_hermite(at, points, np.zeros((3, 3)), [[0, 0, 0], [0, 0.1, 0], [0, 0, 0]])
    found = verify(bent, Demands(3, waypoints=points, times=at, tube=none))
    worst = row(found, "tube")
    assert not found.holds and worst.ratio is None and worst.value > 1e-4 and worst.joint in (0, 1)
    narrow = verify(bent, Demands(3, waypoints=points, times=at, tube=np.array([0.0, 0.5, 0.0])))
    assert narrow.holds and row(narrow, "tube").joint == 1 and 0 < row(narrow, "tube").ratio < 1
    wrong = verify(bent, Demands(3, waypoints=points, times=at, tube=np.array([0.0, 0.0, 0.5])))
    assert not wrong.holds and row(wrong, "tube").joint in (0, 1)


def test_figures_by_hand():
    arc = Trajectory.from_powers([0, 1], np.array([[[0.0, 0.0]], [[1.0, 0.4]], [[0.0, -0.4]]]))  # bulges by 0.1
    points, at = np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([0.0, 1.0])
    found = verify(arc, Demands(2, waypoints=points, times=at, tube=np.array([0.3, 0.2])))
    worst = row(found, "tube")
    assert (worst.joint, worst.segment, worst.bound, worst.holds) == (1, 0, 0.2, True)
    assert (worst.time, worst.ratio, worst.value) == pytest.approx((0.5, 0.5, 0.1))
    assert found.path_deviation == pytest.approx(0.1)
    turned = arc.mapped([[0.8, -0.6], [0.6, 0.8]])  # across the line (0.8, 0.6): both joints deviate
    found = verify(turned, Demands(2, waypoints=points @ [[0.8, 0.6], [-0.6, 0.8]], times=at, tube=np.full(2, 0.05)))
    worst = row(found, "tube")
    # |0.6 x - 0.8 y| = 0.1 at the middle, against 0.05 (0.6 + 0.8)
    assert worst.ratio == pytest.approx(0.1 / 0.07) and worst.joint == 1 and not worst.holds
    assert found.path_deviation == pytest.approx(0.1)
    over = Trajectory.from_powers([0, 1], np.array([[[0.0]], [[3.0]], [[-2.0]]]))  # to 1 by way of 1.125
    found = verify(over, Demands(1, waypoints=np.array([[0.0], [1.0]]), times=at, tube=np.array([0.5])))
    assert (row(found, "tube").ratio, row(found, "tube").time) == pytest.approx((0.25, 0.75))
    assert found.path_deviation == pytest.approx(0.125)


def test_a_tube_need_not_touch_its_sides():
    line = Trajectory.from_hermite([0, 1], [[0.0], [1.0]])
    demands = Demands(1, waypoints=np.array([[0.0], [1.0]]), tube=np.ones(1))
    worst = row(verify(line, demands, np.array([0.0, 1.0])), "tube")
    assert (worst.ratio, worst.value, worst.holds) == (0.0, 0.0, True)


@given(SEEDS)
def test_the_distance_from_the_polyline(seed):
    _, curve, points, at = motion(seed, 3)
    found = verify(curve, Demands(3, waypoints=points, times=at, tube=np.full(3, 1e9)))
    t, segment = dense(curve, at)
    x, step = curve(t) - points[segment], np.diff(points, axis=0)[segment]
    square = np.maximum((step**2).sum(axis=1), 1e-300)
    share = np.clip((x * step).sum(axis=1) / square, 0, 1)
    seen = np.linalg.norm(x - share[:, None] * step, axis=1).max()
    assert seen * (1 - 1e-9) <= found.path_deviation + 1e-12
    assert found.path_deviation <= seen * (1 + 1e-3) + 1e-9


def test_many_joints_and_pieces_take_seconds():
    import time

    rng = np.random.default_rng(0)
    points = rng.normal(size=(1000, 24))
    curve = Trajectory.from_hermite(np.arange(1000.0), points, rng.normal(size=(1000, 24)) * 0.1)
    limits = Limits.of({"velocity_norm": 1e3}, 24)
    demands = Demands(24, limits, points, tube=np.full(24, 9.0), waypoint_tolerance=np.full(24, 0.1))
    verify(curve.part(0, 9), Demands(24, limits, points[:10], tube=demands.tube), np.arange(10.0))  # compile
    started = time.process_time()
    assert verify(curve, demands, np.arange(1000.0)).holds
    assert time.process_time() - started < 10


def test_a_hold_keeps_every_corridor():
    still = np.tile([[1.0, 2.0]], (3, 1))
    zero = WaypointStates(np.zeros((3, 2)), np.full((3, 2), np.nan))
    for start, end, at in ((0, 0, [0, 0, 0]), (1, 3, [1, 1.5, 3])):
        demands = Demands(
            2,
            Limits.of({"velocity_norm": 1}, 2),
            still,
            waypoint_states=zero,
            waypoint_tolerance=np.zeros(2),
            tube=np.zeros(2),
        )
        found = verify(Trajectory.hold([1.0, 2.0], start, end), demands, np.array(at, dtype=float))
        assert found.holds and [c.quantity for c in found.checks] == ["velocity_norm", "waypoint_tolerance", "tube"]
        assert found.path_deviation == 0 and found.boundary_error == 0


# -- states ----------------------------------------------------------------------------------------------------------


def test_states_at_waypoints_are_judged_from_both_sides():
    at, points = np.array([0.0, 1.0, 2.0]), np.array([[0.0, 0], [1, 1], [2, 0]])
    rates = np.array([[0.0, 1], [0.5, 0], [0, -1]])
    curve = Trajectory.from_hermite(at, points, rates)
    free = np.full((3, 2), np.nan)
    asked = WaypointStates(np.where([[False, True], [True, True], [False, False]], rates, np.nan), free)
    assert verify(curve, Demands(2, waypoints=points, waypoint_states=asked), at).boundary_error < 1e-12
    off = WaypointStates(asked.velocity + 0.3, free)
    found = verify(curve, Demands(2, waypoints=points, waypoint_states=off), at)
    peak = np.abs(curve(np.linspace(0, 2, 20001), 1)).max(axis=0)
    assert not found.holds and found.boundary_error == pytest.approx(0.3 / max(peak.min(), 1), rel=1e-6)
    bend = curve.ends(2)[1][0]  # the acceleration jumps at the second waypoint: from the left it is kept
    jumping = WaypointStates(free, np.stack([free[0], bend, free[0]]))
    assert verify(curve, Demands(2, waypoints=points, waypoint_states=jumping), at).boundary_error > 0.1
    assert verify(curve, Demands(2, waypoints=points, waypoint_states=asked)).boundary_error == np.inf
