"""What is refused before any work, and what a checked request is held to: with a method that honours every word."""

from dataclasses import dataclass

import numpy as np
import pytest

from planner import Infeasible, InvalidRequest, PlanRequest, Trajectory, Unsupported
from planner.bounds import minimised_by, objective
from planner.check import check
from planner.method import Capabilities, Method, Reference
from planner.options import CAPABILITIES, Options
from planner.planning import hold
from planner.types import Bound, Demands, Minimised
from planner.verify import verify

ENDS = frozenset({"velocity", "acceleration"})
WORDS = frozenset(w for w in CAPABILITIES if not w.startswith("boundary"))


def method(timing="given", **more):
    can = Capabilities(timing, 2, honours=WORDS, **{"start": ENDS, "end": ENDS, **more})
    source = Reference("nobody", "nothing", 2000, "nowhere")
    return Method("able", "Able", lambda *_: None, Options, "smoothing", "", "", source, lambda options: can)


def asked(points, timing="given", rests=frozenset(), **given):
    request = PlanRequest.of(points, **given)
    ends = {"start": ENDS - rests, "end": ENDS - rests, "rests": rests}
    return check(request, method(timing, **ends), Options(), [])


def infeasible(*args, **given):
    with pytest.raises(Infeasible) as caught:
        asked(*args, **given)
    assert caught.value.certified
    return caught.value


def invalid(*args, **given):
    with pytest.raises(InvalidRequest) as caught:
        asked(*args, **given)
    return caught.value.errors[0].field, caught.value.errors[0].code


T = [0.0, 1.0, 3.0]


def test_demands_hold_the_corridors():
    states = [None, {"velocity": [1, None]}, None]
    found = asked([[0, 0], [1, 1], [2, 0]], times=T, waypoint_tolerance=[0.1, 0], tube=0.2, waypoint_states=states)
    assert found.demands.waypoint_tolerance.tolist() == [0.1, 0] and found.demands.tube.tolist() == [0.2, 0.2]
    assert found.demands.waypoint_states.velocity[1, 0] == 1 and not found.still
    assert found.demands.start.velocity.tolist() == [0, 0]


# -- position --------------------------------------------------------------------------------------------------------


def test_a_waypoint_beyond_a_limit_needs_a_tolerance_that_reaches_inside():
    limits = {"position": {"lower": -1.0, "upper": 1.0}}
    refused = infeasible([0, 1.3, 0], times=T, limits=limits)
    assert (refused.quantity, refused.joint, refused.bound, refused.needed) == ("position", 0, 1.0, 1.3)
    assert refused.time == 1.0
    refused = infeasible([0, 1.3, 0], times=T, limits=limits, waypoint_tolerance=0.2)
    assert refused.needed == pytest.approx(1.1) and refused.time == 1.0 and "tolerance" in refused.reason
    assert asked([0, 1.3, 0], times=T, limits=limits, waypoint_tolerance=0.3)
    assert asked([0, 1.3, 0], times=T, limits=limits, waypoint_tolerance=0.4)
    assert infeasible([0, 0.5, 1.3], times=T, limits=limits, waypoint_tolerance=0.4).needed == 1.3  # ends stay exact


def test_a_tube_leaves_less_of_a_tolerance():
    limits = {"position": {"upper": 1.0}}
    body = {"times": T, "waypoint_tolerance": 1.0, "segment_limits": [{"position": {"upper": 0.7}}, None]}
    assert asked([0.5, 1.2, 0.6], limits=limits, **body, tube=0.6)
    refused = infeasible([0.7, 1.2, 0.9], **body, tube=0.1)  # 0.8 at least on the second, 0.7 at most on the first
    assert (refused.segment, refused.bound, refused.needed) == (0, 0.7, pytest.approx(0.8))


def test_neighbouring_segments_may_exclude_one_another():
    both = [{"position": {"upper": 1.0}}, {"position": {"lower": 1.2}}]
    refused = infeasible([0, 1.1, 2], times=T, segment_limits=both, waypoint_tolerance=0.5)
    assert refused.quantity == "position"
    assert asked([0, 1.1, 2], times=T, segment_limits=[both[0], {"position": {"lower": 0.9}}], waypoint_tolerance=0.5)


def test_limits_that_exclude_one_another_are_invalid():
    own = [None, {"position": {"lower": [2, -5]}}]
    body = {"limits": {"position": {"upper": 1.0}}, "segment_limits": own}
    assert invalid([[0, 0], [1, 0], [1, 0.5]], times=T, **body) == ("/segment_limits/1", "bad_limits")


# -- states ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("limits", "state", "quantity", "needed"),
    [
        ({"velocity": 1}, {"velocity": [1.5, None]}, "velocity", 1.5),
        ({"acceleration": {"lower": -1, "upper": 5}}, {"acceleration": [None, -1.5]}, "acceleration", -1.5),
        ({"velocity_norm": 4.5}, {"velocity": [3, 4]}, "velocity_norm", 5.0),
        ({"velocity_norm": 2.5}, {"velocity": [3, None]}, "velocity_norm", 3.0),
    ],
)
def test_a_waypoint_state_beyond_its_limit(limits, state, quantity, needed):
    points = [[0, 0], [1, 1], [0, 0]]
    for body in (
        {"limits": limits, "waypoint_states": [None, state, None]},
        {"segment_limits": [limits, None], "waypoint_states": [None, state, None]},
        {"segment_limits": [None, limits], "waypoint_states": [None, state, None]},
        {"segment_limits": [limits, None], "waypoint_states": [state, None, None]},
    ):
        refused = infeasible(points, times=T, **body)
        assert (refused.quantity, refused.needed) == (quantity, needed)
        assert refused.time in (0.0, 1.0)
    assert asked(points, times=T, segment_limits=[None, limits], waypoint_states=[state, None, None])


def test_an_end_state_beyond_the_norm():
    body = {"times": T, "limits": {"velocity_norm": 4.0}}
    refused = infeasible([[0, 0], [1, 1], [0, 0]], end={"velocity": [3, 4]}, **body)
    assert (refused.quantity, refused.segment, refused.time, refused.needed) == ("velocity_norm", 1, 3.0, 5.0)


def test_states_at_the_ends_take_the_place_of_defaults():
    states = [{"velocity": [None, 2]}, None, {"acceleration": [1, None]}]
    found = asked([[0, 0], [1, 1], [2, 0]], times=T, waypoint_states=states, end={"velocity": [3, 0]})
    assert found.request.start.velocity.tolist() == [0, 2] and found.demands.start.acceleration.tolist() == [0, 0]
    assert found.request.end.velocity.tolist() == [3, 0] and found.demands.end.acceleration.tolist() == [1, 0]
    states[2] = {"velocity": [3, 1]}
    field = invalid([[0, 0], [1, 1], [2, 0]], times=T, waypoint_states=states, end={"velocity": [3, 0]})
    assert field == ("/waypoint_states/2/velocity", "conflict")
    states[2] = {"velocity": [3, 0]}
    assert asked([[0, 0], [1, 1], [2, 0]], times=T, waypoint_states=states, end={"velocity": [3, 0]})


def test_free_ends_take_a_state_for_one_joint():
    able = method(start=frozenset(), end=frozenset())
    request = PlanRequest.of([[0, 0], [1, 1]], times=[0, 1], waypoint_states=[{"velocity": [None, 2]}, None])
    found = check(request, able, Options(), [])
    np.testing.assert_array_equal(found.demands.start.velocity, [np.nan, 2])
    assert found.demands.start.acceleration is None and found.demands.end.given() == ()


def test_an_end_at_rest_cannot_be_set_by_a_waypoint_state():
    rests = frozenset({"acceleration"})
    assert asked([0, 1], times=[0, 1], rests=rests, waypoint_states=[{"velocity": [1], "acceleration": [0]}, None])
    with pytest.raises(Unsupported, match="boundary_acceleration"):
        asked([0, 1], times=[0, 1], rests=rests, waypoint_states=[{"acceleration": [1]}, None])


# -- mean velocities -------------------------------------------------------------------------------------------------


def test_a_mean_velocity_beyond_the_norm():
    body = {"times": T, "limits": {"velocity_norm": 4.9}}
    refused = infeasible([[0, 0], [3, 4], [3, 4]], **body)
    assert (refused.quantity, refused.segment, refused.needed, refused.joint) == ("velocity_norm", 0, 5.0, None)
    assert asked([[0, 0], [3, 4], [3, 4]], waypoint_tolerance=0.1, **body)
    assert infeasible([[0, 0], [3, 4], [3, 4]], waypoint_tolerance=[0.01, 0.01], **body).needed < 5
    assert asked([[0, 0], [3, 4], [3, 4]], "chosen", limits={"velocity_norm": 4.9})


def test_a_mean_velocity_of_many_segments():
    points = np.tile([[0.0], [1.0]], (40, 1))
    refused = infeasible(points, times=np.arange(80.0), limits={"velocity": {"lower": -0.8, "upper": 2}})
    assert (refused.quantity, refused.segment, refused.bound, refused.needed) == ("velocity", 1, -0.8, -1.0)
    assert refused.time == 1.5


# -- merging ---------------------------------------------------------------------------------------------------------


def test_merged_waypoints_share_their_states():
    states = [None, {"velocity": [1, None]}, {"velocity": [None, 2], "acceleration": [0, 0]}, None]
    points = [[0, 0], [1, 1], [1, 1], [2, 0]]
    found = asked(points, "chosen", waypoint_states=states, segment_limits=[{"velocity": 5}, None, None])
    assert found.kept.tolist() == [0, 1, 1, 2] and found.request.count == 3
    assert found.request.waypoint_states.velocity[1].tolist() == [1, 2]
    assert found.request.waypoint_states.acceleration[1].tolist() == [0, 0]
    assert found.demands.waypoint_states.velocity.shape == (4, 2)


@pytest.mark.parametrize(
    ("states", "kept"),
    [
        ([None, {"velocity": [1]}, {"velocity": [2]}, None], [0, 1, 2, 3]),
        ([None, {"velocity": [1]}, {"velocity": [1]}, None], [0, 1, 1, 2]),
        ([None, {"velocity": [1]}, {"acceleration": [2]}, None], [0, 1, 1, 2]),
    ],
)
def test_waypoints_of_different_states_stay_apart(states, kept):
    found = asked([0, 1, 1, 3], "chosen", waypoint_states=states)
    assert found.kept.tolist() == kept


def test_a_run_of_equals_is_cut_where_states_differ():
    states = [None, {"velocity": [1]}, None, {"velocity": [2]}, None]
    found = asked([0, 1, 1, 1, 3], "chosen", waypoint_states=states)
    assert found.kept.tolist() == [0, 1, 1, 2, 3]
    assert found.request.waypoint_states.velocity[:, 0].tolist()[1:3] == [1, 2]


def test_the_state_given_for_an_end_counts_where_waypoints_are_merged():
    states = [None, {"velocity": [1]}, None]
    assert asked([0, 0, 3], "chosen", waypoint_states=states, start={"velocity": [0]}).request.count == 3
    merged = asked([0, 0, 3], "chosen", waypoint_states=states)
    assert merged.request.count == 2 and merged.demands.start.velocity.tolist() == [1]


# -- holds -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("times", [None, [1.0, 2.0, 5.0]])
def test_a_hold_keeps_what_is_asked(times):
    body = {"limits": {"velocity_norm": 1}, "tube": 0, "waypoint_tolerance": [0, 0.1]}
    found = asked([[1, 2]] * 3, "given" if times else "chosen", times=times, **body)
    assert found.still
    done = hold(found)
    assert verify(done.trajectory, found.demands, done.waypoint_times[found.kept]).holds
    zero = [None, {"velocity": [0, 0]}, None]
    assert asked([[1, 2]] * 3, "chosen", waypoint_states=zero, **body).still
    moving = [None, {"velocity": [0, 0.1]}, None]
    assert not asked([[1, 2]] * 3, "given", times=T, waypoint_states=moving, **body).still


# -- objectives ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Told:
    low: float

    def lower_bound(self):
        return self.low


@dataclass(frozen=True)
class ToldInFull(Told):
    def residuals(self):
        return {"primal": 0.0, "dual": 1e-9, "complementarity": 2e-9}


def test_objectives_are_computed_from_the_trajectory():
    curve = Trajectory.from_powers([0, 2], np.array([[[0.0]], [[0]], [[1]], [[1]], [[0.5]]]))  # t² + t³ + t⁴/2
    found = verify(curve, Demands(1))
    values = {2: 4 * 2 + 24 * 2 + (36 + 24) * 8 / 3 + 72 * 4 + 36 * 32 / 5, 3: 72 + 144 * 2 + 144 * 8 / 3, 4: 144 * 2}
    for order, value in values.items():
        word = {2: "squared_acceleration", 3: "squared_jerk", 4: "squared_snap"}[order]
        assert objective(minimised_by(word), curve, found, None).value == pytest.approx(value)
        priced = objective(Minimised(f"{word}_plus_time", order, 3.0), curve, found, None)
        assert priced.value == pytest.approx(value + 6) and priced.name == f"{word}_plus_time" and priced.kkt is None
    assert objective(minimised_by("duration"), curve, found, None).value == 2
    assert objective(None, curve, found, None) is None and minimised_by(None) is None


def test_residuals_come_from_the_evidence():
    curve = Trajectory.from_hermite([0, 2], [[0.0], [1.0]])
    found = verify(curve, Demands(1))
    plain = objective(minimised_by("duration"), curve, found, Bound("all", Told(1.0)))
    full = objective(minimised_by("duration"), curve, found, Bound("all", ToldInFull(1.0)))
    assert plain.kkt is None and plain.gap == 1.0
    assert full.kkt == {"primal": 0.0, "dual": 1e-9, "complementarity": 2e-9} and full.lower_bound == 1.0


def test_what_is_unbounded_has_no_value():
    line = Trajectory.from_hermite([0, 1, 2], [[0.0], [1.0], [0.0]])  # a jump of the velocity
    cubic = Trajectory.from_hermite([0, 1, 2], [[0.0], [1.0], [0.5]], np.zeros((3, 1)))  # of the acceleration
    quintic = Trajectory.from_hermite([0, 1, 2], [[0.0], [1.0], [0.5]], *np.zeros((2, 3, 1)))  # of the jerk
    for order, word in ((2, "squared_acceleration"), (3, "squared_jerk"), (4, "squared_snap")):
        for smooth, curve in ((0, line), (1, cubic), (2, quintic)):
            value = objective(minimised_by(word), curve, verify(curve, Demands(1)), None)
            assert (value is None) == (smooth < order - 1)
