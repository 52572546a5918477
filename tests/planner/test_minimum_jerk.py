"""Minimum jerk against trusted costs, against perturbations, and where it cannot be done."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner import Infeasible, InvalidRequest, PlanRequest, Trajectory, plan

CASES = json.loads((Path(__file__).parent.parent / "data" / "minimum-jerk.json").read_text())["cases"]
PLAIN = [c for c in CASES if "options" not in c["request"] and "waypoint_tolerance" not in c["request"]]


def request_of(case):
    body = {k: v for k, v in case["request"].items() if k != "method"}
    return PlanRequest.of(body.pop("waypoints"), **body)


@pytest.mark.parametrize("case", PLAIN, ids=[c["name"] for c in PLAIN])
def test_reference_costs(case):
    done = plan(request_of(case), "minimum_jerk")
    limited = "limits" in case["request"]
    cost, reference = done.certificate.cost["squared_jerk"], case["reference"]["cost"]
    assert cost == pytest.approx(reference, rel=1e-6 if limited else 1e-9)
    objective = done.certificate.objective
    assert objective.lower_bound <= reference * (1 + 1e-9)
    assert -1e-12 <= objective.gap <= 1e-6
    assert done.stats.name == ("piqp" if limited else "block_elimination")
    for key, order in (("node_velocity", 1), ("node_acceleration", 2)):
        if key in case["reference"] and not limited:
            nodes = np.array(case["reference"][key])
            np.testing.assert_allclose(
                done.trajectory(done.waypoint_times, order), nodes, atol=1e-9 * np.abs(nodes).max()
            )


@pytest.mark.parametrize("case", PLAIN, ids=[c["name"] for c in PLAIN])
def test_back_ends_agree(case):
    costs = [
        plan(request_of(case), "minimum_jerk", {"backend": b}).certificate.cost["squared_jerk"]
        for b in ("piqp", "osqp")
    ]
    assert costs[0] == pytest.approx(costs[1], rel=1e-6)


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
    assert max(c.ratio for c in done.certificate.checks) <= 1
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


def test_infeasible_is_proved_and_explained():
    request = PlanRequest.of([0, 1, 0], times=[0, 1, 2], limits={"velocity": 1.2})
    with pytest.raises(Infeasible) as caught:
        plan(request, "minimum_jerk")
    found = caught.value
    assert found.certified and found.joint == 0 and found.quantity == "velocity" and abs(found.bound) == 1.2
    assert found.segment in (0, 1) and found.segment <= found.time <= found.segment + 1
    wider = PlanRequest.of([0, 1, 0], times=[0, 1, 2], limits={"velocity": abs(found.needed) * (1 + 1e-5)})
    assert plan(wider, "minimum_jerk").certificate.holds
    with pytest.raises(Infeasible):
        plan(PlanRequest.of([0, 1, 0], times=[0, 1, 2], limits={"velocity": abs(found.needed) * 0.999}), "minimum_jerk")


def test_hopeless_is_said_without_solving():
    with pytest.raises(Infeasible) as caught:
        plan(PlanRequest.of([0, 1, 5], times=[0, 4, 9], limits={"position": {"upper": 0.5}}), "minimum_jerk")
    assert (caught.value.quantity, caught.value.bound, caught.value.needed) == ("position", 0.5, 5)


@pytest.mark.parametrize(
    ("points", "times", "limits"),
    [
        ([0, 10], [0, 1], {"velocity": 5}),
        ([0, 10, 30], [0, 1, 2], {"velocity": 20.5}),
        ([0, 10, 30], [0, 1, 2], {"velocity": 15}),
        ([0, 1, 0], [0, 1, 2], {"velocity": 5, "acceleration": 4}),
        ([0, 1, 0, 1], [0, 1, 2, 3], {"position": {"lower": -0.001, "upper": 1.001}, "jerk": 20}),
    ],
)
def test_what_is_needed_would_do_and_less_would_not(points, times, limits):
    with pytest.raises(Infeasible) as caught:
        plan(PlanRequest.of(points, times=times, limits=limits), "minimum_jerk")
    found = caught.value
    assert found.certified and found.needed is not None
    for scale, feasible in ((1.0, True), (0.999, False)):
        needed = abs(found.bound) + scale * (abs(found.needed) - abs(found.bound))
        wider = {**limits, found.quantity: needed}
        if found.quantity == "position":
            wider["position"] = {"lower": -needed, "upper": needed}
        if feasible:
            assert plan(PlanRequest.of(points, times=times, limits=wider), "minimum_jerk").certificate.holds
        else:
            with pytest.raises(Infeasible):
                plan(PlanRequest.of(points, times=times, limits=wider), "minimum_jerk")


def test_two_waypoints_leave_nothing_free():
    limits = {"velocity": 0.9}
    with pytest.raises(Infeasible) as caught:
        plan(PlanRequest.of([0, 1], times=[0, 2], limits=limits), "minimum_jerk")
    assert caught.value.needed == pytest.approx(0.9375, rel=1e-6)


def test_times_too_uneven_are_refused():
    with pytest.raises(InvalidRequest) as caught:
        plan(PlanRequest.of([0, 1, 2, 3], times=[0, 1, 1 + 1e-7, 2]), "minimum_jerk")
    assert caught.value.errors[0].field == "/times/1"
    uneven = plan(PlanRequest.of([0, 1, 1.001, 3], times=[0, 1, 1.001, 2]), "minimum_jerk")
    assert uneven.certificate.holds and uneven.certificate.continuity == 4


def test_epoch_times_lose_nothing():
    points = np.random.default_rng(1).normal(size=(6, 2))
    gaps = np.array([0, 0.5, 1.25, 2, 2.5, 4])
    a = plan(PlanRequest.of(points, times=gaps), "minimum_jerk")
    b = plan(PlanRequest.of(points, times=gaps + 2.0**30), "minimum_jerk")
    np.testing.assert_allclose(a.trajectory.coefficients, b.trajectory.coefficients, rtol=1e-12, atol=1e-12)
