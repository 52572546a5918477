"""The fastest law along a path: against fine-grid references, and the laws that any optimum keeps."""

import json
from pathlib import Path

import numpy as np
import pytest

from planner import PlanRequest, Trajectory, plan
from planner.paths import PathOptions, build_path

PATHS = json.loads((Path(__file__).parent.parent / "data" / "paths.json").read_text())["cases"]
CASES = {c["name"]: c for c in PATHS}
#: Without jerk, with jerk; those of many waypoints and jerk take seconds.
FAST = [(n, jerk) for n, c in CASES.items() for jerk in (False, True) if not (jerk and c["request"]["waypoints"][20:])]
SLOW = [(n, True) for n in CASES if (n, True) not in FAST]

V, A, J = 1.0, 3.0, 30.0
POINTS = np.random.default_rng(5).normal(size=(5, 3))
LIMITS = {"velocity": [1.0, 0.8, 1.2], "acceleration": [3.0, 2.0, 4.0], "jerk": [30.0, 20.0, 50.0]}


def timed(points, limits, path=None, stations=None, **given):
    options = {} if path is None else {"path": path}
    options |= {} if stations is None else {"stations": stations}
    return plan(PlanRequest.of(points, limits=limits, **given), "time_optimal_path", options)


def without_jerk(limits):
    return {k: v for k, v in limits.items() if k != "jerk"}


def chosen(jerk):
    return LIMITS if jerk else without_jerk(LIMITS)


def ratio(done, quantity):
    return next(c.ratio for c in done.certificate.checks if c.quantity == quantity)


def assert_strict(done):
    certificate = done.certificate
    assert certificate.holds
    assert max(c.ratio for c in certificate.checks) <= 1 + 1e-9
    scale = max(1.0, float(np.ptp(done.request.waypoints, axis=0).max()))
    assert certificate.path_deviation <= 1e-9 * scale
    assert certificate.waypoint_error is None or certificate.waypoint_error <= 1e-9
    assert certificate.boundary_error <= 1e-9
    if done.waypoint_times is not None:
        assert (np.diff(done.waypoint_times) > 0).all()
    bound = certificate.objective.lower_bound
    assert bound is None or bound <= done.trajectory.duration * (1 + 1e-12)


def assert_reference(name, jerk):
    case = CASES[name]
    request, limits = case["request"], case["request"]["limits"]
    done = timed(request["waypoints"], limits if jerk else without_jerk(limits), request["options"]["path"])
    assert_strict(done)
    assert max(c.ratio for c in done.certificate.checks) >= 1 - 1e-6  # something binds
    assert not {"not_optimal", "smoothness_lost"} & {n.code for n in done.notes}
    assert done.certificate.continuity is None or done.certificate.continuity >= (2 if jerk else 1)
    objective = done.certificate.objective
    assert objective.bound_scope == "all"
    if not jerk:
        assert objective.gap <= 2e-3
    reference = case["reference"].get("with_jerk" if jerk else "velocity_acceleration")
    if reference is not None:
        assert done.trajectory.duration <= reference["duration"] * (1.003 if jerk else 1.001)


@pytest.mark.parametrize(("name", "jerk"), FAST, ids=[f"{n}-{'jerk' if j else 'acceleration'}" for n, j in FAST])
def test_references(name, jerk):
    """No case is refused, also those that have no reference."""
    assert_reference(name, jerk)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "jerk"), SLOW, ids=[n for n, _ in SLOW])
def test_references_of_many_waypoints(name, jerk):
    assert_reference(name, jerk)


def test_a_line_from_rest_to_rest_is_the_closed_form():
    """Trapezoid and double S: 1/4 of them are ramps."""
    for distance, v, a in ((3.0, 1.0, 2.0), (0.3, 1.0, 2.0), (1e3, 2.0, 0.5)):
        reached = distance > v * v / a
        expected = distance / v + v / a if reached else 2 * np.sqrt(distance / a)
        done = timed([[0.0], [distance]], {"velocity": v, "acceleration": a})
        assert expected * (1 - 1e-9) <= done.trajectory.duration <= expected * (1 + 1e-3)
    for distance, v, a, j, expected in (
        (2.0, 1e3, 1e3, 1.0, 4.0),
        (100.0, 5.0, 1e3, 1.0, 20 + 2 * np.sqrt(5)),
        (100.0, 1e3, 2.0, 1.0, 2 + np.sqrt(204)),
        (100.0, 5.0, 2.0, 1.0, 20 + 2 + 2.5),
    ):
        done = timed([[0.0], [distance]], {"velocity": v, "acceleration": a, "jerk": j})
        assert expected * (1 - 1e-9) <= done.trajectory.duration <= expected * (1 + 2e-3)


@pytest.mark.parametrize("jerk", [False, True])
@pytest.mark.parametrize("k", [1e-3, 0.7, 8.0, 100.0])
def test_limits_scaled_as_time_is(jerk, k):
    base = timed(POINTS, chosen(jerk)).trajectory.duration
    powers = {"velocity": 1, "acceleration": 2, "jerk": 3}
    scaled = {q: (np.array(x) * k ** powers[q]).tolist() for q, x in chosen(jerk).items()}
    assert timed(POINTS, scaled).trajectory.duration * k == pytest.approx(base, rel=1e-4)


@pytest.mark.parametrize("jerk", [False, True])
def test_reversed_path_with_mirrored_limits(jerk):
    def sides(x, flip):
        lower, upper = -np.array(x), 0.6 * np.array(x)
        return {"lower": (-upper if flip else lower).tolist(), "upper": (-lower if flip else upper).tolist()}

    # backwards velocity and jerk change sign, acceleration does not
    forward = {q: sides(x, False) for q, x in chosen(jerk).items()}
    backward = {q: sides(x, q != "acceleration") for q, x in chosen(jerk).items()}
    there, back = timed(POINTS, forward), timed(POINTS[::-1], backward)
    assert_strict(there)
    assert_strict(back)
    assert there.trajectory.duration == pytest.approx(back.trajectory.duration, rel=1e-3)


@pytest.mark.parametrize("jerk", [False, True])
def test_order_of_joints_is_nothing(jerk):
    order = [2, 0, 1]
    other = {q: np.array(x)[order].tolist() for q, x in chosen(jerk).items()}
    first, second = timed(POINTS, chosen(jerk)), timed(POINTS[:, order], other)
    assert second.trajectory.duration == pytest.approx(first.trajectory.duration, rel=1e-5)


@pytest.mark.parametrize("jerk", [False, True])
def test_equal_segment_limits_change_nothing(jerk):
    first = timed(POINTS, chosen(jerk)).trajectory.duration
    for own in ([chosen(jerk)] * 4, [None, chosen(jerk), None, None], [None, {"velocity": 5.0}, None, {"jerk": 1e6}]):
        if not jerk and "jerk" in (own[3] or {}):
            continue
        assert timed(POINTS, chosen(jerk), segment_limits=own).trajectory.duration == pytest.approx(first, rel=1e-9)


@pytest.mark.parametrize("jerk", [False, True])
def test_tighter_is_never_faster(jerk):
    for quantity in chosen(jerk):
        last = 0.0
        for k in (2.0, 1.0, 0.5, 0.1):
            limits = {**chosen(jerk), quantity: (k * np.array(LIMITS[quantity])).tolist()}
            duration = timed(POINTS, limits).trajectory.duration
            assert duration >= last * (1 - 1e-3)
            last = duration


def test_jerk_without_end_is_no_limit_of_jerk():
    """From above, and never below what no jerk limit allows; up to 1 part in 1000 on either grid."""
    free = timed(POINTS, without_jerk(LIMITS))
    last = np.inf
    for k in (0.1, 1.0, 10.0, 1e3, 1e5):
        done = timed(POINTS, {**without_jerk(LIMITS), "jerk": (k * np.array(LIMITS["jerk"])).tolist()})
        assert_strict(done)
        assert done.trajectory.duration >= free.certificate.objective.lower_bound
        assert done.trajectory.duration <= last * (1 + 1e-3)
        last = done.trajectory.duration
    assert last == pytest.approx(free.trajectory.duration, rel=2e-3)


@pytest.mark.parametrize("jerk", [False, True])
def test_a_waypoint_on_the_curve_changes_nothing(jerk):
    curve = build_path(PathOptions().path, POINTS).curve
    given = {"polynomial": {"breaks": curve.breaks.tolist(), "coefficients": curve.powers().tolist()}}
    plain = timed(POINTS, chosen(jerk), given)
    knots = np.insert(curve.breaks, 2, 0.3 * curve.breaks[1] + 0.7 * curve.breaks[2])
    more = timed(curve(knots), chosen(jerk), {**given, "knots": knots.tolist()})
    assert_strict(more)
    assert len(more.waypoint_times) == 6
    assert more.trajectory.duration == pytest.approx(plain.trajectory.duration, rel=1e-3)
    assert plain.trajectory.duration == pytest.approx(timed(POINTS, chosen(jerk)).trajectory.duration, rel=1e-6)


@pytest.mark.parametrize("jerk", [False, True])
def test_the_parameter_of_the_path_is_nothing(jerk):
    """The same curve over s = u + 0.3 u² takes the same time."""
    curve = build_path(PathOptions.model_validate({"path": {"kind": "polynomial"}}).path, POINTS[:4]).curve
    powers = np.linspace(curve.start, curve.end, 4)[:, None] ** np.arange(4)
    powers = np.linalg.solve(powers, curve(np.linspace(curve.start, curve.end, 4)))
    ends = np.array([curve.start, curve.end])
    bent, u = np.zeros((7, 3)), np.polynomial.Polynomial([0.0, 1.0, 0.3])
    for m, c in enumerate(powers):
        each = (u**m).coef
        bent[: len(each)] += each[:, None] * c
    last = float(max((u - ends[1]).roots().real))
    knots = [float(max((u - s).roots().real)) for s in build_path(PathOptions().path, POINTS[:4]).knots]
    path = {"polynomial": {"breaks": [0.0, last], "coefficients": bent[:, None].tolist()}, "knots": [0.0, *knots[1:]]}
    path["knots"][-1] = last
    plain, other = timed(POINTS[:4], chosen(jerk), {"kind": "polynomial"}), timed(POINTS[:4], chosen(jerk), path)
    assert_strict(other)
    assert other.trajectory.duration == pytest.approx(plain.trajectory.duration, rel=1e-3)


@pytest.mark.parametrize("jerk", [False, True])
def test_the_norm_of_velocity_is_kept_and_binds(jerk):
    free = timed(POINTS, chosen(jerk))
    assert_strict(free)
    for norm in (1.0, 0.3):
        done = timed(POINTS, {**chosen(jerk), "velocity_norm": norm})
        assert_strict(done)
        assert 0.999 <= ratio(done, "velocity_norm") <= 1 + 1e-9
        assert done.trajectory.duration > free.trajectory.duration
        at = np.linspace(0, done.trajectory.end, 2000)
        speed = np.linalg.norm(done.trajectory(at, 1), axis=1)
        assert speed.max() <= norm * (1 + 1e-9)
        assert np.median(speed) >= 0.98 * norm or norm > 0.5


@pytest.mark.parametrize("jerk", [False, True])
@pytest.mark.parametrize("quantity", ["velocity", "acceleration", "velocity_norm", "jerk"])
def test_limits_of_a_segment_are_kept_there_and_only_there(quantity, jerk):
    if quantity == "jerk" and not jerk:
        return
    free = timed(POINTS, chosen(jerk))
    order = {"velocity": 1, "velocity_norm": 1, "acceleration": 2, "jerk": 3}[quantity]
    for segment in (0, 2):
        bound = {"velocity": 0.2, "acceleration": 0.3, "velocity_norm": 0.25, "jerk": 2.0}[quantity]
        own = [None] * 4
        own[segment] = {quantity: bound}
        done = timed(POINTS, chosen(jerk), segment_limits=own)
        assert_strict(done)
        assert done.trajectory.duration > free.trajectory.duration
        times, inside = done.waypoint_times, np.linspace(0, 1, 3000)[1:-1]
        at = times[segment] + inside * (times[segment + 1] - times[segment])
        values = done.trajectory(at, order)
        size = np.linalg.norm(values, axis=1) if quantity == "velocity_norm" else np.abs(values).max(axis=1)
        assert 0.98 * bound <= size.max() <= bound * (1 + 1e-9)
        others = np.linspace(times[0], times[-1], 3000)
        others = others[(others < times[segment]) | (others > times[segment + 1])]
        assert np.abs(done.trajectory(others, order)).max() > 1.2 * bound


@pytest.mark.parametrize("jerk", [False, True])
def test_the_same_bytes_every_time(jerk):
    def made():
        done = timed(POINTS[:3, :2], {q: x[:2] for q, x in chosen(jerk).items()}, stations=20)
        return done.trajectory.breaks.tobytes() + done.trajectory.coefficients.tobytes()

    assert len({made() for _ in range(100)}) == 1


@pytest.mark.parametrize("jerk", [False, True])
def test_fixed_stations_are_kept_strictly_and_more_are_better(jerk):
    """On a coarse grid limits hold all the same; the duration comes down to that of the adaptive grid."""
    best = timed(POINTS, chosen(jerk)).trajectory.duration
    found = []
    for stations in (10, 100, 1000):
        done = timed(POINTS, chosen(jerk), stations=stations)
        assert_strict(done)
        found.append(done.trajectory.duration)
    assert found[0] <= 1.5 * best and found[2] <= 1.003 * best
    assert found[2] <= found[0] * (1 + 1e-4)


def test_the_answer_is_the_path_composed_with_its_law():
    from planner.methods.time_optimal_path import TimeOptimalPathOptions, solve

    request = PlanRequest.of(POINTS, limits=LIMITS)
    answer = solve(request, TimeOptimalPathOptions())
    curve, law = answer.path.curve, answer.path.law
    at = np.linspace(0, answer.trajectory.end, 500)
    np.testing.assert_allclose(answer.trajectory(at), curve(np.clip(law(at)[:, 0], curve.start, curve.end)), atol=1e-12)
    assert (law(at, 1) >= -1e-12).all() and isinstance(law, Trajectory)
    np.testing.assert_allclose(law(answer.waypoint_times)[:, 0], curve.breaks, atol=1e-12)
