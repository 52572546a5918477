"""Phases of constant jerk: integrated, their extremes, and merged onto one clock, against plain formulas."""

import numpy as np
import pytest

from planner.kernels.phases import extremes, integrate, merge
from planner.trajectory import Trajectory

EPS = np.finfo(float).eps


def random_motion(rng, segments, dims, pieces, stepped=False):
    """Durations (S,) and phases (S, D, n, 5) that join in velocity (and in acceleration); some take no time."""
    durations = rng.uniform(0.2, 3.0, segments)
    cuts = np.sort(rng.uniform(0, 1, (segments, dims, pieces - 1)), axis=2)
    cuts[:, :, pieces // 2 :] = cuts[:, :, -1:] if pieces > 2 else cuts[:, :, pieces // 2 :]
    steps = np.diff(np.pad(cuts, ((0, 0), (0, 0), (1, 1)), constant_values=((0, 0), (0, 0), (0, 1))), axis=2)
    steps *= durations[:, None, None]
    rates = rng.normal(size=steps.shape) * 5
    start = rng.normal(size=(2, segments, dims))
    flags = np.full((segments, dims), stepped)
    phases = integrate(steps, rates, flags, start, np.zeros((3, segments, dims)))
    t, p, v, a, j = np.moveaxis(phases[:, :, -2], 2, 0)
    end = np.stack([p + t * (v + t * (a / 2 + t * j / 6)), v + t * (a + t * j / 2), a + t * j])
    return durations, integrate(steps, rates, flags, start, end)


def state(phases, duration, u):
    """Position, velocity, acceleration and jerk of one joint at a time from the start, by formula."""
    ends = np.cumsum(phases[:, 0])
    k = min(int(np.searchsorted(ends, u, side="right")), len(phases) - 1)
    w = u - (ends[k] - phases[k, 0])
    _, p, v, a, j = phases[k]
    return np.array([p + w * (v + w * (a / 2 + w * j / 6)), v + w * (a + w * j / 2), a + w * j, j])


@pytest.mark.parametrize("seed", range(20))
def test_merged_motions_are_the_phases(seed):
    rng = np.random.default_rng(seed)
    segments, dims = int(rng.integers(1, 6)), int(rng.integers(1, 8))
    durations, phases = random_motion(rng, segments, dims, int(rng.integers(2, 9)), stepped=seed % 3 == 0)
    origin = rng.normal(size=(segments, dims))
    times = np.concatenate([[0.0], np.cumsum(durations)]) + rng.choice([0.0, 60.0])
    breaks, powers = merge(times, phases, origin)
    assert (np.diff(breaks) > 0).all() and np.isin(times, breaks).all()
    made = Trajectory.from_powers(breaks, powers)
    middles = 0.5 * (breaks[:-1] + breaks[1:])
    found = made.states(middles)
    for k, t in enumerate(middles):
        i = np.searchsorted(times, t) - 1
        for d in range(dims):
            expected = state(phases[i, d], durations[i], t - times[i]) + [origin[i, d], 0, 0, 0]
            np.testing.assert_allclose(found[:, k, d], expected, atol=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_short_pieces_late_on_the_clock_stay_exact(seed):
    """The jerk read off the polynomial is the phase's, and what joins, joins, but for the rounding of the clock."""
    rng = np.random.default_rng(seed)
    durations, phases = random_motion(rng, 1, 5, 7)
    phases[:, :, :, 0] *= (squeezed := 10.0 ** rng.uniform(-5, 0))
    steps, rates = phases[:, :, :-1, 0].copy(), phases[:, :, :-1, 4] / squeezed
    phases = integrate(
        steps, rates, np.zeros((1, 5), bool), phases[0:1, :, 0, 2:4].transpose(2, 0, 1).copy(), np.zeros((3, 1, 5))
    )
    times = 60.0 + np.array([0.0, durations[0] * squeezed])
    made = Trajectory.from_powers(*merge(times, phases, np.zeros((1, 5))))
    _, pushed = made.ends(3)
    known = np.append(rates.ravel(), 0.0)
    assert (np.abs(pushed[..., None] - known).min(axis=2) <= 8 * EPS * np.abs(rates).max()).all()
    for order in (0, 1, 2):
        peak = np.abs(np.concatenate(made.ends(order + 1))).max()
        allowed = 60 * EPS * peak * 4 + 64 * EPS * np.abs(np.concatenate(made.ends(order))).max()
        assert np.abs(made.jumps(order)).max(initial=0.0) <= allowed


@pytest.mark.parametrize("stepped", [False, True])
@pytest.mark.parametrize("seed", range(20))
def test_extremes(seed, stepped):
    rng = np.random.default_rng(seed)
    durations, phases = random_motion(rng, 3, 4, 6, stepped)
    found = extremes(phases)
    for i in range(3):
        made = Trajectory.from_powers(*merge(np.array([0.0, durations[i]]), phases[i : i + 1], np.zeros((1, 4))))
        expected = made.extrema(4)
        np.testing.assert_allclose(found[0, :, i], expected.low.min(axis=1), atol=1e-11)
        np.testing.assert_allclose(found[1, :, i], expected.high.max(axis=1), atol=1e-11)


def test_extremes_of_a_joint_that_rests():
    phases = np.zeros((1, 1, 3, 5))
    phases[0, 0, :, 1] = 2.0
    assert extremes(phases)[:, :, 0, 0].tolist() == [[2.0, 0.0, 0.0, 0.0]] * 2


def test_boundaries_that_differ_by_rounding_are_one():
    steps = np.array([[[0.1, 0.2, 0.7], [0.1, 0.2, 0.7], [0.3, 0.7, 0.0]]])
    steps[0, 1, 0] *= 1.0 + 2e-15
    rates = np.array([[[1.0, -1.0, 0.5], [2.0, 1.0, 0.0], [1.0, 2.0, 0.0]]])
    phases = integrate(steps, rates, np.zeros((1, 3), bool), np.zeros((2, 1, 3)), np.zeros((3, 1, 3)))
    breaks, _ = merge(np.array([0.0, 1.0]), phases, np.zeros((1, 3)))
    np.testing.assert_allclose(breaks, [0.0, 0.1, 0.3, 1.0], rtol=1e-14)


def test_short_phases_that_are_seen_stay():
    """A jerk of 1e9 for 1e-13 s changes the acceleration; a boundary at which nothing changes is none."""
    steps, rates = np.array([[[0.5, 1e-13, 0.25, 0.25 - 1e-13]]]), np.array([[[1.0, 1e9, -1.0, -1.0]]])
    phases = integrate(steps, rates, np.zeros((1, 1), bool), np.zeros((2, 1, 1)), np.zeros((3, 1, 1)))
    made = Trajectory.from_powers(*merge(np.array([0.0, 1.0]), phases, np.zeros((1, 1))))
    assert made.pieces == 3
    assert np.abs(made.jumps(2)).max() <= 1e9 * 2 * EPS  # what half a tick of the clock is worth
    assert made.ends(3)[0][:, 0] == pytest.approx([1.0, 1e9, -1.0])


def test_segments_without_duration_vanish_and_joints_that_are_early_rest():
    phases = np.zeros((3, 2, 2, 5))
    phases[[0, 2], 0, 0, 0], phases[[0, 2], 0, 0, 2] = 1.0, 3.0  # joint 0 moves; joint 1 rests from the start
    phases[[0, 2], 0, 1, 1:3] = 3.0
    breaks, powers = merge(np.array([0.0, 1.0, 1.0, 2.0]), phases, np.array([[0.0, 5.0], [3.0, 5.0], [3.0, 5.0]]))
    assert breaks.tolist() == [0.0, 1.0, 2.0]
    assert powers[:2].tolist() == [[[0.0, 5.0], [3.0, 5.0]], [[3.0, 0.0], [3.0, 0.0]]]
