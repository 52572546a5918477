"""Free durations against IPOPT, trusted costs and other starts; within limits, exactly and near the reference."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.deadline import Deadline
from planner.errors import Infeasible, InvalidRequest, TimeLimit
from planner.limits import DurationBounds
from planner.smoothing.free_times import optimal_times
from planner.smoothing.least_duration import optimal_times_within
from planner.solvers import select
from planner.solvers.nlp import solve_nlp
from planner.trajectory import Trajectory
from problems.free_times import FreeDurations

CASES = json.loads((Path(__file__).parent.parent / "data" / "minimum-jerk.json").read_text())["cases"]


def rest(order, dims):
    return np.zeros((order - 1, dims))


def walk(seed, n, dims=3):
    return np.cumsum(np.random.default_rng(seed).normal(size=(n, dims)), axis=0)


def motion(points, found):
    return Trajectory.from_hermite(np.concatenate([[0], np.cumsum(found.h)]), points, *found.states)


def bounds(n, dims, *rates):
    upper = np.full((4, n - 1, dims), np.inf)
    upper[1 : 1 + len(rates)] = np.reshape(rates, (-1, 1, 1))
    return -upper, upper


def excess(points, found, lower, upper):
    """Largest part by which rates exceed their limits, and positions, in their unit."""
    peaks = motion(points, found).extrema(4)
    with np.errstate(invalid="ignore"):
        rates = np.maximum(peaks.high[1:] / upper[1:], peaks.low[1:] / lower[1:]).max()
    return rates - 1, max((peaks.high[0] - upper[0]).max(), (lower[0] - peaks.low[0]).max())


def by_ipopt(points, order, ends, cost, lower=None, upper=None, places=(), start=None, total=(0.0, np.inf)):
    problem = FreeDurations(points, order, np.array(ends), cost, lower, upper, least=total[0], most=total[1])
    found = solve_nlp(lambda: problem.to_casadi(start.h, start.states, np.array(places)), select("nlp", "ipopt")[0])
    return problem.read(found.x)


def slowed(points, found, lower, upper):
    """Duration of a motion slowed down uniformly until it keeps its limits."""
    peaks = motion(points, found).extrema(4)
    ratio = np.maximum(peaks.high[1:] / upper[1:], peaks.low[1:] / lower[1:]).max(axis=(1, 2))
    return found.h.sum() * max(ratio ** (1 / np.arange(1, 4)))


@pytest.mark.parametrize("case", [c for c in CASES if "free_times" in c["request"].get("options", {})])
def test_reference(case):
    points = np.array(case["request"]["waypoints"])
    weight = case["request"]["options"]["time_weight"]
    found = optimal_times(points, 3, rest(3, 3), rest(3, 3), weight)
    assert found.cost == pytest.approx(case["reference"]["cost"], rel=1e-9)
    np.testing.assert_allclose(found.h, case["reference"]["segment_times"], rtol=1e-6)
    made = motion(points, found)
    assert made.squared_integral(3) + weight * made.duration == pytest.approx(found.cost, rel=1e-9)


@pytest.mark.parametrize("order", [2, 3, 4])
@pytest.mark.parametrize("total", [None, 9.0])
def test_ipopt_agrees(order, total):
    points = walk(order, 7)
    start = np.random.default_rng(order).normal(size=(order - 1, 3))
    end = rest(order, 3)
    end[-1, 1] = np.nan
    duration = None if total is None else DurationBounds(total, total)
    found = optimal_times(points, order, start, end, 10.0, duration)
    cost = np.array([1.0, 1.0, 1.0, 10.0])
    span = (0.0, np.inf) if total is None else (total, total)
    h, states = by_ipopt(points, order, (start, end), cost, start=found, total=span)
    other = Trajectory.from_hermite(np.concatenate([[0], np.cumsum(h)]), points, *states)
    assert found.cost == pytest.approx(other.squared_integral(order) + 10.0 * h.sum(), rel=1e-7)


@pytest.mark.parametrize("order", [2, 3, 4])
@given(st.integers(0, 2**32 - 1))
@settings(max_examples=5)
def test_every_start_leads_to_the_same(order, seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 15))
    points = rng.normal(size=(n, 2))
    ends = rest(order, 2), rest(order, 2)
    costs = [optimal_times(points, order, *ends, 5.0).cost]
    costs += [optimal_times(points, order, *ends, 5.0, guess=np.exp(rng.uniform(-1, 1, n - 1))).cost for _ in range(20)]
    np.testing.assert_allclose(costs, costs[0], rtol=1e-9)


@given(st.integers(0, 2**32 - 1))
def test_durations_bounded(seed):
    """Bounds are kept, cost something, and where none binds nothing changes; no exchange of time between gaps helps."""
    rng = np.random.default_rng(seed)
    n, order = int(rng.integers(3, 10)), int(rng.integers(2, 5))
    points, ends = rng.normal(size=(n, 2)), (rest(order, 2), rest(order, 2))
    free = optimal_times(points, order, *ends, 1.0)
    loose = [DurationBounds(0.5 * h, 2 * h) for h in free.h]
    same = optimal_times(points, order, *ends, 1.0, DurationBounds(0.0, 2 * free.h.sum()), loose)
    np.testing.assert_allclose(same.h, free.h, rtol=1e-4)
    tight = [DurationBounds(h * rng.uniform(0.5, 1.2), h * rng.uniform(1.2, 2)) for h in free.h]
    low, high = (sum(getattr(b, side) for b in tight) for side in ("min", "max"))
    total = DurationBounds(low + 0.3 * (high - low), low + 0.3 * (high - low))
    alone = optimal_times(points, order, *ends, 1.0, None, tight)
    both = optimal_times(points, order, *ends, 1.0, total, tight)
    assert free.cost <= alone.cost * (1 + 1e-12) <= both.cost * (1 + 2e-12)
    for found in (alone, both):
        assert all(b.min <= h <= b.max for b, h in zip(tight, found.h, strict=True))
    assert both.h.sum() == pytest.approx(total.min, rel=1e-12)
    for _ in range(10):
        i, j = rng.choice(n - 1, 2, replace=False)
        h = both.h.copy()
        h[i], h[j] = h[i] + 1e-3 * h.min(), h[j] - 1e-3 * h.min()
        if tight[i].min <= h[i] <= tight[i].max and tight[j].min <= h[j] <= tight[j].max:
            fixed = [DurationBounds(x, x) for x in h]
            assert optimal_times(points, order, *ends, 1.0, None, fixed).cost >= both.cost * (1 - 1e-9)


def test_refused():
    line, ends = np.array([[0.0], [1.0], [3.0]]), (rest(3, 1), rest(3, 1))
    half = [DurationBounds(1, 2), DurationBounds(1, 2)]
    for duration in (DurationBounds(0, 1.5), DurationBounds(5, 6)):
        with pytest.raises(InvalidRequest) as caught:
            optimal_times(line, 3, *ends, 1.0, duration, half)
        assert caught.value.errors[0].code == "conflict"
    with pytest.raises(InvalidRequest, match="segment 1 is below"):
        optimal_times(np.array([[0.0], [1], [1], [2]]), 3, *ends, 1.0)
    kept = optimal_times(np.array([[0.0], [1], [1], [2]]), 3, *ends, 1.0, None, [None, DurationBounds(0.1, 1), None])
    assert kept.h[1] == 0.1
    with pytest.raises(InvalidRequest, match="for ever"):
        optimal_times(line, 3, *ends, 0.0)
    assert optimal_times(line, 3, *ends, 0.0, DurationBounds(0, 7)).h.sum() == pytest.approx(7)
    with pytest.raises(TimeLimit):
        optimal_times(line, 3, *ends, 1.0, deadline=Deadline(0.0))
    lower, upper = bounds(3, 1, 1.0)
    with pytest.raises(Infeasible) as proved:
        optimal_times_within(line, 3, np.array([[2.0], [0.0]]), rest(3, 1), lower, upper, None)
    assert proved.value.certified and proved.value.quantity == "velocity"
    with pytest.raises(Infeasible, match="longer than"):
        optimal_times_within(line, 3, *ends, lower, upper, None, DurationBounds(0, 3))
    with pytest.raises(InvalidRequest, match="nothing limits"):
        optimal_times_within(line, 3, *ends, *bounds(3, 1), None)


@pytest.mark.parametrize(("gaps", "order"), [(5, 2), (5, 3), (5, 4), pytest.param(10, 3, marks=pytest.mark.slow)])
def test_least_duration_near_the_reference(gaps, order):
    points = walk(gaps, gaps + 1)
    lower, upper = bounds(gaps + 1, 3, 2.0, 5.0, 20.0)
    ends = rest(order, 3), rest(order, 3)
    found = optimal_times_within(points, order, *ends, lower, upper, None)
    h, _ = by_ipopt(points, order, ends, np.array([0, 0, 0, 1.0]), lower, upper, np.linspace(0, 1, 15), found)
    assert found.h.sum() <= 1.01 * h.sum()
    assert max(excess(points, found, lower, upper)) <= 0
    other = optimal_times_within(points, order, *ends, lower, upper, None, backend="ipopt")
    assert max(excess(points, other, lower, upper)) <= 0
    assert found.h.sum() == pytest.approx(other.h.sum(), rel=0.01)


@pytest.mark.slow
def test_least_duration_of_twenty_gaps():
    test_least_duration_near_the_reference(20, 3)


@given(st.integers(0, 2**32 - 1))
def test_limits_hold_at_all_times(seed):
    rng = np.random.default_rng(seed)
    n, dims, order = int(rng.integers(2, 13)), int(rng.integers(1, 4)), int(rng.integers(2, 5))
    size = 10 ** rng.uniform(-2, 2)
    points = size * rng.normal(size=(n, dims))
    lower, upper = bounds(n, dims, *(size * 10 ** rng.uniform(-0.5, 1, 3)))
    start, end = rest(order, dims), rest(order, dims)
    kind = ("rest", "positions", "moving", "segments", "weighed")[int(rng.integers(5))]
    if kind == "positions":
        room = 0.05 * np.ptp(points)
        lower[0], upper[0] = points.min(axis=0) - room, points.max(axis=0) + room
    elif kind == "moving":
        start[0], end[0] = upper[1, 0] * rng.uniform(-0.7, 0.7, (2, dims))
    elif kind == "segments":
        upper[1] *= rng.uniform(0.3, 1, (n - 1, 1))
        lower[2] *= 0.5
    weight = size**2 * 10 ** rng.uniform(-2, 2) if kind == "weighed" else None
    found = optimal_times_within(points, order, start, end, lower, upper, weight)
    rates, positions = excess(points, found, lower, upper)
    assert rates <= 0 and positions <= 0
    if kind in ("rest", "segments"):
        free = optimal_times(points, order, start, end, 1.0)
        assert found.h.sum() <= slowed(points, free, lower, upper) * (1 + 1e-9)
    if kind == "weighed":
        made = motion(points, found)
        assert made.squared_integral(order) + weight * made.duration == pytest.approx(found.cost, rel=1e-8)
        free = optimal_times(points, order, start, end, weight)
        assert found.cost >= free.cost * (1 - 1e-9)


def test_durations_within_limits():
    points, order = walk(1, 5, 2), 3
    ends = rest(3, 2), rest(3, 2)
    lower, upper = bounds(5, 2, 2.0, 5.0, 20.0)
    best = optimal_times_within(points, order, *ends, lower, upper, None)
    total = best.h.sum()
    segments = [DurationBounds(0.0, 3 * total), DurationBounds(1.1 * best.h[1], 2 * best.h[1]), None, None]
    longer = DurationBounds(1.2 * total, 1.2 * total)
    for duration, own in ((longer, None), (None, segments), (longer, segments)):
        for weight in (None, 1.0):
            found = optimal_times_within(points, order, *ends, lower, upper, weight, duration, own)
            assert max(excess(points, found, lower, upper)) <= 0
            assert duration is None or found.h.sum() == pytest.approx(1.2 * total, rel=1e-9)
            assert own is None or 1.1 * best.h[1] <= found.h[1] <= 2 * best.h[1]


def test_weighed_within_limits_against_ipopt():
    points = walk(4, 6, 2)
    ends = rest(3, 2), rest(3, 2)
    lower, upper = bounds(6, 2, 1.0, 1.5, 6.0)
    found = optimal_times_within(points, 3, *ends, lower, upper, 50.0)
    other = optimal_times_within(points, 3, *ends, lower, upper, 50.0, backend="ipopt")
    assert found.cost == pytest.approx(other.cost, rel=5e-3)
