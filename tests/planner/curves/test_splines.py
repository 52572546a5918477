"""Splines: worked numbers of the methods' sections 3.1 to 3.4 and 8.1, references, errata and laws.

The local coefficients of section 3.2 are in ``tests/planner/test_cubic_spline.py``.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator, make_interp_spline

from planner import InvalidRequest
from planner.curves import (
    control_points,
    cubic_hermite,
    cubic_spline,
    cubic_system,
    freedoms,
    knots,
    linear,
    move,
    quintic_spline,
    septic_spline,
    tangents,
)

SEEDS = st.integers(0, 2**32 - 1)
T, X = [0, 1, 2], [[0], [2], [3]]

#: Times, points, velocities and accelerations at all points -> curve; those that a curve does not take it ignores.
CURVES = {
    "linear": lambda t, x, v, a: linear(t, x),
    "hermite": lambda t, x, v, a: cubic_hermite(t, x, v),
    "catmull_rom": lambda t, x, v, a: cubic_hermite(t, x),
    "finite_difference": lambda t, x, v, a: cubic_hermite(t, x, tangents(t, x, "finite_difference")),
    "clamped": lambda t, x, v, a: cubic_spline(t, x, "clamped", v[0], v[-1]),
    "second_derivative": lambda t, x, v, a: cubic_spline(t, x, "second_derivative", a[0], a[-1]),
    "natural": lambda t, x, v, a: cubic_spline(t, x, "natural"),
    "mixed": lambda t, x, v, a: cubic_spline(t, x, ["clamped", "second_derivative"], v[0], a[-1]),
    "mixed back": lambda t, x, v, a: cubic_spline(t, x, ["natural", "clamped"], 0.0, v[-1]),
    "not_a_knot": lambda t, x, v, a: cubic_spline(t, x, "not_a_knot"),
    "start_conditions": lambda t, x, v, a: cubic_spline(t, x, "start_conditions", v[0], 0.0, a[0]),
    "periodic": lambda t, x, v, a: cubic_spline(t, np.vstack([x[:-1], x[:1]]), "periodic"),
    "quintic": lambda t, x, v, a: quintic_spline(t, x, [v[0], a[0]], [v[-1], a[-1]]),
    "septic": lambda t, x, v, a: septic_spline(t, x, [v[0], a[0], 0 * a[0]], [v[-1], a[-1], 0 * a[0]]),
}
SMOOTH = {"linear": 0, "hermite": 1, "catmull_rom": 1, "finite_difference": 1, "quintic": 4, "septic": 6}


def data(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 8))
    t = rng.normal() + np.cumsum(rng.uniform(0.3, 2, n))
    x, v, a = rng.normal(size=(3, n, 3))
    return rng, t, x, v, a


# -- 3.1: classes and the quintic ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("degree", "open_"), [(1, 0), (2, 1), (3, 2), (5, 4)])
@pytest.mark.parametrize("segments", [1, 2, 7, 100])
def test_freedoms_are_the_class(segments, degree, open_):
    assert freedoms(segments, degree, degree - 1) == open_


def test_erratum_e2_counts_of_polynomials_and_conditions():
    for n in (1, 2, 5, 9):
        assert freedoms(n, 3, 2) == 4 * n - 2 * n - 2 * (n - 1) == 2
        assert linear(np.arange(n + 1.0), np.zeros((n + 1, 1))).pieces == n
        points = n + 1  # Manchester's count: 2 (T-1) + 2 (T-2) conditions, two short of 4 (T-1)
        assert freedoms(n, 3, 2) == 4 * (points - 1) - (4 * (points - 2) + 2)


def test_worked_quintic():
    curve = quintic_spline(T, X)
    assert curve(1.0, 1)[0] == pytest.approx(2.8125, abs=1e-9)
    assert curve(1.0, 2)[0] == pytest.approx(-10 / 3, abs=1e-8)
    assert curve([0.5, 1.5])[:, 0] == pytest.approx([0.50846354, 2.88736979], abs=1e-8)
    assert curve(0.5, 3)[0] == pytest.approx(-12.8125, abs=1e-9)
    left, right = curve.ends(4)
    assert (left[1, 0], right[0, 0]) == pytest.approx((60, 60), abs=1e-8)
    assert curve.extrema(2).peak(1)[0] == pytest.approx(3.19026, abs=1e-5)
    for order in (1, 2):
        assert curve([0, 2], order) == pytest.approx(0, abs=1e-12)


@given(SEEDS)
def test_quintic_is_scipys_collocation(seed):
    rng, t, x, v, a = data(seed)
    ends = [[(1, v[i]), (2, a[i])] for i in (0, -1)]
    reference = make_interp_spline(t, x, 5, bc_type=tuple(ends))
    curve, at = quintic_spline(t, x, [v[0], a[0]], [v[-1], a[-1]]), rng.uniform(t[0], t[-1], 40)
    for order in range(5):
        wanted = reference(at, order)
        np.testing.assert_allclose(curve(at, order), wanted, atol=1e-8 * (1 + np.abs(wanted).max()))


# -- 3.2: the cubic spline -----------------------------------------------------------------------------------------


def absolute(curve):
    """Return the coefficients of every piece in powers of absolute time, one joint."""
    rows = []
    for start, local in zip(curve.breaks, curve.powers()[:, :, 0].T, strict=False):
        rows.append(np.polynomial.Polynomial(local)(np.polynomial.Polynomial([-start, 1])).coef)
    return np.concatenate(rows)


def test_worked_coefficients_in_absolute_time():
    expected = [0, 0, 3.75, -1.75, -2, 6, -2.25, 0.25]
    assert absolute(cubic_spline(T, X)) == pytest.approx(expected, abs=1e-12)
    system, right = cubic_system(T, X, [0], [0])
    assert np.linalg.solve(system, right)[:, 0] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("offset", "condition"), [(0, 312), (10, 9.7e6), (100, 4.7e12)])
def test_worked_condition_numbers_of_the_dense_system(offset, condition):
    system, _ = cubic_system(np.array(T) + offset, X, [0], [0])
    assert np.linalg.cond(system) == pytest.approx(condition, rel=0.01)
    shifted = cubic_spline(np.array(T) + offset, X)
    np.testing.assert_allclose(shifted.powers(), cubic_spline(T, X).powers(), atol=1e-12)  # ours does not mind


def test_worked_accelerations_of_all_variants():
    def states(boundary, *ends):
        curve = cubic_spline(T, X, boundary, *([e] for e in ends))
        return curve(T, 1)[:, 0], curve(T, 2)[:, 0]

    v, a = states("clamped", 0, 0)
    assert [*v, *a] == pytest.approx([0, 2.25, 0, 7.5, -3, -1.5], abs=1e-12)
    v, a = states("natural")
    assert [*v, *a] == pytest.approx([2.25, 1.5, 0.75, 0, -1.5, 0], abs=1e-12)
    v, a = states("clamped", 1, -0.5)
    assert [*v, *a] == pytest.approx([1, 2.125, -0.5, 3.75, -1.5, -3.75], abs=1e-12)
    v, a = states("second_derivative", 1, -2)
    assert [*v, *a] == pytest.approx([1.875, 1.75, 0.125, 1, -1.25, -2], abs=1e-12)


def test_two_points_give_one_cubic_or_a_line():
    clamped, natural = cubic_spline([0, 2], [[1], [5]]), cubic_spline([0, 2], [[1], [5]], "natural")
    assert clamped.powers()[:, 0, 0] == pytest.approx([1, 0, 3, -1], abs=1e-12)
    assert natural.powers()[:, 0, 0] == pytest.approx([1, 2, 0, 0], abs=1e-12)


def test_erratum_e6_natural_means_zero_end_accelerations():
    natural, assigned = cubic_spline(T, X, "natural"), cubic_spline(T, X, "second_derivative", [1], [-2])
    assert (natural(0.5)[0], assigned(0.5)[0]) == pytest.approx((1.09375, 1.015625), abs=1e-12)
    assert natural([0, 2], 2)[:, 0] == pytest.approx([0, 0], abs=1e-12)
    assert assigned([0, 2], 2)[:, 0] == pytest.approx([1, -2], abs=1e-12)


def test_erratum_e34_the_end_velocity_row():
    system, _ = cubic_system(T, X, [0], [0])
    assert system[-1].tolist() == [0, 0, 0, 0, 0, 1, 4, 12]
    assert np.linalg.matrix_rank(system) == 8
    slide = system.copy()
    slide[-1, 4:] = [1, 2, 4, 8]  # repeats the position row
    assert np.linalg.matrix_rank(slide) == 7


def test_erratum_e35_the_acceleration_row():
    system, right = cubic_system(T, X, [0], [0])
    row = [0, 0, 2, 6, 0, 0, -2, -6]
    at = int(np.flatnonzero((system == row).all(axis=1))[0])
    slide = system.copy()
    slide[at] = [0, 0, 1, 6, 0, 0, -1, -6]
    wrong = np.linalg.solve(slide, right)[:, 0]
    assert wrong == pytest.approx([0, 0, 2.25, -0.25, -8, 18, -9.75, 1.75], abs=1e-12)
    assert abs((wrong[:4] - wrong[4:]) @ [0, 0, 2, 6]) == pytest.approx(12, abs=1e-12)
    good = np.linalg.solve(system, right)[:, 0]
    assert abs((good[:4] - good[4:]) @ [0, 0, 2, 6]) < 1e-12


@given(SEEDS)
def test_erratum_e36_the_dense_system_counts_and_is_linear(seed):
    rng, t, x, v, _ = data(seed)
    t = t - t[0]
    count = len(t)
    system, right = cubic_system(t, x, v[0], v[-1])
    positions = (system[:, ::4] != 0).any(axis=1).sum()  # only rows of positions have constant terms
    assert system.shape == (4 * (count - 1),) * 2 and positions == 2 * (count - 1)
    assert len(system) - positions - 2 == 2 * (count - 2)
    solved = np.linalg.solve(system, right).reshape(count - 1, 4, 3)
    curve = cubic_spline(t, x, "clamped", v[0], v[-1])
    at = rng.uniform(t[0], t[-1], 30)
    piece = np.searchsorted(t, at, side="right") - 1
    values = np.einsum("mp,mpd->md", at[:, None] ** np.arange(4), solved[piece])
    np.testing.assert_allclose(values, curve(at), atol=1e-6 * (1 + np.abs(curve(at)).max()))


@given(SEEDS)
def test_natural_minimises_the_squared_acceleration(seed):
    _, t, x, v, a = data(seed)
    least = cubic_spline(t, x, "natural").squared_integral(2)
    for name in ("clamped", "second_derivative", "mixed", "mixed back", "start_conditions", "quintic", "septic"):
        assert CURVES[name](t, x, v, a).squared_integral(2) > least


@pytest.mark.parametrize("name", ["clamped", "second_derivative", "mixed", "not_a_knot", "start_conditions", "quintic"])
@given(SEEDS)
def test_cubics_are_reproduced(name, seed):
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.3, 2, 5))
    p = np.polynomial.Polynomial(rng.normal(size=4))
    x, v, a = (d(t)[:, None] for d in (p, p.deriv(), p.deriv(2)))
    at = np.linspace(t[0], t[-1], 40)
    scale = 1 + np.abs(p(at)).max()
    np.testing.assert_allclose(CURVES[name](t, x, v, a)(at)[:, 0], p(at), atol=1e-9 * scale)


def test_start_conditions_amplify_by_about_four_per_knot():
    t, x = np.arange(12.0), np.zeros((12, 1))
    slopes = np.abs(cubic_spline(t, x, "start_conditions", [1e-6])(t, 1)[:, 0])
    assert slopes[2:] / slopes[1:-1] == pytest.approx(2 + np.sqrt(3), rel=0.08)


# -- 3.4: the cubic Hermite spline ---------------------------------------------------------------------------------

M0, T0, M1, T1 = ([0, 0], [1, 2], [2, 1], [0, -1])


def test_worked_hermite_piece():
    curve = cubic_hermite([0, 1], [M0, M1], [T0, T1])
    np.testing.assert_allclose(curve.powers()[:, 0], [[0, 0], [1, 2], [4, 0], [-3, -1]], atol=1e-12)
    expected = [[0.453125, 0.484375], [1.125, 0.875], [1.734375, 1.078125]]
    np.testing.assert_allclose(curve([0.25, 0.5, 0.75]), expected, atol=1e-12)
    assert curve(0.5, 1) == pytest.approx([2.75, 1.25], abs=1e-12)


def test_the_map_from_data_to_coefficients_inverts_the_conditions():
    m0, t0, m1, t1 = np.eye(4)  # joint i: the i-th unit datum
    mapping = cubic_hermite([0, 1], [m0, m1], [t0, t1]).powers()[:, 0]
    conditions = [[1, 0, 0, 0], [0, 1, 0, 0], [1, 1, 1, 1], [0, 1, 2, 3]]
    np.testing.assert_allclose(mapping @ conditions, np.eye(4), atol=1e-13)
    at = np.linspace(0, 1, 11)
    weights = at[:, None] ** np.arange(4) @ mapping
    np.testing.assert_allclose(weights[:, 0] + weights[:, 2], 1, atol=1e-13)  # of the two points


@given(SEEDS)
def test_bezier_twin(seed):
    _, t, x, v, _ = data(seed)
    h = np.diff(t)[:, None]
    twin = control_points(cubic_hermite(t, x, v))
    expected = [x[:-1], x[:-1] + h * v[:-1] / 3, x[1:] - h * v[1:] / 3, x[1:]]
    np.testing.assert_allclose(twin, expected, atol=1e-12 * (1 + np.abs(expected).max()))


def test_erratum_e33_tangents_are_per_piece_and_coefficients_end_in_c_d():
    n = 4
    q, local = np.random.default_rng(1).normal(size=(2, n + 1, 2))
    path = cubic_hermite(knots(q, "uniform"), q, n * local)  # y'(s) = n t for tangents t of the local parameter
    for i in range(n):
        m0, t0, m1, t1 = q[i], local[i], q[i + 1], local[i + 1]
        expected = [m0, t0, -3 * m0 - 2 * t0 + 3 * m1 - t1, 2 * m0 + t0 - 2 * m1 + t1]
        np.testing.assert_allclose(path.coefficients[::-1, i], expected, atol=1e-12)
    assert path.degree == 3 and len(path.coefficients) == 4
    assert np.abs(cubic_hermite(knots(q, "uniform"), q, local)(0.1) - path(0.1)).max() > 0.01


@given(SEEDS)
def test_hermite_is_scipys(seed):
    rng, t, x, v, _ = data(seed)
    at = rng.uniform(t[0], t[-1], 40)
    np.testing.assert_allclose(cubic_hermite(t, x, v)(at), CubicHermiteSpline(t, x, v)(at), atol=1e-11)


def test_tangent_rules_by_hand():
    t, x = [0, 1, 3, 4], [[0], [2], [1], [3]]  # slopes 2, -1/2, 2
    assert tangents(t, x)[:, 0] == pytest.approx([2, 1 / 3, 1 / 3, 2], abs=1e-15)
    assert tangents(t, x, "finite_difference")[:, 0] == pytest.approx([2, 0.75, 0.75, 2], abs=1e-15)
    assert tangents(t, x, "monotone")[:, 0] == pytest.approx([2, 0, 0, 2], abs=1e-15)
    assert (cubic_hermite(t, x).coefficients == cubic_hermite(t, x, tangents(t, x)).coefficients).all()
    steep = tangents([0, 1, 2], [[0], [1], [11]], "monotone")[:, 0]  # slopes 1, 10; the mean 5.5 is too steep
    cut = 3 / np.hypot(1, 5.5)
    assert steep == pytest.approx([cut, 5.5 * cut, 10], abs=1e-12)


@given(SEEDS)
def test_monotone_data_give_monotone_curves(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 12))
    steps = 10 ** rng.uniform(-3, 3, (n, 3)) * (rng.random((n, 3)) < 0.8)
    sign = rng.choice([-1, 1], 3)
    t, x = np.cumsum(10 ** rng.uniform(-1, 1, n + 1)), np.concatenate([[np.zeros(3)], np.cumsum(steps, axis=0)]) * sign
    found = cubic_hermite(t, x, tangents(t, x, "monotone")).extrema(2)
    low, high = np.where(sign > 0, found.low[1], -found.high[1]), np.where(sign > 0, found.high[1], -found.low[1])
    assert (low >= -1e-12 * high.max(axis=0)).all()


@given(SEEDS)
def test_monotone_tangents_never_leave_the_data(seed):
    _, t, x, _, _ = data(seed)
    found = cubic_hermite(t, x, tangents(t, x, "monotone")).extrema(1)
    low, high = np.minimum(x[:-1], x[1:]), np.maximum(x[:-1], x[1:])
    assert (found.low[0] >= low - 1e-12).all() and (found.high[0] <= high + 1e-12).all()
    signs = PchipInterpolator(t, x).derivative()(t)
    assert (tangents(t, x, "monotone")[1:-1][signs[1:-1] == 0] == 0).all()


def test_the_other_rules_do_overshoot():
    t, x = [0, 1, 2, 3], [[0], [0], [1], [1]]
    for rule, overshoots in (("catmull_rom", True), ("finite_difference", True), ("monotone", False)):
        found = cubic_hermite(t, x, tangents(t, x, rule)).extrema(1)
        assert (found.high[0].max() > 1.01) == overshoots


# -- 8.1: the way-point command ------------------------------------------------------------------------------------


def test_move_is_the_clamped_spline():
    curve = move(0, 0, 1, 2, 2, 3)
    assert curve([0.5, 1.5])[:, 0] == pytest.approx([0.71875, 2.78125], abs=1e-12)
    assert curve.states(1.5)[:, 0] == pytest.approx([2.78125, 0.9375, -2.25, 1.5], abs=1e-12)


@given(SEEDS)
def test_move_of_several_axes_is_every_axis_by_itself(seed):
    rng, t, x, _, _ = data(seed)
    whole, at = move(*(e for pair in zip(t, x, strict=True) for e in pair)), rng.uniform(t[0], t[-1], 30)
    for axis in range(3):
        alone = move(*(e for pair in zip(t, x[:, axis], strict=True) for e in pair))
        np.testing.assert_allclose(alone(at)[:, 0], whole(at)[:, axis], atol=1e-11)
    np.testing.assert_allclose(whole(t), x, atol=1e-12)
    np.testing.assert_allclose(whole([t[0], t[-1]], 1), 0, atol=1e-11)


def test_a_dwell_is_legal_and_equal_times_are_not():
    curve = move(0, [0, 1], 1, [2, 2], 2, [2, 2], 3, [1, 1])
    assert curve([1, 2]).tolist() == [[2, 2], [2, 2]]
    assert curve(1.5, 1)[1] == pytest.approx(0, abs=1e-12)  # that axis is the same both ways


@pytest.mark.parametrize(
    ("pairs", "field", "code"),
    [
        ((0, 0, 1, 2, 1, 3), "/times/2", "not_increasing"),
        ((0, 0, 1, 2, 0.5, 3), "/times/2", "not_increasing"),
        ((0, 0), "/waypoints", "too_few_points"),
        ((), "/waypoints", "too_few_points"),
        ((0, 0, 1), "/times", "shape_mismatch"),
        ((0, [0, 1], 1, [2]), "/waypoints/1", "shape_mismatch"),
        ((0, 0, np.nan, 2), "/times/1", "not_finite"),
        ((0, 0, 1, np.inf), "/waypoints/1/0", "not_finite"),
    ],
)
def test_bad_moves_are_refused(pairs, field, code):
    with pytest.raises(InvalidRequest) as caught:
        move(*pairs)
    assert (caught.value.errors[0].field, caught.value.errors[0].code) == (field, code)


# -- 0: bad data ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("times", "points", "code"),
    [
        ([0, 1, 1], [[0], [1], [2]], "not_increasing"),
        ([0, 2, 1], [[0], [1], [2]], "not_increasing"),
        ([0, 1], [[0], [1], [2]], "shape_mismatch"),
        ([0, 1, 2], [[0], [np.nan], [2]], "not_finite"),
        ([0], [[0]], "too_few_points"),
    ],
    ids=["repeated time", "falling time", "time missing", "nan", "one point"],
)
@pytest.mark.parametrize("make", [linear, cubic_hermite, cubic_spline, quintic_spline, septic_spline])
def test_curves_refuse_bad_data(make, times, points, code):
    with pytest.raises(InvalidRequest) as caught:
        make(times, points)
    assert caught.value.errors[0].code == code


@pytest.mark.parametrize("make", [linear, cubic_hermite, cubic_spline, quintic_spline, septic_spline])
def test_points_of_one_joint_may_be_a_vector(make):
    assert (make(T, [0, 2, 3]).coefficients == make(T, X).coefficients).all()


# -- 6.1, 13: laws -------------------------------------------------------------------------------------------------


def matrices(rng):
    """Return a regular, a singular and a 2x3 matrix."""
    return rng.normal(size=(3, 3)), np.outer(rng.normal(size=3), rng.normal(size=3)), rng.normal(size=(2, 3))


@pytest.mark.parametrize("name", CURVES)
@given(SEEDS)
def test_affine_maps_commute(name, seed):
    rng, t, x, v, a = data(seed)
    make, at = CURVES[name], np.linspace(t[0], t[-1], 40)
    curve = make(t, x, v, a)
    size = np.abs(curve(at)).max()
    for matrix in matrices(rng):
        offset = rng.normal(size=len(matrix))
        found = make(t, x @ matrix.T + offset, v @ matrix.T, a @ matrix.T)  # derivatives take the matrix only
        scale = 1 + size * np.abs(matrix).max()
        np.testing.assert_allclose(found(at), curve.mapped(matrix, offset)(at), atol=1e-10 * scale)


def test_erratum_e13_tangents_take_the_matrix_only():
    t, x, v = [0, 1], np.array([[0.0], [1]]), np.array([[1.0], [1]])
    mapped = cubic_hermite(t, x, v).mapped([[1]], [5])
    np.testing.assert_allclose(cubic_hermite(t, x + 5, v)([0.25, 0.5]), mapped([0.25, 0.5]), atol=1e-12)
    assert abs(cubic_hermite(t, x + 5, v + 5)(0.25)[0] - mapped(0.25)[0]) > 0.1


@pytest.mark.parametrize("name", CURVES)
@given(SEEDS)
def test_time_scaling(name, seed):
    rng, t, x, v, a = data(seed)
    alpha = float(rng.uniform(0.3, 3))
    make, at = CURVES[name], rng.uniform(t[0], t[-1], 30)
    fast, slow = make(t, x, v, a), make(alpha * t, x, v / alpha, a / alpha**2)
    there = np.clip(alpha * at, slow.start, slow.end)
    for order in range(4):
        wanted = fast(at, order)
        np.testing.assert_allclose(slow(there, order) * alpha**order, wanted, atol=1e-8 * (1 + np.abs(wanted).max()))
        np.testing.assert_allclose(fast.scaled(alpha).ends(order)[0] * alpha**order, fast.ends(order)[0], rtol=1e-9)


@pytest.mark.parametrize("name", CURVES)
@given(SEEDS)
def test_axes_can_be_split(name, seed):
    _, t, x, v, a = data(seed)
    make, at = CURVES[name], np.linspace(t[0], t[-1], 30)
    together = make(t, x, v, a)(at)
    alone = [make(t, *(y[:, [d]] for y in (x, v, a)))(at) for d in range(3)]
    np.testing.assert_allclose(np.concatenate(alone, axis=1), together, atol=1e-11 * (1 + np.abs(together).max()))


@pytest.mark.parametrize("name", CURVES)
@given(SEEDS)
def test_data_are_hit_and_derivatives_do_not_jump(name, seed):
    _, t, x, v, a = data(seed)
    curve = CURVES[name](t, x, v, a)
    wanted = np.vstack([x[:-1], x[:1]]) if name == "periodic" else x
    scale = max(1.0, curve.extrema(1).peak(0).max())
    np.testing.assert_allclose(curve(t), wanted, atol=1e-9 * scale)
    assert (curve.breaks == t).all()
    smooth = SMOOTH.get(name, 2)
    for order in range(smooth + 1):
        allowed = 1e-9 * scale / np.diff(t).min() ** order
        assert np.abs(curve.jumps(order)).max() <= allowed
        if name == "periodic":
            left, right = curve.ends(order)
            assert np.abs(left[0] - right[-1]).max() <= allowed
    if name != "not_a_knot":  # of three points, that is one parabola
        assert np.abs(curve.jumps(smooth + 1)).max() > 1e-6


def test_what_a_boundary_asks_is_met():
    _, t, x, v, a = data(5)

    def ends(name, order):
        return CURVES[name](t, x, v, a)([t[0], t[-1]], order)

    np.testing.assert_allclose(ends("clamped", 1), v[[0, -1]], atol=1e-9)
    np.testing.assert_allclose(ends("second_derivative", 2), a[[0, -1]], atol=1e-9)
    np.testing.assert_allclose(ends("natural", 2), 0, atol=1e-9)
    np.testing.assert_allclose(ends("mixed", 1)[0], v[0], atol=1e-9)
    np.testing.assert_allclose(ends("mixed", 2)[1], a[-1], atol=1e-9)
    np.testing.assert_allclose(ends("start_conditions", 1)[0], v[0], atol=1e-9)
    np.testing.assert_allclose(ends("start_conditions", 2)[0], a[0], atol=1e-9)
    for name in ("quintic", "septic"):
        np.testing.assert_allclose(ends(name, 1), v[[0, -1]], atol=1e-9)
        np.testing.assert_allclose(ends(name, 2), a[[0, -1]], atol=1e-9)
    knot = CURVES["not_a_knot"](t, x, v, a).jumps(3)
    np.testing.assert_allclose(knot[[0, -1]], 0, atol=1e-9)


@given(SEEDS)
def test_hermite_pieces_are_local(seed):
    rng, t, x, v, _ = data(seed)
    moved = x.copy()
    moved[-1] += rng.normal(size=3)
    same = len(t) - 2  # all pieces but the last
    here, there = (cubic_hermite(t, y, v).coefficients for y in (x, moved))
    assert (here[:, :same] == there[:, :same]).all() and (here[:, same:] != there[:, same:]).any()
    assert (cubic_spline(t, moved)(t[0] + 0.1) != cubic_spline(t, x)(t[0] + 0.1)).all()
