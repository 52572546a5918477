"""The distance from a curve run through by a law, against evaluation."""

import numpy as np
import pytest

from planner.kernels.deviation import largest_deviation
from planner.trajectory import Trajectory


def deviation(motion, law, curve, places):
    each = ((x.breaks, x.coefficients) for x in (motion, law, curve))
    return largest_deviation(*(array for pair in each for array in pair), places)


def increasing(rng, count, start, end):
    inner = np.sort(rng.uniform(start, end, count - 2))
    return np.concatenate([[start], inner, [end]])


@pytest.mark.parametrize("seed", range(40))
def test_agrees_with_evaluation(seed):
    """Breaks that differ, laws that leave the curve, trajectories that start earlier or end later than the law."""
    rng = np.random.default_rng(seed)
    dims, degree = int(rng.integers(1, 18)), int(rng.integers(1, 10))
    curve = Trajectory(increasing(rng, 5, 0, 2), rng.normal(size=(4, 4, dims)))
    times = increasing(rng, 7, 0, 3)
    law = Trajectory.from_hermite(times, increasing(rng, 7, 0, 2 + 0.1 * (seed % 2))[:, None])
    first, last = (0.0, 3.0) if seed % 3 else (-0.5, 3.5)
    motion = Trajectory(increasing(rng, 6, first, last), rng.normal(size=(degree + 1, 5, dims)))
    places = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, 12) / 12)
    breaks = np.union1d(motion.breaks, np.clip(law.breaks, motion.start, motion.end))
    at = (breaks[:-1, None] + np.diff(breaks)[:, None] * places).reshape(-1)
    at = np.clip(at, max(first, 0.0), min(last, 3.0))
    s = np.clip(law(at)[:, 0], curve.start, curve.end)
    expected = np.linalg.norm(motion(at) - curve(s), axis=1).max()
    assert deviation(motion, law, curve, places) == pytest.approx(expected, rel=1e-9)


def test_what_overflows_is_told_as_such():
    curve = Trajectory([0.0, 1.0], np.array([1.0, 0.0])[:, None, None])
    huge = Trajectory([0.0, 1.0], np.array([1e200, 0.0])[:, None, None])
    assert deviation(huge, curve, curve, np.linspace(0, 1, 9)) == np.inf
    assert deviation(curve, curve, curve, np.linspace(0, 1, 9)) == 0.0
