"""States that lead beyond a limit: by hand, against ruckig, against integration, and never where a motion is known."""

import re
from dataclasses import replace

import numpy as np
import pytest

from planner import PlanRequest, Trajectory
from planner.errors import Infeasible
from planner.limits import Limit, Limits
from planner.timing.state_to_state import Legs, joined, profiles
from planner.waypoints.admissible import refuse_inadmissible, stopping_distance

LIMITS = {"velocity": 1.0, "acceleration": 2.0, "jerk": 4.0}


def refused(points, **given):
    """Return the refusal, or None."""
    try:
        refuse_inadmissible(PlanRequest.of(points, **given))
    except Infeasible as error:
        assert error.certified
        return error
    return None


def end(velocity, acceleration):
    return {"velocity": velocity, "acceleration": acceleration}


# -- by hand -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("side", "state", "bound", "words"),
    [
        ("start", (0.8, 1.6), 1.0, "acceleration may be at most 1.26491 .* velocity at most 0.68"),
        ("start", (-0.8, -1.6), -1.0, "acceleration may be at least -1.26491 .* velocity at least -0.68"),
        ("end", (0.8, -1.6), 1.0, "acceleration may be at least -1.26491 .* velocity at most 0.68"),
        ("end", (-0.8, 1.6), -1.0, "acceleration may be at most 1.26491 .* velocity at least -0.68"),
    ],
)
def test_velocities_by_hand(side, state, bound, words):
    v, a = state  # 0.8 + 1.6² / (2 · 4) = 1.12
    points = [[0.0, 0.0], [1.0, 2.0], [1.0, 5.0]]
    found = refused(points, limits=LIMITS, **{side: end([0.0, v], [0.0, a])})
    assert (found.joint, found.quantity, found.bound) == (1, "velocity", bound)
    assert found.needed == pytest.approx(1.12 * bound) and found.segment == (0 if side == "start" else 1)
    assert f"at the {side}" in found.reason and re.search(words, found.reason)
    enough = {**LIMITS, "velocity": abs(found.needed)}
    assert refused(points, limits=enough, **{side: end([0.0, v], [0.0, a])}) is None
    for better in (end([0.0, 0.679999 * bound], [0.0, a]), end([0.0, v], [0.0, np.copysign(1.2649, a)])):
        assert refused(points, limits=LIMITS, **{side: better}) is None
    assert refused(points, limits=LIMITS, **{side: end([0.0, v], [0.0, -a])}) is None


def test_each_side_of_the_jerk_limit_counts():
    limits = {"velocity": 1.0, "acceleration": 2.0, "jerk": {"lower": -1.0, "upper": 4.0}}
    for side, states in (("start", [(0.5, 1.0), (-0.5, -2.0)]), ("end", [(0.5, -1.0), (-0.5, 2.0)])):
        for k, (v, a) in enumerate(states):  # at its end, time runs backwards: jerk is applied with the other sign
            assert refused([0, 5], limits=limits, **{side: end([v], [a])}) is None
            found = refused([0, 5], limits=limits, **{side: end([1.01 * v], [a])})
            assert abs(found.needed) == pytest.approx(1.005) and found.bound == np.copysign(1.0, v), k
    lopsided = {**LIMITS, "velocity": {"lower": -0.1, "upper": 1.0}}
    assert refused([0, 5], limits=lopsided, start=end([0.0], [0.9])) is None
    found = refused([0, 5], limits=lopsided, start=end([0.0], [-0.9]))  # 0.81 / 8
    assert found.bound == -0.1 and found.needed == pytest.approx(-0.10125)


def test_states_at_waypoints_count_forwards_and_backwards():
    def asked(v, a):
        return refused([0, 1, 5], limits=LIMITS, waypoint_states=[None, end([v], [a]), None])

    assert asked(0.68, 1.6) is None and asked(-0.68, 1.6) is None
    assert asked(0.7, 1.6).segment == 1 and "waypoint 1 leads" in asked(0.7, 1.6).reason
    assert asked(-0.7, 1.6).segment == 0 and "waypoint 1 can only come from" in asked(-0.7, 1.6).reason
    assert asked(None, 1.6) is None and asked(0.9, None) is None


def test_what_the_other_end_asks_may_be_a_way_out():
    start = end([0.9], [1.0])
    assert refused([0, 1], limits=LIMITS, start=start) is not None
    # on to an end with acceleration left: 0.9 + (1 - 0.9²) / 8 = 0.92375 is the least velocity there
    assert refused([0, 1], limits=LIMITS, start=start, end=end([0.93], [0.7])) is not None  # 0.96375
    assert refused([0, 1], limits=LIMITS, start=start, end=end([0.92], [0.9])) is not None
    assert refused([0, 1], limits=LIMITS, start=start, end=end([0.93], [0.9])) is None
    assert refused([0, 1], limits=LIMITS, start=start, end=end([0.93], [-0.9])) is not None
    # a position beyond need not be reached by one who does not stop
    box = {**LIMITS, "position": {"lower": -1.0, "upper": 1.0}}
    assert refused([0.9, 1], limits=box, start=end([0.9], [0.0])) is not None
    assert refused([0.9, 1], limits=box, start=end([0.9], [0.0]), end=end([0.9], [0.0])) is None
    assert refused([0.9, 0.8], limits=box, start=end([0.9], [0.0]), end=end([0.9], [0.0])) is not None


def test_free_derivatives_are_chosen_well():
    nan = np.nan
    free = PlanRequest.of([0, 1], limits={**LIMITS, "position": {"lower": -1.0, "upper": 1.1}})
    refuse_inadmissible(
        replace(free, start=replace(free.start, velocity=np.array([nan]), acceleration=np.array([2.0])))
    )
    # quickest stop from 1 with acceleration -2: 0.25, to be free to 1.1 from 0.85 on
    for p, well in ((0.84, True), (0.86, False)):
        asked = PlanRequest.of([p, 0], limits={**LIMITS, "position": {"lower": -1.0, "upper": 1.1}})
        asked = replace(asked, start=replace(asked.start, velocity=np.array([1.0]), acceleration=np.array([nan])))
        if well:
            refuse_inadmissible(asked)
            continue
        with pytest.raises(Infeasible, match="position limit of joint 0: the velocity may be at most 0.97979"):
            refuse_inadmissible(asked)


def test_the_loosest_of_the_segments_ahead_counts():
    state, points = end([0.8], [1.6]), [0, 1, 2, 3]
    wide, narrow = {"velocity": 1.2}, {"velocity": 0.9}
    limits = {"acceleration": 2.0, "jerk": 4.0}
    for own, passes in (([narrow] * 3, False), ([narrow, wide, narrow], True), ([narrow, {"jerk": 1.0}, narrow], True)):
        assert (refused(points, limits=limits, segment_limits=own, start=state) is None) == passes
    backwards = refused(points, limits=limits, segment_limits=[narrow] * 3, end=end([0.8], [-1.6]))
    assert backwards.segment == 2 and backwards.bound == 0.9
    states = [None, state, None, None]
    for own, passes in (([wide, narrow, narrow], False), ([narrow, narrow, wide], True)):
        assert (refused(points, limits=limits, segment_limits=own, waypoint_states=states) is None) == passes


def test_positions_by_hand():
    # from rest in acceleration: jerk -4 for 0.5 s to -2, 0.5 m/s lost; 0.5 s on at -2 … with v = 1: 5/12 + 1/16
    assert stopping_distance(1.0, 0.0, 2.0, 4.0) == pytest.approx(1.0 * 0.5 - 4 * 0.125 / 6 + 0.25 / 4)
    assert stopping_distance(1.0, -2.0, 2.0, 4.0) == pytest.approx(0.25)
    assert stopping_distance(1.0, 0.5, 2.0, np.inf) == pytest.approx(0.25)
    assert stopping_distance(0.02, 0.0, 2.0, 4.0) == pytest.approx(0.02 * 0.1 * 2 / 3)
    assert stopping_distance(1.0, 0.0, np.inf, np.inf) == 0.0 == stopping_distance(-1.0, 0.0, 2.0, 4.0)
    assert stopping_distance(1.0, -np.inf, np.inf, 4.0) == 0.0
    room = stopping_distance(1.0, 0.0, 2.0, 4.0)
    for side, points, k, v in (
        ("start", [0.0, -3.0], 1, 1.0),
        ("start", [0.0, 3.0], -1, -1.0),
        ("end", [-3.0, 0.0], 1, -1.0),
        ("end", [3.0, 0.0], -1, 1.0),
    ):
        for factor, passes in ((1.0, True), (1 + 1e-6, True), (1 - 1e-6, False)):
            sides = sorted([-4.0 * k, k * room * factor])
            box = {**LIMITS, "position": {"lower": sides[0], "upper": sides[1]}}
            found = refused(points, limits=box, **{side: end([v], [0.0])})
            assert (found is None) == passes
            if found is not None:
                assert (found.quantity, found.segment, found.joint) == ("position", 0, 0)
                assert found.needed == pytest.approx(k * room) and found.bound == k * room * factor
                word = f"velocity may be at {'most' if v > 0 else 'least'} {'-' if v < 0 else ''}(0.99999|1)"
                assert re.search(word, found.reason) and f"at the {side}" in found.reason


# -- against others ----------------------------------------------------------------------------------------------------


def farthest(v, a, braking, jerk):
    """Return how far the quickest stop goes, integrated in small steps."""
    falling = (a + braking) / jerk
    t = np.linspace(0.0, 1.001 * (falling + max(v + falling * (a - braking) / 2.0, 0.0) / braking), 20001)
    push = np.maximum(a - jerk * t, -braking)
    dt = t[1]
    speed = v + np.concatenate([[0.0], np.cumsum(0.5 * (push[1:] + push[:-1]) * dt)])
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * dt - dt**2 * np.diff(push) / 12)])
    assert speed[-1] <= 1e-9 * abs(v)
    return way.max(), np.abs(way).max()


def test_stops_against_integration():
    rng = np.random.default_rng(31)
    print("seed 31")
    for _ in range(300):
        braking, jerk = 10 ** rng.uniform(-1, 1, 2)
        v, a = rng.normal() * 10 ** rng.uniform(-1, 1), rng.uniform(-1, 2) * braking
        expected, size = farthest(v, a, braking, jerk)
        assert stopping_distance(v, a, braking, jerk) == pytest.approx(expected, abs=1e-6 * size)


def test_velocities_against_ruckig():
    rng = np.random.default_rng(7)
    print("seed 7")
    seen = np.zeros(2, int)
    for _ in range(300):
        low, high = -rng.uniform(0.3, 2), rng.uniform(0.3, 2)
        slow, fast = -rng.uniform(0.5, 3), rng.uniform(0.5, 3)
        jerk, far = 10 ** rng.uniform(-0.3, 1.3), rng.choice([-50.0, 50.0])
        v, a = rng.uniform(low, high), rng.uniform(slow, fast)
        zero = np.zeros(1)
        limits = Limit(np.array([low]), np.array([high])), Limit(np.array([slow]), np.array([fast]))
        rows = [Limit(x.lower[None], x.upper[None]) for x in limits]
        states = (x[None] for x in (zero, zero + v, zero + a, zero + far, zero, zero))
        legs = Legs(*states, *rows, (zero + jerk)[None], np.zeros(1))
        motion = joined(*profiles(legs), legs.p0)[0].extrema(2)
        out = max(motion.high[1].max() / high, motion.low[1].min() / low)
        if 1e-12 < abs(out - 1.0) < 1e-7:
            continue  # on the edge: rounding decides
        asked = {
            "velocity": {"lower": low, "upper": high},
            "acceleration": {"lower": slow, "upper": fast},
            "jerk": jerk,
        }
        found = refused([0.0, far], limits=asked, start=end([v], [a]))
        assert (found is not None) == (out > 1.0 + 1e-9), (v, a, out)
        seen[int(out > 1.0 + 1e-9)] += 1
        turned = {**asked, "velocity": {"lower": -high, "upper": -low}}  # time backwards
        again = refused([far, 0.0], limits=turned, end=end([-v], [a]))
        assert (again is None) == (found is None)
        if found is not None:
            reached = motion.high[1].max() if found.bound > 0 else motion.low[1].min()
            assert found.needed == pytest.approx(reached, rel=1e-9)
            assert again.needed == -found.needed and again.bound == -found.bound
    assert seen.min() > 30


def test_known_motions_are_never_refused():
    """Motions of constant jerk, piece by piece, whose own extrema are the limits, of the whole or of every segment."""
    rng = np.random.default_rng(11)
    print("seed 11")
    for trial in range(300):
        dims, n = int(rng.integers(1, 3)), int(rng.integers(2, 6))
        pieces, size = 3 * (n - 1), 10 ** rng.uniform(-4, 3)
        h = rng.uniform(0.1, 1, pieces)
        jerk = rng.normal(size=(pieces, dims)) * (rng.random((pieces, 1)) < 0.8)
        if trial % 3 == 0:
            jerk = np.sign(jerk)  # bang-bang: every limit is felt
        powers = np.zeros((4, pieces, dims))
        x = rng.normal(size=(3, dims)) * rng.integers(0, 2, (3, 1))
        for i in range(pieces):
            powers[:, i] = x[0], x[1], x[2] / 2, jerk[i] / 6
            x = np.array(
                [
                    x[0] + h[i] * (x[1] + h[i] * (x[2] / 2 + h[i] * jerk[i] / 6)),
                    x[1] + h[i] * (x[2] + h[i] * jerk[i] / 2),
                    x[2] + h[i] * jerk[i],
                ]
            )
        motion = Trajectory.from_powers(np.concatenate([[0.0], np.cumsum(h)]), powers * size)
        found, at = motion.extrema(4), motion.breaks[::3]
        states = motion.states(at, 3)

        def limits(rows, found=found, least=1e-9 * size):
            each = {}
            for order, name in enumerate(("position", "velocity", "acceleration", "jerk")):
                low, high = found.low[order][rows].min(axis=0), found.high[order][rows].max(axis=0)
                room = least if order == 0 else 0.0
                low, high = (
                    (low - room, high + room) if order == 0 else (np.minimum(low, -least), np.maximum(high, least))
                )
                each[name] = {"lower": low.tolist(), "upper": high.tolist()}
            return each

        given = {"limits": limits(slice(None))}
        if trial % 2:
            given["segment_limits"] = [limits(slice(3 * i, 3 * i + 3)) for i in range(n - 1)]
        if trial % 5:
            given["waypoint_states"] = [end(v.tolist(), a.tolist()) for v, a in zip(states[1], states[2], strict=True)]
        given["start"], given["end"] = (end(states[1, k], states[2, k]) for k in (0, -1))
        assert refused(states[0], **given) is None, trial


def test_mirrors_and_scales():
    rng = np.random.default_rng(5)
    print("seed 5")
    seen = 0
    for _ in range(100):
        names = ("velocity", "acceleration", "jerk")
        sides = {n: (-rng.uniform(0.5, 2, 3), rng.uniform(0.5, 2, 3)) for n in names}
        sides["position"] = (-rng.uniform(0.5, 2, 3), rng.uniform(0.5, 2, 3))
        points = rng.uniform(-0.5, 0.5, (3, 3))
        v, a = rng.normal(size=3), rng.normal(size=3)
        v, a = (np.clip(x, *sides[n]) for x, n in ((v, "velocity"), (a, "acceleration")))

        def limits(signs, sides=sides):
            each = {}
            for name, (low, high) in sides.items():
                k = signs.get(name, 1.0)
                low, high = (k * low, k * high) if k > 0 else (k * high, k * low)
                each[name] = {"lower": low.tolist(), "upper": high.tolist()}
            return each

        plain = refused(points, limits=limits({}), start=end(v, a))
        over = dict.fromkeys(sides, -1.0)
        mirrored = refused(-points, limits=limits(over), start=end(-v, -a))
        back = refused(points[::-1], limits=limits({"velocity": -1.0, "jerk": -1.0}), end=end(-v, a))
        for other in (mirrored, back):
            assert (other is None) == (plain is None)
        if plain is None:
            continue
        seen += 1
        sign = -1.0 if plain.quantity == "velocity" else 1.0
        assert (mirrored.needed, mirrored.joint) == (-plain.needed, plain.joint)
        assert (back.needed, back.joint, back.segment) == (sign * plain.needed, plain.joint, 1)
        for unit in (1e-4, 1e-2, 10.0, 1e3):
            scaled = refused(points * unit, limits=limits(dict.fromkeys(sides, unit)), start=end(v * unit, a * unit))
            assert (scaled.joint, scaled.quantity) == (plain.joint, plain.quantity)
            assert scaled.needed == pytest.approx(unit * plain.needed, rel=1e-12)
            if unit > 10:
                continue  # a jerk of more than the largest number that is read
            scaled = refused(  # and of time
                points,
                limits=limits({n: unit**m for m, n in enumerate(("position", *names))}),
                start=end(v * unit, a * unit**2),
            )
            assert (scaled.joint, scaled.quantity) == (plain.joint, plain.quantity)
    assert 20 < seen < 100


def test_states_on_the_edge_pass():
    rng = np.random.default_rng(3)
    for _ in range(200):
        unit = 10 ** rng.uniform(-4, 3)
        a, jerk = rng.uniform(0.1, 2) * unit, 10 ** rng.uniform(-1, 1) * unit
        high = a * a / (2 * jerk) * rng.uniform(1, 3)
        limits = {"velocity": high, "acceleration": 3 * unit, "jerk": jerk}
        edge = high - a * a / (2 * jerk)
        assert refused([0, unit], limits=limits, start=end([edge], [a])) is None
        assert refused([0, unit], limits=limits, start=end([edge + 1e-10 * high], [a])) is None
        assert refused([0, unit], limits=limits, start=end([edge + 1e-8 * high], [a])) is not None


def test_nothing_is_said_where_nothing_moves_or_is_limited():
    request = PlanRequest.of([[0.0], [1.0]])
    refuse_inadmissible(request)
    refuse_inadmissible(replace(request, limits=Limits.of(LIMITS, 1)))
    assert refused([0, 1], start=end([1e6], [1e6])) is None
    assert refused([0, 1], limits={"velocity": 1.0}, start=end([1.0], [1e6])) is None
    assert refused([0, 1], limits={"jerk": 1.0}, start=end([1.0], [1e6])) is None
    assert refused([0, 1], limits=LIMITS, start={"velocity": [1.0]}) is None
