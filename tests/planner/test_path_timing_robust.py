"""Paths that are hard on timing: tiny, huge, barely moving, dwelling, reversing, of every kind; all solved strictly."""

import numpy as np
import pytest

from planner import PlanRequest, plan
from planner.paths import PathOptions, build_path

RNG = np.random.default_rng(0)
POINTS = RNG.normal(size=(5, 3))
CLOSED = np.concatenate([POINTS, POINTS[:1]])
TWICE = POINTS[[0, 1, 1, 2, 3]]
SLOPES = RNG.normal(size=(5, 3)).tolist()
DEGREE_7 = RNG.normal(size=(8, 1, 3))
LIMITS = {"velocity": 1.0, "acceleration": 3.0, "jerk": 30.0}
WEIGHTS = [1.0, 2.0, 0.5, 3.0, 1.0]


def scaled(points, joint, factor):
    out = points.copy()
    out[:, joint] *= factor
    return out


def kind(name, **given):
    return {"path": {"kind": name, **given}}


def case(points, options=None, **limits):
    return np.asarray(points, dtype=float), options or {}, LIMITS | limits


#: Every honoured wish of a path; points, options, limits.
FAMILY = {
    **{f"moves_of_{s:g}": case(POINTS * s) for s in (1e-12, 1e-7, 1e-6, 1e6)},
    "one_joint_barely": case(scaled(POINTS, 1, 1e-5)),
    "one_joint_hardly": case(scaled(POINTS, 1, 1e-13)),
    "one_joint_still": case(scaled(POINTS, 1, 0.0)),
    "two_joints_barely": case(scaled(scaled(POINTS, 0, 1e-5), 1, 3e-6)),
    "two_points": case(POINTS[:2]),
    "two_points_one_joint": case(POINTS[:2, :1]),
    "far_and_near": case([[0, 0], [1e6, 1e-6]]),
    "joints_64": case(RNG.normal(size=(3, 64))),
    "loop": case(TWICE, kind("cubic_spline", knots=[0, 1, 2, 3, 4])),
    "loop_quintic": case(TWICE, kind("quintic_spline", knots=[0, 1, 2, 3, 4])),
    "merged": case(TWICE),
    "dwell": case(TWICE, kind("linear", knots=[0, 1, 2, 3, 4])),
    "dwell_at_both_ends": case(POINTS[[0, 0, 1, 1]], kind("linear", knots=[0, 1, 2, 3])),
    "dwell_over_two_segments": case(POINTS[[0, 1, 1, 1, 2]], kind("linear", knots=[0, 1, 2, 3, 4])),
    "dwell_monotone": case(TWICE, kind("cubic_hermite", tangents="monotone", knots=[0, 1, 2, 3, 4])),
    "reversals": case([[0.0], [1], [0], [2], [-1]]),
    "reversals_clamped": case([[0.0, 0], [1, 1], [0, 0]], kind("cubic_spline", boundary="clamped")),
    "reversal_in_all_joints": case([[0.0, 0, 0], [1, 2, -1], [0, 0, 0]], kind("cubic_spline", knots=[0, 0.5, 1])),
    "zero_inertia": case([[0.0, 0], [1, 1], [2, 0], [3, 1]]),
    "zero_inertia_only_one_joint": case(np.stack([np.sin(np.arange(6.0)), np.zeros(6)], axis=1)),
    "circle": case([[np.cos(x), np.sin(x)] for x in np.linspace(0, 2 * np.pi, 9)], velocity=None),
    "corners": case(POINTS, kind("linear")),
    "collinear_corners": case([[0, 0], [1, 1], [3, 3]], kind("linear")),
    **{
        f"knots_of_{s:g}": case(POINTS, kind("cubic_spline", knots=(s * np.array([0, 1, 2.5, 3, 4])).tolist()))
        for s in (1e-6, 1e6)
    },
    "knots_far_from_zero": case(POINTS, kind("cubic_spline", knots=[1e6, 1e6 + 1, 1e6 + 2, 1e6 + 3, 1e6 + 5])),
    "uneven_knots": case(POINTS, kind("cubic_spline", knots=[0, 1e-3, 1, 1.0001, 2])),
    "asymmetric": case(
        POINTS,
        velocity={"lower": [-0.1, -1, -3], "upper": [1, None, 0.2]},
        acceleration={"lower": -2, "upper": [0.5, 3, 0.1]},
        jerk={"lower": -10, "upper": [100, None, 20]},
    ),
    "one_sided": case(POINTS, velocity={"upper": 0.5}, jerk={"lower": -20.0}),
    "no_velocity": case(POINTS, velocity=None),
    "null_for_some": case(POINTS, velocity=[None, 1.0, None], jerk=[None, 30.0, None]),
    "null_where_still": case(scaled(POINTS, 1, 0.0), acceleration=[3.0, None, 1.0]),
    "unlike": case(POINTS, velocity=[1, 1e-3, 1e3], acceleration=[3e-3, 3e3, 3], jerk=[30, 3e4, 3e-2]),
    "unlike_again": case(POINTS, velocity=[1, 1e6, 1e3], acceleration=[3e6, 3e3, 3], jerk=[30, 3e-2, 3e4]),
    "jerk_of_1e-3": case(POINTS, jerk=1e-3),
    "jerk_of_1e9": case(POINTS, jerk=1e9),
    "velocity_of_1e-6": case(POINTS, velocity=1e-6),
    "limits_of_1e6": case(POINTS, velocity=1e6, acceleration=1e6, jerk=1e6),
    "bezier": case(POINTS, kind("bezier")),
    "bspline": case(POINTS, kind("bspline", interpolate=False)),
    "bspline_of_degree_2": case(POINTS, kind("bspline", interpolate=False, degree=2)),
    "bspline_through": case(POINTS, kind("bspline")),
    "nurbs": case(POINTS, kind("nurbs", weights=WEIGHTS)),
    "nurbs_of_degree_2": case(POINTS, kind("nurbs", weights=WEIGHTS, degree=2)),
    "hermite": case(POINTS, kind("hermite", velocities=SLOPES)),
    "cubic_hermite": case(POINTS, kind("cubic_hermite")),
    "polynomial": case(POINTS, kind("polynomial")),
    "clamped": case(POINTS, kind("cubic_spline", boundary="clamped")),
    "not_a_knot": case(POINTS, kind("cubic_spline", boundary="not_a_knot")),
    "periodic": case(CLOSED, kind("cubic_spline", boundary="periodic")),
    "quintic": case(POINTS, kind("quintic_spline")),
    "septic": case(POINTS, kind("septic_spline")),
    "septic_of_two": case(POINTS[:2], kind("septic_spline")),
    "degree_7": case(
        [DEGREE_7[0, 0], DEGREE_7.sum(axis=0)[0]],
        {"path": {"polynomial": {"breaks": [0.0, 1.0], "coefficients": DEGREE_7.tolist()}}},
    ),
}


def solved(points, options, limits, **given):
    return plan(PlanRequest.of(points, limits=limits, **given), "time_optimal_path", options)


@pytest.mark.parametrize("jerk", [False, True], ids=["acceleration", "jerk"])
@pytest.mark.parametrize("name", FAMILY)
def test_hard_paths(name, jerk):
    points, options, limits = FAMILY[name]
    done = solved(points, options, {k: v for k, v in limits.items() if jerk or k != "jerk"})
    certificate, duration = done.certificate, done.trajectory.duration
    scale = max(1.0, float(np.ptp(points, axis=0).max()))
    assert certificate.holds
    assert 1 - 1e-6 <= max(c.ratio for c in certificate.checks) <= 1 + 1e-8  # strict, and nothing given away
    assert certificate.path_deviation <= 1e-9 * scale
    assert certificate.boundary_error <= 5e-7  # of septic paths, which start as s⁴: at 1e-9 s a rounding of s counts
    if done.waypoint_times is not None:
        assert certificate.waypoint_error <= 1e-9
        steps = np.diff(done.waypoint_times)
        assert (steps >= 0 if name == "merged" else steps > 0).all()
    codes = {n.code for n in done.notes}
    assert not codes & {"not_optimal", "smoothness_lost"}
    bound = certificate.objective.lower_bound
    if name.startswith("nurbs"):
        assert bound is None
        return
    assert 0 < bound <= duration * (1 + 1e-12)
    if not jerk and "stops_at_corners" not in codes:
        assert certificate.objective.gap <= 3e-3  # of second order it is the optimum but for the grid


@pytest.mark.parametrize("size", [1e-7, 1.0, 1e4])
@pytest.mark.parametrize("jerk", [False, True])
def test_a_polyline_takes_what_its_stops_take(size, jerk):
    """Corner to corner it is what ruckig takes, by closed forms."""
    points = POINTS * size
    limits = {k: v for k, v in LIMITS.items() if jerk or k != "jerk"}
    done = solved(points, kind("linear"), limits)
    exact = plan(PlanRequest.of(points, limits=limits), "ruckig").trajectory.duration
    # where cruises are long, limits are capped for ruckig: up to some 1e-4 longer than the closed form
    assert exact * (1 - 3e-4) <= done.trajectory.duration <= exact * (1 + 2e-3)


@pytest.mark.parametrize("jerk", [False, True])
@pytest.mark.parametrize("seed", range(8))
def test_one_joint_to_and_fro(seed, jerk):
    """A path of one joint that turns back takes no longer than to stop at each of its turns, a closed form."""
    points = np.random.default_rng(seed).normal(size=(6, 1))
    limits = {k: v for k, v in LIMITS.items() if jerk or k != "jerk"}
    done = solved(points, {}, limits)
    assert done.certificate.holds
    curve = build_path(PathOptions().path, points).curve
    at = np.linspace(curve.start, curve.end, 20001)
    values = curve(at)[:, 0]
    rising = np.sign(np.diff(values))
    turns = values[1:-1][rising[1:] != rising[:-1]]
    stops = np.concatenate([points[:1, 0], turns, points[-1:, 0]])[:, None]
    assert done.trajectory.duration <= plan(PlanRequest.of(stops, limits=limits), "ruckig").trajectory.duration * 1.002


@pytest.mark.parametrize("jerk", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_thousand_waypoints_of_one_joint(jerk):
    """With jerk it is no more than a quarter above the law without: that every piece by itself allows."""
    points = np.random.default_rng(1).normal(size=(1000, 1))
    limits = {"velocity": 1.0, "acceleration": 3.0}
    free = solved(points, {}, limits)
    assert free.certificate.holds and free.certificate.objective.gap <= 1e-2
    assert len(free.waypoint_times) == 1000 and (np.diff(free.waypoint_times) > 0).all()
    if jerk:
        done = solved(points, {}, {**limits, "jerk": 30.0})
        assert done.certificate.holds
        assert done.trajectory.duration <= 1.25 * free.trajectory.duration


@pytest.mark.parametrize("dims", [1, 2, 3, 7, 8, 9, 16, 17])
def test_any_number_of_joints_beside_still_ones(dims):
    """The lanes' width is nothing to the answer: joints that stand still change no more than the grid's part."""
    points = np.zeros((4, dims))
    points[:, -1] = [0.0, 1.0, 1.7, 2.5]
    alone, beside = (solved(p, {}, LIMITS).trajectory.duration for p in (points[:, -1:], points))
    assert beside == pytest.approx(alone, rel=1e-3)
