"""The quintic spline in windows: against 50 digits, the kernel for all at once, SciPy; seams, memory, refusals."""

import itertools
import tracemalloc
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from planner.curves.higher import quintic_pieces, quintic_spline
from planner.errors import InvalidRequest, Unsupported
from planner.kernels import quintic
from planner.kernels.hermite import hermite_jumps, hermite_pieces
from planner.kernels.splines import hermite_states

Array = NDArray[np.float64]
SEAMS = [2, 3, 9, 10, quintic.GAPS, quintic.GAPS + 1, quintic.GAPS + 2, 2 * quintic.GAPS - 40, 1500]


def problem(n: int, dims: int, seed: int, decades: float = 0.5) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng([seed, n, dims])
    t = np.concatenate([[0.0], np.cumsum(10.0 ** rng.uniform(-decades, 0, n - 1))])
    return t, rng.standard_normal((n, dims)), rng.standard_normal((2, 2, dims))


def windowed(t: Array, x: Array, ends: Array) -> tuple[Array, float]:
    out = np.full((6, len(x) - 1, x.shape[1]), np.nan)
    solved, uneven = quintic.quintic_pieces(t, x, ends, out)
    assert solved
    return out, uneven


def all_at_once(t: Array, x: Array, ends: Array) -> Array:
    states, out = np.empty((2, *x.shape)), np.empty((6, len(x) - 1, x.shape[1]))
    assert hermite_states(np.diff(t), x, ends, np.ones((2, 2), dtype=bool), states)
    hermite_pieces(np.diff(t), x, states, out)
    return out


def digits(t: Array, x: Array, ends: Array) -> Array:
    """Return velocities and accelerations at the nodes, (2, N), by block elimination of the Hessian, in 50 digits."""
    mpmath.mp.dps = 50
    mp = mpmath.matrix
    h = [mpmath.mpf(b) - mpmath.mpf(a) for a, b in itertools.pairwise(t)]
    rate = [(mpmath.mpf(b) - mpmath.mpf(a)) / s**3 for a, b, s in zip(x, x[1:], h, strict=False)]
    states, passed = [mp([float(ends[0, 0]), float(ends[0, 1])])], [mpmath.zeros(2)]
    for i in range(1, len(h)):  # the state is states[i] - passed[i] times the next
        p, s = h[i - 1], h[i]
        own = mp([[64 / p**3 + 64 / s**3, 12 / s**2 - 12 / p**2], [12 / s**2 - 12 / p**2, 3 / p + 3 / s]])
        before, after = (
            mp([[56 / p**3, 8 / p**2], [-8 / p**2, -1 / p]]),
            mp([[56 / s**3, -8 / s**2], [8 / s**2, -1 / s]]),
        )
        right = mp([120 * (rate[i - 1] / p + rate[i] / s), 20 * (rate[i] - rate[i - 1])])
        inverse = (own - before * passed[-1]) ** -1
        states.append(inverse * (right - before * states[-1]))
        passed.append(inverse * after)
    states.append(mp([float(ends[1, 0]), float(ends[1, 1])]))
    for i in range(len(h) - 1, 0, -1):
        states[i] -= passed[i] * states[i + 1]
    return np.array([[float(y[r]) for y in states] for r in range(2)])


@pytest.mark.parametrize(("decades", "slack"), [(0.0, 1e-14), (0.5, 1e-14), (1.5, 1e-14), (3.0, 1e-13), (6.0, 1e-11)])
def test_states_against_fifty_digits(decades: float, slack: float) -> None:
    for seed in range(2):
        t, x, ends = problem(quintic.GAPS + 60, 1, seed, decades)
        pieces, _ = windowed(t, x, ends)
        h, exact = np.diff(t), digits(t, x[:, 0], ends[:, :, 0])[:, :-1]
        for r, (row, factor) in enumerate(((4, 1.0), (3, 2.0))):
            found = factor * pieces[row, :, 0] / h ** (r + 1)
            assert np.abs(found - exact[r]).max() <= slack * np.abs(exact[r]).max(), (seed, r)


@given(seed=st.integers(0, 2**32 - 1), n=st.sampled_from(SEAMS), dims=st.integers(1, 17), decades=st.floats(0, 6))
def test_agrees_with_all_at_once(seed: int, n: int, dims: int, decades: float) -> None:
    t, x, ends = problem(n, dims, seed, decades)
    pieces, uneven = windowed(t, x, ends)
    reference = all_at_once(t, x, ends)
    slack = 1e-12 * 10 ** max(decades - 3, 0)  # both lose digits to steps this uneven
    assert np.abs(pieces - reference).max() <= slack * np.abs(reference).max()
    ratio = np.diff(t)[1:] / np.diff(t)[:-1]
    assert uneven == pytest.approx(max(ratio.max(initial=1), (1 / ratio).max(initial=1)), rel=1e-12)


@pytest.mark.parametrize("dims", [1, 3, 7, 8, 9])
@pytest.mark.parametrize("n", SEAMS)
def test_agrees_with_scipy_and_is_continuous(n: int, dims: int) -> None:
    t, x, ends = problem(n, dims, 0)
    curve = quintic_spline(t, x, *ends)
    conditions = tuple([(r + 1, ends[side, r]) for r in range(2)] for side in (0, 1))
    peer = make_interp_spline(t, x, k=5, bc_type=conditions)
    at = (t[:-1] + t[1:]) / 2
    assert np.abs(curve(at) - peer(at)).max() < 1e-9 * np.abs(x).max()
    jumps = np.empty(2)
    hermite_jumps(np.diff(t), curve.coefficients, jumps)
    assert n == 2 or jumps.max() < 1e-11
    assert (curve.coefficients[5] == x[:-1]).all()


def test_joints_are_independent_whatever_shares_their_register() -> None:
    t, x, ends = problem(900, 7, 1)
    whole, _ = windowed(t, x, ends)
    for d in range(7):
        one, _ = windowed(t, np.ascontiguousarray(x[:, d : d + 1]), np.ascontiguousarray(ends[:, :, d : d + 1]))
        assert (whole[:, :, d] == one[:, :, 0]).all()


def test_a_far_waypoint_changes_nothing_that_can_be_seen() -> None:
    t, x, ends = problem(1200, 2, 2)
    before, _ = windowed(t, x, ends)
    x[600] += 1.0
    after, _ = windowed(t, x, ends)
    changed = np.abs(after - before).max(axis=(0, 2))
    assert changed[560:640].max() > 0.1 and changed[:500].max() < 1e-13 and changed[700:].max() < 1e-13


@given(seed=st.integers(0, 2**32 - 1), power=st.integers(-20, 20))
def test_scales_exactly(seed: int, power: int) -> None:
    """In other units, powers of two, not a bit changes."""
    t, x, ends = problem(500, 3, seed)
    unit = 2.0**power
    pieces, _ = windowed(t, x, ends)
    slow, _ = windowed(t * unit, x / unit, ends / unit / unit ** np.arange(1, 3)[:, None])
    assert (slow * unit == pieces).all()


def test_out_is_filled_and_little_else_allocated() -> None:
    t, x, ends = problem(20_000, 7, 0)
    out = np.empty((6, 19_999, 7))
    quintic_pieces(t, x, *ends, out=out)
    tracemalloc.start()
    found = quintic_pieces(t, x, *ends, out=out)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found is out and peak < 4 * t.nbytes < out.nbytes / 10
    assert (out == quintic_spline(t, x, *ends).coefficients).all()


@pytest.mark.parametrize(
    "out",
    [
        np.empty((6, 3, 2)),
        np.empty((6, 4, 2), dtype=np.float32),
        np.empty((6, 4, 4))[:, :, ::2],
        np.asfortranarray(np.empty((6, 4, 2))),
        np.broadcast_to(np.zeros(1), (6, 4, 2)),
    ],
)
def test_other_out_is_refused(out: Any) -> None:
    with pytest.raises(ValueError, match="C-contiguous"):
        quintic_pieces(np.arange(5.0), np.zeros((5, 2)), out=out)


def test_where_a_window_is_too_short_all_is_done_at_once() -> None:
    """Steps that fall to nothing in geometric progression: far corrections come back large."""
    rng = np.random.default_rng(0)
    t, x, ends = -(0.7 ** np.arange(500.0)), rng.standard_normal((500, 2)), rng.standard_normal((2, 2, 2))
    solved, uneven = quintic.quintic_pieces(t, x, ends, np.empty((6, 499, 2)))
    assert not solved and uneven == pytest.approx(1 / 0.7)
    assert (quintic_pieces(t, x, *ends) == all_at_once(t, x, ends)).all()


@pytest.mark.parametrize("times", [[0, 1e-17, 1], [0, 0, 1], [0, 2, 1], [0, np.nan, 1], [0, 1, np.inf]])
def test_times_that_the_kernel_refuses(times: list[float]) -> None:
    t, x, ends = np.array(times, dtype=float), np.ones((3, 1)), np.zeros((2, 2, 1))
    assert not quintic.quintic_pieces(t, x, ends, np.empty((6, 2, 1)))[0]


def test_uneven_times_are_solved_where_they_can_be() -> None:
    near = np.array([0.0, 1e-20, 1.0])
    found = quintic_pieces(near, [[0.0], [1e-20], [1.0]], [[1.0], [0.0]], [[1.0], [0.0]])
    assert found[4, :, 0] / np.diff(near) == pytest.approx([1, 1], rel=1e-12)
    with pytest.raises(Unsupported):
        quintic_pieces([0, 1, 2, 2 + 1e-15, 3], np.random.default_rng(0).standard_normal((5, 1)))
    with pytest.raises(InvalidRequest):
        quintic_pieces([0, 1, 1], np.zeros((3, 1)))
