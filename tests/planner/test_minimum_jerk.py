"""Minimum acceleration, jerk and snap against trusted costs, splines of others, and perturbations."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import make_interp_spline

from planner import Infeasible, InvalidRequest, PlanRequest, Trajectory, Unsupported, plan

CASES = json.loads((Path(__file__).parent.parent / "data" / "minimum-jerk.json").read_text())["cases"]
FIXED = [c for c in CASES if "times" in c["request"]]
ALL = pytest.mark.parametrize("case", FIXED, ids=[c["name"] for c in FIXED])
BACKENDS = ("interior_point", "clarabel", "piqp", "daqp", "osqp")


def solved(case, **options):
    body = {k: v for k, v in case["request"].items() if k not in ("method", "options")}
    options = {**case["request"].get("options", {}), **options}
    return plan(PlanRequest.of(body.pop("waypoints"), **body), "minimum_jerk", options)


def bound(case):
    return "limits" in case["request"] or "waypoint_tolerance" in case["request"]


@ALL
def test_reference_costs(case):
    done, reference = solved(case), case["reference"]["cost"]
    objective = done.certificate.objective
    assert objective.value == pytest.approx(reference, rel=1e-6 if bound(case) else 1e-9)
    assert objective.lower_bound <= reference * (1 + (1e-6 if bound(case) else 1e-9))
    assert -1e-12 <= objective.gap <= 1e-7 and max(objective.kkt.values()) <= 1e-7
    assert done.stats.name == ("interior_point" if bound(case) else "block_elimination")
    for key, order in (("node_velocity", 1), ("node_acceleration", 2)):
        if key in case["reference"] and not bound(case):
            nodes = np.array(case["reference"][key])
            np.testing.assert_allclose(
                done.trajectory(done.waypoint_times, order), nodes, atol=1e-9 * np.abs(nodes).max()
            )


@pytest.mark.parametrize("backend", BACKENDS)
@ALL
def test_back_ends_agree(case, backend):
    """Each by itself, to 1e-6 in cost; DAQP is meant for small programs."""
    if backend == "daqp" and len(case["request"]["waypoints"]) > 50:
        return
    if backend == "osqp" and case["name"].startswith("C5"):
        return  # comes to no end within a tolerance that counts
    done = solved(case, backend=backend)
    assert done.stats.name == backend
    assert done.certificate.objective.value == pytest.approx(case["reference"]["cost"], rel=1e-6)


@given(st.integers(0, 2**32 - 1), st.sampled_from([2, 3, 4]))
def test_splines_of_others(seed, order):
    """Rest to rest: the spline of degree 2k - 1 through the points with k - 1 derivatives zero at the ends, by scipy;
    free ends: with derivatives k … 2k - 2 zero there."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(order + 1, 12))
    times, points = np.cumsum(10 ** rng.uniform(-0.5, 0.5, n)), rng.normal(size=(n, 2))
    for ends, low in (("fixed", 1), ("free", order)):
        side = [(r, np.zeros(2)) for r in range(low, low + order - 1)]
        spline = make_interp_spline(times, points, k=2 * order - 1, bc_type=(side, side))
        done = plan(PlanRequest.of(points, times=times), "minimum_jerk", {"order": order, "ends": ends})
        at = np.linspace(times[0], times[-1], 100)
        for r in range(order):
            values = spline(at, r)
            np.testing.assert_allclose(done.trajectory(at, r), values, atol=1e-6 * np.abs(values).max())
        assert done.certificate.continuity in (None, 2 * order - 2)
        assert done.certificate.objective.gap <= 1e-9


def test_rest_to_rest_closed_form():
    done = plan(PlanRequest.of([0, 1], times=[0, 2]), "minimum_jerk")
    np.testing.assert_allclose(done.trajectory.powers()[:, 0, 0], [0, 0, 0, 1.25, -0.9375, 0.1875], atol=1e-12)
    assert done.certificate.cost["squared_jerk"] == pytest.approx(22.5, rel=1e-12)
    assert done.certificate.peaks["acceleration"][0] == pytest.approx(10 / np.sqrt(3) / 4, rel=1e-9)


def test_given_end_states():
    ends = {"start": {"velocity": [0.5], "acceleration": [-0.3]}, "end": {"velocity": [-0.4], "acceleration": [0.6]}}
    done = plan(PlanRequest.of([0.2, 1], times=[0, 2], **ends), "minimum_jerk")
    np.testing.assert_allclose(done.trajectory.powers()[:, 0, 0], [0.2, 0.5, -0.15, 1.025, -0.8625, 0.1875], atol=1e-12)
    assert done.certificate.cost["squared_jerk"] == pytest.approx(25.065, rel=1e-9)


@given(st.integers(0, 2**32 - 1))
def test_nothing_near_is_better(seed):
    """Any other node states cost more: the free optimum is the minimum, and snap is continuous there."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 12))
    times = np.cumsum(10 ** rng.uniform(-1, 1, n))
    points = rng.normal(size=(n, 2))
    done = plan(PlanRequest.of(points, times=times), "minimum_jerk")
    assert done.certificate.continuity == 4
    best = done.certificate.cost["squared_jerk"]
    velocity, acceleration = (done.trajectory(times, m) for m in (1, 2))
    for scale in (1e-2, 1e-1):
        nudge = [rng.normal(size=(n, 2)) * scale for _ in range(2)]
        for x in nudge:
            x[0] = x[-1] = 0
        other = Trajectory.from_hermite(times, points, velocity + nudge[0], acceleration + nudge[1])
        assert other.squared_integral(3) > best * (1 - 1e-12)


@given(st.integers(0, 2**32 - 1))
def test_limits_that_can_be_kept_are_kept(seed):
    """Limits just above the peaks of some quintic spline are feasible, however tight they are for the optimum."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 9))
    times = np.cumsum(10 ** rng.uniform(-0.5, 0.5, n))
    points = rng.normal(size=(n, 2))
    rates = [rng.normal(size=(n, 2)) for _ in range(2)]
    for x in rates:
        x[0] = x[-1] = 0
    known = Trajectory.from_hermite(times, points, *rates)
    peaks = known.extrema(4)
    limits = {q: (peaks.peak(m) * 1.001).tolist() for m, q in ((1, "velocity"), (2, "acceleration"), (3, "jerk"))}
    done = plan(PlanRequest.of(points, times=times, limits=limits), "minimum_jerk")
    assert max(c.ratio for c in done.certificate.checks) <= 1 + 1e-6
    assert done.certificate.cost["squared_jerk"] <= known.squared_integral(3) * (1 + 1e-9)
    assert done.certificate.objective.gap <= 1e-5


def test_limits_touched_by_waypoints_and_end_states():
    request = PlanRequest.of(
        [0, 1, 0.2, 1],
        times=[0, 1, 2, 3],
        limits={"position": {"lower": -0.5, "upper": 1}, "velocity": 3},
        start={"velocity": [3.0]},
    )
    done = plan(request, "minimum_jerk")
    position = done.certificate.checks[0]
    assert position.value <= 1 + 2e-9


def test_position_limits_hold_between_waypoints():
    free = plan(PlanRequest.of([0, 1, 1, 0], times=[0, 1, 2, 3]), "minimum_jerk")
    assert free.certificate.peaks["position"][0] > 1.05
    limits = {"position": {"lower": -0.01, "upper": 1.02}}
    done = plan(PlanRequest.of([0, 1, 1, 0], times=[0, 1, 2, 3], limits=limits), "minimum_jerk")
    assert done.certificate.checks[0].value <= 1.02
    assert done.certificate.cost["squared_jerk"] > free.certificate.cost["squared_jerk"]


def test_two_waypoints_leave_nothing_free():
    limits = {"velocity": 0.9}
    with pytest.raises(Infeasible) as caught:
        plan(PlanRequest.of([0, 1], times=[0, 2], limits=limits), "minimum_jerk", {"sub_segments": 1})
    assert caught.value.needed == pytest.approx(0.9375, rel=1e-6)
    assert caught.value.minimum_duration == pytest.approx(2 * 0.9375 / 0.9, rel=2e-4)


@pytest.mark.parametrize("gap", [1e-3, 1e-5, 1e-7, 1e-9])
def test_very_uneven_times_without_limits(gap):
    """Answered with the class that is promised, or refused by name: never wrong in silence."""
    points, times = [0, 1, 1 + gap, 3], [0, 1, 1 + gap, 2]
    try:
        done = plan(PlanRequest.of(points, times=times), "minimum_jerk")
    except (InvalidRequest, Unsupported):
        assert gap < 1e-6
        return
    assert done.certificate.holds and (done.certificate.continuity == 4 or gap < 1e-4)


def test_epoch_times_lose_nothing():
    points = np.random.default_rng(1).normal(size=(6, 2))
    gaps = np.array([0, 0.5, 1.25, 2, 2.5, 4])
    a = plan(PlanRequest.of(points, times=gaps), "minimum_jerk")
    b = plan(PlanRequest.of(points, times=gaps + 2.0**30), "minimum_jerk")
    np.testing.assert_allclose(a.trajectory.coefficients, b.trajectory.coefficients, rtol=1e-12, atol=1e-12)
