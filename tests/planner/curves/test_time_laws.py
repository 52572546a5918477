"""Paths run through by time laws, uniform scaling, path parameters and turns (methods 1.2, 1.3, 3.3)."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner import InvalidRequest, PlanRequest, Trajectory, plan
from planner.curves import (
    chebyshev_nodes,
    cubic_hermite,
    cubic_spline,
    knots,
    linear,
    minimum_jerk_motion,
    nurbs,
    polynomial,
    quintic_spline,
    shortest_turns,
)

SEEDS = st.integers(0, 2**32 - 1)
T, X = [0, 1, 2], [[0], [2], [3]]
QUINTIC = Trajectory([0, 2], np.array([6.0, -15, 10, 0, 0, 0])[:, None, None])


def refused(code, call, *args):
    with pytest.raises(InvalidRequest) as caught:
        call(*args)
    assert caught.value.errors[0].code == code


# -- 1.2: path and time law ----------------------------------------------------------------------------------------


def test_worked_line_with_a_quintic_law():
    assert QUINTIC.states(0.5, 3)[:, 0] == pytest.approx([0.103515625, 0.52734375, 1.40625], abs=1e-12)
    line = linear([0, 1], [[0, 0], [3, 4]]).compose(QUINTIC)
    expected = [[0.310546875, 0.4140625], [1.58203125, 2.109375], [4.21875, 5.625]]
    np.testing.assert_allclose(line.states(0.5, 3), expected, atol=1e-12)
    same = minimum_jerk_motion(2.0, np.zeros((3, 1)), [[1], [0], [0]])
    np.testing.assert_allclose(same.coefficients, QUINTIC.coefficients, atol=1e-12)


def test_worked_circle_with_a_quadratic_law():
    s = chebyshev_nodes(24, 0, 1)
    circle = polynomial(s, np.stack([np.cos(s), np.sin(s)], axis=1), 0.0, 1.0)
    motion = circle.compose(Trajectory([0, 1], np.array([1.0, 0, 0])[:, None, None]))
    expected = [[0.88233286, 0.47062589], [-0.65887624, 1.23526600], [-2.67062418, 0.84223898]]
    np.testing.assert_allclose(motion.states(0.7, 3), expected, atol=1e-8)


def test_a_circle_stays_one_under_any_law():
    arc = nurbs([[1, 0], [1, 1], [0, 1]], [1, np.sqrt(0.5), 1], [0, 0, 0, 1, 1, 1], 2)
    motion = arc.compose(QUINTIC)
    at = np.linspace(0, 2, 101)
    x, v, a = motion.states(at, 3)
    np.testing.assert_allclose(np.linalg.norm(x, axis=1), 1, atol=1e-12)
    np.testing.assert_allclose((x * v).sum(axis=1), 0, atol=1e-11)
    np.testing.assert_allclose((x * a).sum(axis=1), -(v**2).sum(axis=1), atol=1e-10)


@pytest.mark.parametrize("rational", [False, True])
@given(SEEDS)
def test_chain_rule(rational, seed):
    rng = np.random.default_rng(seed)
    if rational:
        inner = np.sort(rng.uniform(0.2, 0.8, 2))
        path = nurbs(rng.normal(size=(6, 2)), rng.uniform(0.5, 2, 6), [0, 0, 0, 0, *inner, 1, 1, 1, 1])
    else:
        path = cubic_spline(np.linspace(0, 1, 5), rng.normal(size=(5, 2)), "natural")
    law = cubic_hermite([0, 1, 3], [[0], [rng.uniform(0.2, 0.8)], [1]], [[0.1], [0.2], [0]])
    motion = path.compose(law)
    at = rng.uniform(0.01, 2.99, 40)
    s, s1, s2, s3 = law.states(at)
    f = path.states(s[:, 0])
    wanted = [f[0], f[1] * s1, f[2] * s1**2 + f[1] * s2, f[3] * s1**3 + 3 * f[2] * s1 * s2 + f[1] * s3]
    for order in range(4):
        np.testing.assert_allclose(motion(at, order), wanted[order], atol=1e-8 * (1 + np.abs(wanted[order]).max()))


@pytest.mark.parametrize(
    "law",
    [
        linear([0, 1], [[1], [0]]),
        linear([0, 1, 2, 3], [[0], [0.6], [0.5], [1]]),
        cubic_hermite([0, 1], [[0.2], [0.8]], [[-0.3], [0]]),
        cubic_hermite([0, 1], [[0.2], [0.8]], [[0], [-0.3]]),
        Trajectory([0, 1], np.array([8.0, -12, 5, 0])[:, None, None]),  # up to 0.64, down to 0.36, up to 1
        Trajectory([0, 1, 2], np.array([[[0.5], [0.5]], [[0.0], [0.4]]])),  # falls by a jump
    ],
    ids=["falls", "turns back", "dips first", "comes back", "wiggles", "jumps back"],
)
def test_a_law_that_falls_is_refused(law):
    refused("not_increasing", linear([0, 1], [[0, 0], [3, 4]]).compose, law)


@given(st.floats(1e-2, 1), st.booleans())
def test_a_law_that_dips_a_little_is_refused(slope, late):
    law = cubic_hermite([0, 1], [[0.2], [0.8]], [[0 if late else -slope], [-slope if late else 0]])
    refused("not_increasing", linear([0, 1], [[0, 0], [3, 4]]).compose, law)


def test_a_law_may_rest_but_not_leave_the_path():
    path = linear([0, 1], [[0, 0], [3, 4]])
    resting = path.compose(linear([0, 1, 2, 3], [[0], [0.5], [0.5], [1]]))
    np.testing.assert_allclose(resting([1, 1.5, 2]), [[1.5, 2]] * 3, atol=1e-12)
    refused("out_of_range", path.compose, linear([0, 1], [[0], [1.01]]))
    refused("out_of_range", path.compose, linear([0, 1], [[-0.01], [1]]))


# -- 1.3: uniform scaling ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("slow", [cubic_spline(T, X).scaled(2.0), cubic_spline([0, 2, 4], X)])
def test_worked_scaling_by_two(slow):
    assert cubic_spline(T, X).states(0.5)[:, 0] == pytest.approx([0.71875, 2.4375, 2.25, -10.5], abs=1e-12)
    assert slow.states(1.0)[:, 0] == pytest.approx([0.71875, 1.21875, 0.5625, -1.3125], abs=1e-12)


def test_worked_peaks():
    found = cubic_spline(T, X).extrema(4)
    assert found.peak(1)[0] == pytest.approx(75 / 28, abs=1e-12)
    assert found.at_high[1, 0, 0] == pytest.approx(5 / 7, abs=1e-9)
    assert found.peak(2)[0] == pytest.approx(7.5, abs=1e-12)


@pytest.mark.parametrize(
    ("limits", "alpha", "binding"),
    [
        ({"velocity": 1, "acceleration": 2}, 75 / 28, "velocity"),
        ({"velocity": 2, "acceleration": 2}, np.sqrt(7.5 / 2), "acceleration"),
        ({"velocity": 2, "acceleration": 7, "jerk": 1}, np.cbrt(10.5), "jerk"),
        ({"velocity": 10, "acceleration": 20}, 1.0, None),
    ],
)
def test_the_smallest_factor_and_the_limit_that_binds(limits, alpha, binding):
    done = plan(PlanRequest.of(X, times=T, limits=limits), "time_scaled")
    assert done.trajectory.duration == pytest.approx(2 * alpha, rel=1e-9)
    assert done.waypoint_times == pytest.approx(np.array(T) * alpha, rel=1e-9)
    assert done.trajectory(np.array(T) * done.trajectory.duration / 2)[:, 0] == pytest.approx([0, 2, 3], abs=1e-9)
    named = [n.message.split()[1] for n in done.notes if n.code == "binding_limit"]
    assert named == ([] if binding is None else [binding])


def test_speeding_up_only_when_asked():
    request = PlanRequest.of(X, times=T, limits={"velocity": 10, "acceleration": 20})
    assert plan(request, "time_scaled").trajectory.duration == 2.0
    faster = plan(request, "time_scaled", {"allow_faster": True})
    assert faster.trajectory.duration == pytest.approx(2 * np.sqrt(7.5 / 20), rel=1e-9)
    assert [n.code for n in faster.notes] == ["binding_limit"] and "acceleration" in faster.notes[0].message


def test_erratum_e14_boundary_derivatives_scale_too():
    fast, right = cubic_spline(T, X, "clamped", [1], [0]), cubic_spline([0, 2, 4], X, "clamped", [0.5], [0])
    wrong = cubic_spline([0, 2, 4], X, "clamped", [1], [0])
    assert (fast(0.5)[0], right(1.0)[0], wrong(1.0)[0]) == pytest.approx((0.875, 0.875, 1.03125), abs=1e-12)
    ends = [[1], [2]], [[0], [-1]]
    quintic = quintic_spline(T, X, *ends)
    slow = quintic_spline([0, 2, 4], X, [[0.5], [0.5]], [[0], [-0.25]])
    at = np.linspace(0, 2, 41)
    np.testing.assert_allclose(slow(2 * at), quintic(at), atol=1e-12)
    assert np.abs(quintic_spline([0, 2, 4], X, *ends)(2 * at) - quintic(at)).max() > 0.1


# -- 3.3: the path parameter ---------------------------------------------------------------------------------------

Q = np.array([[0, 0], [1, 0], [1, 2], [3, 2]], dtype=float)


def test_worked_polyline_on_the_unit_interval():
    path = linear(knots(Q, "uniform"), Q)
    expected = [[0.3, 0], [1, 0], [1, 1], [2.4, 2], [3, 2]]
    np.testing.assert_allclose(path([0.1, 1 / 3, 0.5, 0.9, 1]), expected, atol=1e-12)


def test_erratum_e22_the_last_piece_is_closed():
    path = linear(knots(Q, "uniform"), Q)
    n = path.pieces
    assert int(np.floor(1.0 * n)) == n == 3  # the piece that the source asks for at s = 1 is not there
    assert path(1.0).tolist() == Q[-1].tolist()
    assert path(1.0, 1) == pytest.approx(n * (Q[3] - Q[2]), abs=1e-12)


@given(SEEDS)
def test_equal_split_is_the_pieces_one_after_the_other(seed):
    rng = np.random.default_rng(seed)
    n, dims = int(rng.integers(1, 30)), int(rng.integers(1, 4))
    q = rng.normal(size=(n + 1, dims))
    path = linear(knots(q, "uniform"), q)
    s = np.concatenate([rng.uniform(0, 1, 30), path.breaks])
    i = np.minimum(np.floor(s * n).astype(int), n - 1)
    u = (s * n - i)[:, None]
    np.testing.assert_allclose(path(s), (1 - u) * q[i] + u * q[i + 1], atol=1e-12)
    right = np.append(np.arange(n), n - 1)  # at a break the derivative from the right, at s = 1 from the left
    np.testing.assert_allclose(path(path.breaks, 1), n * np.diff(q, axis=0)[right], atol=1e-9)


def test_a_dwell_is_legal_in_the_equal_split():
    q = np.array([[0.0], [1], [1], [2]])
    path = linear(knots(q, "uniform"), q)
    assert path([1 / 3, 0.5, 2 / 3])[:, 0] == pytest.approx([1, 1, 1], abs=1e-12)
    assert path(0.5, 1)[0] == 0


def test_derivatives_in_the_path_parameter_are_n_times_those_of_the_piece():
    path = cubic_spline(knots(Q, "uniform"), Q, "natural")
    s, n = 0.4, path.pieces
    c3, c2, c1, _ = path.coefficients[:, 1]
    u = s * n - 1
    np.testing.assert_allclose(path(s, 1), n * (c1 + 2 * c2 * u + 3 * c3 * u**2), atol=1e-12)
    np.testing.assert_allclose(path(s, 2), n**2 * (2 * c2 + 6 * c3 * u), atol=1e-11)


def test_spacings_are_powers_of_the_chords():
    q = np.array([[0, 0], [3, 4], [3, 8.0], [4, 8]])  # chords 5, 4, 1
    assert knots(q, "uniform") == pytest.approx([0, 1 / 3, 2 / 3, 1], abs=1e-15)
    assert knots(q, "chord_length") == pytest.approx([0, 0.5, 0.9, 1], abs=1e-15)
    root = np.sqrt([5, 4, 1])
    assert knots(q) == pytest.approx(np.append(0, np.cumsum(root) / root.sum()), abs=1e-15)


# -- 3.3: joints that turn without end -----------------------------------------------------------------------------


@given(SEEDS)
def test_shortest_turns(seed):
    rng = np.random.default_rng(seed)
    q, turning = rng.uniform(-30, 30, (8, 3)), rng.random(3) < 0.7
    found = shortest_turns(q, turning)
    assert (found[0] == q[0]).all() and (found[:, ~turning] == q[:, ~turning]).all()
    turns = (found - q) / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-9)
    assert (np.abs(np.diff(found[:, turning], axis=0)) <= np.pi * (1 + 1e-12)).all()
    np.testing.assert_allclose(shortest_turns(found, turning), found, atol=1e-12)


def test_a_half_turn_stays_one():
    half = np.pi
    q = np.array([[0], [half], [0], [-half], [2 * half]])
    found = shortest_turns(q, [True])
    assert found[:4].tolist() == q[:4].tolist()
    assert np.abs(np.diff(found, axis=0)) == pytest.approx(half)


def test_wrap_of_a_request():
    def asked(points, wrap):
        done = plan(PlanRequest.of(points, times=[0, 1], wrap=wrap), "linear")
        return done.trajectory(1.0).tolist(), [n.code for n in done.notes]

    turn = 2 * np.pi
    points = [[6, 6], [0.5, 0.5]]
    assert asked(points, [True, False]) == ([pytest.approx(0.5 + turn), 0.5], ["turns_added"])
    assert asked(points, True) == ([pytest.approx(0.5 + turn)] * 2, ["turns_added"])
    assert asked(points, None) == asked(points, False) == ([0.5, 0.5], [])
    assert asked([[1, 2], [2, 4]], True) == ([2, 4], [])
