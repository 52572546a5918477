"""Operations on trajectories, polynomial and rational, against dense evaluation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from planner import InvalidRequest, Trajectory
from planner.curves import bspline, clamped_knots, control_points, cubic_hermite, linear, nurbs

SEEDS = st.integers(0, 2**32 - 1)
KINDS = pytest.mark.parametrize("rational", [False, True], ids=["polynomial", "rational"])
ORDERS = range(4)


def curve_of(rng, rational, dims=None):
    """Return a curve, and the knots, control points, weights and degree that it is made of."""
    n, degree = int(rng.integers(4, 8)), int(rng.integers(1, 4))
    start = rng.normal()
    t = clamped_knots(n, degree, start, start + float(rng.uniform(1, 6)))
    x = rng.normal(size=(n, int(rng.integers(1, 4)) if dims is None else dims))
    w = rng.uniform(0.4, 2, n) if rational else np.ones(n)
    curve = nurbs(x, w, t, degree) if rational else bspline(x, t, degree)
    assert (curve.weights is not None) == rational
    return curve, (t, x, w, degree)


def times_of(rng, curve, count=40):
    """Return times off the breaks, at which the curve may have corners."""
    at = rng.uniform(curve.start, curve.end, 2 * count)
    far = np.abs(at[:, None] - curve.breaks).min(axis=1) > 1e-6 * curve.duration
    return at[far][:count]


def close(found, wanted, tolerance=1e-8):
    np.testing.assert_allclose(found, wanted, rtol=0, atol=tolerance * (1 + np.abs(wanted).max()))


@KINDS
@given(SEEDS)
def test_evaluation_is_scipys(rational, seed):
    rng = np.random.default_rng(seed)
    curve, (t, x, w, degree) = curve_of(rng, rational)
    at = times_of(rng, curve)
    a = [BSpline(t, x * w[:, None], degree)(at, nu=m) for m in ORDERS]
    b = [BSpline(t, w, degree)(at, nu=m)[:, None] for m in ORDERS]
    f = [a[0] / b[0]]
    f.append((a[1] - b[1] * f[0]) / b[0])
    f.append((a[2] - 2 * b[1] * f[1] - b[2] * f[0]) / b[0])
    f.append((a[3] - 3 * b[1] * f[2] - 3 * b[2] * f[1] - b[3] * f[0]) / b[0])
    for m in ORDERS:
        close(curve(at, m), f[m])
        close(curve.derivative(m)(at), f[m], 1e-6)
    close(curve.states(at, 2, 1), np.stack(f[1:3]))


@pytest.mark.parametrize("order", [1, 2, 3])
def test_derivatives_of_a_rational_curve_keep_their_digits(order):
    points, knots = [[0, 0], [1, 2], [3, 1], [4, 0], [5, 1]], [0, 0, 0, 0, 0.5, 1, 1, 1, 1]
    curve, at = nurbs(points, [1, 20, 1, 20, 1], knots), np.linspace(0, 1, 101)
    wanted = curve(at, order)
    assert np.abs(curve.derivative(order)(at) - wanted).max() < 1e-8 * np.abs(wanted).max()


@KINDS
@given(SEEDS)
def test_mapped(rational, seed):
    rng = np.random.default_rng(seed)
    curve, _ = curve_of(rng, rational)
    matrix, offset, at = rng.normal(size=(2, curve.dims)), rng.normal(size=2), times_of(rng, curve)
    image = curve.mapped(matrix, offset)
    for m in ORDERS:
        close(image(at, m), curve(at, m) @ matrix.T + (offset if m == 0 else 0))
    close(curve.mapped(matrix)(at), curve(at) @ matrix.T)


@KINDS
@given(SEEDS)
def test_reversed(rational, seed):
    rng = np.random.default_rng(seed)
    curve, _ = curve_of(rng, rational)
    back, at = curve.reversed(), times_of(rng, curve)
    assert (back.start, back.end) == (curve.start, curve.end)
    mirror = np.clip(curve.start + curve.end - at, curve.start, curve.end)
    for m in ORDERS:
        close(back(mirror, m), (-1) ** m * curve(at, m))
    close(back.reversed()(at), curve(at))


@KINDS
@given(SEEDS)
def test_split_and_sliced(rational, seed):
    rng = np.random.default_rng(seed)
    curve, _ = curve_of(rng, rational)
    extra, at = times_of(rng, curve, 5), times_of(rng, curve)
    cut = curve.split(extra)
    assert np.isin(extra, cut.breaks).all() and cut.pieces == curve.pieces + len(extra)
    assert curve.split([*curve.breaks, curve.start - 1, curve.end + 1]) is curve
    a, b = np.sort(times_of(rng, curve, 2))
    part = curve.sliced(a, b)
    assert (part.start, part.end) == (a, b)
    inside = at[(at > a) & (at < b)]
    for m in ORDERS:
        close(cut(at, m), curve(at, m))
        if len(inside):
            close(part(inside, m), curve(inside, m))
    assert curve.sliced(curve.start, curve.end).pieces == curve.pieces


@KINDS
@given(SEEDS)
def test_parts_concatenate_to_the_whole(rational, seed):
    rng = np.random.default_rng(seed)
    curve, _ = curve_of(rng, rational)
    at = times_of(rng, curve)
    edges = [curve.start, *np.sort(times_of(rng, curve, 3)), curve.end]
    whole = Trajectory.concatenate([curve.sliced(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True)])
    for m in ORDERS:
        close(whole(at, m), curve(at, m))


@given(SEEDS)
def test_unlike_parts_concatenate(seed):
    rng = np.random.default_rng(seed)
    first, _ = curve_of(rng, False, 2)
    second, _ = curve_of(rng, True, 2)
    second = second.shifted(first.end - second.start)
    third = linear([second.end, second.end + 1], rng.normal(size=(2, 2)))
    whole = Trajectory.concatenate([first, second, third])
    for part in (first, second, third):
        at = times_of(rng, part)
        for m in ORDERS:
            close(whole(at, m), part(at, m))
    assert whole.weights is not None and whole.pieces == first.pieces + second.pieces + 1


@KINDS
@given(SEEDS)
def test_joints(rational, seed):
    rng = np.random.default_rng(seed)
    curve, _ = curve_of(rng, rational, 4)
    at = times_of(rng, curve)
    chosen = [2, 0, 2]
    for m in ORDERS:
        assert (curve.joints(chosen)(at, m) == curve(at, m)[:, chosen]).all()


@KINDS
@given(SEEDS)
def test_scaled_and_shifted(rational, seed):
    rng = np.random.default_rng(seed)
    curve, _ = curve_of(rng, rational)
    factor, offset, at = float(rng.uniform(0.3, 3)), float(rng.normal()), times_of(rng, curve)
    slow = curve.scaled(factor).shifted(offset)
    assert slow.start == pytest.approx(curve.start + offset, abs=1e-12)
    there = np.clip(slow.start + (at - curve.start) * factor, slow.start, slow.end)
    for m in ORDERS:
        close(slow(there, m) * factor**m, curve(at, m))


@KINDS
@given(SEEDS)
def test_composed_with_a_law(rational, seed):
    rng = np.random.default_rng(seed)
    curve, _ = curve_of(rng, rational)
    values = np.linspace(curve.start, curve.end, 4) + rng.uniform(-0.1, 0.1, 4) * curve.duration * [0, 1, 1, 0]
    law = cubic_hermite([0, 1, 2, 3], values[:, None], rng.uniform(0, 0.5, (4, 1)) * curve.duration)
    motion, at = curve.compose(law), rng.uniform(0, 3, 60)
    s = np.clip(law(at)[:, 0], curve.start, curve.end)
    far = np.abs(s[:, None] - curve.breaks).min(axis=1) > 1e-6 * curve.duration  # corners of degree 1
    at, s = at[far], s[far]
    rate, push = law(at, 1), law(at, 2)
    close(motion(at), curve(s))
    close(motion(at, 1), curve(s, 1) * rate, 1e-7)
    close(motion(at, 2), curve(s, 2) * rate**2 + curve(s, 1) * push, 1e-6)
    assert np.isin(law.breaks, motion.breaks).all()


@KINDS
@pytest.mark.parametrize("order", ORDERS)
@given(SEEDS)
def test_squared_integral_is_the_quadrature(rational, order, seed):
    rng = np.random.default_rng(seed)
    curve, _ = curve_of(rng, rational)
    nodes, weights = np.polynomial.legendre.leggauss(60)
    total = 0.0
    for a, b in zip(curve.breaks[:-1], curve.breaks[1:], strict=True):
        for c, d in ((a, 0.5 * (a + b)), (0.5 * (a + b), b)):
            at = 0.5 * (c + d) + 0.5 * (d - c) * nodes
            total += 0.5 * (d - c) * float(weights @ (curve(at, order) ** 2).sum(axis=1))
    assert curve.squared_integral(order) == pytest.approx(total, rel=1e-9, abs=1e-12)


@KINDS
@given(SEEDS)
def test_powers_round_trip(rational, seed):
    rng = np.random.default_rng(seed)
    curve, _ = curve_of(rng, rational)
    at = times_of(rng, curve)
    powers, weights = curve.powers(), curve.weight_powers()
    assert (weights is not None) == rational
    again = Trajectory.from_powers(curve.breaks, powers, weights)
    close(again.coefficients, curve.coefficients, 1e-12)
    piece = np.searchsorted(curve.breaks, at, side="right") - 1
    u = (at - curve.breaks[piece])[:, None] ** np.arange(curve.degree + 1)
    value = np.einsum("mk,kmd->md", u, powers[:, piece])
    if rational:
        close(again.weights, curve.weights, 1e-12)
        value /= np.einsum("mk,km->m", u, weights[:, piece])[:, None]
    close(curve(at), value)


@given(SEEDS)
def test_bernstein_round_trip(seed):
    rng = np.random.default_rng(seed)
    curve, _ = curve_of(rng, False)
    again = Trajectory.from_bernstein(curve.breaks, control_points(curve))
    close(again.coefficients, curve.coefficients, 1e-12)


@KINDS
@given(SEEDS)
def test_ends_and_jumps(rational, seed):
    rng = np.random.default_rng(seed)
    curve, (_, _, _, degree) = curve_of(rng, rational)
    eps = 1e-7 * np.diff(curve.breaks).min()
    peaks = curve.extrema(4)
    for m in range(3):
        left, right = curve.ends(m)
        scale = 1e-5 * (1 + peaks.peak(m + 1).max())
        assert np.abs(left - curve(curve.breaks[:-1] + eps, m)).max() < scale
        assert np.abs(right - curve(curve.breaks[1:] - eps, m)).max() < scale
        if m < degree and curve.pieces > 1:
            assert np.abs(curve.jumps(m)).max() <= 1e-9 * (1 + peaks.peak(m).max())
    if curve.pieces > 1:
        assert np.abs(curve.jumps(degree)).max() > 1e-6


@KINDS
@given(SEEDS)
def test_extrema_enclose_and_are_tight(rational, seed):
    rng = np.random.default_rng(seed)
    curve, _ = curve_of(rng, rational)
    found, parts = curve.extrema(4), [curve.part(i, i + 1) for i in range(curve.pieces)]
    for m in ORDERS:
        values = np.stack([part(np.linspace(part.start, part.end, 1001), m) for part in parts])
        slack = 1e-9 * (1 + np.abs(values).max())
        least, most = values.min(axis=1), values.max(axis=1)
        assert (least >= found.low[m] - slack).all() and (most <= found.high[m] + slack).all()
        near = 1e-2 * (1 + np.abs(values).max())  # of sampling
        low, high = found.low[m].min(axis=0), found.high[m].max(axis=0)
        assert (least.min(axis=0) <= low + near).all() and (most.max(axis=0) >= high - near).all()
        assert found.peak(m) == pytest.approx(np.maximum(np.abs(low), np.abs(high)))


# -- errors --------------------------------------------------------------------------------------------------------

PLAIN = linear([0, 1, 2], [[0, 0], [1, 2], [3, 3]])


@pytest.mark.parametrize(
    ("call", "code"),
    [
        (lambda: PLAIN.mapped(np.eye(3)), "shape_mismatch"),
        (lambda: PLAIN.mapped([1, 2]), "shape_mismatch"),
        (lambda: PLAIN.sliced(1, 1), "out_of_range"),
        (lambda: PLAIN.sliced(1.5, 1), "out_of_range"),
        (lambda: PLAIN.sliced(-0.1, 1), "out_of_range"),
        (lambda: PLAIN.sliced(0.5, 2.1), "out_of_range"),
        (lambda: PLAIN.sliced(np.nan, 1), "out_of_range"),
        (lambda: PLAIN.scaled(0), "not_increasing"),
        (lambda: PLAIN.scaled(-1), "not_increasing"),
        (lambda: PLAIN.shifted(np.inf), "not_finite"),
        (lambda: PLAIN.compose(PLAIN), "shape_mismatch"),
        (lambda: PLAIN.compose(nurbs([[0], [0.1], [1]], [1, 2, 1], [0, 0, 0, 1, 1, 1], 2)), "shape_mismatch"),
        (lambda: PLAIN(2.1), "out_of_range"),
        (lambda: Trajectory.from_powers([0, 1], np.zeros((2, 2, 1))), "shape_mismatch"),
        (lambda: Trajectory.from_powers([0, 1], np.zeros((2, 1, 1)), np.ones((3, 1))), "shape_mismatch"),
        (lambda: Trajectory([0, 1], np.zeros((2, 1, 1)), np.ones((1, 1))), "shape_mismatch"),
        (lambda: Trajectory([0, 1], np.zeros((2, 1, 1)), [[-2.0], [1.0]]), "bad_weights"),
        (lambda: Trajectory([0, 1], np.zeros((3, 1, 1)), [[4.0], [-4.0], [1.0]]), "bad_weights"),  # touches zero
        (lambda: Trajectory([0, 1], np.zeros((2, 1, 1)), [[np.nan], [1.0]]), "bad_weights"),
    ],
)
def test_errors(call, code):
    with pytest.raises(InvalidRequest) as caught:
        call()
    assert caught.value.errors[0].code == code


@pytest.mark.parametrize(
    "call",
    [
        lambda: Trajectory.concatenate([PLAIN, PLAIN.shifted(5)]),
        lambda: Trajectory.concatenate([PLAIN, linear([1, 3], [[3, 3], [4, 4]])]),
        lambda: Trajectory.concatenate([PLAIN, linear([2, 3], [[3], [4]])]),
        lambda: Trajectory.concatenate([]),
        lambda: PLAIN.mapped(np.eye(2), [1, 2, 3]),
        lambda: PLAIN.joints([2]),
        lambda: PLAIN(0.5, -1),
    ],
    ids=["gap", "overlap", "joints", "nothing", "offset", "no such joint", "negative order"],
)
def test_errors_are_typed_and_nothing_is_repaired_in_silence(call):
    with pytest.raises(InvalidRequest):
        call()
