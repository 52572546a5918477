"""The minimum-jerk motion between two states: laws of the calculus of variations first, then the worked numbers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from planner import InvalidRequest, PlanRequest, plan
from planner.curves import control_points as bezier_points
from planner.curves import minimum_jerk_motion, shortest_duration
from planner.curves.motion import control_points

SEEDS = st.integers(0, 2**32 - 1)
REST = [[0.0], [0.0], [0.0]]
ASYMMETRIC = ([[0.2], [0.5], [-0.3]], [[1.0], [-0.4], [0.6]])


def random_states(seed):
    rng = np.random.default_rng(seed)
    dims, duration = int(rng.integers(1, 4)), float(10.0 ** rng.uniform(-1, 1))
    rates = duration ** -np.arange(3.0)[:, None]
    return rng, duration, *(rng.normal(size=(3, dims)) * rates for _ in range(2))


def jerk_integral(curve, bump=None):
    """J over all joints of the curve plus a polynomial bump of t, by Gauss-Legendre: exact at these degrees."""
    u, w = np.polynomial.legendre.leggauss(20)
    t = 0.5 * curve.duration * (u + 1)
    jerk = curve(t, 3)
    if bump is not None:
        jerk = jerk + bump(t)
    return float((0.5 * curve.duration * w) @ (jerk**2).sum(axis=1))


# -- laws ----------------------------------------------------------------------------------------------------------


@given(SEEDS)
def test_boundary_data_are_met_and_the_sixth_derivative_is_zero(seed):
    _, duration, start, end = random_states(seed)
    curve = minimum_jerk_motion(duration, start, end)
    assert curve.degree == 5 and curve.pieces == 1 and (curve.start, curve.end) == (0.0, duration)
    for order in range(3):
        scale = (1 + np.abs(start).max() + np.abs(end).max()) * duration**-order
        assert np.abs(curve(0.0, order) - start[order]).max() <= 1e-9 * max(scale, 1)
        assert np.abs(curve(duration, order) - end[order]).max() <= 1e-9 * max(scale, 1)
    assert (curve(np.linspace(0, duration, 5), 6) == 0).all()


@given(SEEDS)
def test_random_bumps_raise_the_cost(seed):
    """Any t^3 (T - t)^3 times a polynomial leaves the boundary data alone; J grows by exactly the bump's own J."""
    rng, duration, start, end = random_states(seed)
    curve = minimum_jerk_motion(duration, start, end)
    least = jerk_integral(curve)
    t = np.polynomial.Polynomial([0, 1])
    for _ in range(5):
        shape = t**3 * (duration - t) ** 3 * np.polynomial.Polynomial(rng.normal(size=4))
        third = shape.deriv(3)
        raw = np.sqrt(jerk_integral(minimum_jerk_motion(duration, REST, REST), lambda x, f=third: f(x)[:, None]))
        eps = float(10.0 ** rng.uniform(-2, 1)) * np.sqrt(least) / raw
        direction = rng.normal(size=start.shape[1])
        bumped = jerk_integral(curve, lambda x, f=third, e=eps, d=direction: e * f(x)[:, None] * d)
        own = eps**2 * raw**2 * float(direction @ direction)
        assert bumped > least
        assert bumped == pytest.approx(least + own, rel=1e-8)  # the first variation vanishes


@given(SEEDS)
def test_the_cost_is_the_squared_integral(seed):
    _, duration, start, end = random_states(seed)
    curve = minimum_jerk_motion(duration, start, end)
    assert curve.squared_integral(3) == pytest.approx(jerk_integral(curve), rel=1e-9)


@given(SEEDS)
def test_rest_to_rest_is_a_straight_line_with_time_symmetry(seed):
    rng, duration, start, end = random_states(seed)
    start[1:] = end[1:] = 0
    curve = minimum_jerk_motion(duration, start, end)
    t = np.linspace(0, duration, 31)
    u = t / duration
    share = 10 * u**3 - 15 * u**4 + 6 * u**5
    size = np.abs([start[0], end[0]]).max()
    assert np.abs(curve(t) - (start[0] + share[:, None] * (end[0] - start[0]))).max() <= 1e-12 * size
    back = curve(np.clip(duration - t, 0, duration))
    assert np.abs(back - (start[0] + end[0] - curve(t))).max() <= 1e-12 * size
    d = np.linalg.norm(end[0] - start[0])
    assert curve.squared_integral(3) == pytest.approx(720 * d**2 / duration**5, rel=1e-9)


@given(SEEDS)
def test_affine_maps_send_rates_by_the_matrix_alone_E13(seed):
    """Positions take A x + b, velocities and accelerations A alone; with b on the rates too it is another curve."""
    rng, duration, start, end = random_states(seed)
    dims = start.shape[1]
    matrix, offset = rng.normal(size=(2, dims)), rng.normal(size=2) + 2
    curve = minimum_jerk_motion(duration, start, end)
    shift = np.array([[1.0], [0.0], [0.0]]) * offset
    mapped = minimum_jerk_motion(duration, start @ matrix.T + shift, end @ matrix.T + shift)
    t = np.linspace(0, duration, 21)
    expected = curve(t) @ matrix.T + offset
    assert np.abs(mapped(t) - expected).max() <= 1e-10 * (1 + np.abs(expected).max())
    wrong = minimum_jerk_motion(duration, start @ matrix.T + offset, end @ matrix.T + offset)
    assert np.abs(wrong(t) - expected).max() > 1e-3 * duration


@given(SEEDS)
def test_free_ends_meet_the_natural_conditions(seed):
    rng, duration, start, end = random_states(seed)
    free = rng.random(size=end.shape) < 0.5
    curve = minimum_jerk_motion(duration, start, np.where(free, np.nan, end))
    for order in range(3):
        natural = curve(duration, 5 - order)
        scale = max(np.abs(curve(np.linspace(0, duration, 9), 5 - order)).max(), duration ** (order - 5.0))
        assert np.abs(natural[free[order]]).max(initial=0) <= 1e-8 * scale
        reached = curve(duration, order)[~free[order]]
        assert np.abs(reached - end[order][~free[order]]).max(initial=0) <= 1e-9 * max(1.0, duration**-order)


@pytest.mark.parametrize("free", [(2,), (1,), (0,), (1, 2), (0, 2), (0, 1), (0, 1, 2)])
def test_free_ends_are_the_least_of_all_end_values(free):
    """A general minimiser over the free end values finds the natural conditions' answer, and nothing better."""
    start, end = np.array([[0.2], [0.5], [-0.3]]), np.array([[1.0], [-0.4], [0.6]])
    open_end = end.copy()
    open_end[list(free)] = np.nan
    curve = minimum_jerk_motion(1.5, start, open_end)

    def cost(values):
        tried = end.copy()
        tried[list(free), 0] = values
        return minimum_jerk_motion(1.5, start, tried).squared_integral(3)

    found = minimize(cost, end[list(free), 0], method="BFGS", options={"gtol": 1e-9})
    assert curve.squared_integral(3) == pytest.approx(found.fun, abs=1e-8)
    assert [curve(1.5, m)[0] for m in free] == pytest.approx(found.x, abs=1e-4)
    assert curve.squared_integral(3) <= cost(end[list(free), 0]) + 1e-12


def test_a_free_end_state_needs_no_jerk_at_all():
    """Nothing asked at the end: x''' = 0 throughout, the parabola of the start."""
    curve = minimum_jerk_motion(2.0, ASYMMETRIC[0], [[np.nan]] * 3)
    assert curve.squared_integral(3) <= 1e-20
    assert curve(2.0)[0] == pytest.approx(0.2 + 0.5 * 2 - 0.15 * 4, abs=1e-12)


@given(SEEDS)
def test_the_shortest_duration_meets_one_limit_and_keeps_all(seed):
    rng = np.random.default_rng(seed)
    distance = rng.normal(size=3) * 10.0 ** rng.uniform(-2, 2)
    v, a, j = 10.0 ** rng.uniform(-2, 2, 3)
    duration = shortest_duration(distance, v, a, j)
    start = np.zeros((3, 3))
    end = np.stack([distance, np.zeros(3), np.zeros(3)])
    found = minimum_jerk_motion(duration, start, end).extrema(4)
    ratios = [found.peak(m).max() / limit for m, limit in ((1, v), (2, a), (3, j))]
    assert max(ratios) == pytest.approx(1, rel=1e-9)


# -- worked numbers ------------------------------------------------------------------------------------------------


def test_worked_rest_to_rest():
    curve = minimum_jerk_motion(2.0, REST, [[1.0], [0.0], [0.0]])
    assert bezier_points(curve)[:, 0, 0] == pytest.approx([0, 0, 0, 1, 1, 1], abs=1e-14)
    assert curve.powers()[:, 0, 0] == pytest.approx([0, 0, 0, 1.25, -0.9375, 0.1875], abs=1e-12)
    assert curve([0.6, 1])[:, 0] == pytest.approx([0.16308, 0.5], abs=1e-12)
    found = curve.extrema(4)
    assert found.peak(1)[0] == pytest.approx(0.9375, abs=1e-12)
    assert found.peak(2)[0] == pytest.approx(1.44337567, abs=5e-9)
    assert found.peak(3)[0] == pytest.approx(7.5, abs=1e-12)
    assert found.at_high[1, 0, 0] == pytest.approx(1.0, abs=1e-6)
    assert found.at_high[2, 0, 0] == pytest.approx(0.42265, abs=5e-6)
    assert found.at_low[2, 0, 0] == pytest.approx(2 - 0.42265, abs=5e-6)
    assert curve([0, 2], 3)[:, 0] == pytest.approx([7.5, 7.5], abs=1e-12)  # where the jerk jumps from and to rest
    assert curve.squared_integral(3) == pytest.approx(22.5, abs=1e-9)


@pytest.mark.parametrize("d, duration", [(1.0, 1.0), (-2.5, 0.7), (3.0, 4.0)])
def test_worked_peaks_of_rest_to_rest(d, duration):
    curve = minimum_jerk_motion(duration, [[1.0], [0.0], [0.0]], [[1.0 + d], [0.0], [0.0]])
    found, size = curve.extrema(4), abs(d)
    assert found.peak(1)[0] == pytest.approx(1.875 * size / duration, rel=1e-12)
    assert found.peak(2)[0] == pytest.approx(10 / np.sqrt(3) * size / duration**2, rel=1e-12)
    assert found.peak(3)[0] == pytest.approx(60 * size / duration**3, rel=1e-12)
    at = duration * (0.5 + np.array([-1, 1]) / (2 * np.sqrt(3)))
    assert curve(at, 2)[:, 0] == pytest.approx(10 / np.sqrt(3) * d / duration**2 * np.array([1, -1]), rel=1e-12)
    assert curve.squared_integral(3) == pytest.approx(720 * d**2 / duration**5, rel=1e-12)


def test_worked_asymmetric():
    assert control_points(2.0, *ASYMMETRIC)[:, 0] == pytest.approx([0.2, 0.4, 0.54, 1.44, 1.16, 1], abs=1e-12)
    curve = minimum_jerk_motion(2.0, *ASYMMETRIC)
    assert bezier_points(curve)[:, 0, 0] == pytest.approx([0.2, 0.4, 0.54, 1.44, 1.16, 1], abs=1e-12)
    assert curve.powers()[:, 0, 0] == pytest.approx([0.2, 0.5, -0.15, 1.025, -0.8625, 0.1875], abs=1e-12)
    assert curve([0.6, 1])[:, 0] == pytest.approx([0.5702, 0.9], abs=1e-12)


def test_E9_the_cost_is_the_squared_norm_of_the_jerk():
    """720 d²/T⁵ and 25.065, not their roots; equal ends are fine; given ends are essential, natural ones are free."""
    rest = minimum_jerk_motion(2.0, REST, [[1.0], [0.0], [0.0]]).squared_integral(3)
    assert rest == pytest.approx(720 / 2**5, abs=1e-9)
    asymmetric = minimum_jerk_motion(2.0, *ASYMMETRIC)
    assert asymmetric.squared_integral(3) == pytest.approx(25.065, abs=1e-9)
    assert jerk_integral(asymmetric) == pytest.approx(25.065, abs=1e-9)
    loop = minimum_jerk_motion(1.0, [[1.0], [2.0], [0.0]], [[1.0], [2.0], [0.0]])
    assert loop([0, 1])[:, 0] == pytest.approx([1, 1]) and loop.squared_integral(3) > 1
    natural = minimum_jerk_motion(2.0, ASYMMETRIC[0], [[1.0], [np.nan], [np.nan]])
    assert natural(2.0, 3)[0] == pytest.approx(0, abs=1e-12) and natural(2.0, 4)[0] == pytest.approx(0, abs=1e-12)
    assert abs(asymmetric(2.0, 3)[0]) > 0.1  # given values are not natural conditions
    assert natural.squared_integral(3) < asymmetric.squared_integral(3)


def test_the_cost_falls_with_the_duration():
    costs = [minimum_jerk_motion(t, REST, [[2.0], [0.0], [0.0]]).squared_integral(3) for t in (1, 2, 10, 100)]
    assert costs == pytest.approx([720 * 4 / t**5 for t in (1, 2, 10, 100)], rel=1e-9)


@pytest.mark.parametrize(
    "limits, expected",
    [
        ({"velocity": 0.5}, 3.75),
        ({"acceleration": 0.5}, np.sqrt(10 / np.sqrt(3) / 0.5)),
        ({"jerk": 7.5}, 2.0),
        ({"velocity": 0.9375, "acceleration": 1.4433756729740645, "jerk": 7.5}, 2.0),
        ({"velocity": 10, "acceleration": 0.5, "jerk": 1000}, np.sqrt(10 / np.sqrt(3) / 0.5)),
        ({}, 0.0),
    ],
)
def test_worked_shortest_durations(limits, expected):
    assert shortest_duration(1.0, **limits) == pytest.approx(expected, rel=1e-12)
    assert shortest_duration([-1.0, 0.5], **limits) == pytest.approx(expected, rel=1e-12)


def test_no_distance_at_rest_is_a_constant_without_cost():
    curve = minimum_jerk_motion(3.0, [[0.7], [0.0], [0.0]], [[0.7], [0.0], [0.0]])
    assert (curve(np.linspace(0, 3, 9)) == 0.7).all() and curve.squared_integral(3) == 0
    assert shortest_duration(0.0, 1, 1, 1) == 0


@pytest.mark.parametrize("duration", [0, 0.0, -1, np.inf, np.nan])
def test_durations_that_are_not_positive_are_refused(duration):
    with pytest.raises(InvalidRequest) as caught:
        minimum_jerk_motion(duration, *ASYMMETRIC)
    assert (caught.value.errors[0].field, caught.value.errors[0].code) == ("/duration", "bad_duration")


@pytest.mark.parametrize(
    "start, end, code",
    [
        (REST[:2], REST[:2], "shape_mismatch"),
        (REST, [[0, 0]] * 3, "shape_mismatch"),
        ([0, 0, 0], [1, 0, 0], "shape_mismatch"),
        ([[np.nan], [0], [0]], REST, "not_finite"),
        (REST, [[np.inf], [0], [0]], "not_finite"),
    ],
)
def test_bad_states(start, end, code):
    with pytest.raises(InvalidRequest) as caught:
        minimum_jerk_motion(1.0, start, end)
    assert caught.value.errors[0].code == code


@given(SEEDS)
def test_the_method_agrees_for_two_waypoints(seed):
    rng, duration, start, end = random_states(seed)
    ends = {
        side: {"velocity": s[1].tolist(), "acceleration": s[2].tolist()} for side, s in (("start", start), ("end", end))
    }
    done = plan(PlanRequest.of([start[0], end[0]], times=[0, duration], **ends), "minimum_jerk")
    curve = minimum_jerk_motion(duration, start, end)
    t = np.linspace(0, duration, 21)
    assert np.abs(done.trajectory(t) - curve(t)).max() <= 1e-9 * (1 + np.abs(curve(t)).max())
    assert done.certificate.objective.value == pytest.approx(curve.squared_integral(3), rel=1e-8)
