import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import PPoly

from planner import InvalidRequest, Trajectory

SEEDS = st.integers(0, 2**32 - 1)


def random_trajectory(rng, degree=None, pieces=None, dims=None):
    degree = int(rng.integers(0, 10)) if degree is None else degree
    pieces = int(rng.integers(1, 8)) if pieces is None else pieces
    dims = int(rng.integers(1, 4)) if dims is None else dims
    breaks = rng.normal() + np.cumsum(np.concatenate([[0], 10 ** rng.uniform(-2, 1, pieces)]))
    return Trajectory(breaks, rng.normal(size=(degree + 1, pieces, dims)))


def as_ppoly(t):
    return PPoly(t.powers()[::-1], t.breaks)


@given(SEEDS)
def test_evaluation_is_scipys(seed):
    rng = np.random.default_rng(seed)
    t = random_trajectory(rng)
    times = rng.uniform(t.start, t.end, 50)
    for order in range(4):
        reference = as_ppoly(t).derivative(order)(times) if order else as_ppoly(t)(times)
        scale = max(np.abs(reference).max(), 1.0)
        np.testing.assert_allclose(t(times, order), reference, atol=1e-9 * scale)
        np.testing.assert_allclose(t.derivative(order)(times), t(times, order), atol=1e-9 * scale)


@given(SEEDS)
def test_extrema_enclose_and_are_taken(seed):
    rng = np.random.default_rng(seed)
    t = random_trajectory(rng)
    found = t.extrema(4)
    for m in range(4):
        for i in range(t.pieces):
            inside = np.linspace(t.breaks[i], t.breaks[i + 1], 301)[1:-1]
            values = t(inside, m)
            scale = max(np.abs(values).max(), 1e-300)
            assert (values <= found.high[m, i] + 1e-9 * scale).all()
            assert (values >= found.low[m, i] - 1e-9 * scale).all()
            piece = Trajectory(t.breaks[i : i + 2], t.coefficients[:, i : i + 1])
            for d in range(t.dims):
                at = np.clip(found.at_high[m, i, d], piece.start, piece.end)
                assert piece(at, m)[d] == pytest.approx(found.high[m, i, d], rel=1e-7, abs=1e-7 * scale)


def test_extrema_of_double_roots_and_flat_pieces():
    flat = Trajectory([0, 1], np.array([0.0, 0.0, 0.0, 2.0])[:, None, None])
    assert flat.extrema(4).high[:, 0, 0].tolist() == [2, 0, 0, 0]
    touching = Trajectory([0, 1], np.array([1.0, -1.0, 0.25])[:, None, None])  # (u - 1/2)²
    assert touching.extrema(1).low[0, 0, 0] == pytest.approx(0, abs=1e-16)
    saddle = Trajectory([0, 1], np.array([1.0, -1.5, 0.75, -0.125])[:, None, None])  # (u - 1/2)³
    found = saddle.extrema(2)
    assert (found.low[0, 0, 0], found.high[0, 0, 0]) == pytest.approx((-0.125, 0.125))
    assert found.low[1, 0, 0] == pytest.approx(0, abs=1e-15)


@given(SEEDS)
def test_split_powers_and_scaling_change_nothing(seed):
    rng = np.random.default_rng(seed)
    t = random_trajectory(rng, degree=int(rng.integers(1, 7)))
    times = rng.uniform(t.start, t.end, 30)
    split = t.split(rng.uniform(t.start, t.end, 5))
    scale = np.abs(t(times)).max() + 1
    np.testing.assert_allclose(split(times), t(times), atol=1e-10 * scale)
    again = Trajectory.from_powers(t.breaks, t.powers())
    np.testing.assert_allclose(again.coefficients, t.coefficients, atol=1e-12 * scale)
    factor = float(rng.uniform(0.5, 3))
    slow = t.scaled(factor)
    at = t.start + (times - t.start) * factor
    for m in range(4):
        fast = t(times, m)
        np.testing.assert_allclose(
            slow(np.minimum(at, slow.end), m) * factor**m, fast, atol=1e-7 * (np.abs(fast).max() + 1)
        )


@given(SEEDS)
def test_composition_is_exact(seed):
    rng = np.random.default_rng(seed)
    curve = random_trajectory(rng, degree=int(rng.integers(1, 6)))
    knots = np.linspace(0, 2, int(rng.integers(2, 6)))
    values = np.sort(rng.uniform(curve.start, curve.end, len(knots)))
    values[0], values[-1] = curve.start, curve.end
    law = Trajectory.from_hermite(knots, values[:, None])
    if rng.random() < 0.5:  # a smooth monotone one
        law = Trajectory([0, 2], np.array([-2.0, 3.0, 0.0, 0.0])[:, None, None] * curve.duration)
        law = Trajectory(law.breaks, law.coefficients + np.eye(4)[3][:, None, None] * curve.start)
    whole = curve.compose(law)
    assert whole.degree == curve.degree * law.degree
    times = rng.uniform(0, 2, 60)
    expected = curve(np.clip(law(times)[:, 0], curve.start, curve.end))
    np.testing.assert_allclose(whole(times), expected, atol=1e-8 * (np.abs(expected).max() + 1))


@given(SEEDS)
def test_squared_integral_is_the_quadrature(seed):
    rng = np.random.default_rng(seed)
    t = random_trajectory(rng, degree=5)
    nodes, weights = np.polynomial.legendre.leggauss(8)
    total = 0.0
    for a, b in zip(t.breaks[:-1], t.breaks[1:], strict=True):
        at = 0.5 * (a + b) + 0.5 * (b - a) * nodes
        total += 0.5 * (b - a) * float(weights @ (t(at, 3) ** 2).sum(axis=1))
    assert t.squared_integral(3) == pytest.approx(total, rel=1e-9)


@pytest.mark.parametrize(("values", "order"), [(1, 0), (2, 1), (3, 2)])
def test_hermite_meets_its_data(values, order):
    rng = np.random.default_rng(5)
    times = np.cumsum(rng.uniform(0.1, 2, 6))
    data = rng.normal(size=(values, 6, 2))
    t = Trajectory.from_hermite(times, *data)
    for m in range(values):
        left, right = t.ends(m)
        np.testing.assert_allclose(np.concatenate([left, right[-1:]]), data[m], atol=1e-9)
        np.testing.assert_allclose(t.jumps(m), 0, atol=1e-9)
    assert order == values - 1


def test_at_a_jump_the_right_value_counts_and_the_left_one_at_the_end():
    steps = Trajectory([0, 1, 2], np.array([[[1.0], [5.0]]]))
    assert steps(1.0) == 5.0
    assert steps([0, 0.999, 1.0, 2.0])[:, 0].tolist() == [1, 1, 5, 5]


def test_outside_is_an_error():
    t = Trajectory.hold([1.0], 0, 1)
    for time in (-1e-9, 1.0001, np.nan):
        with pytest.raises(InvalidRequest):
            t(time)


@pytest.mark.parametrize(
    ("breaks", "coefficients", "code"),
    [
        ([0, 1, 1], np.zeros((2, 2, 1)), "not_increasing"),
        ([0, 1], np.zeros((2, 2, 1)), "shape_mismatch"),
        ([0, np.nan], np.zeros((2, 1, 1)), "not_finite"),
        ([0, 0], np.zeros((2, 1, 1)), "not_increasing"),
    ],
)
def test_bad_trajectories_are_refused(breaks, coefficients, code):
    with pytest.raises(InvalidRequest) as caught:
        Trajectory(breaks, coefficients)
    assert caught.value.errors[0].code == code


def test_hold_without_duration():
    t = Trajectory.hold([1.0, 2.0], 3.0, 3.0)
    assert t.duration == 0 and t(3.0).tolist() == [1, 2] and t(3.0, 1).tolist() == [0, 0]
    assert t.extrema(4).high[:, 0, 1].tolist() == [2, 0, 0, 0]
    assert not t.coefficients.flags.writeable
