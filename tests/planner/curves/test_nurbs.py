"""Rational B-splines: circles, invariances, the quotient's derivatives, and the worked numbers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from planner import InvalidRequest
from planner.curves import bspline, inserted, nurbs

SEEDS = st.integers(0, 2**32 - 1)
HALF = np.sqrt(0.5)
QUARTER = ([[1, 0], [1, 1], [0, 1]], [1, HALF, 1], [0, 0, 0, 1, 1, 1], 2)
CIRCLE = (
    [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]],
    [1, HALF, 1, HALF, 1, HALF, 1, HALF, 1],
    [0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1],
    2,
)


def random_nurbs(seed, spread=1.0):
    """Points, weights between 10^-spread and 10^spread, knots with multiplicities, degree."""
    rng = np.random.default_rng(seed)
    degree = int(rng.integers(1, 7))
    inner: list[float] = []
    for t in np.cumsum(rng.uniform(0.2, 1.5, int(rng.integers(0, 4)))):
        inner += [float(t)] * int(rng.integers(1, degree + 1) if rng.random() < 0.4 else 1)
    end = (inner[-1] if inner else 0.0) + float(rng.uniform(0.2, 1.5))
    knots = np.array([0.0] * (degree + 1) + inner + [end] * (degree + 1))
    count = len(knots) - degree - 1
    points = rng.normal(size=(count, int(rng.integers(1, 4))))
    return rng, points, 10.0 ** rng.uniform(-spread, spread, count), knots, degree


def reference(points, weights, knots, degree):
    """The curve as a function of times by scipy: a quotient of two splines."""
    above = BSpline(knots, np.asarray(points) * np.asarray(weights)[:, None], degree)
    below = BSpline(knots, np.asarray(weights, dtype=float), degree)
    return above, below


def at_of(curve, count=80):
    return np.clip(np.linspace(curve.start, curve.end, count), curve.start, curve.end)


# -- laws ----------------------------------------------------------------------------------------------------------


@given(SEEDS)
def test_values_and_derivatives_are_the_quotient_formulas(seed):
    """s = A / W, s' = (A' - W' s) / W, s'' = (A'' - 2 W' s' - W'' s) / W, with A and W by scipy."""
    _, points, weights, knots, degree = random_nurbs(seed)
    curve = nurbs(points, weights, knots, degree)
    above, below = reference(points, weights, knots, degree)
    at = at_of(curve)[:-1]
    a, w = ([f(at, nu=m) if m <= degree else np.zeros_like(f(at)) for m in range(3)] for f in (above, below))
    w = [x[:, None] for x in w]
    s = a[0] / w[0]
    first = (a[1] - w[1] * s) / w[0]
    second = (a[2] - 2 * w[1] * first - w[2] * s) / w[0]
    for order, expected in enumerate((s, first, second)):
        assert np.abs(curve(at, order) - expected).max() <= 1e-9 * (1 + np.abs(expected).max())


@given(SEEDS)
def test_equal_weights_are_the_b_spline(seed):
    rng, points, _, knots, degree = random_nurbs(seed)
    curve = nurbs(points, np.full(len(points), 10.0 ** rng.uniform(-3, 3)), knots, degree)
    plain = bspline(points, knots, degree)
    assert (curve.weights[:-1] == 0).all() and (curve.weights[-1] == 1).all()  # said all the same: always rational
    assert np.abs(curve(at_of(plain)) - plain(at_of(plain))).max() <= 1e-14 * np.abs(points).max()


@given(SEEDS)
def test_nearly_equal_weights_are_nearly_the_b_spline(seed):
    """So the rational road leads to the same place as the polynomial one that equal weights take."""
    rng, points, _, knots, degree = random_nurbs(seed)
    weights = 1 + 1e-9 * rng.uniform(-1, 1, len(points))
    curve, plain = nurbs(points, weights, knots, degree), bspline(points, knots, degree)
    assert curve.weights is not None
    assert np.abs(curve(at_of(plain)) - plain(at_of(plain))).max() <= 1e-8 * np.abs(points).max()


@given(SEEDS)
def test_a_common_factor_of_the_weights_changes_nothing(seed):
    rng, points, weights, knots, degree = random_nurbs(seed, 2.0)
    one = nurbs(points, weights, knots, degree)
    other = nurbs(points, weights * 10.0 ** rng.uniform(-6, 6), knots, degree)
    for order in range(3):
        a, b = one(at_of(one), order), other(at_of(one), order)
        assert np.abs(a - b).max() <= 1e-9 * (1 + np.abs(one.ends(order)).max())


@given(SEEDS)
def test_curve_stays_in_the_box_of_its_points(seed):
    _, points, weights, knots, degree = random_nurbs(seed, 2.0)
    curve = nurbs(points, weights, knots, degree)
    values = curve(at_of(curve, 200))
    assert (values >= points.min(axis=0) - 1e-10).all() and (values <= points.max(axis=0) + 1e-10).all()
    assert curve(curve.start) == pytest.approx(points[0], abs=1e-10)
    assert curve(curve.end) == pytest.approx(points[-1], abs=1e-10)


@given(SEEDS)
def test_a_large_weight_draws_the_curve(seed):
    rng, points, weights, knots, degree = random_nurbs(seed, 0.5)
    i = int(rng.integers(len(points)))
    heavy = weights.copy()
    heavy[i] *= 1000
    nearest = [
        np.linalg.norm(nurbs(points, w, knots, degree)(np.linspace(knots[0], knots[-1], 400)) - points[i], axis=1).min()
        for w in (weights, heavy)
    ]
    assert nearest[1] <= nearest[0] + 1e-12


@given(SEEDS)
def test_affine_maps_commute(seed):
    """Also singular ones, and ones into another dimension."""
    rng, points, weights, knots, degree = random_nurbs(seed)
    dims, curve = points.shape[1], nurbs(points, weights, knots, degree)
    plain = curve(at_of(curve))
    singular = np.outer(rng.normal(size=dims), rng.normal(size=dims))
    for matrix in (rng.normal(size=(dims, dims)), singular, rng.normal(size=(2, dims))):
        offset = rng.normal(size=len(matrix))
        image = points @ matrix.T + offset
        found = nurbs(image, weights, knots, degree)(at_of(curve))
        assert np.abs(found - (plain @ matrix.T + offset)).max() <= 1e-10 * (1 + np.abs(image).max())


@given(SEEDS)
def test_projective_maps_commute(seed):
    """x -> (A x + b) / (c x + d) of the curve is the NURBS of the mapped points with weights w (c x + d)."""
    rng, points, weights, knots, degree = random_nurbs(seed)
    dims = points.shape[1]
    a, b, c = rng.normal(size=(dims, dims)), rng.normal(size=dims), rng.normal(size=dims)
    d = 0.5 + float(np.abs(points @ c).max())
    below = points @ c + d
    mapped = nurbs((points @ a.T + b) / below[:, None], weights * below, knots, degree)
    plain = nurbs(points, weights, knots, degree)(at_of(mapped))
    expected = (plain @ a.T + b) / (plain @ c + d)[:, None]
    assert np.abs(mapped(at_of(mapped)) - expected).max() <= 1e-9 * (1 + np.abs(expected).max())


@given(SEEDS)
def test_points_reversed_run_backwards(seed):
    _, points, weights, knots, degree = random_nurbs(seed)
    there = nurbs(points, weights, knots, degree)
    back = nurbs(points[::-1], weights[::-1], (knots[-1] - knots)[::-1], degree)
    at = at_of(there)
    assert np.abs(there(at) - back(np.clip(knots[-1] - at, back.start, back.end))).max() <= 1e-10


@given(SEEDS)
def test_inserted_knots_leave_the_curve(seed):
    """Boehm's algorithm on the homogeneous points."""
    rng, points, weights, knots, degree = random_nurbs(seed)
    curve = nurbs(points, weights, knots, degree)
    time = float(rng.uniform(knots[0], knots[-1]))
    whole = np.concatenate([points * weights[:, None], weights[:, None]], axis=1)
    more_knots, more = inserted(knots, whole, degree, time)
    finer = nurbs(more[:, :-1] / more[:, -1:], more[:, -1], more_knots, degree)
    assert np.abs(finer(at_of(curve)) - curve(at_of(curve))).max() <= 1e-10 * (1 + np.abs(points).max())


# -- circles and worked numbers ------------------------------------------------------------------------------------


def test_worked_quarter_circle():
    curve = nurbs(*QUARTER)
    np.testing.assert_allclose(curve(0.25), [0.92978830, 0.36809471], rtol=0, atol=5e-9)
    np.testing.assert_allclose(curve(0.5), [HALF, HALF], rtol=0, atol=1e-12)
    assert np.abs(np.linalg.norm(curve(np.linspace(0, 1, 1001)), axis=1) - 1).max() <= 1e-12
    # u = 0.25 by hand: weights 9/16, 6/16 sqrt(1/2), 1/16
    w = np.array([9, 6 * HALF, 1]) / 16
    expected = (w @ np.array(QUARTER[0], dtype=float)) / w.sum()
    np.testing.assert_allclose(curve(0.25), expected, rtol=0, atol=1e-15)


def test_worked_full_circle():
    curve = nurbs(*CIRCLE)
    assert curve.pieces == 4 and curve.degree == 2 and curve.weights.shape == (3, 4)
    np.testing.assert_allclose(curve(0.1), [0.81382604, 0.58110858], rtol=0, atol=5e-9)
    np.testing.assert_allclose(curve(0.3), [-0.29381194, 0.95586325], rtol=0, atol=5e-9)
    radius = np.linalg.norm(curve(np.linspace(0, 1, 4001)), axis=1)
    assert np.abs(radius - 1).max() <= 1e-13
    assert np.median(np.abs(radius - 1)) <= 1e-14
    assert (curve(1.0) == curve(0.0)).all()


def test_the_circles_derivatives_obey_the_circle():
    """Of x·x = 1: x·x' = 0 and x·x'' + x'·x' = 0; the third: x·x''' + 3 x'·x'' = 0."""
    curve = nurbs(*CIRCLE)
    at = np.linspace(0, 1, 997)
    x, v, a, j = (curve(at, m) for m in range(4))

    def dot(p, q):
        return (p * q).sum(axis=1)

    assert np.linalg.norm(v, axis=1).min() > 5
    assert np.abs(dot(x, v)).max() <= 1e-11
    assert np.abs(dot(x, a) + dot(v, v)).max() <= 1e-9
    assert np.abs(dot(x, j) + 3 * dot(v, a)).max() <= 1e-8


def test_the_circle_is_c1_in_its_parameter_and_no_smoother():
    """Double knots promise C0; by symmetry the velocity is continuous too, and the acceleration towards the centre."""
    curve = nurbs(*CIRCLE)
    assert np.abs(curve.jumps(1)).max() <= 1e-12
    jumps, here = curve.jumps(2), curve([0.25, 0.5, 0.75])
    tangent = np.stack([-here[:, 1], here[:, 0]], axis=1)
    assert np.abs((jumps * here).sum(axis=1)).max() <= 1e-10
    assert np.abs((jumps * tangent).sum(axis=1)).min() > 20


def test_derivatives_by_the_complex_step():
    """Im f(t + i h) / h of the quotient, evaluated with complex times: exact to the last digits, no differences."""
    points, weights = np.array(QUARTER[0], dtype=float), np.array(QUARTER[1])
    curve = nurbs(*QUARTER)

    def complex_value(u, derivative):
        basis = np.array([(1 - u) ** 2, 2 * u * (1 - u), u**2])
        if not derivative:
            w = weights @ basis
            return (weights * basis) @ points / w
        slope = np.array([-2 * (1 - u), 2 - 4 * u, 2 * u])
        w, dw = weights @ basis, weights @ slope
        return ((weights * slope) @ points * w - (weights * basis) @ points * dw) / w**2

    for u in np.linspace(0.01, 0.99, 25):
        first = complex_value(u + 1e-30j, False).imag / 1e-30
        second = complex_value(u + 1e-30j, True).imag / 1e-30
        assert curve(u, 1) == pytest.approx(first, abs=1e-13)
        assert curve(u, 2) == pytest.approx(second, abs=1e-12)


def test_other_conics():
    """One middle weight w: below 1 an ellipse's arc, 1 a parabola's, above a hyperbola's."""
    points, knots = [[0, 0], [1, 1], [2, 0]], [0, 0, 0, 1, 1, 1]
    for weight in (0.3, 1.0, 4.0):
        x, y = nurbs(points, [1, weight, 1], knots, 2)(np.linspace(0, 1, 50)).T
        p = 1 - x  # implicit form of the conic: with barycentric a, b, c of the points, b² = 4 w² a c
        b, a = y, (p + 1 - y) / 2
        assert np.abs(b**2 - 4 * weight**2 * a * (1 - a - b)).max() <= 1e-13
        assert nurbs(points, [1, weight, 1], knots, 2)(0.5)[1] == pytest.approx(weight / (1 + weight), abs=1e-14)


# -- bad input -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "changes, field, code",
    [
        ({"weights": [1, 0, 1]}, "/options/weights/1", "bad_weights"),
        ({"weights": [1, -1, 1]}, "/options/weights/1", "bad_weights"),
        ({"weights": [-1, -1, -1]}, "/options/weights/0", "bad_weights"),
        ({"weights": [1, 1, np.nan]}, "/options/weights/2", "bad_weights"),
        ({"weights": [1, 1, 3e6]}, "/options/weights", "bad_weights"),
        ({"weights": [1, 1]}, "/options/weights", "shape_mismatch"),
        ({"knots": [0, 0, 0, 1, 1]}, "/options/knots", "bad_knots"),
        ({"knots": [0, 0, 0, 1, 1, 0.5]}, "/options/knots/5", "bad_knots"),
        ({"knots": [0, 0, 0, 0, 1, 1]}, "/options/knots", "bad_knots"),
        ({"degree": 0}, "/options/degree", "bad_degree"),
        ({"degree": 3}, "/waypoints", "too_few_points"),
    ],
)
def test_bad_input(changes, field, code):
    given_ = dict(zip(("points", "weights", "knots", "degree"), QUARTER, strict=True)) | changes
    with pytest.raises(InvalidRequest) as caught:
        nurbs(**given_)
    error = caught.value.errors[0]
    assert (error.field, error.code) == (field, code)
