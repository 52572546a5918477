"""Minimum jerk in boxes around waypoints, in tubes, under the norm of the velocity, with given and periodic states."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner import Infeasible, PlannerError, PlanRequest, plan

SEEDS = st.integers(0, 2**32 - 1)
ORDERS = pytest.mark.parametrize("order", [2, 3, 4])


def made(seed, dims=None, closed=False):
    rng = np.random.default_rng(seed)
    n, dims = int(rng.integers(3, 9)), dims or int(rng.integers(1, 5))
    points, times = rng.normal(size=(n, dims)), np.cumsum(10 ** rng.uniform(-0.3, 0.3, n))
    if closed:
        points[-1] = points[0]
    return points, times, rng


def solved(points, times, options=None, **body):
    return plan(PlanRequest.of(points, times=times, **body), "minimum_jerk", options or {})


def row(done, quantity):
    return next(c for c in done.certificate.checks if c.quantity == quantity)


def cost(done):
    return done.certificate.objective.value


@given(SEEDS, st.integers(2, 4))
def test_wider_boxes_are_kept_used_and_cheaper(seed, order):
    points, times, rng = made(seed)
    before = cost(solved(points, times, {"order": order}))
    for width in (1e-3, 1e-1):
        each = width * rng.uniform(0.5, 1, points.shape[1])
        done = solved(points, times, {"order": order}, waypoint_tolerance=each)
        missed = np.abs(done.trajectory(times) - points)
        assert (missed[1:-1] <= each).all() and missed[[0, -1]].max() <= 1e-9
        found = row(done, "waypoint_tolerance")
        assert found.holds and found.value == pytest.approx(missed[1:-1][:, found.joint].max(), abs=1e-12)
        assert found.ratio >= 1 - 1e-5  # a box that is not used up somewhere would not help
        assert cost(done) <= before * (1 + 1e-9) and done.certificate.objective.gap <= 1e-5
        before = cost(done)


@pytest.mark.parametrize("dims", [1, 2, 3, 4])
@pytest.mark.parametrize("seed", range(2))
def test_narrower_tubes_are_kept_and_cost_more(seed, dims):
    points, times, _ = made(10 * seed + dims, dims)
    before = cost(solved(points, times))
    for width in (0.5, 0.2, 0.1):
        done = solved(points, times, {"sub_segments": 4}, tube=width)
        found = row(done, "tube")
        assert found.holds and found.ratio <= 1
        if width < 0.5:
            assert cost(done) >= before * (1 - 1e-6)
        before = cost(done)
        at = np.linspace(times[0], times[-1], 400)
        where = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
        offset, step = done.trajectory(at) - points[where], np.diff(points, axis=0)[where]
        s = np.linspace(0, 1, 2001)[:, None, None]  # some point of the line has all joints within the width
        away = np.abs(offset - s * step).max(axis=2).min(axis=0)
        assert away.max() <= width + np.abs(step).max() / 2000


@ORDERS
@pytest.mark.parametrize("seed", range(3))
def test_boxes_agree_with_the_reference(seed, order, sampled):
    points, times, _ = made(seed, 2)
    done = solved(points, times, {"order": order}, waypoint_tolerance=0.1)
    states = np.full((order, *points.shape), np.nan)
    states[:, [0, -1]] = 0.0
    states[0, [0, -1]] = points[[0, -1]]
    reference = sampled(times, states)
    for d in range(2):
        gap = np.arange(1, len(times) - 1)
        middle = np.concatenate([[0.0], points[1:-1, d]])
        box = (middle - 0.1, middle + 0.1)
        reference.limit(0, np.eye(2)[d], *box, at=(gap, np.zeros(len(gap))))
    assert cost(done) == pytest.approx(reference.minimum(), rel=1e-6)


@ORDERS
@pytest.mark.parametrize("dims", [1, 2, 3])
def test_the_norm_is_kept_cheaply(order, dims, sampled):
    """Above the program with cones at many samples, close to it, and below that with boxes inscribed in the ball."""
    points, times, _ = made(10 * order + dims, dims)
    free = solved(points, times, {"order": order})
    speed = np.linalg.norm(free.trajectory(np.linspace(times[0], times[-1], 3000), 1), axis=1).max()
    bound = 0.93 * speed
    done = solved(points, times, {"order": order, "sub_segments": 2}, limits={"velocity_norm": bound})
    found = row(done, "velocity_norm")
    assert found.holds and found.ratio <= 1
    at = np.linspace(times[0], times[-1], 5000)
    assert np.linalg.norm(done.trajectory(at, 1), axis=1).max() <= bound * (1 + 1e-9)
    assert done.certificate.objective.gap <= 1e-6
    states = np.full((order, 2 * len(times) - 1, dims), np.nan)
    states[0, ::2] = points
    states[1:, [0, -1]] = 0.0
    nodes = np.sort(np.concatenate([times, 0.5 * (times[1:] + times[:-1])]))
    reference = sampled(nodes, states)
    reference.norm(bound, samples=40)
    below = reference.minimum()
    assert below <= cost(done) * (1 + 1e-7) and cost(done) <= below * (1 + 1e-2)
    try:
        boxed = solved(points, times, {"order": order, "sub_segments": 2}, limits={"velocity": bound / np.sqrt(dims)})
    except Infeasible:
        return
    assert cost(done) <= cost(boxed) * (1 + 1e-7)


@given(SEEDS, st.integers(2, 4), st.sampled_from(["fixed", "free", "periodic"]))
def test_given_states_are_hit_and_the_rest_is_optimal(sampled, seed, order, ends):
    points, times, rng = made(seed, closed=ends == "periodic")
    n, dims = points.shape
    states = [None] * n
    given_at = np.full((order, n, dims), np.nan)
    for i in range(1, n - 1):
        if rng.random() < 0.5:
            velocity = [None if rng.random() < 0.3 else float(x) for x in rng.normal(size=dims)]
            states[i] = {"velocity": velocity}
            given_at[1, i] = [np.nan if v is None else v for v in velocity]
            if order > 2 and rng.random() < 0.5:
                states[i]["acceleration"] = rng.normal(size=dims).tolist()
                given_at[2, i] = states[i]["acceleration"]
    body = {"waypoint_states": states} if any(s for s in states) else {}
    done = solved(points, times, {"order": order, "ends": ends}, **body)
    for r in (1, 2):
        found = done.trajectory(times, r)[~np.isnan(given_at[min(r, order - 1)])] if r < order else np.zeros(0)
        asked = given_at[min(r, order - 1)][~np.isnan(given_at[min(r, order - 1)])] if r < order else np.zeros(0)
        np.testing.assert_allclose(found, asked, atol=1e-8 * (1 + np.abs(done.trajectory.coefficients).max()))
    given_at[0] = points
    if ends == "fixed":
        given_at[1:, [0, -1]] = 0.0
    reference = sampled(times, given_at, ends == "periodic").minimum()
    assert cost(done) == pytest.approx(reference, rel=1e-6, abs=1e-5)


@ORDERS
def test_a_closed_curve_meets_itself(order):
    """Without limits up to the derivative 2k - 2, whatever waypoint it starts at; with them, up to k - 1."""
    points, times, _ = made(order, 2, closed=True)
    done = solved(points, times, {"order": order, "ends": "periodic"})
    motion, span = done.trajectory, times[-1] - times[0]
    for r in range(2 * order - 1):
        size = np.abs(motion(np.linspace(times[0], times[-1], 200), r)).max()
        np.testing.assert_allclose(motion(times[0], r), motion(times[-1], r), atol=1e-7 * size)
    turned = np.concatenate([points[2:-1], points[:3]])
    clock = np.concatenate([times[2:-1], times[:3] + span])
    assert cost(solved(turned, clock, {"order": order, "ends": "periodic"})) == pytest.approx(cost(done), rel=1e-9)
    peaks = motion.extrema(3)
    limits = {"velocity": peaks.peak(1) * 0.95}
    tight = solved(points, times, {"order": order, "ends": "periodic"}, limits=limits)
    assert tight.certificate.holds and row(tight, "velocity").ratio <= 1 and cost(tight) > cost(done)
    for r in range(order):
        size = np.abs(tight.trajectory(np.linspace(times[0], times[-1], 200), r)).max()
        np.testing.assert_allclose(tight.trajectory(times[0], r), tight.trajectory(times[-1], r), atol=1e-9 * size)


@given(SEEDS, st.integers(2, 4))
def test_free_ends_are_natural(seed, order):
    """Derivatives k … 2k - 2 vanish at both ends; cheaper than any ends that are given."""
    points, times, rng = made(seed)
    if len(points) < order:
        return
    done = solved(points, times, {"order": order, "ends": "free"})
    at = np.linspace(times[0], times[-1], 300)
    for r in range(order, 2 * order - 1):
        size = np.abs(done.trajectory(at, r)).max()
        for end in (times[0], times[-1]):
            assert np.abs(done.trajectory(end, r)).max() <= 1e-6 * size + 1e-6
    ends = {s: {"velocity": rng.normal(size=points.shape[1])} for s in ("start", "end")}
    assert cost(done) <= cost(solved(points, times, {"order": order}, **ends)) * (1 + 1e-9)


@ORDERS
def test_more_polynomials_per_gap_cost_no_more(order):
    """Inside limits; without them the one polynomial is the optimum already."""
    points, times, _ = made(order + 20, 2)
    free = [cost(solved(points, times, {"order": order, "sub_segments": n})) for n in (1, 2, 3, 5)]
    np.testing.assert_allclose(free, free[0], rtol=1e-8)
    peaks = solved(points, times, {"order": order}).trajectory.extrema(3)
    limits = {"velocity": peaks.peak(1) * 0.93, "acceleration": peaks.peak(2) * 1.1}
    costs = []
    for n in (1, 2, 4, 8):
        try:
            costs.append(cost(solved(points, times, {"order": order, "sub_segments": n}, limits=limits)))
        except Infeasible:
            assert not costs
    assert len(costs) >= 3 and (np.diff(costs) <= 1e-7 * costs[0]).all()


def test_gaps_are_divided_only_where_that_is_needed():
    body = {"limits": {"velocity": 1.5}}
    done = solved([0, 1, 0, 1], [0, 1, 2, 3], **body)
    assert "sub_segments_used" in [n.code for n in done.notes] and row(done, "velocity").ratio <= 1
    with pytest.raises(Infeasible, match="one polynomial per gap") as caught:
        solved([0, 1, 0, 1], [0, 1, 2, 3], {"sub_segments": 1}, **body)
    assert caught.value.certified
    parts = done.trajectory.pieces // 3
    same = solved([0, 1, 0, 1], [0, 1, 2, 3], {"sub_segments": parts}, **body)
    assert not same.notes and cost(same) == pytest.approx(cost(done), rel=1e-9)


@pytest.mark.parametrize("order", [2, 3, 4])
def test_accelerations_at_waypoints_are_hit_or_refused(order):
    """Order 2 has none that could be given: that is the caller's to hear, not a failure of ours."""
    states = [None, {"acceleration": [0.5]}, None]
    try:
        done = solved([0, 1, 0.5], [0, 1, 2], {"order": order}, waypoint_states=states)
    except PlannerError as error:
        assert error.code == "unsupported" and order == 2
        return
    assert done.trajectory(1.0, 2)[0] == pytest.approx(0.5)
