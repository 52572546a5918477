"""The rule of jumps against its formula in arrays."""

import numpy as np
import pytest

from planner.jumps import GROWTH, JUMP, Jumps
from planner.pieces import differentiated
from planner.trajectory import Trajectory


def by_formula(trajectory, order, peak):
    """Return which jumps count, and whether one of them does by the lenient rule."""
    eps, h, c = np.finfo(float).eps, np.diff(trajectory.breaks)[:, None], np.abs(trajectory.coefficients)
    here, there = trajectory.ends(order)
    jumps = np.abs(here[1:] - there[:-1])
    own = differentiated(c, order).sum(axis=0) / h**order
    rounding = 64 * eps * np.maximum(c[:-1].max(axis=0, initial=0.0) / h**order, own)
    floor = 1e3 * eps * c[-1] / h**order
    rounding = np.where((own <= floor).all(axis=0), np.maximum(rounding, floor), rounding)
    tick = eps * np.abs(trajectory.breaks[1:-1, None])
    peaks, rates = (np.maximum(np.abs(a[1:]), np.abs(b[:-1])) for a, b in ((here, there), trajectory.ends(order + 1)))
    clock = tick * rates + order * tick / np.minimum(h[1:], h[:-1]) * peaks
    stand = 8 * eps * c[-1] / h**order
    stand = np.minimum(np.maximum(stand[1:], stand[:-1]), 1e-3 * peak)
    allowed = np.maximum(rounding[1:], rounding[:-1]) + np.minimum(clock, 1e-2 * peak) + stand
    counted = jumps > JUMP * peak + allowed
    size = np.abs(np.concatenate(trajectory.ends(0))).max(axis=0)
    noise = 64 * eps * GROWTH**order * size / np.maximum(h[1:], h[:-1]) ** order
    return counted, bool((counted & (jumps > noise)).any())


@pytest.mark.parametrize("seed", range(80))
def test_agrees_with_the_formula(seed):
    """Jumps of all sizes, about that of rounding too, and joints that stand still but for it."""
    rng = np.random.default_rng(seed)
    pieces, dims, degree = int(rng.integers(2, 30)), int(rng.integers(1, 9)), int(rng.integers(1, 8))
    breaks = np.concatenate([[0.0], np.cumsum(np.exp(rng.uniform(-8, 3, pieces)))]) + 10.0 ** rng.integers(-3, 7)
    powers = rng.normal(size=(degree + 1, 1, dims)) * 10.0 ** rng.integers(-3, 3)
    powers[1:, 0, rng.random(dims) < 0.3] = 0.0
    start = breaks[:-1, None] - breaks[0]
    each = [
        sum(powers[m] * np.prod(np.arange(m - k + 1, m + 1)) * start ** (m - k) for m in range(k, degree + 1))
        for k in range(degree + 1)
    ]
    factorial = np.cumprod([1.0, *range(1, degree + 1)])[:, None, None]
    curve = Trajectory.from_powers(breaks, np.array(each) / factorial)
    off = 10.0 ** rng.uniform(-18, -2, curve.coefficients.shape) * rng.normal(size=curve.coefficients.shape)
    curve = Trajectory(breaks, curve.coefficients * (1.0 + off * (rng.random(off.shape) < 0.5)))
    judge = Jumps(curve)
    for order in range(1, degree + 2):
        peak = np.abs(np.concatenate(curve.ends(order))).max(axis=0)
        counted, lost = judge.judged(order, peak)
        expected, expected_lost = by_formula(curve, order, peak)
        np.testing.assert_array_equal(counted, expected)
        assert lost == expected_lost
