"""One polynomial through all points: worked numbers of the methods' sections 2.1 to 2.3, references and laws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BarycentricInterpolator, KroghInterpolator

from planner import InvalidRequest
from planner.curves import (
    barycentric,
    barycentric_weights,
    chebyshev_nodes,
    hermite,
    lagrange_basis,
    lebesgue_constant,
    polynomial,
    vandermonde,
)

SEEDS = st.integers(0, 2**32 - 1)
T, X = np.array([0.0, 1, 2, 4]), np.array([[1.0], [3], [2], [5]])
TH, XH, VH = [0, 1, 3], [[0], [2], [1]], [[1], [0], [-1]]

#: N, max errors of 1/(1 + 25 t²) at equispaced and at Chebyshev nodes, and of 1/(1 + t²) at equispaced ones.
RUNGE = [
    (4, 0.438357, 0.40202, 2.2282e-2),
    (8, 1.045174, 0.17084, 2.2584e-3),
    (10, 1.915643, 0.10915, 7.9137e-4),
    (16, 14.393851, 3.2613e-2, 3.9906e-5),
    (20, 59.822309, 1.5334e-2, 5.8480e-6),
    (30, 2387.998, 2.0615e-3, 5.4e-8),
]


def runge(t):
    return 1 / (1 + 25 * t**2)


def harmless(t):
    return 1 / (1 + t**2)


def worst(function, nodes, evaluate="trajectory"):
    """Return the largest of 4001 errors on [-1, 1]."""
    at, points = np.linspace(-1, 1, 4001), function(nodes)[:, None]
    found = barycentric(nodes, points, at) if evaluate == "barycentric" else polynomial(nodes, points, -1.0, 1.0)(at)
    return np.abs(found[:, 0] - function(at)).max()


def nodes_and_points(seed, most=9):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, most))
    t = rng.normal() + np.cumsum(rng.uniform(0.3, 1.5, n))
    return rng, t, rng.normal(size=(n, int(rng.integers(1, 4))))


# -- 2.1: the interpolating polynomial -----------------------------------------------------------------------------


def test_worked_polynomial():
    a, condition = vandermonde(T, X)
    assert a[:, 0] == pytest.approx([1, 4.6666666667, -3.25, 0.5833333333], abs=1e-9)
    assert condition > 1
    weights = barycentric_weights(T)
    assert weights / weights[0] == pytest.approx(np.array([-1 / 8, 1 / 3, -1 / 4, 1 / 24]) / (-1 / 8), rel=1e-12)
    expected = [2.59375, 2.65625, 1.5]
    assert barycentric(T, X, [0.5, 1.5, 3])[:, 0] == pytest.approx(expected, abs=1e-12)
    assert polynomial(T, X)([0.5, 1.5, 3])[:, 0] == pytest.approx(expected, abs=1e-12)
    assert polynomial(T, X).powers()[:, 0, 0] == pytest.approx(a[:, 0], abs=1e-12)


@pytest.mark.parametrize(
    ("degree", "least", "most"), [(5, 4.85e3, 4.95e3), (10, 1.15e8, 1.25e8), (15, 3.05e12, 3.15e12)]
)
def test_worked_condition_numbers(degree, least, most):
    t = np.linspace(0, 1, degree + 1)
    assert least <= vandermonde(t, t[:, None])[1] <= most


def test_worked_condition_number_past_double_precision():
    t = np.linspace(0, 1, 21)
    assert vandermonde(t, t[:, None])[1] > 1e16


@given(SEEDS)
def test_lagrange_basis(seed):
    rng, t, _ = nodes_and_points(seed)
    assert (lagrange_basis(t, t) == np.eye(len(t))).all()
    at = rng.uniform(t[0], t[-1], 20)
    values = lagrange_basis(t, at)
    np.testing.assert_allclose(values.sum(axis=-1), 1, atol=1e-12)
    for i in range(len(t)):  # the product formula, weights and all
        others = np.delete(t, i)
        product = np.prod((at[:, None] - others) / (t[i] - others), axis=1)
        np.testing.assert_allclose(values[:, i], product, atol=1e-9 * (1 + np.abs(product).max()))


@given(SEEDS)
def test_polynomial_is_scipys_and_hits_its_data(seed):
    rng, t, x = nodes_and_points(seed)
    curve, at = polynomial(t, x), rng.uniform(t[0], t[-1], 40)
    reference = BarycentricInterpolator(t, x)
    scale = 1 + np.abs(reference(at)).max()
    np.testing.assert_allclose(curve(at), reference(at), atol=1e-9 * scale)
    np.testing.assert_allclose(barycentric(t, x, at), reference(at), atol=1e-9 * scale)
    np.testing.assert_allclose(curve(t), x, atol=1e-9 * scale)
    assert (barycentric(t, x, t) == x).all()


@given(SEEDS)
def test_polynomials_are_reproduced_with_their_derivatives(seed):
    rng, t, x = nodes_and_points(seed)
    middle = t.mean()
    wanted = np.polynomial.Polynomial(rng.normal(size=int(rng.integers(1, len(t) + 1))))
    curve, at = polynomial(t, wanted(t - middle)[:, None]), np.linspace(t[0], t[-1], 30)
    for order in range(4):
        values = (wanted.deriv(order) if order else wanted)(at - middle)
        np.testing.assert_allclose(curve(at, order)[:, 0], values, atol=1e-8 * (1 + np.abs(wanted(t - middle)).max()))


@given(SEEDS)
def test_the_order_of_points_does_not_matter(seed):
    rng, t, x = nodes_and_points(seed)
    order, at = rng.permutation(len(t)), rng.uniform(t[0], t[-1], 20)
    here = barycentric(t, x, at)
    np.testing.assert_allclose(barycentric(t[order], x[order], at), here, atol=1e-10 * (1 + np.abs(here).max()))


def test_one_value_gives_a_constant():
    assert barycentric([3.0], [[5.0, 6.0]], [0, 3, 10]).tolist() == [[5, 6]] * 3
    assert polynomial([3.0], [[5.0]], 0.0, 10.0)([0, 3, 10])[:, 0].tolist() == [5, 5, 5]
    assert polynomial([3.0], [[5.0]])(3.0).tolist() == [5]
    assert chebyshev_nodes(1, 2, 4) == pytest.approx([3])


def test_fifty_chebyshev_nodes_are_stable():
    t = chebyshev_nodes(50, 2, 5)
    curve, at = polynomial(t, np.sin(7 * t)[:, None], 2.0, 5.0), np.linspace(2, 5, 1001)
    assert np.abs(curve(at)[:, 0] - np.sin(7 * at)).max() < 1e-12
    assert np.abs(curve(at, 1)[:, 0] - 7 * np.cos(7 * at)).max() < 1e-10
    noise = np.random.default_rng(2).normal(size=(50, 2))
    rough = polynomial(t, noise, 2.0, 5.0)
    np.testing.assert_allclose(rough(at), barycentric(t, noise, at), atol=1e-12 * lebesgue_constant(t, 2, 5))


def test_nodes_on_very_small_and_large_intervals_neither_overflow_nor_vanish():
    for size in (1e-6, 1e6):
        t = chebyshev_nodes(200, 0, size)
        at = np.linspace(0, size, 101)
        assert np.isfinite(barycentric_weights(t)).all()
        found = polynomial(t, np.sin(9 * t / size)[:, None], 0.0, size)(at)[:, 0]
        assert np.abs(found - np.sin(9 * at / size)).max() < 1e-11


def test_too_many_equispaced_nodes_are_refused_with_their_condition_number():
    for count in (51, 52, 80):
        t = np.linspace(0, 1, count)
        with pytest.raises(InvalidRequest) as caught:
            polynomial(t, np.sin(t)[:, None])
        error = caught.value.errors[0]
        assert (error.field, error.code) == ("/waypoints", "bad_degree")
        assert f"{lebesgue_constant(t, 0, 1):.3g}" in error.reason and "chebyshev" in error.reason
    t = np.linspace(0, 1, 50)
    curve = polynomial(t, np.sin(t)[:, None])
    assert np.abs(curve(t)[:, 0] - np.sin(t)).max() < 1e-6


def test_equal_nodes_are_refused():
    with pytest.raises(InvalidRequest) as caught:
        barycentric([0, 1, 1], [[0], [1], [2]], 0.5)
    assert caught.value.errors[0].code == "not_increasing"


@pytest.mark.parametrize(
    ("times", "points", "code"),
    [
        ([0, 1, 1], [[0], [1], [2]], "not_increasing"),
        ([0, 1], [[0], [1], [2]], "shape_mismatch"),
        ([0, 1, 2], [[0], [np.nan], [2]], "not_finite"),
    ],
    ids=["repeated time", "time missing", "nan"],
)
@pytest.mark.parametrize("make", [polynomial, lambda t, x: hermite(t, x, np.zeros((len(x), 1)))])
def test_curves_refuse_bad_data(make, times, points, code):
    with pytest.raises(InvalidRequest) as caught:
        make(times, points)
    assert caught.value.errors[0].code == code


@pytest.mark.parametrize(("name", "t"), [("first", T), ("last", T)])
def test_errata_e1_e5_the_ends_are_taken(name, t):
    i = 0 if name == "first" else -1
    assert polynomial(t, X)(t[i])[0] == pytest.approx(X[i, 0], abs=1e-12)
    assert hermite(TH, XH, VH)(TH[i])[0] == pytest.approx(XH[i][0], abs=1e-12)
    with pytest.raises(InvalidRequest):
        polynomial(t, X)(t[i] + (-1e-9 if name == "first" else 1e-9))


# -- 2.2: Runge's phenomenon ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("evaluate", ["trajectory", "barycentric"])
@pytest.mark.parametrize(("degree", "even", "chebyshev", "tame"), RUNGE)
def test_worked_runge_table_and_erratum_e3(degree, even, chebyshev, tame, evaluate):
    t, nodes = np.linspace(-1, 1, degree + 1), chebyshev_nodes(degree + 1)
    assert worst(runge, t, evaluate) == pytest.approx(even, rel=1e-4)
    assert worst(runge, nodes, evaluate) == pytest.approx(chebyshev, rel=1e-4)
    rounding = 0.05 if degree == 30 else 1e-4
    assert worst(harmless, t, evaluate) == pytest.approx(tame, rel=rounding)


def test_erratum_e3_the_function_that_does_diverge():
    def stretched(u):
        return harmless(5 * u)

    errors = [worst(stretched, np.linspace(-1, 1, n + 1)) for n in (8, 16, 30)]
    assert errors == pytest.approx([1.045174, 14.393851, 2387.998], rel=1e-4)


def test_equispaced_errors_rise_and_chebyshev_errors_fall():
    degrees = range(8, 31, 2)
    rising = [worst(runge, np.linspace(-1, 1, n + 1)) for n in degrees]
    falling = [worst(runge, chebyshev_nodes(n + 1)) for n in degrees]
    assert (np.diff(rising) > 0).all() and (np.diff(falling) < 0).all()


def test_erratum_e4_chebyshev_nodes_converge():
    analytic = [worst(runge, chebyshev_nodes(n + 1)) for n in (30, 60, 90, 120)]
    assert analytic[0] == pytest.approx(2.0615e-3, rel=1e-4)
    assert (np.array(analytic[1:]) < 0.01 * np.array(analytic[:-1])).all()  # geometric
    lipschitz = [worst(np.abs, chebyshev_nodes(n + 1)) for n in (10, 40, 160)]
    assert (np.diff(lipschitz) < 0).all() and lipschitz[-1] < 0.01
    assert worst(np.abs, np.linspace(-1, 1, 41)) > 1e3


def test_chebyshev_nodes_and_weights():
    for count in (1, 2, 7, 30):
        nodes = chebyshev_nodes(count)
        assert np.abs(np.polynomial.chebyshev.Chebyshev.basis(count)(nodes)).max() < 1e-12  # the roots of T_N+1
        assert (np.diff(nodes) > 0).all() and np.abs(nodes).max() < 1
    k = np.arange(12)[::-1]  # the formula counts from the right
    closed = (-1.0) ** k * np.sin((2 * k + 1) * np.pi / 24)
    weights = barycentric_weights(chebyshev_nodes(12, 3, 11))
    assert weights / weights[0] == pytest.approx(closed / closed[0], rel=1e-9)


# -- 2.3: osculating interpolation ---------------------------------------------------------------------------------


def test_worked_hermite():
    curve = hermite(TH, XH, VH)
    assert curve([0.5, 2])[:, 0] == pytest.approx([1.2719907407, 0.6296296296], abs=1e-9)
    assert curve([0.5, 2], 1)[:, 0] == pytest.approx([2.7210648148, -0.9629629630], abs=1e-9)


@given(SEEDS)
def test_hermite_basis(seed):
    rng, t, _ = nodes_and_points(seed, 7)
    n, at = len(t), rng.uniform(t[0], t[-1], 20)
    one, none = np.eye(n), np.zeros((n, n))
    h, hh = hermite(t, one, none), hermite(t, none, one)  # joint i: the basis function h_i, hh_i
    size = 1 + np.abs(h(at)).max() + np.abs(hh(at)).max()
    for curve, values, slopes in ((h, one, none), (hh, none, one)):
        np.testing.assert_allclose(curve(t), values, atol=1e-9 * size)
        np.testing.assert_allclose(curve(t, 1), slopes, atol=1e-8 * size)
    np.testing.assert_allclose(h(at).sum(axis=1), 1, atol=1e-9 * size)
    basis = lagrange_basis(t, at)
    slope = np.array([(1 / (t[i] - np.delete(t, i))).sum() for i in range(n)])
    np.testing.assert_allclose(h(at), (1 - 2 * slope * (at[:, None] - t)) * basis**2, atol=1e-8 * size)
    np.testing.assert_allclose(hh(at), (at[:, None] - t) * basis**2, atol=1e-8 * size)


@given(SEEDS)
def test_hermite_is_scipys(seed):
    rng, t, x = nodes_and_points(seed, 6)
    v = rng.normal(size=x.shape)
    reference = KroghInterpolator(np.repeat(t, 2), np.stack([x, v], axis=1).reshape(-1, x.shape[1]))
    curve, at = hermite(t, x, v), rng.uniform(t[0], t[-1], 30)
    for order in range(3):
        wanted = reference.derivative(at, order)
        np.testing.assert_allclose(curve(at, order), wanted, atol=1e-8 * (1 + np.abs(wanted).max()))


# -- 6.1, 13: laws -------------------------------------------------------------------------------------------------

#: Times, points, velocities -> curve.
CURVES = {"polynomial": lambda t, x, v: polynomial(t, x), "hermite": hermite}


def matrices(rng):
    """Return a regular, a singular and a 2x3 matrix."""
    return rng.normal(size=(3, 3)), np.outer(rng.normal(size=3), rng.normal(size=3)), rng.normal(size=(2, 3))


def data(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 7))
    return rng, np.cumsum(rng.uniform(0.5, 1.5, n)), rng.normal(size=(n, 3)), rng.normal(size=(n, 3))


@pytest.mark.parametrize("name", CURVES)
@given(SEEDS)
def test_affine_maps_commute(name, seed):
    rng, t, x, v = data(seed)
    make, at = CURVES[name], np.linspace(t[0], t[-1], 40)
    curve = make(t, x, v)
    size = np.abs(curve(at)).max()
    for matrix in matrices(rng):
        offset = rng.normal(size=len(matrix))
        found = make(t, x @ matrix.T + offset, v @ matrix.T)
        scale = 1 + size * np.abs(matrix).max()
        np.testing.assert_allclose(found(at), curve.mapped(matrix, offset)(at), atol=1e-10 * scale)


@given(SEEDS)
def test_erratum_e13_slopes_take_the_matrix_only(seed):
    rng, t, x, v = data(seed)
    matrix, offset = rng.normal(size=(3, 3)), rng.uniform(1, 2, 3)
    mapped = hermite(t, x, v).mapped(matrix, offset)
    wrong = hermite(t, x @ matrix.T + offset, v @ matrix.T + offset)
    at = np.linspace(t[0], t[-1], 40)
    assert np.abs(wrong(at) - mapped(at)).max() > 1e-3
    np.testing.assert_allclose((wrong(t, 1) - mapped(t, 1)), np.tile(offset, (len(t), 1)), atol=1e-7)


@pytest.mark.parametrize("name", CURVES)
@given(SEEDS)
def test_time_scaling(name, seed):
    rng, t, x, v = data(seed)
    alpha = float(rng.uniform(0.3, 3))
    make, at = CURVES[name], np.linspace(t[0], t[-1], 40)[1:-1]
    fast, slow = make(t, x, v), make(alpha * t, x, v / alpha)
    for order in range(4):
        wanted = fast(at, order)
        np.testing.assert_allclose(
            slow(alpha * at, order) * alpha**order, wanted, atol=1e-8 * (1 + np.abs(wanted).max())
        )


@pytest.mark.parametrize("name", CURVES)
@given(SEEDS)
def test_axes_can_be_split(name, seed):
    _, t, x, v = data(seed)
    make, at = CURVES[name], np.linspace(t[0], t[-1], 40)
    alone = [make(t, x[:, [d]], v[:, [d]])(at) for d in range(3)]
    together = make(t, x, v)(at)
    np.testing.assert_allclose(np.concatenate(alone, axis=1), together, atol=1e-12 * (1 + np.abs(together).max()))


@pytest.mark.parametrize("name", CURVES)
@given(SEEDS)
def test_pieces_are_one_polynomial(name, seed):
    _, t, x, v = data(seed)
    curve = CURVES[name](t, x, v)
    peaks = curve.extrema(6)
    for order in range(6):
        assert (np.abs(curve.jumps(order)) <= 1e-9 * (1 + peaks.peak(order))).all()
