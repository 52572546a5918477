"""The fastest motion through waypoints: references, random problems against stops at each waypoint, hard kinds.

Its options, durations and states at waypoints: test_waypoint_options.py.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from planner import Infeasible, InvalidRequest, PlanRequest, TimeLimit, Unsupported, plan
from planner.errors import PlannerError
from planner.limits import QUANTITIES

METHOD = "time_optimal_waypoints"
CASES = json.loads((Path(__file__).parent.parent / "data" / "waypoints.json").read_text())["cases"]
NAMES = [c["name"] for c in CASES]
LIMITS = {"velocity": 1.0, "acceleration": 2.0, "jerk": 10.0}
SOLVERS = ("interior_point", "stop_plan")


def request_of(body):
    body = {k: v for k, v in body.items() if k not in ("method", "options")}
    return PlanRequest.of(body.pop("waypoints"), **body)


def fastest(request, **options):
    """Return the plan once everything that holds for every answer was checked."""
    done = plan(request, METHOD, options)
    found, t = done.certificate, done.trajectory
    assert found.holds and found.continuity in (None, 2, 3)
    assert found.waypoint_error <= 1e-9 and found.boundary_error <= 1e-9
    for check in found.checks:
        if check.quantity in QUANTITIES[1:]:
            assert check.ratio <= 1 + 1e-12, check
    assert {q for q in QUANTITIES if getattr(request.limits, q) is not None} <= {c.quantity for c in found.checks}
    assert isinstance(found.path_deviation, float) and found.path_deviation >= 0
    assert found.objective.name == "duration" and found.objective.value == t.duration
    assert 0 <= found.objective.lower_bound <= t.duration * (1 + 1e-12)
    assert found.objective.bound_scope == ("method" if options.get("straight") else "all")
    assert done.stats.name in SOLVERS and done.waypoint_times[0] == t.start == 0
    assert done.waypoint_times[-1] == pytest.approx(t.end, rel=1e-15) and (np.diff(done.waypoint_times) >= 0).all()
    times = np.linspace(t.start, t.end, 301)  # once more, by samples
    for order, quantity in enumerate(QUANTITIES):
        limit = getattr(request.limits, quantity)
        if limit is not None:
            room = 1e-9 * np.maximum(1.0, np.abs(np.nan_to_num(limit.upper, posinf=0))) if order == 0 else 0
            assert (t(times, order) <= limit.upper + 1e-11 * np.abs(limit.upper) + room).all()
            assert (t(times, order) >= limit.lower - 1e-11 * np.abs(limit.lower) - room).all()
    for order in (0, 1, 2):
        assert (np.abs(t.jumps(order)) <= 1e-9 * np.maximum(t.extrema(4).peak(order), 1e-300)).all()
    return done


def duration(request, **options):
    return fastest(request, **options).trajectory.duration


def stopping(request):
    return plan(request, "ruckig").trajectory.duration


# -- references --------------------------------------------------------------------------------------------------------

RATIOS: dict[str, float] = {}


@pytest.mark.parametrize("case", CASES, ids=NAMES)
def test_near_the_best_known(case):
    reference = case["reference"]
    request = request_of(case["request"])
    seconds = duration(request)
    RATIOS[case["name"]] = seconds / reference["best_known"]
    print(case["name"], RATIOS[case["name"]])
    assert seconds <= 1.004 * reference["best_known"]
    assert seconds <= reference["stop_at_waypoints"] * (1 + 1e-12)
    if "ruckig_pro" in reference:
        assert seconds < reference["ruckig_pro"]
        assert duration(request, effort="fast") < reference["ruckig_pro"]


def test_the_median_is_nearer():
    for case in CASES:
        if case["name"] not in RATIOS:
            made = plan(request_of(case["request"]), METHOD)
            RATIOS[case["name"]] = made.trajectory.duration / case["reference"]["best_known"]
    assert np.median([RATIOS[name] for name in NAMES]) <= 1.0015


@pytest.mark.parametrize("case", CASES, ids=NAMES)
def test_best_effort(case):
    seconds = duration(request_of(case["request"]), effort="best")
    print(case["name"], seconds / case["reference"]["best_known"])
    assert seconds <= 1.0007 * case["reference"]["best_known"]


@pytest.mark.parametrize("name", ["ruckig_ex03", "d3_rand_5wp", "panda7_boundary_5wp", "d3_poslimits_5wp"])
def test_more_effort_is_no_worse(name):
    """Up to local optima: each effort begins anew, with pieces of its own."""
    request = request_of(next(c for c in CASES if c["name"] == name)["request"])
    fast, default, best = (duration(request, effort=e) for e in ("fast", "default", "best"))
    print(name, fast, default, best)
    assert best <= default * (1 + 5e-4) and default <= fast * (1 + 5e-4)


# -- random problems ---------------------------------------------------------------------------------------------------


def random_body(seed):
    """A request whose joints have sizes and limits of their own; half move at both ends, a third asymmetric."""
    rng = np.random.default_rng(seed)
    dims, n = int(rng.integers(1, 8)), int(rng.integers(2, 10))
    size = 10 ** rng.uniform(-0.75, 0.75, dims) * (10 ** rng.uniform(-3, 3) if seed % 5 == 0 else 1.0)
    points = rng.uniform(-1, 1, (n, dims)) * size
    if rng.random() < 0.15:
        points = np.cumsum(np.abs(points), 0)
    v = size * 10 ** rng.uniform(-0.3, 0.3, dims)
    a = v * 10 ** rng.uniform(0, 0.8, dims)
    j = a * 10 ** rng.uniform(0.2, 1.3, dims)
    low_v, low_a, low_j = -v, -a, -j
    if rng.random() < 0.3:
        low_v, low_a = -v * rng.uniform(0.4, 1, dims), -a * rng.uniform(0.4, 1, dims)
        low_j = -j * rng.uniform(0.5, 1, dims)
    sides = {"velocity": (low_v, v), "acceleration": (low_a, a), "jerk": (low_j, j)}
    limits = {q: {"lower": low.tolist(), "upper": high.tolist()} for q, (low, high) in sides.items()}
    body = {"waypoints": points.tolist(), "limits": limits}
    if seed % 2:
        for side in ("start", "end"):
            velocity = rng.uniform(0.8 * low_v, 0.8 * v)
            most = 0.95 * np.sqrt(2 * -low_j * np.minimum(v - velocity, velocity - low_v))
            acceleration = np.clip(rng.uniform(0.8 * low_a, 0.8 * a), -most, most)
            body[side] = {"velocity": velocity.tolist(), "acceleration": acceleration.tolist()}
    return body


def judge(seed):
    print("seed", seed)
    request = request_of(random_body(seed))
    try:
        stops = stopping(request)
    except Infeasible:
        stops = None
    try:
        done = fastest(request)
    except Infeasible as error:
        assert stops is None, error
        return
    if stops is not None:
        assert done.trajectory.duration <= stops * (1 + 1e-12)
    again = plan(request, METHOD)
    assert again.trajectory.coefficients.tobytes() == done.trajectory.coefficients.tobytes()
    assert again.trajectory.breaks.tobytes() == done.trajectory.breaks.tobytes()
    assert again.waypoint_times.tobytes() == done.waypoint_times.tobytes()


@pytest.mark.parametrize("seed", range(40))
def test_random_problems(seed):
    judge(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1000, 1400))
def test_more_random_problems(seed):
    judge(seed)


# -- hard kinds --------------------------------------------------------------------------------------------------------


def random_points(seed, n, dims):
    return np.random.default_rng(seed).uniform(-1, 1, (n, dims))


def test_one_waypoint_in_a_row_by_hand():
    """Through a waypoint on the way there is no stop: the same as without it."""
    alone = duration(PlanRequest.of([[0.0], [3.0]], limits=LIMITS))
    assert alone == pytest.approx(3 / 1 + 1 / 2 + 2 / 10, rel=1e-6)
    for between in ([1.0], [1.5], [1.0, 2.0], [0.1, 0.2, 2.9]):
        request = PlanRequest.of([[0.0], *([x] for x in between), [3.0]], limits=LIMITS)
        assert alone * (1 - 1e-9) <= duration(request) <= alone * 1.001


@pytest.mark.parametrize("seed", range(12))
def test_from_rest_to_rest_it_is_ruckigs_optimum(seed):
    rng = np.random.default_rng(seed)
    dims = int(rng.integers(1, 8))
    limits = {"velocity": rng.uniform(0.3, 2, dims), "acceleration": rng.uniform(0.5, 6, dims)}
    request = PlanRequest.of(rng.uniform(-2, 2, (2, dims)), limits=limits | {"jerk": rng.uniform(2, 60, dims)})
    best = stopping(request)
    assert best * (1 - 1e-3) <= duration(request) <= best * (1 + 1e-12)


@pytest.mark.parametrize("seed", range(1, 25, 2))
def test_between_moving_states_it_is_no_longer_than_ruckig(seed):
    body = random_body(seed)
    body["waypoints"] = body["waypoints"][:2]
    request = request_of(body)
    assert duration(request) <= stopping(request) * (1 + 1e-12)


def test_duplicates_are_passed_at_once():
    points = random_points(1, 6, 3)
    plain = fastest(PlanRequest.of(points, limits=LIMITS))
    doubled = fastest(PlanRequest.of(np.repeat(points, [1, 2, 1, 3, 1, 2], axis=0), limits=LIMITS))
    assert doubled.trajectory.duration == pytest.approx(plain.trajectory.duration, rel=1e-9)
    assert (doubled.waypoint_times == np.repeat(plain.waypoint_times, [1, 2, 1, 3, 1, 2])).all()
    assert "waypoints_merged" in {n.code for n in doubled.notes}


@pytest.mark.parametrize("seconds", [1e-3, 0.1, 0.4, 2.0, 20.0])
def test_duplicates_with_a_least_duration(seconds):
    """A loop or a dwell: the time passes between the two, whatever the motion there."""
    points = random_points(2, 5, 3)
    points[2] = points[1]
    durations = [None, {"min": seconds}, None, None]
    done = fastest(PlanRequest.of(points, limits=LIMITS, segment_durations=durations))
    assert done.waypoint_times[2] - done.waypoint_times[1] >= seconds * (1 - 1e-9)
    free = duration(PlanRequest.of(points, limits=LIMITS))
    assert free * (1 - 1e-4) <= done.trajectory.duration
    assert done.trajectory.duration <= stopping(PlanRequest.of(points, limits=LIMITS, segment_durations=durations))
    all_alike = PlanRequest.of(np.tile(points[0], (3, 1)), limits=LIMITS, segment_durations=[{"min": seconds}, None])
    assert plan(all_alike, METHOD).trajectory.duration == pytest.approx(seconds)


def test_nothing_moves_but_the_ends_do():
    """From a waypoint to itself with a velocity: a loop."""
    state = {"velocity": [0.3, 0.0]}
    request = PlanRequest.of([[1.0, 2.0], [1.0, 2.0]], limits=LIMITS, start=state, end=state)
    assert duration(request) <= stopping(request) * (1 + 1e-12)


@pytest.mark.parametrize("n", [3, 6, 11])
def test_collinear(n):
    """Evenly along a line: as fast as straight there."""
    way = np.array([1.0, -2.0, 0.5])
    points = np.linspace(0, 1, n)[:, None] * way
    straight = duration(PlanRequest.of(points[[0, -1]], limits=LIMITS))
    done = fastest(PlanRequest.of(points, limits=LIMITS))
    assert straight * (1 - 1e-9) <= done.trajectory.duration <= straight * 1.003
    spread = np.sort(np.random.default_rng(n).uniform(0, 1, n))
    points = (spread - spread[0])[:, None] / np.ptp(spread) * way
    assert straight * (1 - 1e-9) <= duration(PlanRequest.of(points, limits=LIMITS)) <= straight * 1.005


def test_reversals():
    """Back and forth: one joint alone must turn at each waypoint, so a motion of least time is a bound."""
    points = np.array([[0.0, 0.0], [1.0, 1.0], [0.0, 0.0], [1.0, 1.0], [0.0, 0.0]])
    done = fastest(PlanRequest.of(points, limits=LIMITS))
    assert done.trajectory.duration < stopping(PlanRequest.of(points, limits=LIMITS)) * 0.99
    speeds = done.trajectory(done.waypoint_times, 1)
    assert np.abs(speeds).max() <= 1.0
    one = duration(PlanRequest.of(points[:, :1], limits=LIMITS))
    assert one * (1 - 1e-4) <= done.trajectory.duration <= one * 1.002
    assert done.certificate.objective.gap <= 0.06


def test_joints_that_do_not_move_change_nothing():
    points = random_points(3, 6, 3)
    plain = fastest(PlanRequest.of(points, limits=LIMITS)).trajectory
    wide = np.insert(points, [0, 2, 3], 0.7, axis=1)
    done = fastest(PlanRequest.of(wide, limits=LIMITS)).trajectory
    assert done.duration == pytest.approx(plain.duration, rel=1e-9)
    assert (done(np.linspace(0, done.end, 50))[:, [0, 3, 5]] == 0.7).all()
    assert (done.extrema(4).peak(1)[[0, 3, 5]] == 0).all()
    limits = {q: [x, None, x, x] for q, x in LIMITS.items()}  # a joint that rests needs no limit
    beside = np.insert(points, 1, -3.0, axis=1)
    assert duration(PlanRequest.of(beside, limits=limits)) == pytest.approx(plain.duration, rel=1e-9)


def test_all_but_one_joint_rest():
    points = np.zeros((5, 6)) + 0.25
    points[:, 4] = [0.0, 0.5, 0.2, 1.5, 1.0]
    alone = duration(PlanRequest.of(points[:, 4:5], limits=LIMITS))
    assert duration(PlanRequest.of(points, limits=LIMITS)) == pytest.approx(alone, rel=1e-9)


@pytest.mark.parametrize("unit", [1e-4, 1e3, [1e-4, 1e3, 1.0]])
@pytest.mark.parametrize("second", [1.0, 0.05, 30.0])
def test_units_do_not_matter(unit, second):
    points, unit = random_points(4, 6, 3), np.broadcast_to(unit, 3)
    plain = duration(PlanRequest.of(points, limits=LIMITS))
    limits = {q: LIMITS[q] * unit / second**m for m, q in enumerate(QUANTITIES) if m}
    done = fastest(PlanRequest.of(points * unit, limits=limits))
    assert done.trajectory.duration == pytest.approx(plain * second, rel=1e-4)


def test_mirrored_and_permuted():
    request = request_of(random_body(3))
    body = random_body(3)
    mirrored = {"waypoints": (-np.array(body["waypoints"])).tolist()}
    mirrored["limits"] = {
        q: {"lower": [-x for x in limit["upper"]], "upper": [-x for x in limit["lower"]]}
        for q, limit in body["limits"].items()
    }
    for side in ("start", "end"):
        mirrored[side] = {k: [-x for x in v] for k, v in body[side].items()}
    assert duration(request_of(mirrored)) == pytest.approx(duration(request), rel=1e-4)


@pytest.mark.parametrize("seed", range(3))
def test_two_hundred_waypoints(seed):
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(size=(200, 6)) * 0.3, axis=0)
    request = PlanRequest.of(points, limits={"velocity": 2.0, "acceleration": 8.0, "jerk": 60.0})
    assert duration(request, effort="fast") < 0.95 * stopping(request)


@pytest.mark.parametrize("lower", [-2.0, -40.0])
def test_asymmetric_jerk_counts_on_each_side(lower):
    """By hand: from rest to rest, with no other limit reached, jerk is at its upper, lower, upper limit in turn.

    For times t, r t, t with the acceleration and the velocity zero at the end, r = 2 upper / -lower. ruckig knows one
    jerk limit only, so the program's own pieces stay, whose switches lie on its grid.
    """
    upper, r = 10.0, 2 * 10.0 / -lower
    p, v, a = upper / 6, upper / 2, upper  # after the first second
    p, v, a = p + v * r + a * r**2 / 2 + lower * r**3 / 6, v + a * r + lower * r**2 / 2, a + lower * r
    p, v, a = p + v + a / 2 + upper / 6, v + a + upper / 2, a + upper
    assert (v, a) == pytest.approx((0, 0), abs=1e-9)
    best = (2 + r) / p ** (1 / 3)
    limits = {"velocity": 100.0, "acceleration": 100.0, "jerk": {"lower": lower, "upper": upper}}
    request = PlanRequest.of([[0.0], [1.0]], limits=limits)
    assert best * (1 - 1e-9) <= duration(request) <= best * 1.01
    assert best * (1 - 1e-9) <= duration(request, effort="best") <= best * 1.004


def test_position_limits_prevent_what_would_overshoot():
    points = [[0.0, 0.0], [1.0, 0.3], [1.0, 1.0], [0.0, 1.2]]
    free = fastest(PlanRequest.of(points, limits=LIMITS))
    found = free.trajectory.extrema(4)
    assert found.high[0][:, 0].max() > 1.01  # on between the two at 1, and back
    box = {"lower": [-0.0005, -1.0], "upper": [1.0005, 1.2]}  # joint 1 ends on its limit
    request = PlanRequest.of(points, limits={**LIMITS, "position": box})
    kept = fastest(request)
    low, high = kept.trajectory.extrema(4).low[0].min(axis=0), kept.trajectory.extrema(4).high[0].max(axis=0)
    assert low[0] >= -0.0005 - 1e-9 and high[0] <= 1.0005 + 1e-9 and high[1] <= 1.2 + 1e-9
    stops = stopping(PlanRequest.of(points, limits=LIMITS))
    assert free.trajectory.duration * (1 - 1e-4) <= kept.trajectory.duration <= stops * (1 + 1e-12)


@pytest.mark.parametrize("room", [0.0, 1e-6, 1e-3, 0.1])
def test_a_waypoint_near_or_on_the_position_limit(room):
    """On the limit the joint must turn there."""
    points = [[0.0, 0.0], [1.0, 0.5], [0.5, 1.0], [0.2, 0.1]]
    box = {"lower": [-2, -2], "upper": [1.0 + room, 2.0]}
    request = PlanRequest.of(points, limits={**LIMITS, "position": box})
    done = fastest(request)
    assert done.trajectory.duration <= stopping(PlanRequest.of(points, limits=LIMITS)) * (1 + 1e-12)
    assert done.trajectory.extrema(4).high[0][:, 0].max() <= 1.0 + room + 1e-9
    if room == 0.0:
        assert abs(done.trajectory(done.waypoint_times[1], 1)[0]) <= 1e-4


def test_a_joint_that_rests_on_its_position_limit():
    points = random_points(5, 5, 3)
    points[:, 1] = 0.5
    box = {"lower": [-5.0, -1.0, -5.0], "upper": [5.0, 0.5, 5.0]}
    assert duration(PlanRequest.of(points, limits={**LIMITS, "position": box})) == pytest.approx(
        duration(PlanRequest.of(points, limits=LIMITS)), rel=1e-3
    )


def test_limits_of_segments():
    points = random_points(6, 5, 2)
    own = [None, {"velocity": 0.2}, {"acceleration": [0.5, 3.0], "jerk": 4.0}, {"velocity": [0.9, None]}]
    request = PlanRequest.of(points, limits=LIMITS, segment_limits=own)
    done = fastest(request)
    assert duration(PlanRequest.of(points, limits=LIMITS)) < done.trajectory.duration <= stopping(request)
    found = done.trajectory.sliced(*done.waypoint_times[1:3]).extrema(4)
    assert found.peak(1).max() <= 0.2 * (1 + 1e-9)
    found = done.trajectory.sliced(*done.waypoint_times[2:4]).extrema(4)
    assert found.peak(2)[0] <= 0.5 * (1 + 1e-9) and found.peak(3).max() <= 4.0 * (1 + 1e-9)
    room = {"position": {"lower": -3.0, "upper": 3.0}}
    each = [None, {"position": {"lower": points.min() - 0.01, "upper": points.max() + 0.01}}, None, None]
    assert duration(PlanRequest.of(points, limits={**LIMITS, **room}, segment_limits=each)) > 0


@pytest.mark.parametrize("short", [1e-2, 1e-4, 1e-6])
def test_one_segment_much_shorter_than_its_neighbours(short):
    """On the way it costs next to nothing; against it, all joints must have the same share of their way there."""
    points = np.array([[0.0, 0.0], [1.0, 1.0], [1.0 + short, 1.0 + short], [2.0, 2.5]])
    without = duration(PlanRequest.of(points[[0, 1, 3]], limits=LIMITS))
    if short > 1e-5:  # below, a jerk moves a joint by less than rounding there: only stops are sure to be beaten
        assert duration(PlanRequest.of(points, limits=LIMITS)) <= without * (1.01 if short < 1e-3 else 1.05)
    assert duration(PlanRequest.of(points, limits=LIMITS)) <= stopping(PlanRequest.of(points, limits=LIMITS))
    points = np.array([[0.0, 0.0], [1.0, 1.0], [1.0 + short, 1.0 - short], [2.0, 0.0]])
    request = PlanRequest.of(points, limits=LIMITS)
    assert duration(request) <= stopping(request) * (1 + 1e-12)


def test_huge_limits_beside_small_ones():
    points = random_points(7, 5, 3)
    limits = {"velocity": [1.0, 1e9, 1.0], "acceleration": [2.0, 1e9, 1e9], "jerk": [10.0, 1e9, 1e9]}
    done = fastest(PlanRequest.of(points, limits=limits))
    alone = duration(PlanRequest.of(points[:, :1], limits=LIMITS))
    assert alone * (1 - 1e-3) <= done.trajectory.duration <= stopping(PlanRequest.of(points, limits=limits))


# -- states at the ends ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_states_exactly_at_the_limits(sign):
    points = sign * np.array([[0.0, 0.0], [1.5, 1.0], [3.0, 3.0]])
    for side in ("start", "end"):
        request = PlanRequest.of(points, limits=LIMITS, **{side: {"velocity": [sign * 1.0, sign * 1.0]}})
        assert duration(request) <= stopping(request) * (1 + 1e-12)
    edge = sign * (1.0 - 1.5**2 / 20)  # with acceleration 1.5 the velocity goes up to just 1
    request = PlanRequest.of(points, limits=LIMITS, start={"velocity": [edge, 0], "acceleration": [sign * 1.5, 0]})
    assert duration(request) <= stopping(request) * (1 + 1e-12)
    request = PlanRequest.of(points, limits=LIMITS, end={"velocity": [edge, 0], "acceleration": [sign * -1.5, 0]})
    assert duration(request) <= stopping(request) * (1 + 1e-12)
    request = PlanRequest.of(points, limits=LIMITS, start={"acceleration": [sign * 2.0, sign * -2.0]})
    assert duration(request) <= stopping(request) * (1 + 1e-12)


def test_moving_ends_are_met():
    start = {"velocity": [0.4, -0.3], "acceleration": [0.5, 1.0]}
    end = {"velocity": [-0.2, 0.6], "acceleration": [0.0, -0.4]}
    points = random_points(8, 5, 2)
    t = fastest(PlanRequest.of(points, limits=LIMITS, start=start, end=end)).trajectory
    for side, at in ((start, t.start), (end, t.end)):
        assert t(at, 1) == pytest.approx(side["velocity"], abs=1e-9)
        assert t(at, 2) == pytest.approx(side["acceleration"], abs=1e-9)
    plain = fastest(PlanRequest.of(points, limits=LIMITS)).trajectory
    for at in (plain.start, plain.end):
        assert np.abs([plain(at, 1), plain(at, 2)]).max() <= 1e-9


@pytest.mark.parametrize("effort", ["fast", "default", "best"])
@pytest.mark.parametrize("straight", [False, True])
def test_inadmissible_states_are_refused_with_numbers(effort, straight):
    for side, sign in (("start", 1.0), ("end", -1.0)):
        state = {"velocity": [0.9, 0.9], "acceleration": [sign * 1.8, sign * 1.8]}
        with pytest.raises(Infeasible) as caught:
            plan(
                PlanRequest.of([[0, 0], [1, 1], [2, 2]], limits=LIMITS, **{side: state}),
                METHOD,
                {"effort": effort, "straight": straight},
            )
        found = caught.value
        assert (found.joint, found.quantity, found.bound, found.certified) == (0, "velocity", 1.0, True)
        assert found.needed == pytest.approx(0.9 + 1.8**2 / 20)
        enough = {**LIMITS, "velocity": found.needed * (1 + 1e-9)}
        again = PlanRequest.of([[0, 0], [1, 1], [2, 2]], limits=enough, **{side: state})
        assert plan(again, METHOD, {"effort": effort, "straight": straight}).certificate.holds


def test_a_state_that_leads_beyond_a_position_limit():
    limits = {**LIMITS, "position": {"lower": -1.0, "upper": 1.1}}
    with pytest.raises(Infeasible) as caught:
        plan(PlanRequest.of([[1.0], [0.0]], limits=limits, start={"velocity": [0.9]}), METHOD)
    found = caught.value
    assert (found.joint, found.quantity, found.bound, found.certified) == (0, "position", 1.1, True)
    enough = {**LIMITS, "position": {"lower": -1.0, "upper": found.needed + 1e-6}}
    assert fastest(PlanRequest.of([[1.0], [0.0]], limits=enough, start={"velocity": [0.9]})).certificate.holds


@pytest.mark.parametrize("name", ["velocity", "acceleration"])
def test_states_beyond_a_limit(name):
    with pytest.raises(Infeasible) as caught:
        plan(PlanRequest.of([[0.0], [1.0]], limits=LIMITS, start={name: [3.0]}), METHOD)
    assert caught.value.quantity == name and caught.value.certified and caught.value.needed == pytest.approx(3.0)


# -- what is needed, and how long it may take --------------------------------------------------------------------------


@pytest.mark.parametrize("quantity", ["velocity", "acceleration", "jerk"])
def test_each_limit_is_needed(quantity):
    limits = {k: v for k, v in LIMITS.items() if k != quantity}
    with pytest.raises(InvalidRequest) as caught:
        plan(PlanRequest.of([[0.0], [1.0]], limits=limits), METHOD)
    assert (caught.value.errors[0].field, caught.value.errors[0].code) == (f"/limits/{quantity}", "missing")
    with pytest.raises(InvalidRequest) as caught:
        plan(PlanRequest.of([[0.0, 0.0], [1.0, 1.0]], limits={**LIMITS, quantity: [1.0, None]}), METHOD)
    assert caught.value.errors[0].code == "bad_limits"


@pytest.mark.parametrize(
    "given",
    [{"times": [0, 1, 2]}, {"tube": 0.1}, {"waypoint_tolerance": 0.1}, {"robot": {"model": "ur5e"}}],
)
def test_what_it_does_not_honour_is_refused(given):
    with pytest.raises(Unsupported) as caught:
        plan(PlanRequest.of([[0.0], [1.0], [3.0]], limits=LIMITS, **given), METHOD)
    assert caught.value.what == next(iter(given))
    with pytest.raises(Unsupported):
        plan(PlanRequest.of([[0.0], [1.0]], limits={**LIMITS, "velocity_norm": 1.0}), METHOD)


def test_auto_picks_it():
    found = plan(PlanRequest.of(random_points(0, 4, 2), limits=LIMITS))
    assert found.method == METHOD
    assert found.picked_because == "no times, but velocity, acceleration and jerk limits were given"


@pytest.mark.parametrize("options", [{}, {"effort": "best"}, {"smoothness": 0.1}, {"straight": True}])
def test_the_timeout_is_kept(options):
    points = np.cumsum(random_points(9, 60, 6), axis=0)
    with pytest.raises(TimeLimit):
        plan(PlanRequest.of(points, limits=LIMITS, timeout=1e-3), METHOD, options)


def test_nothing_but_planners_errors():
    """Odd numbers: an answer, or one of our errors."""
    odd = [
        PlanRequest.of([[0.0], [1e-12], [1.0]], limits=LIMITS),
        PlanRequest.of([[0.0], [1e9]], limits=LIMITS),
        PlanRequest.of([[1e9], [1e9 - 1.0], [1e9]], limits=LIMITS),
        PlanRequest.of([[0.0], [1.0], [1.0 + 1e-13], [2.0]], limits=LIMITS),
        PlanRequest.of([[0.0], [1.0]], limits={"velocity": 1e-9, "acceleration": 1e9, "jerk": 1e9}),
        PlanRequest.of([[0.0], [1.0]], limits={"velocity": 1e9, "acceleration": 1e-9, "jerk": 1e-9}),
        PlanRequest.of([[0.0, 0.0], [1e9, 1e-9], [0.0, 1.0]], limits=LIMITS),
        PlanRequest.of([[0.0]] * 2, limits=LIMITS, start={"acceleration": [1.0]}),
    ]
    answered = 0
    for request in odd:
        try:
            assert plan(request, METHOD).certificate.holds
            answered += 1
        except PlannerError as error:
            assert not isinstance(error, AssertionError) and error.code not in ("not_verified", "solver_failed"), error
            print(request.waypoints.tolist(), error)
    assert answered >= 6
