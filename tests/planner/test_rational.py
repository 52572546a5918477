"""Rational trajectories: derivatives against exact references, extrema as enclosures, and everything made of them."""

from fractions import Fraction
from math import comb, factorial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner import InvalidRequest, PlanRequest, Trajectory, certify, plan
from planner.curves import clamped_knots, nurbs
from planner.curves.basis import bezier_pieces
from planner.types import Demands
from planner.verify import path_length, verify

SEEDS = st.integers(0, 2**32 - 1)
HALF = np.sqrt(0.5)
CIRCLE = (
    [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]],
    [1, HALF, 1, HALF, 1, HALF, 1, HALF, 1],
    [0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1],
    2,
)


def random_nurbs(seed, spread=2.0, dims=None):
    """A NURBS of degree 1 … 6, weights 10^±spread, inner knots of random multiplicity, and the multiplicities."""
    rng = np.random.default_rng(seed)
    degree = int(rng.integers(1, 7))
    inner = np.cumsum(rng.uniform(0.3, 1.5, int(rng.integers(0, 4))))
    multiplicities = np.minimum(rng.integers(1, degree + 1, len(inner)), rng.integers(1, 3, len(inner)))
    end = (inner[-1] if len(inner) else 0.0) + float(rng.uniform(0.3, 1.5))
    knots = np.concatenate([np.zeros(degree + 1), np.repeat(inner, multiplicities), np.full(degree + 1, end)])
    count = len(knots) - degree - 1
    points = rng.normal(size=(count, int(rng.integers(1, 4)) if dims is None else dims))
    weights = 10.0 ** rng.uniform(-spread, spread, count)
    return rng, nurbs(points, weights, knots, degree), degree, multiplicities


def exact_derivatives(curve, piece, u, orders):
    """Derivatives in fractions, from the floats that the trajectory holds: Taylor coefficients of A / W."""
    u, h = Fraction(u), Fraction(float(curve.breaks[piece + 1])) - Fraction(float(curve.breaks[piece]))

    def taylor(c):  # about u, lowest first
        low = [Fraction(float(x)) for x in c[::-1]]
        return [sum(comb(m, k) * low[m] * u ** (m - k) for m in range(k, len(low))) for k in range(orders)]

    below = taylor(curve.weights[:, piece])
    out = []
    for d in range(curve.dims):
        above, x = taylor(curve.coefficients[:, piece, d]), []
        for k in range(orders):
            x.append((above[k] - sum(below[j] * x[k - j] for j in range(1, k + 1))) / below[0])
        out.append([float(factorial(k) * x[k] / h**k) for k in range(orders)])
    return np.array(out).T


def at_of(curve, count):
    return np.clip(np.linspace(curve.start, curve.end, count), curve.start, curve.end)


def dense(curve, per_piece=4000):
    """Times all over the pieces, denser towards their ends, without the breaks themselves."""
    u = 0.5 - 0.5 * np.cos(np.pi * np.linspace(1e-6, 1 - 1e-6, per_piece))
    return (curve.breaks[:-1, None] + np.diff(curve.breaks)[:, None] * u).reshape(curve.pieces, -1)


# -- derivatives ---------------------------------------------------------------------------------------------------


@given(SEEDS)
def test_derivatives_up_to_order_4_against_fractions(seed):
    """Exact arithmetic on the same coefficients; what differs is the rounding of the quotient rule."""
    rng, curve, _, _ = random_nurbs(seed)
    if curve.weights is None:
        return
    piece = int(rng.integers(curve.pieces))
    a, b = (Fraction(float(t)) for t in curve.breaks[piece : piece + 2])
    ends = [np.abs(curve.ends(order)).max() for order in range(5)]
    for u in (0.0, 0.3125, 0.75):
        t = float(a) + u * float(b - a)
        expected = exact_derivatives(curve, piece, (Fraction(t) - a) / (b - a), 5)
        states = curve.states(t, 5)
        for order in range(5):
            assert np.abs(states[order] - expected[order]).max() <= 1e-10 * (
                ends[order] + np.abs(expected[order]).max()
            )


@given(SEEDS)
def test_derivative_as_a_trajectory_is_the_derivative(seed):
    """The second one has the denominator W⁴: in monomials that is for even weights only."""
    for order, spread, tolerance in ((1, 1.0, 1e-8), (2, 0.2, 1e-7)):
        _, curve, _, _ = random_nurbs(seed, spread)
        t = at_of(curve, 41)[1:-1]
        found, expected = curve.derivative(order)(t), curve(t, order)
        assert np.abs(found - expected).max() <= tolerance * (1 + np.abs(curve.ends(order)).max())


def test_derivatives_of_a_known_quotient():
    """1 / (1 + t) on [0, 3]: the m-th derivative is (-1)^m m! / (1 + t)^(m + 1)."""
    breaks = [0.0, 0.5, 3.0]
    powers = np.zeros((2, 2, 1))
    powers[0] = 1.0
    curve = Trajectory.from_powers(breaks, powers, [[1.0, 1.5], [1.0, 1.0]])
    t = np.linspace(0, 3, 61)
    for order in range(7):
        expected = (-1) ** order * factorial(order) / (1 + t) ** (order + 1)
        assert curve(t, order)[:, 0] == pytest.approx(expected, rel=1e-12)
        left, right = curve.ends(order)
        at = np.array([[0.0, 0.5], [0.5, 3.0]])
        known = (-1) ** order * factorial(order) / (1 + at) ** (order + 1)
        assert left[:, 0] == pytest.approx(known[0], rel=1e-12) and right[:, 0] == pytest.approx(known[1], rel=1e-12)
        assert np.abs(curve.jumps(order)).max() <= 1e-12 * factorial(order)
    found = curve.extrema(4)
    assert found.high[:, :, 0].max(axis=1) == pytest.approx([1, -1 / 16, 2, -6 / 256], rel=1e-9)
    assert found.low[:, :, 0].min(axis=1) == pytest.approx([1 / 4, -1, 2 / 64, -6], rel=1e-9)
    assert curve.squared_integral(1) == pytest.approx((1 - 4**-3) / 3, rel=1e-10)  # of (1 + t)^-4
    assert path_length(curve) == pytest.approx(0.75, rel=1e-10)


# -- extrema -------------------------------------------------------------------------------------------------------


@given(SEEDS)
def test_extrema_enclose_every_sample(seed):
    """On every piece no sample lies outside, but for the rounding of the sample."""
    _, curve, _, _ = random_nurbs(seed)
    found, times = curve.extrema(4), dense(curve)
    for order in range(4):
        values = curve(times.reshape(-1), order).reshape(*times.shape, curve.dims)
        high, low = values.max(axis=1), values.min(axis=1)
        size = np.maximum(np.abs(values).max(axis=(0, 1)), 1e-9)
        assert (found.high[order] >= high - 1e-10 * size).all() and (found.low[order] <= low + 1e-10 * size).all()
        peak = np.maximum(found.high[order].max(axis=0), -found.low[order].min(axis=0))
        assert (peak == found.peak(order)).all()


def largest(curve, order, joint, sign):
    """The largest of sign x the derivative: dense samples, the pieces' own ends, and two closer looks."""
    best = max(float((sign * x[:, joint]).max()) for x in curve.ends(order))
    u = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0, 1, 801))
    for a, b in zip(curve.breaks[:-1], curve.breaks[1:], strict=True):
        left, right = a, b
        for _ in range(3):
            t = left + (right - left) * u
            t = t[(t > a) & (t < b)]
            values = sign * curve(t, order)[:, joint]
            k = int(np.argmax(values))
            left, right = t[k - 1] if k else left, t[k + 1] if k + 1 < len(t) else right
        best = max(best, float(values.max()))
    return best


@given(SEEDS)
def test_extrema_are_tight(seed):
    """The bounds cover what rounding of the coefficients may do: with uneven weights that grows with the order."""
    _, curve, _, _ = random_nurbs(seed)
    found = curve.extrema(4)
    for order in range(4):
        for joint in range(curve.dims):
            size = found.peak(order)[joint]
            for bound, sign in ((found.high[order, :, joint].max(), 1), (-found.low[order, :, joint].min(), -1)):
                reached = largest(curve, order, joint, sign)
                assert reached - 1e-10 * size <= bound <= reached + (1e-8, 1e-6, 1e-5, 1e-4)[order] * size


def test_extrema_are_mostly_tighter_by_far():
    """Of forty curves, half within 1e-10 of what a search finds and nine in ten within 1e-8, in every order."""
    excess = [[], [], [], []]
    for seed in range(40):
        _, curve, _, _ = random_nurbs(seed)
        found = curve.extrema(4)
        for order in range(4):
            for joint in range(curve.dims):
                if size := found.peak(order)[joint]:
                    excess[order].append((found.high[order, :, joint].max() - largest(curve, order, joint, 1)) / size)
    for each in excess:
        assert np.median(each) <= 1e-10 and np.quantile(each, 0.9) <= 1e-8


@given(SEEDS)
def test_the_largest_value_is_taken_where_it_is_said(seed):
    """At the time named the derivative has that value, to 1e-3 of the larger magnitude; at a piece's end its own."""
    _, curve, _, _ = random_nurbs(seed)
    found = curve.extrema(4)
    for order in range(4):
        left, right = curve.ends(order)
        for joint in range(curve.dims):
            for bounds, places, sign in ((found.high, found.at_high, 1), (found.low, found.at_low, -1)):
                piece = int(np.argmax(sign * bounds[order, :, joint]))
                t, bound = places[order, piece, joint], bounds[order, piece, joint]
                assert curve.breaks[piece] <= t <= curve.breaks[piece + 1]
                there = curve(t, order)[joint]
                if t == curve.breaks[piece]:
                    there = left[piece, joint]
                elif t == curve.breaks[piece + 1]:
                    there = right[piece, joint]
                assert abs(there - bound) <= 1e-3 * found.peak(order)[joint]


@pytest.mark.parametrize("ratio", [1e3, 1e6])
def test_extrema_of_very_uneven_weights(ratio):
    """One weight far above the others: a curve that hurries, with a narrow peak that samples hardly find."""
    curve = nurbs([[0], [1], [-1], [0.5]], [1, ratio, 1, ratio / 10], [0, 0, 0, 0.4, 1, 1, 1], 2)
    found = curve.extrema(4)
    u = np.concatenate([np.geomspace(1e-12, 0.5, 20_000), 1 - np.geomspace(1e-12, 0.5, 20_000)])
    times = (curve.breaks[:-1, None] + np.diff(curve.breaks)[:, None] * np.sort(u)).reshape(-1)
    for order in range(4):
        values = curve(times, order)[:, 0]
        peak = found.peak(order)[0]
        assert np.abs(values).max() <= peak * (1 + 1e-9)
        assert np.abs(values).max() >= peak * (1 - 1e-4)


def test_extrema_of_the_circle():
    found = nurbs(*CIRCLE).extrema(2)
    assert found.high[0].max(axis=0) == pytest.approx([1, 1], abs=1e-9)
    assert found.low[0].min(axis=0) == pytest.approx([-1, -1], abs=1e-9)
    assert (found.high[0].max(axis=0) >= 1 - 1e-15).all()
    curve = nurbs(*CIRCLE)
    assert (found.peak(1) >= np.abs(curve(np.linspace(0, 1, 10_001), 1)).max(axis=0)).all()


@given(SEEDS)
def test_bounds_agree_with_the_polynomial_ones_where_the_denominator_is_constant(seed):
    rng = np.random.default_rng(seed)
    n, pieces = int(rng.integers(1, 7)), int(rng.integers(1, 4))
    breaks = np.cumsum(rng.uniform(0.3, 2, pieces + 1))
    coefficients = rng.normal(size=(n + 1, pieces, 2))
    weights = np.zeros((n + 1, pieces))
    weights[-1] = rng.uniform(0.5, 2, pieces)
    plain = Trajectory(breaks, coefficients / weights[-1][:, None])
    rational = Trajectory(breaks, coefficients, weights)
    a, b = rational.extrema(4), plain.extrema(4)
    for order in range(4):
        size = 1 + b.peak(order).max()
        assert (a.high[order].max(axis=0) >= b.high[order].max(axis=0) - 1e-12 * size).all()
        assert np.abs(a.high[order].max(axis=0) - b.high[order].max(axis=0)).max() <= 1e-8 * size
        assert np.abs(a.low[order].min(axis=0) - b.low[order].min(axis=0)).max() <= 1e-8 * size
    assert rational.squared_integral(1) == pytest.approx(plain.squared_integral(1), rel=1e-9)
    assert path_length(rational) == pytest.approx(path_length(plain), rel=1e-9)


# -- ends and jumps ------------------------------------------------------------------------------------------------


@given(SEEDS)
def test_class_is_the_degree_less_the_multiplicity(seed):
    _, curve, degree, multiplicities = random_nurbs(seed, 0.5)
    peaks = [np.abs(curve.ends(order)).max(axis=(0, 1)) for order in range(degree + 1)]
    expected = degree
    for k, multiplicity in enumerate(multiplicities):
        smooth = int(degree - multiplicity)
        for order in range(smooth + 1):
            assert np.abs(curve.jumps(order)[k]).max() <= 1e-9 * (1 + peaks[order].max())
        jump = np.abs(curve.jumps(smooth + 1)[k])
        assert jump.max() > 1e-6
        if (jump > 1e-4 * peaks[smooth + 1]).any():  # the certificate counts jumps above 1e-6 of the peak
            expected = min(expected, smooth)
    if len(multiplicities):
        continuity = verify(curve, Demands(curve.dims)).continuity
        assert degree - int(multiplicities.max()) <= continuity <= expected


@given(SEEDS)
def test_ends_are_the_limits_from_within(seed):
    _, curve, _, _ = random_nurbs(seed, 1.0)
    for order in range(4):
        left, right = curve.ends(order)
        inner = curve(curve.breaks[1:-1], order)  # at a break the value from the right
        size = 1 + np.abs(left).max() + np.abs(right).max()
        assert np.abs(inner - left[1:]).max(initial=0) <= 1e-9 * size
        assert np.abs(curve(curve.start, order) - left[0]).max() <= 1e-9 * size
        assert np.abs(curve(curve.end, order) - right[-1]).max() <= 1e-9 * size
        gap = np.diff(curve.breaks) * 1e-9
        before = curve(curve.breaks[1:] - gap, order)
        assert np.abs(before - right).max() <= 1e-6 * (size + np.abs(curve.ends(order + 1)).max())


# -- operations ----------------------------------------------------------------------------------------------------


@given(SEEDS)
def test_operations_that_change_only_the_form(seed):
    rng, curve, _, _ = random_nurbs(seed, 1.0)
    t = at_of(curve, 37)
    cuts = rng.uniform(curve.start, curve.end, 3)
    split = curve.split(cuts)
    assert split.pieces == curve.pieces + 3
    part = curve.sliced(*np.sort(cuts)[[0, 2]])
    inside = at_of(part, 21)
    again = Trajectory.from_powers(curve.breaks, curve.powers(), curve.weight_powers())
    factor, offset = float(rng.uniform(0.1, 5)), float(rng.uniform(-5, 5))
    slow, later, back = curve.scaled(factor), curve.shifted(offset), curve.reversed()
    matrix, shift = rng.normal(size=(2, curve.dims)), rng.normal(size=2)
    mapped = curve.mapped(matrix, shift)
    for order in range(3):
        x = curve(t, order)
        size = 1e-8 * (1 + np.abs(x).max())
        assert np.abs(split(t, order) - x).max() <= size
        assert np.abs(part(inside, order) - curve(inside, order)).max() <= size
        assert np.abs(again(t, order) - x).max() <= size
        assert np.abs(slow(np.clip(t * factor, slow.start, slow.end), order) * factor**order - x).max() <= size
        assert np.abs(later(np.clip(t + offset, later.start, later.end), order) - x).max() <= size * 10
        assert np.abs(mapped(t, order) - (x @ matrix.T + (shift if order == 0 else 0))).max() <= 10 * size
    mirrored = np.clip(curve.start + curve.end - t, curve.start, curve.end)
    assert np.abs(back(mirrored) - curve(t)).max() <= 1e-9


@given(SEEDS)
def test_composed_with_a_law(seed):
    """q(s(t)) by values; velocity and acceleration by the chain rule."""
    rng, curve, degree, _ = random_nurbs(seed, 1.0)
    n = int(rng.integers(2, 5))
    s = np.concatenate([[curve.start], np.sort(rng.uniform(curve.start, curve.end, n - 2)), [curve.end]])
    times = np.cumsum(rng.uniform(0.3, 2, n))
    slope = np.minimum(*(np.concatenate([[0], np.diff(s) / np.diff(times)]), np.append(np.diff(s) / np.diff(times), 0)))
    law = Trajectory.from_hermite(times, s[:, None], slope[:, None])  # slopes below the smaller secant: no overshoot
    motion = curve.compose(law)
    assert motion.degree == 3 * degree and (motion.weights is None) == (curve.weights is None)
    t = np.clip(np.linspace(law.start, law.end, 61), law.start, law.end)
    t = t[(np.abs(t[:, None] - motion.breaks) > 1e-6).all(axis=1)]
    u = np.clip(law(t)[:, 0], curve.start, curve.end)
    rate, bend = law(t, 1), law(t, 2)
    expected = (curve(u), curve(u, 1) * rate, curve(u, 2) * rate**2 + curve(u, 1) * bend)
    for order, x in enumerate(expected):
        assert np.abs(motion(t, order) - x).max() <= 1e-8 * (1 + np.abs(x).max())


def test_laws_with_weights_are_refused():
    curve = nurbs(*CIRCLE)
    with pytest.raises(InvalidRequest) as caught:
        curve.compose(nurbs([[0], [0.5], [1]], [1, 2, 1], [0, 0, 0, 1, 1, 1], 2))
    assert caught.value.errors[0].code == "shape_mismatch"


def test_rational_and_polynomial_parts_in_a_row():
    arc = nurbs([[1, 0], [1, 1], [0, 1]], [1, HALF, 1], [0, 0, 0, 1, 1, 1], 2)
    line = Trajectory.from_hermite([1.0, 3.0], [[0, 1], [-4, 1]])
    whole = Trajectory.concatenate([arc, line])
    assert whole.pieces == 2 and whole.weights is not None
    for t in (0.0, 0.3, 0.7):
        assert whole(t) == pytest.approx(arc(t), abs=1e-15)
    assert whole(2.0) == pytest.approx([-2, 1], abs=1e-15) and whole(2.5, 1) == pytest.approx([-2, 0], abs=1e-15)
    assert np.abs(whole.jumps(0)).max() <= 1e-15
    assert path_length(whole) == pytest.approx(np.pi / 2 + 4, rel=1e-10)


# -- integrals -----------------------------------------------------------------------------------------------------


def integrated(curve, function):
    """Composite Gauss-Legendre over each piece, on intervals that are shorter towards its ends."""
    u, w = np.polynomial.legendre.leggauss(20)
    edges = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0, 1, 121))
    total = 0.0
    for a, b in zip(curve.breaks[:-1], curve.breaks[1:], strict=True):
        x = a + (b - a) * edges
        t = x[:-1, None] + 0.5 * np.diff(x)[:, None] * (u + 1)
        total += float((0.5 * np.diff(x)[:, None] * w * function(t.reshape(-1)).reshape(t.shape)).sum())
    return total


@pytest.mark.parametrize("order", [1, 2, 3])
@given(seed=SEEDS)
def test_squared_integrals_by_numerical_integration(order, seed):
    _, curve, _, _ = random_nurbs(seed, 1.0)
    expected = integrated(curve, lambda t: (curve(t, order) ** 2).sum(axis=1))
    assert curve.squared_integral(order) == pytest.approx(expected, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("dims", [1, 2, 3])
@given(seed=SEEDS)
def test_lengths_are_those_of_dense_polygons(dims, seed):
    """The speed has kinks where one joint turns, and almost kinks where several do: the length must see them."""
    _, curve, _, _ = random_nurbs(seed, 1.0, dims)
    u = np.linspace(0, 1, 50_001)
    u, total = u**2 * (3 - 2 * u), 0.0
    for a, b in zip(curve.breaks[:-1], curve.breaks[1:], strict=True):
        steps = np.diff(curve(np.clip(a + u * (b - a), a, b)), axis=0)
        total += float(np.linalg.norm(steps, axis=1).sum())
    assert path_length(curve) == pytest.approx(total, rel=2e-8)


@pytest.mark.parametrize("turn", [1e-4, 0.0027, 0.004, 0.2527, 0.999])
@pytest.mark.parametrize("rational", [False, True])
def test_the_length_of_a_motion_that_turns_beside_a_break(turn, rational):
    """(u - turn)²: neither of two quadrature rules may overlook the kink in front of their first nodes."""
    coefficients = np.array([1.0, -2 * turn, turn**2])[:, None, None]
    weights = np.array([0.0, 0.0, 2.0])[:, None] if rational else None
    curve = Trajectory([0, 1], coefficients * (2 if rational else 1), weights)
    assert path_length(curve) == pytest.approx(turn**2 + (1 - turn) ** 2, rel=1e-9)


def test_the_length_of_the_circle():
    curve = nurbs(*CIRCLE)
    assert path_length(curve) == pytest.approx(2 * np.pi, rel=1e-10)
    assert path_length(curve.scaled(7.0)) == pytest.approx(2 * np.pi, rel=1e-10)
    assert path_length(curve.mapped([[3, 0], [0, 3]], [1, 1])) == pytest.approx(6 * np.pi, rel=1e-10)
    found = certify(curve)
    assert found.cost["path_length"] == pytest.approx(2 * np.pi, rel=1e-10)


# -- denominators --------------------------------------------------------------------------------------------------


def test_denominators_that_are_positive_though_a_coefficient_is_not():
    """1 - 3.9 u (1 - u) > 0 has a negative Bernstein coefficient; only subdivision tells it positive."""
    curve = Trajectory([0, 1], [[[0.0]], [[0.0]], [[1.0]]], [[3.9], [-3.9], [1.0]])
    assert curve(0.5)[0] == pytest.approx(40, rel=1e-12)
    assert curve.extrema(1).peak(0)[0] == pytest.approx(40, rel=1e-9)


@pytest.mark.parametrize(
    "weights",
    [
        [[4.0], [-4.0], [1.0]],  # zero in the middle
        [[4.1], [-4.1], [1.0]],  # negative there
        [[0.0], [1.0], [0.0]],  # zero at the start
        [[0.0], [-1.0], [1.0]],  # zero at the end
        [[0.0], [-2.0], [1.0]],
        [[0.0], [0.0], [-1.0]],
        [[0.0], [0.0], [0.0]],
        [[0.0], [0.0], [np.nan]],
        [[0.0], [0.0], [np.inf]],
    ],
)
def test_denominators_that_are_not_positive_are_refused(weights):
    with pytest.raises(InvalidRequest) as caught:
        Trajectory([0, 1], [[[1.0]], [[0.0]], [[1.0]]], weights)
    assert caught.value.errors[0].code == "bad_weights"


@pytest.mark.parametrize("weights", [[1.0], [[1.0]], [[1.0], [1.0], [1.0], [1.0]], [[1.0, 1.0]] * 3])
def test_weights_of_another_shape_are_refused(weights):
    with pytest.raises(InvalidRequest) as caught:
        Trajectory([0, 1], [[[1.0]], [[0.0]], [[1.0]]], weights)
    assert caught.value.errors[0].code == "shape_mismatch"


def test_pieces_come_from_the_homogeneous_blossom():
    """The denominator of a piece is that of the weights' own B-spline."""
    points, weights, knots, degree = CIRCLE
    breaks, below = bezier_pieces(np.array(knots), np.array(weights)[:, None], degree)
    curve = nurbs(*CIRCLE)
    u = 0.25
    value = below[0] * (1 - u) ** 2 + 2 * u * (1 - u) * below[1] + u**2 * below[2]
    assert (curve.breaks == breaks).all()
    mine = curve.weights[0] * u**2 + curve.weights[1] * u + curve.weights[2]
    assert mine == pytest.approx(value[:, 0] / max(weights), abs=1e-15)


def exact_velocity(curve, piece, u):
    """The velocity in fractions, from the coefficients as they are."""
    a = [Fraction(float(c)) for c in curve.coefficients[:, piece, 0]]
    w = [Fraction(float(c)) for c in curve.weights[:, piece]]
    n = len(a) - 1

    def at(c):
        return sum(x * u ** (n - k) for k, x in enumerate(c))

    def slope(c):
        return sum((n - k) * x * u ** (n - k - 1) for k, x in enumerate(c[:-1]))

    rate = (slope(a) * at(w) - at(a) * slope(w)) / at(w) ** 2
    return float(rate) / float(np.diff(curve.breaks)[piece])


@pytest.mark.parametrize(("offset", "move"), [(0, 1), (1e3, 1), (1e6, 1e-3), (1e6, 1e-5), (1e8, 1)])
def test_an_offset_does_not_hide_a_broken_limit(offset, move):
    """Far from the origin the coefficients' own rounding moves the curve: the bounds must cover what they say."""
    points = [[offset + move * v] for v in (-0.7, -0.5, 0.2, -0.4, 0.1)]
    option = {"path": {"kind": "nurbs", "degree": 4, "weights": [59, 98, 2, 1293, 10]}}
    done = plan(PlanRequest.of(points, limits={"velocity": 1.0}), "time_scaled", option)
    curve = done.trajectory
    for piece in range(curve.pieces):
        for k in range(0, 401):
            assert abs(exact_velocity(curve, piece, Fraction(k, 400))) <= 1 + 1e-6
    assert done.certificate.checks[0].ratio <= 1 + 1e-9


def test_a_curve_far_from_the_origin_takes_no_longer():
    rng = np.random.default_rng(3)
    points = 1e6 + rng.normal(size=(8, 3))
    curve = nurbs(points, [0.0155, 1, 7, 0.3, 62, 2, 0.5, 1], clamped_knots(8, 7), 7)
    near = nurbs(points - 1e6, [0.0155, 1, 7, 0.3, 62, 2, 0.5, 1], clamped_knots(8, 7), 7)
    assert curve.squared_integral(3) == pytest.approx(near.squared_integral(3), rel=1e-3)
    assert path_length(curve) == pytest.approx(path_length(near), rel=1e-6)
