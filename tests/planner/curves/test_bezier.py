"""Bézier curves: laws and references first, then the worked numbers; composite curves and their joints."""

from math import comb

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BPoly
from scipy.spatial import ConvexHull

from planner import InvalidRequest
from planner.curves import (
    bernstein_basis,
    bezier,
    composite_bezier,
    control_points,
    cubic_spline,
    de_casteljau,
    derivative_points,
    elevated,
    subdivided,
)

SEEDS = st.integers(0, 2**32 - 1)
P = np.array([[0, 0], [1, 2], [3, 3], [4, 0]], dtype=float)


def points_of(seed, degrees=(1, 12)):
    rng = np.random.default_rng(seed)
    n, dims = int(rng.integers(*degrees)), int(rng.integers(1, 4))
    return rng, rng.normal(size=(n + 1, dims)) * 10.0 ** rng.uniform(-2, 2)


def by_casteljau(points, s):
    return np.stack([de_casteljau(points, x) for x in s])


def changes(values):
    """Number of sign changes along the values, zeros left out."""
    signs = np.sign(values[np.abs(values) > 1e-9])
    return int((signs[1:] != signs[:-1]).sum())


# -- laws ----------------------------------------------------------------------------------------------------------


@given(SEEDS)
def test_weights_are_not_negative_and_sum_to_one(seed):
    rng = np.random.default_rng(seed)
    n, s = int(rng.integers(0, 40)), np.concatenate([[0.0, 1.0], rng.uniform(0, 1, 20)])
    weights = bernstein_basis(n, s)
    assert weights.shape == (22, n + 1) and (weights >= 0).all()
    assert np.abs(weights.sum(axis=-1) - 1).max() <= 1e-12
    # an affine invariant sum must also reproduce the line: the weighted mean of i / n is s
    if n:
        assert np.abs(weights @ (np.arange(n + 1) / n) - s).max() <= 1e-12


@given(SEEDS)
def test_curve_stays_in_the_box_of_its_points_and_meets_its_ends(seed):
    rng, p = points_of(seed, (1, 60))
    start, end = np.sort(rng.uniform(-3, 3, 2)) + [0, 0.1]
    curve = bezier(p, start, end)
    values, span = curve(np.linspace(start, end, 301)), np.ptp(p, axis=0)
    slack = 1e-12 * (span + np.abs(p).max())
    assert (values >= p.min(axis=0) - slack).all() and (values <= p.max(axis=0) + slack).all()
    n, h = len(p) - 1, end - start
    for at, value, slope in ((start, p[0], p[1] - p[0]), (end, p[-1], p[-1] - p[-2])):
        assert np.abs(curve(at) - value).max() <= 1e-12 * np.abs(p).max()
        assert np.abs(curve(at, 1) - n * slope / h).max() <= 1e-9 * n * np.abs(p).max() / h


@given(SEEDS)
def test_curve_stays_in_the_convex_hull(seed):
    rng = np.random.default_rng(seed)
    p = rng.normal(size=(int(rng.integers(4, 12)), 2))
    hull = ConvexHull(p).equations
    values = bezier(p)(np.linspace(0, 1, 101))
    assert (values @ hull[:, :2].T + hull[:, 2] <= 1e-12).all()


@given(SEEDS)
def test_agrees_with_de_casteljau_and_with_scipy(seed):
    _, p = points_of(seed, (1, 25))
    s, size = np.linspace(0, 1, 41), np.abs(p).max()
    curve = bezier(p)
    assert np.abs(curve(s) - by_casteljau(p, s)).max() <= 1e-12 * size
    reference = BPoly(p[:, None, :], [0, 1])
    n = len(p) - 1
    for order in range(min(4, n + 1)):
        scale = size * np.prod([float(n - k) * 2 for k in range(order)])
        assert np.abs(curve(s, order) - reference(s, nu=order)).max() <= 1e-10 * (scale + size)


@pytest.mark.parametrize("degree", [6, 30, 100, 200])
@pytest.mark.parametrize("seed", range(3))
def test_high_degrees_keep_their_digits(degree, seed):
    p = np.random.default_rng([degree, seed]).normal(size=(degree + 1, 2))
    s = np.linspace(0, 1, 157)
    curve = bezier(p)
    assert np.abs(curve(s) - by_casteljau(p, s)).max() <= 1e-12
    q = p
    for order in (1, 2):
        q = derivative_points(q)
        assert np.abs(curve(s, order) - by_casteljau(q, s)).max() <= 1e-11 * np.abs(q).max()
        assert np.abs(curve.jumps(order)).max() <= 1e-11 * np.abs(q).max()


def test_a_degree_over_the_highest_is_refused():
    with pytest.raises(InvalidRequest) as caught:
        bezier(np.arange(202.0)[:, None])
    assert caught.value.errors[0].code == "bad_degree"


@given(SEEDS)
def test_affine_maps_commute(seed):
    """Also singular ones, and ones into another dimension."""
    rng, p = points_of(seed)
    dims, s = p.shape[1], np.linspace(0, 1, 30)
    plain = bezier(p)(s)
    singular = np.outer(rng.normal(size=dims), rng.normal(size=dims))
    for matrix in (rng.normal(size=(dims, dims)), singular, rng.normal(size=(2, dims)), rng.normal(size=(5, dims))):
        offset = rng.normal(size=len(matrix))
        image = p @ matrix.T + offset
        found = bezier(image)(s)
        assert np.abs(found - (plain @ matrix.T + offset)).max() <= 1e-10 * (1 + np.abs(image).max())


@given(SEEDS)
def test_points_reversed_run_backwards(seed):
    _, p = points_of(seed, (1, 60))
    s = np.linspace(0, 1, 30)
    assert np.abs(bezier(p)(s) - bezier(p[::-1])(1 - s)).max() <= 1e-12 * np.abs(p).max()


@given(SEEDS)
def test_elevation_and_subdivision_leave_the_curve(seed):
    rng, p = points_of(seed)
    s, curve, size = np.linspace(0, 1, 30), bezier(p), np.abs(p).max()
    more = elevated(p)
    assert more.shape == (len(p) + 1, p.shape[1])
    assert np.abs(bezier(elevated(more))(s) - curve(s)).max() <= 1e-12 * size
    cut = float(rng.uniform(0.05, 0.95))
    left, right = subdivided(p, cut)
    assert np.abs(bezier(left, 0, cut)(cut * s) - curve(cut * s)).max() <= 1e-12 * size
    rest = np.clip(cut + (1 - cut) * s, cut, 1)
    assert np.abs(bezier(right, cut, 1)(rest) - curve(rest)).max() <= 1e-12 * size
    assert (left[-1] == right[0]).all() and (left[0] == p[0]).all() and (right[-1] == p[-1]).all()


@given(SEEDS)
def test_variation_diminishes(seed):
    """No line is crossed more often by the curve than by the polygon of its points."""
    rng = np.random.default_rng(seed)
    p = rng.normal(size=(int(rng.integers(3, 15)), 2))
    values = bezier(p)(np.linspace(0, 1, 400))
    for _ in range(20):
        normal, offset = rng.normal(size=2), rng.normal() * 0.5
        assert changes(values @ normal - offset) <= changes(p @ normal - offset)


@given(SEEDS)
def test_control_points_come_back_from_the_monomials(seed):
    rng = np.random.default_rng(seed)
    n, pieces = int(rng.integers(1, 6)), int(rng.integers(1, 5))
    p = rng.normal(size=(n + 1, pieces, 2))
    p[0, 1:] = p[-1, :-1]
    curve = composite_bezier(p, np.cumsum(rng.uniform(0.1, 2, pieces + 1)))
    assert np.abs(control_points(curve) - p).max() <= 1e-12 * 3**n


@given(SEEDS)
def test_derivatives_scale_with_the_interval(seed):
    rng, p = points_of(seed, (3, 6))
    h = float(10.0 ** rng.uniform(-2, 2))
    s = np.linspace(0, 1, 11)
    for order in range(4):
        slow = bezier(p, 5.0, 5.0 + h)(np.clip(5 + s * h, 5, 5 + h), order) * h**order
        fast = bezier(p)(s, order)
        assert np.abs(slow - fast).max() <= 1e-9 * (1 + np.abs(fast).max()) * max(1.0, 1.0 / h)


def test_one_point_is_a_constant_with_zero_derivatives():
    curve = bezier([[2.0, -1.0]])
    assert (curve([0, 0.5, 1]) == [2, -1]).all() and (curve([0, 0.5, 1], 1) == 0).all()
    assert derivative_points([[2.0, -1.0]]).tolist() == [[0, 0]]


def test_first_points_that_coincide_start_at_rest_towards_the_first_distinct_one():
    curve = bezier([[0, 0], [0, 0], [3, 4], [1, 1]])
    assert (curve(0.0, 1) == 0).all()
    direction = curve(1e-6, 1)
    assert direction / np.linalg.norm(direction) == pytest.approx([0.6, 0.8], abs=1e-5)


def test_derivatives_beyond_the_degree_are_zero():
    curve = bezier(P)
    assert (curve([0, 0.3, 1], 4) == 0).all() and (curve([0, 0.3, 1], 5) == 0).all()


# -- worked numbers ------------------------------------------------------------------------------------------------


def test_worked_values_and_derivatives():
    curve = bezier(P)
    np.testing.assert_allclose(curve([0.25, 0.5]), [[0.90625, 1.265625], [2, 1.875]], rtol=0, atol=1e-12)
    np.testing.assert_allclose(curve([0.25, 0.5], 1), [[4.125, 3.9375], [4.5, 0.75]], rtol=0, atol=1e-12)
    np.testing.assert_allclose(curve(0.5, 2), [0, -15], rtol=0, atol=1e-12)
    np.testing.assert_allclose(curve([0, 0.4, 1], 3), [[-12, -18]] * 3, rtol=0, atol=1e-11)
    np.testing.assert_allclose(de_casteljau(P, 0.25), [0.90625, 1.265625], rtol=0, atol=1e-12)
    np.testing.assert_allclose(de_casteljau(derivative_points(P), 0.25), [4.125, 3.9375], rtol=0, atol=1e-12)


def test_worked_split_and_elevation():
    left, right = subdivided(P, 0.25)
    np.testing.assert_allclose(left, [[0, 0], [0.25, 0.5], [0.5625, 0.9375], [0.90625, 1.265625]], rtol=0, atol=1e-12)
    np.testing.assert_allclose(right, [[0.90625, 1.265625], [1.9375, 2.25], [3.25, 2.25], [4, 0]], rtol=0, atol=1e-12)
    np.testing.assert_allclose(elevated(P), [[0, 0], [0.75, 1.5], [2, 2.5], [3.25, 2.25], [4, 0]], rtol=0, atol=1e-12)


def test_E7_the_quadratics_derivatives():
    """2 (1-s) (P1-P0) + 2 s (P2-P1) and 2 (P0 - 2 P1 + P2), with ds/dt once and squared: 2 for points 0, 1, 3."""
    points = np.array([[0.0], [1.0], [3.0]])
    curve = bezier(points)
    assert curve([0, 0.5, 1], 2)[:, 0] == pytest.approx([2, 2, 2], abs=1e-12)
    s = np.linspace(0, 1, 7)
    assert curve(s, 1)[:, 0] == pytest.approx(2 * (1 - s) * 1 + 2 * s * 2, abs=1e-12)
    wrong = 2 * (s - 1) * 1 + 2 * s * 2
    assert np.abs(curve(s, 1)[:, 0] - wrong).max() > 1
    slow = bezier(points, 0, 4)
    assert slow(1.0, 1)[0] == pytest.approx((2 * 0.75 + 2 * 0.25 * 2) / 4, abs=1e-12)
    assert slow(1.0, 2)[0] == pytest.approx(2 / 16, abs=1e-12)


def test_E8_the_derivatives_weights():
    """C(n-1, i) s^i (1-s)^(n-1-i): exchanged exponents would give (4.125, -3.5625) at 0.25."""
    s, n = 0.25, 3
    steps = n * np.diff(P, axis=0)
    right = sum(comb(n - 1, i) * s**i * (1 - s) ** (n - 1 - i) * steps[i] for i in range(n))
    wrong = sum(comb(n - 1, i) * s ** (n - 1 - i) * (1 - s) ** i * steps[i] for i in range(n))
    assert wrong == pytest.approx([4.125, -3.5625], abs=1e-12)
    found = bezier(P)(s, 1)
    assert found == pytest.approx([4.125, 3.9375], abs=1e-12) and found == pytest.approx(right, abs=1e-12)
    assert (derivative_points(P) == steps).all()
    assert bernstein_basis(2, s) @ derivative_points(P) == pytest.approx(right, abs=1e-12)


# -- composite curves ----------------------------------------------------------------------------------------------

MANCHESTER = np.array([[0, 2], [0, 2.75], [1.25, 3], [2, 3]])[:, :, None]


def test_worked_composite_is_the_cubic_spline():
    spline = cubic_spline([0, 1, 2], [[0], [2], [3]])
    np.testing.assert_allclose(control_points(spline), MANCHESTER, rtol=0, atol=1e-12)
    composed = composite_bezier(MANCHESTER, [0, 1, 2], "C2")
    np.testing.assert_allclose(composed.powers(), spline.powers(), rtol=0, atol=1e-12)
    assert composed([0.5, 1.5])[:, 0] == pytest.approx([0.71875, 2.78125], abs=1e-12)
    assert composed([0, 1, 2], 2)[:, 0] == pytest.approx([7.5, -3, -1.5], abs=1e-12)


def joined(h, smooth):
    """Random cubic segments, joined as the formulas of C1 and C2 with durations h say."""
    rng = np.random.default_rng(5)
    p = rng.normal(size=(4, len(h), 2))
    for k in range(1, len(h)):
        ratio = h[k] / h[k - 1]
        p[0, k] = p[3, k - 1]
        if smooth >= 1:
            p[1, k] = p[0, k] + ratio * (p[3, k - 1] - p[2, k - 1])
        if smooth >= 2:
            bend = ratio**2 * (p[3, k - 1] - 2 * p[2, k - 1] + p[1, k - 1])
            p[2, k] = bend + 2 * p[1, k] - p[0, k]
    return p


@pytest.mark.parametrize("smooth", [0, 1, 2])
@pytest.mark.parametrize("h", [(1.0, 1.0, 1.0), (0.5, 2.0, 0.1)], ids=["even", "uneven"])
def test_joints_are_accepted_up_to_their_class_and_refused_beyond(smooth, h):
    breaks, p = np.concatenate([[0.0], np.cumsum(h)]), joined(h, smooth)
    for asked in range(3):
        if asked <= smooth:
            curve = composite_bezier(p, breaks, f"C{asked}")
            for order in range(asked + 1):
                assert np.abs(curve.jumps(order)).max() <= 1e-9 * max(1.0, np.abs(curve.extrema(4).peak(order)).max())
        else:
            with pytest.raises(InvalidRequest) as caught:
                composite_bezier(p, breaks, f"C{asked}")
            assert caught.value.errors[0].code == "conflict"
            assert ("position", "velocity", "acceleration")[smooth + 1] in caught.value.errors[0].reason


def test_joints_depend_on_the_durations():
    """Points that join C1 and C2 at even durations do not at uneven ones, though their direction is the same."""
    p = joined((1.0, 1.0, 1.0), 2)
    composite_bezier(p, [0, 1, 2, 3], "C2")
    with pytest.raises(InvalidRequest):
        composite_bezier(p, [0, 1, 3, 4], "C1")
    curve = composite_bezier(p, [0, 1, 3, 4], "C0")
    left, right = curve.ends(1)
    assert np.abs(right[0] - 2 * left[1]).max() <= 1e-12 * np.abs(right).max()


@pytest.mark.parametrize("gap, meets", [(1e-6, False), (3e-9, False), (1e-12, True)])
def test_segments_that_do_not_meet_are_refused(gap, meets):
    p = MANCHESTER.copy()
    p[0, 1] += gap * np.ptp(p)
    if meets:
        assert composite_bezier(p, [0, 1, 2]).pieces == 2
        return
    with pytest.raises(InvalidRequest) as caught:
        composite_bezier(p, [0, 1, 2])
    assert caught.value.errors[0].code == "conflict" and "position" in caught.value.errors[0].reason


@pytest.mark.parametrize("breaks", [[0, 1], [0, 1, 1], [0, 2, 1], [0, 1, 2, 3]])
def test_breaks_that_do_not_fit_are_refused(breaks):
    with pytest.raises(InvalidRequest) as caught:
        composite_bezier(MANCHESTER, breaks)
    assert caught.value.errors[0].code == "bad_knots"


@pytest.mark.parametrize("degree", [8, 40])
def test_composite_curves_of_high_degree(degree):
    rng = np.random.default_rng(degree)
    p = rng.normal(size=(degree + 1, 3, 2))
    p[0, 1:] = p[-1, :-1]
    breaks, s = np.array([0.0, 0.3, 2.0, 2.5]), np.linspace(0, 1, 23)
    curve = composite_bezier(p, breaks)
    for k in range(3):
        at = np.clip(breaks[k] + s * (breaks[k + 1] - breaks[k]), 0, 2.5)
        assert np.abs(curve(at) - by_casteljau(p[:, k], s)).max() <= 1e-11
