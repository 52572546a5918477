"""B-splines: the recursion in fractions and scipy as references, laws, and the worked numbers."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline, make_interp_spline
from scipy.spatial import ConvexHull

from planner import InvalidRequest, PlanRequest, plan
from planner.curves import (
    basis_values,
    bezier,
    bspline,
    clamped_knots,
    cubic_hermite,
    cubic_spline,
    de_boor,
    hermite,
    inserted,
    interpolating_points,
    interpolation_knots,
)

SEEDS = st.integers(0, 2**32 - 1)
KNOTS = [0, 0, 0, 0, 0.5, 1, 1, 1, 1]
P = np.array([[0, 0], [1, 2], [3, 3], [4, 0], [6, 1]], dtype=float)


def raw(knots, i, p, t):
    """The recursion as it is written, half-open spans everywhere, 0/0 = 0; exact in fractions."""
    if p == 0:
        return Fraction(int(knots[i] <= t < knots[i + 1]))
    total = Fraction(0)
    if knots[i + p] > knots[i]:
        total += (t - knots[i]) / Fraction(knots[i + p] - knots[i]) * raw(knots, i, p - 1, t)
    if knots[i + p + 1] > knots[i + 1]:
        total += (knots[i + p + 1] - t) / Fraction(knots[i + p + 1] - knots[i + 1]) * raw(knots, i + 1, p - 1, t)
    return total


def whole(knots, degree, times):
    """The library's basis values as a full matrix, (M, N)."""
    knots = np.asarray(knots, dtype=float)
    j, values = basis_values(knots, degree, np.asarray(times, dtype=float))
    out = np.zeros((len(values), len(knots) - degree - 1))
    for row, (span, v) in enumerate(zip(j, values, strict=True)):
        out[row, span - degree : span + 1] = v
    return out


def random_knots(rng, count, degree, clamped=True):
    """Increasing knots with some interior ones repeated up to degree times; with or without clamped ends."""
    inner = []
    while len(inner) < count - degree - 1:
        inner += [float(rng.uniform(0, 10))] * int(rng.integers(1, degree + 1) if rng.random() < 0.3 else 1)
    inner = np.sort(inner[: count - degree - 1])
    if clamped:
        return np.concatenate([np.full(degree + 1, -0.5), inner, np.full(degree + 1, 10.5)])
    before, after = (np.sort(rng.uniform(0.1, 3, degree + 1)) for _ in range(2))
    return np.concatenate([-before[::-1], inner, 10 + after])


def random_spline(seed, clamped=None):
    rng = np.random.default_rng(seed)
    degree = int(rng.integers(1, 8))
    count = degree + 1 + int(rng.integers(0, 9))
    knots = random_knots(rng, count, degree, rng.random() < 0.6 if clamped is None else clamped)
    return rng, degree, knots, rng.normal(size=(count, int(rng.integers(1, 4))))


def span_of(knots, degree, count=60):
    return np.clip(np.linspace(knots[degree], knots[-degree - 1], count), knots[degree], knots[-degree - 1])


# -- laws and references -------------------------------------------------------------------------------------------


@given(SEEDS)
def test_weights_are_the_recursions_not_negative_and_of_sum_one(seed):
    rng = np.random.default_rng(seed)
    degree = int(rng.integers(1, 5))
    knots = np.sort(rng.integers(0, 9, 2 * degree + 5)) / 4  # quarters: exact, and full of multiplicities
    multiple = (knots[degree + 1 :] == knots[: -degree - 1]).any()
    if multiple or not knots[degree] < knots[-degree - 1]:
        return
    exact = [Fraction(k) for k in knots]
    times = np.arange(int(knots[degree] * 16), int(knots[-degree - 1] * 16)) / 16
    values = whole(knots, degree, times)
    assert (values >= 0).all() and np.abs(values.sum(axis=1) - 1).max() <= 1e-14
    reference = [[raw(exact, i, degree, Fraction(t)) for i in range(values.shape[1])] for t in times[::3]]
    assert np.abs(values[::3] - np.array(reference, dtype=float)).max() <= 1e-14


@given(SEEDS)
def test_curve_and_derivatives_agree_with_scipy(seed):
    _, degree, knots, points = random_spline(seed)
    curve, reference = bspline(points, knots, degree), BSpline(knots, points, degree)
    at = span_of(knots, degree)[:-1]  # scipy's derivative at a knot is from the right, as ours
    step = np.diff(np.unique(knots)).min()
    for order in range(min(degree, 4)):
        expected = reference(at, nu=order)
        scale = max(1.0, np.abs(expected).max(), 1e-3 * (degree / step) ** order)
        assert np.abs(curve(at, order) - expected).max() <= 1e-10 * scale
    assert curve.start == knots[degree] and curve.end == knots[len(points)]


@given(SEEDS)
def test_de_boor_agrees_with_the_curve(seed):
    _, degree, knots, points = random_spline(seed)
    curve = bspline(points, knots, degree)
    for t in span_of(knots, degree, 17):
        assert np.abs(de_boor(knots, points, degree, t) - curve(t)).max() <= 1e-12 * np.abs(points).max()


@given(SEEDS)
def test_each_span_stays_in_the_box_of_its_active_points(seed):
    _, degree, knots, points = random_spline(seed)
    curve = bspline(points, knots, degree)
    at = span_of(knots, degree, 200)
    values = curve(at)
    for t, value in zip(at[:-1], values[:-1], strict=True):
        j = int(np.searchsorted(knots, t, side="right")) - 1
        active = points[j - degree : j + 1]
        assert (value >= active.min(axis=0) - 1e-12).all() and (value <= active.max(axis=0) + 1e-12).all()


@given(SEEDS)
def test_curve_stays_in_the_convex_hull(seed):
    rng, degree, knots, _ = random_spline(seed)
    points = rng.normal(size=(len(knots) - degree - 1, 2))
    if len(points) < 4:
        return
    hull = ConvexHull(points).equations
    values = bspline(points, knots, degree)(span_of(knots, degree, 100))
    assert (values @ hull[:, :2].T + hull[:, 2] <= 1e-11).all()


@given(SEEDS)
def test_local_support(seed):
    """Moving x_i changes the curve on [t_i, t_{i+p+1}] and nowhere else, not by a bit."""
    rng, degree, knots, points = random_spline(seed)
    i = int(rng.integers(len(points)))
    moved = points.copy()
    moved[i] += 1.0
    at = span_of(knots, degree, 200)
    off = np.abs(bspline(moved, knots, degree)(at) - bspline(points, knots, degree)(at)).max(axis=1)
    outside = (at < knots[i]) | (at > knots[i + degree + 1])
    inside = (at > knots[i]) & (at < knots[i + degree + 1])
    assert (off[outside] == 0).all()
    assert (off[inside] > 0).any() or not inside.any()


@given(SEEDS)
def test_inserted_knots_leave_the_curve(seed):
    rng, degree, knots, points = random_spline(seed)
    at, before = span_of(knots, degree), bspline(points, knots, degree)
    more_knots, more = knots, points
    for _ in range(3):
        time = float(rng.uniform(knots[degree], knots[-degree - 1]))
        more_knots, more = inserted(more_knots, more, degree, time)
    assert len(more) == len(points) + 3 and (np.diff(more_knots) >= 0).all()
    assert np.abs(bspline(more, more_knots, degree)(at) - before(at)).max() <= 1e-11 * np.abs(points).max()


def test_a_knot_inserted_as_often_as_the_degree_puts_a_point_on_the_curve():
    knots, points = np.array(KNOTS, dtype=float), P
    for _ in range(2):
        knots, points = inserted(knots, points, 3, 0.5)
    assert (points == [2.75, 2]).all(axis=1).any()


@given(SEEDS)
def test_affine_maps_commute(seed):
    """Also singular ones, and ones into another dimension."""
    rng, degree, knots, points = random_spline(seed)
    dims, at = points.shape[1], span_of(knots, degree)
    plain = bspline(points, knots, degree)(at)
    singular = np.outer(rng.normal(size=dims), rng.normal(size=dims))
    for matrix in (rng.normal(size=(dims, dims)), singular, rng.normal(size=(2, dims))):
        offset = rng.normal(size=len(matrix))
        found = bspline(points @ matrix.T + offset, knots, degree)(at)
        assert np.abs(found - (plain @ matrix.T + offset)).max() <= 1e-10 * (1 + np.abs(found).max())


@given(SEEDS)
def test_points_and_knots_reversed_run_backwards(seed):
    _, degree, knots, points = random_spline(seed)
    at = span_of(knots, degree)
    back = bspline(points[::-1], -knots[::-1], degree)
    assert np.abs(back(-at) - bspline(points, knots, degree)(at)).max() <= 1e-11


@given(SEEDS)
def test_variation_diminishes(seed):
    rng, degree, knots, _ = random_spline(seed)
    points = rng.normal(size=(len(knots) - degree - 1, 2))
    values = bspline(points, knots, degree)(span_of(knots, degree, 400))

    def changes(x):
        signs = np.sign(x[np.abs(x) > 1e-9])
        return int((signs[1:] != signs[:-1]).sum())

    for _ in range(20):
        normal, offset = rng.normal(size=2), rng.normal() * 0.5
        assert changes(values @ normal - offset) <= changes(points @ normal - offset)


@given(SEEDS)
def test_class_is_the_degree_less_the_multiplicity(seed):
    rng = np.random.default_rng(seed)
    degree = int(rng.integers(1, 8))
    multiplicities = rng.integers(1, degree + 2, 3)
    multiplicities[0] = min(multiplicities[0], degree)  # degree + 1: the position itself jumps
    inner = np.repeat([1.0, 2.0, 3.0], multiplicities)
    knots = np.concatenate([np.zeros(degree + 1), inner, np.full(degree + 1, 4.0)])
    curve = bspline(rng.normal(size=(len(knots) - degree - 1, 2)), knots, degree)
    assert curve.breaks.tolist() == [0, 1, 2, 3, 4]
    for k, multiplicity in enumerate(multiplicities):
        smooth = int(degree - multiplicity)
        for order in range(smooth + 1):
            assert np.abs(curve.jumps(order)[k]).max() <= 1e-10 * (1 + curve.extrema(degree + 1).peak(order).max())
        assert np.abs(curve.jumps(smooth + 1)[k]).max() > 1e-3  # random points: nothing makes it smoother


@pytest.mark.parametrize("degree", range(1, 11))
def test_clamped_without_inner_knots_is_bezier(degree):
    points = np.random.default_rng(degree).normal(size=(degree + 1, 2))
    s = np.linspace(0, 1, 30)
    knots = clamped_knots(degree + 1, degree)
    assert knots.tolist() == [0.0] * (degree + 1) + [1.0] * (degree + 1)
    assert np.abs(bspline(points, knots, degree)(s) - bezier(points)(s)).max() <= 1e-12


# -- interpolation -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("degree", range(1, 8))
@given(seed=SEEDS)
def test_interpolation_agrees_with_scipy(degree, seed):
    rng = np.random.default_rng(seed)
    n = degree + 1 + int(rng.integers(0, 9))
    times, points = np.cumsum(rng.uniform(0.3, 2, n)), rng.normal(size=(n, 2))
    knots = interpolation_knots(times, degree)
    assert len(knots) == n + degree + 1
    found = interpolating_points(times, points, knots, degree)
    reference = make_interp_spline(times, points, degree, t=knots)
    size = max(1.0, np.abs(reference.c).max())
    assert np.abs(found - reference.c).max() <= 1e-8 * size
    curve = bspline(found, knots, degree)
    assert np.abs(curve(np.clip(times, curve.start, curve.end)) - points).max() <= 1e-9 * size
    if degree % 2:  # even degrees: scipy has other knots by default
        own, at = make_interp_spline(times, points, degree), span_of(knots, degree)
        assert np.abs(curve(at) - own(at)).max() <= 1e-8 * size


@pytest.mark.parametrize("degree", range(1, 8))
def test_interpolation_reproduces_polynomials_of_its_degree(degree):
    rng = np.random.default_rng(degree)
    polynomial = np.polynomial.Polynomial(rng.normal(size=degree + 1), domain=[0, 5])
    times = np.sort(np.concatenate([[0, 5], rng.uniform(0.2, 4.8, degree + 4)]))
    done = plan(PlanRequest.of(polynomial(times)[:, None], times=times), "bspline", {"degree": degree})
    at = np.linspace(0, 5, 80)
    reference = polynomial(at)
    assert np.abs(done.trajectory(at)[:, 0] - reference).max() <= 1e-9 * max(1.0, np.abs(reference).max())


def test_degree_3_is_the_not_a_knot_spline():
    rng = np.random.default_rng(2)
    times, points = np.cumsum(rng.uniform(0.3, 2, 9)), rng.normal(size=(9, 3))
    at = np.linspace(times[0], times[-1], 99)
    curve = plan(PlanRequest.of(points, times=times), "bspline").trajectory
    assert np.abs(curve(at) - cubic_spline(times, points, "not_a_knot")(at)).max() <= 1e-11


@pytest.mark.parametrize(
    "times, knots",
    [
        ([0, 1, 2, 3, 4], [0, 0, 0, 0, 0.5, 4, 4, 4, 4]),  # fits
        ([0, 0.1, 0.2, 0.3, 4], [0, 0, 0, 0, 0.05, 4, 4, 4, 4]),  # fits
        ([0, 1, 2, 3, 4, 5], [0, 0, 0, 0.1, 0.2, 0.3, 5, 5, 5]),  # time 2 lies beyond the first functions
        ([0, 1, 2, 3, 4, 5], [0, 0, 0, 4.2, 4.5, 4.8, 5, 5, 5]),
    ],
)
def test_schoenberg_whitney(times, knots):
    """Solvable exactly where t_i < tau_i < t_{i+p+1} for every i: told from the collocation matrix's rank."""
    degree = len(knots) - len(times) - 1
    points = np.random.default_rng(0).normal(size=(len(times), 1))
    regular = np.linalg.matrix_rank(whole(knots, degree, times)) == len(times)
    if regular:
        found = interpolating_points(times, points, knots, degree)
        assert np.abs(bspline(found, knots, degree)(times) - points).max() <= 1e-9
        return
    with pytest.raises(InvalidRequest) as caught:
        interpolating_points(times, points, knots, degree)
    assert caught.value.errors[0].code == "bad_knots" and "Schoenberg-Whitney" in caught.value.errors[0].reason


# -- bad input -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "knots, degree, code",
    [
        ([0, 0, 0, 0, 0.5, 1, 1, 1], 3, "bad_knots"),  # one too few
        ([0, 0, 0, 0, 0.5, 1, 1, 1, 1, 1], 3, "bad_knots"),  # one too many
        ([0, 0, 0, 0, 0.5, 0.4, 1, 1, 1], 3, "bad_knots"),  # falling
        ([0, 0, 0, 0, 0, 1, 1, 1, 1], 3, "bad_knots"),  # five times
        ([0, 0, 0.5, 0.5, 0.5, 1, 1], 1, "bad_knots"),  # three times, degree 1
        ([0, 0.1, 0.2, 1, 1, 1, 1.5, 2, 2], 3, "bad_knots"),  # nothing between knots p and N
        (KNOTS, 0, "bad_degree"),
        (KNOTS, -1, "bad_degree"),
        (KNOTS, 11, "bad_degree"),
        ([0] * 6 + [1] * 6, 5, "too_few_points"),
    ],
)
def test_bad_input(knots, degree, code):
    with pytest.raises(InvalidRequest) as caught:
        bspline(P, knots, degree)
    assert caught.value.errors[0].code == code


@pytest.mark.parametrize("time", [-1e-9, 1 + 1e-9, np.nan])
def test_times_outside_the_valid_span_are_refused(time):
    for evaluate in (lambda: de_boor(KNOTS, P, 3, time), lambda: bspline(P, KNOTS)(time)):
        with pytest.raises(InvalidRequest) as caught:
            evaluate()
        assert caught.value.errors[0].code == "out_of_range"
    with pytest.raises(InvalidRequest):
        de_boor(np.arange(9.0), P, 3, 2.5)  # uniform knots: the span is [3, 5]


# -- worked numbers ------------------------------------------------------------------------------------------------


def test_worked_values_and_derivatives():
    curve = bspline(P, KNOTS, 3)
    expected = [[1.46875, 1.9375], [2.75, 2], [3.90625, 0.9375], [6, 1]]
    np.testing.assert_allclose(curve([0.25, 0.5, 0.75, 1]), expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(curve([0, 0.5, 1], 1), [[6, 12], [4.5, -3], [12, 6]], rtol=0, atol=1e-12)
    np.testing.assert_allclose(curve([0, 0.5], 2), [[0, -36], [-6, -24]], rtol=0, atol=1e-11)
    for t, value in zip((0.25, 0.5, 0.75, 1.0), expected, strict=True):
        assert de_boor(KNOTS, P, 3, t) == pytest.approx(value, abs=1e-12)
    weights = whole(KNOTS, 3, [0.25])[0]
    assert weights == pytest.approx([0.125, 0.59375, 0.25, 0.03125, 0], abs=1e-15)


def test_worked_derivative_is_the_spline_of_the_point_differences():
    """Degree p - 1, points p (x_{i+1} - x_i) / (t_{i+p+1} - t_{i+1}), the outer knots dropped."""
    knots = np.array(KNOTS)
    steps = 3 * np.diff(P, axis=0) / (knots[4:8] - knots[1:5])[:, None]
    at = np.linspace(0, 1, 21)
    lower = bspline(steps, knots[1:-1], 2)
    assert np.abs(bspline(P, knots)(at, 1) - lower(at)).max() <= 1e-12


def test_worked_uniform_weights():
    knots = np.arange(9.0)
    assert whole(knots, 3, [3.5])[0] == pytest.approx(np.array([1, 23, 23, 1, 0]) / 48, abs=1e-15)
    assert np.abs(whole(knots, 3, np.linspace(3, 5, 41)).sum(axis=1) - 1).max() <= 1e-15
    points = np.random.default_rng(1).normal(size=(5, 2))
    curve = bspline(points, knots, 3)
    assert (curve.start, curve.end) == (3.0, 5.0)
    assert np.linalg.norm(curve(3.0) - points[0]) > 0.1 and np.linalg.norm(curve(5.0) - points[-1]) > 0.1
    assert curve(3.0) == pytest.approx((points[0] + 4 * points[1] + points[2]) / 6, abs=1e-14)


@pytest.mark.parametrize(
    "time, total",
    [("1/2", "1/48"), ("3/2", "1/2"), ("5/2", "47/48"), ("3", "1"), ("4", "1"), ("11/2", "47/48"), ("8", "0")],
)
def test_E12_weights_sum_to_one_on_the_valid_span_only(time, total):
    """The raw recursion on uniform knots: less than 1 outside [t_p, t_{N+1}], and 0 at the very last knot."""
    knots, t = [Fraction(k) for k in range(9)], Fraction(time)
    assert sum(raw(knots, i, 3, t) for i in range(5)) == Fraction(total)
    if 3 <= t <= 5:
        assert whole(knots, 3, [float(t)]).sum() == pytest.approx(1.0, abs=1e-15)
    else:
        with pytest.raises(InvalidRequest):
            basis_values(np.arange(9.0), 3, np.array([float(t)]))


def test_E12_the_last_span_is_closed():
    """The raw recursion gives nothing at the end of clamped knots either; the library the last point."""
    exact = [Fraction(k) for k in KNOTS]
    assert sum(raw(exact, i, 3, Fraction(1)) for i in range(5)) == 0
    assert whole(KNOTS, 3, [1.0])[0].tolist() == [0, 0, 0, 0, 1]
    assert (bspline(P, KNOTS, 3)(1.0) == [6, 1]).all() and (de_boor(KNOTS, P, 3, 1.0) == [6, 1]).all()
    # unclamped, and with an end knot repeated: the last non-empty span is closed at t_{N+1}
    uneven = [0, 1, 2, 3, 4, 4.5, 4.5, 4.5, 5]
    assert bspline(P, uneven, 3)(4.5) == pytest.approx(BSpline(uneven, P, 3)(4.5 - 1e-12), abs=1e-9)


def test_E13_affine_maps_need_weights_of_sum_one():
    """Where the weights sum to less, a shift of the points by b shifts the curve by less than b."""
    knots, points, shift = np.arange(9), np.array([1.0, -2.0, 0.5, 3.0, 1.0]), 10.0
    for time, total in ((2.5, 47 / 48), (3.5, 1.0), (5.5, 47 / 48)):
        weights = np.array([float(raw(knots, i, 3, Fraction(time))) for i in range(5)])
        assert weights @ (points + shift) - weights @ points == pytest.approx(shift * total, abs=1e-12)
    at = np.linspace(3, 5, 9)
    moved = bspline(points[:, None] + shift, knots)(at) - bspline(points[:, None], knots)(at)
    assert np.abs(moved - shift).max() <= 1e-12


@pytest.mark.parametrize("curve", [hermite, cubic_hermite])
def test_E13_slopes_are_mapped_by_the_matrix_alone(curve):
    """Slopes + b instead of slopes gives another curve for b != 0."""
    rng = np.random.default_rng(4)
    times, points, slopes = np.array([0.0, 0.7, 2.0]), rng.normal(size=(3, 2)), rng.normal(size=(3, 2))
    matrix, offset = rng.normal(size=(2, 2)), np.array([1.0, -2.0])
    at = np.linspace(0, 2, 41)
    expected = curve(times, points, slopes)(at) @ matrix.T + offset
    right = curve(times, points @ matrix.T + offset, slopes @ matrix.T)
    wrong = curve(times, points @ matrix.T + offset, slopes @ matrix.T + offset)
    assert np.abs(right(at) - expected).max() <= 1e-10
    assert np.abs(wrong(at) - expected).max() > 0.1
    # what is missing is known: the curve of zero values with slopes b
    rest = curve(times, np.zeros((3, 2)), np.tile(offset, (3, 1)))
    assert np.abs(wrong(at) - expected - rest(at)).max() <= 1e-10


def test_worked_collocation_of_the_manchester_spline():
    """Clamped: values at 0, 1, 2 and zero slopes at the ends, five conditions for five points."""
    knots = [0, 0, 0, 0, 1, 2, 2, 2, 2]
    points = np.array([[0], [0], [2.5], [3], [3]], dtype=float)
    curve = bspline(points, knots, 3)
    spline = cubic_spline([0, 1, 2], [[0], [2], [3]])
    np.testing.assert_allclose(curve.powers(), spline.powers(), rtol=0, atol=1e-12)
    assert curve([0, 1, 2])[:, 0] == pytest.approx([0, 2, 3], abs=1e-12)
    assert curve([0, 2], 1)[:, 0] == pytest.approx([0, 0], abs=1e-12)
    assert curve([0.5, 1.5])[:, 0] == pytest.approx([0.71875, 2.78125], abs=1e-12)
    assert curve([0, 1, 2], 2)[:, 0] == pytest.approx([7.5, -3, -1.5], abs=1e-12)
    # the points are the only ones: collocation of three values and two slopes
    rows = whole(knots, 3, [0, 1, 2])
    slope = np.zeros((2, 5))
    slope[0, :2], slope[1, 3:] = (-3, 3), (-3, 3)
    solved = np.linalg.solve(np.vstack([rows, slope]), [0, 2, 3, 0, 0])
    assert solved == pytest.approx(points[:, 0], abs=1e-12)
    # and interpolation at five of its own points finds them again
    times = np.array([0, 0.5, 1, 1.5, 2])
    assert interpolating_points(times, spline(times), knots, 3) == pytest.approx(points, abs=1e-12)
