"""What cannot be done within the limits: proved, confirmed by others, and told what would do."""

import numpy as np
import pytest

from planner import Infeasible, PlanRequest, plan

POINTS, TIMES = [0, 1, 0], [0, 1, 2]


def solved(body, options):
    body = dict(body)
    return plan(PlanRequest.of(body.pop("waypoints"), **body), "minimum_jerk", options)


ONE = {"sub_segments": 1}


def refused(body, options=None):
    with pytest.raises(Infeasible) as caught:
        solved(body, options or ONE)
    return caught.value


def kept(body, options=None):
    try:
        return solved(body, options or ONE).certificate.holds
    except Infeasible:
        return False


def test_refusals_are_confirmed_and_nothing_else_is_refused(doubtful, infeasible_by_samples):
    """The free optimum's peaks times 0.6 to 1.1. Four polynomials per gap, limits at samples alone, by Clarabel."""
    seen = 0
    for seed in range(20):
        problem = doubtful(seed, lambda b, o: solved(b, o).trajectory)
        try:
            assert solved(problem.body, problem.options).certificate.holds
        except Infeasible as error:
            assert error.certified, seed
            assert infeasible_by_samples(problem), seed
            seen += 1
    assert seen >= 2


STALLS = pytest.mark.xfail(strict=True, reason="the search stalls and takes that for a refusal: needed is not least")


@pytest.mark.parametrize(
    ("quantity", "order"),
    [
        ("velocity", 2),
        ("velocity", 3),
        ("velocity", 4),
        ("acceleration", 2),
        ("acceleration", 3),
        ("acceleration", 4),
        ("jerk", 3),
        ("jerk", 4),
    ],
)
def test_what_is_needed_would_do(order, quantity):
    options = {"order": order, "sub_segments": 1}
    peak = plan(PlanRequest.of([0, 1, 0.3], times=TIMES), "minimum_jerk", {"order": order}).trajectory.extrema(4)
    bound = 0.5 * float(peak.peak(("velocity", "acceleration", "jerk").index(quantity) + 1)[0])
    body = {"waypoints": [0, 1, 0.3], "times": TIMES}
    found = refused({**body, "limits": {quantity: bound}}, options)
    assert found.certified and found.quantity == quantity and found.joint == 0
    assert abs(found.bound) == pytest.approx(bound, rel=1e-13)
    assert quantity in found.reason and f"segment {found.segment}" in found.reason
    assert found.segment <= found.time <= found.segment + 1
    assert kept({**body, "limits": {quantity: abs(found.needed) * (1 + 1e-5)}}, options)
    assert not kept({**body, "limits": {quantity: abs(found.needed) * 0.999}}, options)


@pytest.mark.parametrize("side", ["lower", "upper"])
def test_one_side_alone_presses(side):
    """Up is slow, down is free, or the other way around: the bound has its side's sign."""
    limits = {"velocity": {"lower": -1.2 if side == "lower" else -50, "upper": 1.2 if side == "upper" else 50}}
    found = refused({"waypoints": POINTS, "times": TIMES, "limits": limits})
    sign = 1 if side == "upper" else -1
    assert found.bound == sign * 1.2 and sign * found.needed > 1.2
    limits["velocity"][side] = found.needed * (1 + 1e-5)
    assert kept({"waypoints": POINTS, "times": TIMES, "limits": limits})


@pytest.mark.parametrize("limits", [
    {"velocity": 1.2}, {"acceleration": 3.0}, {"jerk": 20.0}, {"velocity": 2.0, "acceleration": 4.0},
])  # fmt: skip
def test_the_least_duration_would_do(limits):
    """From rest to rest, times stretched alike: to it and a little more, and not to 0.99 of it."""
    body = {"waypoints": [[0.0], [1.0], [0.2]], "limits": limits}
    found = refused({**body, "times": TIMES})
    assert found.certified and found.minimum_duration > 2
    for part, feasible in ((1 + 1e-4, True), (0.99, False)):
        times = np.array(TIMES) * found.minimum_duration / 2 * part
        assert kept({**body, "times": times.tolist()}) == feasible


@STALLS
def test_what_is_needed_is_the_least_of_the_richest_family():
    """1.15 is kept by two polynomials per gap, and so by four: for 1.1 no more can be needed."""
    body = {"waypoints": POINTS, "times": TIMES}
    assert kept({**body, "limits": {"velocity": 1.15}}, {"sub_segments": 2})
    found = refused({**body, "limits": {"velocity": 1.1}}, {"sub_segments": 4})
    assert abs(found.needed) <= 1.15


def test_no_duration_where_slowing_changes_what_is_given():
    body = {"waypoints": POINTS, "times": TIMES, "limits": {"velocity": 1.2}, "start": {"velocity": [0.5]}}
    found = refused(body)
    assert found.certified and found.minimum_duration is None and found.needed is not None


def test_all_joints_count_for_the_duration():
    """The second joint, which is refused for less, needs the most time."""
    body = {"waypoints": [[0, 0], [1, 3]], "times": [0, 1], "limits": {"velocity": 1.0}}
    found = refused(body)
    alone = refused({**body, "waypoints": [[0], [3]]})
    assert found.minimum_duration == pytest.approx(alone.minimum_duration, rel=1e-3)
    assert found.minimum_duration == pytest.approx(5.625, rel=1e-3)  # 15/8 of the mean speed


def test_limits_in_conflict_are_named():
    """A waypoint at its position limit, reached faster than the acceleration allows to stop."""
    limits = {"position": {"lower": -0.1, "upper": 1.01}, "acceleration": 3.0}
    body = {
        "waypoints": [0, 1, 0],
        "times": TIMES,
        "limits": limits,
        "waypoint_states": [None, {"velocity": [1.0]}, None],
    }
    found = refused(body)
    assert found.certified and found.quantity in ("position", "acceleration")
    assert "acceleration" in found.reason and "segment" in found.reason


def test_the_norm_refused():
    body = {"waypoints": [[0, 0], [1, 1]], "times": [0, 1], "limits": {"velocity_norm": 1.5}}
    found = refused(body)
    assert found.certified and found.quantity == "velocity_norm" and found.bound == pytest.approx(1.5)
    assert found.joint is None
    if found.needed is not None:
        assert kept({**body, "limits": {"velocity_norm": found.needed * (1 + 1e-4)}})
        assert not kept({**body, "limits": {"velocity_norm": found.needed * 0.999}})
    if found.minimum_duration is not None:
        assert kept({**body, "times": [0, found.minimum_duration * (1 + 1e-3)]})
        assert not kept({**body, "times": [0, found.minimum_duration * 0.99]})


def test_corridors_refused():
    """A tube between far waypoints, crossed from rest to rest with too little acceleration for the corner."""
    body = {"waypoints": [[0, 0], [1, 0], [1, 1]], "times": TIMES, "tube": 0.01, "limits": {"acceleration": 4.2}}
    found = refused(body)
    assert found.certified and found.quantity in ("tube", "acceleration", "velocity")


@pytest.mark.parametrize(("shift", "size"), [(0.0, 1.0), (1e6, 1.0), (0.0, 1e-6), (0.0, 1e5)])
@pytest.mark.parametrize("clock", [0.0, 1.7e9])
def test_scale_place_and_clock_do_not_matter(shift, size, clock):
    body = {"waypoints": [shift, shift + size, shift], "times": [clock + t for t in TIMES]}
    found = refused({**body, "limits": {"velocity": 1.2 * size}})
    first = refused({"waypoints": POINTS, "times": TIMES, "limits": {"velocity": 1.2}})
    assert found.certified and abs(found.needed) / size == pytest.approx(abs(first.needed), rel=1e-4)
    assert found.minimum_duration == pytest.approx(first.minimum_duration, rel=1e-3)


def test_uneven_times_are_refused_or_kept():
    """Neighbouring gaps of a ratio of 1e-9: answered without limits or named as the cause."""
    times, points = [0.0, 1.0, 1.0 + 1e-9 * 4, 2.0], [0.0, 1.0, 1.0 + 4e-9, 2.0]
    try:
        assert plan(PlanRequest.of(points, times=times), "minimum_jerk").certificate.holds
    except Exception as error:
        assert getattr(error, "code", None) in ("invalid_request", "unsupported")
