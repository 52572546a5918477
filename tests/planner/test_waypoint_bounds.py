"""The lower bound through waypoints: closed forms, scaling, symmetry, and never above what is feasible."""

import itertools
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import ruckig

from planner import PlanRequest, plan
from planner.limits import segment_bounds
from planner.waypoints.bounds import LeastRuns
from problems.rest_to_rest import double_integrator, triple_integrator

CASES = json.loads((Path(__file__).parent.parent / "data" / "waypoints.json").read_text())["cases"]


def runs(waypoints, velocity, acceleration, jerk, **given):
    """Evidence with limits that are numbers, one per joint, or pairs (lower, upper) of such."""
    points = np.asarray(waypoints, dtype=float)
    points = points.reshape(len(points), -1)
    sides = [x if isinstance(x, tuple) else (-np.asarray(x), x) for x in (velocity, acceleration, jerk)]
    shape = len(points) - 1, points.shape[1]
    lower, upper = (np.array([np.broadcast_to(np.float64(s[k]), shape) for s in sides]) for k in (0, 1))
    given = {"least": np.zeros(shape[0]), "floor": 0.0, "rests": (True, True)} | given
    return LeastRuns(points, lower, upper, **given)


def bound(*args, **given):
    return runs(*args, **given).lower_bound()


def random_runs(rng, count=None, dims=None, varying=False):
    """Random waypoints, on a coarse grid so that joints repeat positions, and asymmetric limits."""
    count, dims = count or rng.integers(2, 9), dims or rng.integers(1, 4)
    points = rng.integers(-4, 5, (count, dims)) * rng.choice([0.05, 0.3, 1.0])
    shape = 3, count - 1 if varying else 1, dims
    scale = np.array([1.0, rng.uniform(1, 5), rng.uniform(3, 60)])[:, None, None]
    lower, upper = (np.broadcast_to(scale * rng.uniform(0.4, 1, shape), (3, count - 1, dims)) for _ in range(2))
    rests = bool(rng.integers(2)), bool(rng.integers(2))
    return LeastRuns(points, -lower, upper, rng.uniform(0, 0.3, count - 1), 0.0, rests)


def ruckig_duration(start, end, limits):
    """Return the shortest duration of one joint between states (position, velocity, acceleration)."""
    (low_v, high_v), (low_a, high_a), jerk = limits
    given = ruckig.InputParameter(1)
    given.current_position, given.current_velocity, given.current_acceleration = ([x] for x in start)
    given.target_position, given.target_velocity, given.target_acceleration = ([x] for x in end)
    given.min_velocity, given.max_velocity = [low_v], [high_v]
    given.min_acceleration, given.max_acceleration, given.max_jerk = [low_a], [high_a], [jerk]
    found = ruckig.Trajectory(1)
    result = ruckig.Ruckig(1).calculate(given, found)
    return found.duration if result in (ruckig.Result.Working, ruckig.Result.Finished) else np.inf


def best_on_grid(points, limits, parts=9, start=(0.0, 0.0), end=(0.0, 0.0)):
    """Return the least duration over velocities and accelerations on a grid at the inner waypoints.

    The grid has both limits and 0 of each, but for states which lead beyond the velocity limits.
    """
    (low_v, high_v), (low_a, high_a), jerk = limits
    axes = [
        np.concatenate([np.linspace(low, 0, parts // 2 + 1), np.linspace(0, high, parts // 2 + 1)[1:]])
        for low, high in ((low_v, high_v), (low_a, high_a))
    ]
    inner = [
        (v, a) for v, a in itertools.product(*axes) if low_v <= v - a * a / 2 / jerk <= v + a * a / 2 / jerk <= high_v
    ]
    before = {start: 0.0}
    for i in range(1, len(points)):
        last = i == len(points) - 1
        states = [end] if last else inner
        before = {
            state: min(
                so_far + ruckig_duration((points[i - 1], *old), (points[i], *state), limits)
                for old, so_far in before.items()
                if np.isfinite(so_far)
            )
            for state in states
        }
    return before[end]


def test_rest_to_rest_is_the_closed_form():
    rng = np.random.default_rng(1)
    for _ in range(200):
        d, v, a, j = 10.0 ** rng.uniform(-3, 1, 4)
        assert bound([0, d], v, a, j) == pytest.approx(float(triple_integrator(d, v, a, j)), rel=1e-11)
        assert bound([0, -d], v, a, np.inf) == pytest.approx(float(double_integrator(d, v, a, a)), rel=1e-11)
        assert bound([0, d], v, np.inf, np.inf) == pytest.approx(d / v, rel=1e-11)
        assert bound([0, d], v, np.inf, j) == pytest.approx(float(triple_integrator(d, v, 1e9 * j, j)), rel=1e-7)
        assert bound([0, d], np.inf, a, j) == pytest.approx(float(triple_integrator(d, 1e9, a, j)), rel=1e-7)
    assert bound([0, 1], np.inf, np.inf, np.inf) == 0.0


def test_rest_to_rest_with_asymmetric_limits_is_ruckigs():
    rng = np.random.default_rng(2)
    for _ in range(200):
        low_v, high_v, low_a, high_a, j = 10.0 ** rng.uniform(-1, 1, 5)
        d = rng.choice([-1, 1]) * 10.0 ** rng.uniform(-3, 1)
        exact = ruckig_duration((0, 0, 0), (d, 0, 0), ((-low_v, high_v), (-low_a, high_a), j))
        assert bound([0, d], (-low_v, high_v), (-low_a, high_a), j) == pytest.approx(exact, rel=1e-9)


def test_from_turn_to_turn_it_is_the_cubic_of_a_constant_jerk():
    # 0.6 between two turns: jerk alone gives 0.9 s with an acceleration of 4.5 at either end.
    jerk = 10.0
    four, two = (bound(points, 100, 100, jerk) for points in ([0, 1, 0.4, 1.4], [0, 1, 0]))
    assert four - two == pytest.approx((12 * 0.6 / jerk) ** (1 / 3), rel=1e-9)
    # With acceleration 2 each half is v² / 2a + v a / 2j - a³ / 24j² long and takes v / a + a / 2j.
    top = np.roots([1 / 4, 2 / 20, -(2**3) / 2400 - 0.3]).max()
    four, two = (bound(points, 100, 2, jerk) for points in ([0, 1, 0.4, 1.4], [0, 1, 0]))
    assert four - two == pytest.approx(2 * (top / 2 + 2 / 20), rel=1e-9)


def test_from_rest_to_a_turn_the_jerk_changes_sign_once():
    # v = j t² / 2 until t1, then j (2 t1 t - t² / 2 - t1²), which is 0 at T = (2 + sqrt 2) t1.
    jerk, first = 10.0, 0.3
    last = (2 + np.sqrt(2)) * first
    falling = np.polynomial.Polynomial([0, -(first**2), first, -1 / 6])
    distance = jerk * (first**3 / 6 + falling(last) - falling(first))
    assert bound([0, distance, 0], 100, 100, jerk) == pytest.approx(2 * last, rel=1e-9)


def test_a_moving_end_may_pass_in_any_state():
    assert bound([0, 1], 2, 100, 1000, rests=(False, False)) == pytest.approx(0.5)
    # Up to v = 2 with a = 4 takes 1 m; jerk of the moving side is not counted on, as nothing is known beyond the end.
    assert bound([0, 0.5, 0], 2, 4, np.inf, rests=(False, False)) == pytest.approx(2 * np.sqrt(2 * 0.5 / 4))
    assert bound([0, 0.7], 10, 1e6, 9.0, rests=(True, False)) == pytest.approx((6 * 0.7 / 9) ** (1 / 3))
    assert bound([0, 1.7], 2, 4, np.inf, rests=(True, False)) == pytest.approx(1.7 / 2 + 2 / 4 / 2)


def test_least_durations_and_floor_count():
    points, limits = [[0, 0], [1, 0], [1, 1]], (1, 1e6, np.inf)
    assert bound(points, *limits) == pytest.approx(2, rel=1e-2)
    assert bound(points, *limits, least=np.array([3.0, 0])) == pytest.approx(4, rel=1e-2)
    assert bound(points, *limits, floor=7.5) == 7.5
    assert bound([[1, 2], [1, 2]], *limits) == 0.0
    still = bound([[1, 2], [1, 3]], (-np.array([np.inf, 1]), np.array([np.inf, 1])), np.inf, np.inf)
    assert still == pytest.approx(1)


def test_it_is_at_least_the_velocity_bound_and_the_slowest_joint():
    for seed in range(60):
        e = random_runs(np.random.default_rng(seed), count=12, varying=bool(seed % 2))
        value = e.lower_bound()
        step = np.diff(e.waypoints, axis=0)
        seconds = np.where(step > 0, step / e.upper[0], step / e.lower[0]).max(axis=1)
        assert value >= (1 - 1e-11) * np.maximum(seconds, e.least).sum()
        for d in range(e.waypoints.shape[1]):
            alone = replace(e, waypoints=e.waypoints[:, [d]], lower=e.lower[:, :, [d]], upper=e.upper[:, :, [d]])
            assert value >= (1 - 1e-11) * replace(alone, least=0 * e.least).lower_bound()


def test_scaling_laws():
    for seed in range(60):
        e = random_runs(np.random.default_rng(seed), varying=bool(seed % 2))
        value = e.lower_bound()
        scaled = replace(e, waypoints=7 * e.waypoints, lower=7 * e.lower, upper=7 * e.upper)
        assert scaled.lower_bound() == pytest.approx(value, rel=1e-10)
        rates = 3.0 ** -np.arange(1, 4)[:, None, None]
        slower = replace(e, lower=rates * e.lower, upper=rates * e.upper, least=3 * e.least)
        assert slower.lower_bound() == pytest.approx(3 * value, rel=1e-10)


def test_symmetries():
    for seed in range(60):
        e = random_runs(np.random.default_rng(seed), varying=bool(seed % 2))
        value = e.lower_bound()
        mirrored = replace(e, waypoints=-e.waypoints, lower=-e.upper, upper=-e.lower)
        assert mirrored.lower_bound() == pytest.approx(value, rel=1e-11)
        # Backwards in time the velocity and the jerk change sign, the acceleration does not.
        swapped = np.array([True, False, True])[:, None, None]
        lower, upper = (
            x[:, ::-1] for x in (np.where(swapped, -e.upper, e.lower), np.where(swapped, -e.lower, e.upper))
        )
        back = LeastRuns(e.waypoints[::-1], lower, upper, e.least[::-1], 0.0, e.rests[::-1])
        assert back.lower_bound() == pytest.approx(value, rel=1e-10)


def test_it_grows_with_the_distance_and_falls_with_the_limits():
    for seed in range(60):
        rng = np.random.default_rng(seed)
        e = random_runs(rng, varying=bool(seed % 2))
        value = e.lower_bound()
        wider = replace(
            e, lower=e.lower * rng.uniform(1, 2, e.lower.shape), upper=e.upper * rng.uniform(1, 2, e.lower.shape)
        )
        assert wider.lower_bound() <= value * (1 + 1e-11) or not seed % 2  # limits that differ lose the states beyond
        assert replace(e, waypoints=1.3 * e.waypoints).lower_bound() >= value * (1 - 1e-11)
        assert replace(e, rests=(False, False)).lower_bound() <= value * (1 + 1e-11)


@pytest.mark.parametrize(
    "points", [[0, 1, 0], [0, 0.3, 1], [0, 1, 0.2, 1.5], [0, 0.6, 0.5], [0, 0.05, 0], [0, 0.2, 1, 0.4]]
)
@pytest.mark.parametrize("limits", [((-1, 1), (-2, 2), 10.0), ((-0.5, 0.8), (-1.5, 3), 20.0)])
def test_one_joint_is_close_to_the_best_on_a_grid(points, limits):
    best, value = best_on_grid(points, limits), bound(points, *limits[:2], limits[2])
    print(points, value / best)
    assert 0.95 * best <= value <= best * (1 + 1e-9)


def random_ends(rng):
    """Random limits and two states (velocity, acceleration) which stay within them."""
    low_v, high_v, low_a, high_a = rng.uniform(0.3, 2, 4)
    jerk = rng.uniform(1, 20)
    ends = []
    while len(ends) < 2:
        v, a = rng.uniform(-low_v, high_v), rng.uniform(-low_a, high_a) * rng.integers(2)
        if -low_v <= v - a * a / 2 / jerk <= v + a * a / 2 / jerk <= high_v:
            ends.append((v, a))
    return ((-low_v, high_v), (-low_a, high_a), jerk), *ends


def test_between_moving_ends_it_is_below_ruckigs_duration():
    ratios = []
    for seed in range(400):
        rng = np.random.default_rng(seed)
        limits, start, end = random_ends(rng)
        d = rng.uniform(-2, 2)
        states = np.array([start, end])[:, :, None]
        exact = ruckig_duration((0, *start), (d, *end), limits)
        value = bound([0, d], *limits[:2], limits[2], rests=(False, False), states=states)
        assert value <= exact * (1 + 1e-9), seed
        ratios.append(value / exact)
        half = bound([0, d], *limits[:2], limits[2], rests=(False, True), states=states)
        exact = ruckig_duration((0, *start), (d, 0, 0), limits)
        assert half <= exact * (1 + 1e-9), seed
    assert np.median(ratios) > 0.7


@pytest.mark.parametrize("seed", range(24))
def test_from_moving_ends_it_is_close_to_the_best_on_a_grid(seed):
    rng = np.random.default_rng(seed)
    limits, start, end = random_ends(rng)
    points = rng.uniform(-1.5, 1.5, 3)
    states = np.array([start, end])[:, :, None]
    value = bound(points, *limits[:2], limits[2], rests=(False, False), states=states)
    best = best_on_grid(points, limits, 9, start, end)
    print(points, value / best)
    assert value <= best * (1 + 1e-9)


@pytest.mark.parametrize("case", CASES, ids=[c["name"] for c in CASES])
def test_it_is_below_the_best_known(case):
    body = {k: v for k, v in case["request"].items() if k != "method"}
    request = PlanRequest.of(body.pop("waypoints"), **body)
    shape = request.count - 1, request.dims
    limits = [segment_bounds(request.limits, request.segment_limits, k, *shape) for k in (1, 2, 3)]
    lower, upper = (np.array([np.broadcast_to(getattr(x, side), shape) for x in limits]) for side in ("lower", "upper"))
    least = [0.0 if d is None else d.min for d in request.segment_durations or [None] * shape[0]]
    ends = [
        (np.zeros(request.dims) if x is None else x for x in (e.velocity, e.acceleration))
        for e in (request.start, request.end)
    ]
    states = np.array([list(e) for e in ends])
    evidence = LeastRuns(request.waypoints, lower, upper, np.array(least), 0.0, (False, False), states)
    best = case["reference"]["best_known"]
    assert 0.8 * best <= evidence.lower_bound() <= best
    without = replace(evidence, states=None)
    assert without.lower_bound() <= evidence.lower_bound() * (1 + 1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_it_is_never_above_a_stop_plan(seed):
    for k in range(10 * seed, 10 * seed + 10):
        e = random_runs(np.random.default_rng(k), varying=bool(k % 2))
        keep = np.append(True, (np.diff(e.waypoints, axis=0) != 0).any(axis=1))  # a stop plan wants each to differ
        if keep.sum() < 2:
            continue
        print("seed", k)
        inner = keep[1:]
        e = LeastRuns(e.waypoints[keep], e.lower[:, inner], e.upper[:, inner], e.least[inner], 0.0, e.rests)
        upper = e.upper.copy()
        upper[2] = np.minimum(-e.lower[2], upper[2])  # ruckig takes no other jerk
        lower = np.stack([e.lower[0], e.lower[1], -upper[2]])
        names = "velocity", "acceleration", "jerk"
        whole, *each = (
            {n: {"lower": lo[i].tolist(), "upper": up[i].tolist()} for i, n in enumerate(names)}
            for lo, up in [
                (lower.min(axis=1), upper.max(axis=1)),
                *zip(lower.swapaxes(0, 1), upper.swapaxes(0, 1), strict=True),
            ]
        )
        durations = [{"min": t} for t in e.least]
        request = PlanRequest.of(e.waypoints, limits=whole, segment_limits=each, segment_durations=durations)
        assert e.lower_bound() <= plan(request, "ruckig").trajectory.duration * (1 + 1e-9)
