"""The worked numbers of the cubic spline's boundary variants, and scipy as a second opinion."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from planner import InvalidRequest, PlanRequest, Unsupported, plan
from planner.curves.cubic import cubic_spline

T, X = [0, 1, 2], [[0], [2], [3]]


@pytest.mark.parametrize(
    ("boundary", "ends", "first", "second"),
    [
        ("clamped", (0, 0), (0, 0, 3.75, -1.75), (2, 2.25, -1.5, 0.25)),
        ("natural", (0, 0), (0, 2.25, 0, -0.25), (2, 1.5, -0.75, 0.25)),
        ("clamped", (1, -0.5), (0, 1, 1.875, -0.875), (2, 2.125, -0.75, -0.375)),
        ("second_derivative", (1, -2), (0, 1.875, 0.5, -0.375), (2, 1.75, -0.625, -0.125)),
    ],
)
def test_worked_coefficients(boundary, ends, first, second):
    curve = cubic_spline(T, X, boundary, [ends[0]], [ends[1]])
    np.testing.assert_allclose(curve.powers()[:, :, 0].T, [first, second], atol=1e-12)


def test_worked_values():
    curve = cubic_spline(T, X)
    assert curve([0.5, 1.5])[:, 0] == pytest.approx([0.71875, 2.78125], abs=1e-12)
    assert curve([0.5, 1, 1.5], 1)[:, 0] == pytest.approx([2.4375, 2.25, 0.9375], abs=1e-12)
    assert curve([0, 1, 2], 2)[:, 0] == pytest.approx([7.5, -3, -1.5], abs=1e-12)


def test_worked_unequal_knots():
    t, x = [0, 1, 3, 4], [[0], [2], [1], [3]]
    natural, clamped = cubic_spline(t, x, "natural"), cubic_spline(t, x)
    assert natural(t, 2)[:, 0] == pytest.approx([0, -3.75, 3.75, 0], abs=1e-12)
    assert natural(t, 1)[:, 0] == pytest.approx([2.625, 0.75, 0.75, 2.625], abs=1e-12)
    assert natural([0.5, 2, 3.5])[:, 0] == pytest.approx([1.234375, 1.5, 1.765625], abs=1e-12)
    assert clamped(t, 2)[:, 0] == pytest.approx([9, -6, 6, -9], abs=1e-12)
    assert clamped([0.5, 2, 3.5])[:, 0] == pytest.approx([0.8125, 1.5, 2.1875], abs=1e-12)


def test_worked_periodic():
    curve = cubic_spline([0, 1, 2, 4], [[0], [1], [-1], [0]], "periodic")
    assert curve([0, 4], 1)[:, 0] == pytest.approx([1.8, 1.8], abs=1e-12)
    assert curve([0, 4], 2)[:, 0] == pytest.approx([0.3, 0.3], abs=1e-12)
    assert curve([0.5, 1.5, 3])[:, 0] == pytest.approx([0.81875, 0.13125, -1.4], abs=1e-12)


def test_worked_start_conditions():
    curve = cubic_spline(T, X, "start_conditions", [1.0], 0, [0.0])
    assert curve.powers()[3, :, 0] == pytest.approx([1, -6])
    assert (curve(2.0, 1)[0], curve(2.0, 2)[0]) == pytest.approx((-8, -30))
    done = plan(PlanRequest.of(X, times=T, start={"velocity": [1]}), "cubic_spline", {"boundary": "start_conditions"})
    assert [n.code for n in done.notes] == ["ill_conditioned"]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("count", [2, 3, 4, 5, 30])
def test_agrees_with_scipy(count, seed):
    rng = np.random.default_rng([count, seed])
    t, x = np.cumsum(rng.uniform(0.2, 2, count)), rng.normal(size=(count, 3))
    a, b = rng.normal(size=(2, 3))
    variants = [
        ("natural", "natural"),
        ("clamped", ((1, a), (1, b))),
        ("second_derivative", ((2, a), (2, b))),
        (["clamped", "natural"], ((1, a), (2, 0 * b))),
        (["second_derivative", "clamped"], ((2, a), (1, b))),
        ("not_a_knot", "not-a-knot"),
    ]
    if count > 2:  # scipy takes not-a-knot of two points for something else
        variants += [(["not_a_knot", "second_derivative"], ("not-a-knot", (2, b)))]
        variants += [(["clamped", "not_a_knot"], ((1, a), "not-a-knot"))]
    at = np.linspace(t[0], t[-1], 101)
    for boundary, reference in variants:
        if reference == "not-a-knot" and count == 2:
            continue
        np.testing.assert_allclose(
            cubic_spline(t, x, boundary, a, b)(at), CubicSpline(t, x, bc_type=reference)(at), atol=1e-10
        )
    if count > 2:
        x[-1] = x[0]
        reference = CubicSpline(t, x, bc_type="periodic")(at)
        np.testing.assert_allclose(cubic_spline(t, x, "periodic")(at), reference, atol=1e-10)


def test_reproduces_a_cubic():
    t = np.array([0, 0.3, 1.1, 2.0])
    cubic = np.polynomial.Polynomial([1, -2, 0.5, 3])
    curve = cubic_spline(t, cubic(t)[:, None], "clamped", [cubic.deriv()(t[0])], [cubic.deriv()(t[-1])])
    at = np.linspace(0, 2, 50)
    np.testing.assert_allclose(curve(at)[:, 0], cubic(at), atol=1e-12)


def test_natural_is_the_least_bent():
    rng = np.random.default_rng(3)
    t, x = np.arange(6.0), rng.normal(size=(6, 1))
    best = cubic_spline(t, x, "natural").squared_integral(2)
    for _ in range(20):
        assert cubic_spline(t, x, "clamped", rng.normal(size=1), rng.normal(size=1)).squared_integral(2) > best


def test_a_million_knots_take_linear_memory():
    t = np.arange(200_000.0)
    curve = cubic_spline(t, np.sin(t)[:, None], "periodic" if np.sin(t[-1]) == 0 else "natural")
    assert curve.pieces == 199_999


@pytest.mark.parametrize(
    ("boundary", "points", "code"),
    [
        ("periodic", [[0], [1], [0.1]], "not_periodic"),
        ("periodic", [[0], [0]], "too_few_points"),
        ("start_conditions", [[(-1) ** i] for i in range(40)], "bad_boundary"),
    ],
)
def test_bad_boundaries(boundary, points, code):
    with pytest.raises(InvalidRequest) as caught:
        cubic_spline(np.arange(len(points)), points, boundary)
    assert caught.value.errors[0].code == code


@pytest.mark.parametrize(
    ("boundary", "sent"),
    [
        ("natural", {"start": {"velocity": [0]}}),
        ("clamped", {"start": {"acceleration": [0]}}),
        ("second_derivative", {"end": {"velocity": [0]}}),
        ("start_conditions", {"end": {"velocity": [0]}}),
        (["clamped", "natural"], {"end": {"velocity": [0]}}),
        ("periodic", {"end": {"velocity": [0]}}),
    ],
)
def test_what_a_boundary_does_not_take_is_refused(boundary, sent):
    points = [[0], [1], [0]]
    with pytest.raises(Unsupported):
        plan(PlanRequest.of(points, times=T, **sent), "cubic_spline", {"boundary": boundary})
