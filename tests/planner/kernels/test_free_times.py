"""The energy at its best node states against its definition, and its gradient against finite differences."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.kernels.blocks import factorise, solve
from planner.kernels.free_times import best_energy
from planner.smoothing.free_times import Nodes
from planner.trajectory import Trajectory


def energy(nodes, h, slope, noise):
    room = nodes.room()
    value = best_energy(h, nodes.groups, nodes.points, nodes.ends, nodes.fixed, room, slope, noise)
    return value, nodes.states(room)


@pytest.mark.parametrize("order", [2, 3, 4])
@given(st.integers(0, 2**32 - 1))
def test_energy_and_gradient(order, seed):
    rng = np.random.default_rng(seed)
    n, dims = int(rng.integers(2, 9)), int(rng.integers(1, 4))
    points, ends = rng.normal(size=(n, dims)), rng.normal(size=(2, order - 1, dims))
    ends[rng.random(ends.shape) < 0.2] = np.nan
    nodes = Nodes.of(points, order, *ends)
    h = np.exp(rng.uniform(-1, 1, n - 1))
    slope, noise = np.empty(n - 1), np.empty(n - 1)
    value, states = energy(nodes, h, slope, noise)
    spline = Trajectory.from_hermite(np.concatenate([[0], np.cumsum(h)]), points, *states)
    size = value + 1e-9 * (points**2).sum() / h.min() ** (2 * order - 1)
    assert abs(spline.squared_integral(order) - value) <= 1e-9 * size
    gradient, largest, rounding = slope.copy(), float(np.abs(slope).max()), noise.copy()
    for i in range(n - 1):
        step = np.zeros(n - 1)
        step[i] = 1e-5
        change = energy(nodes, h * np.exp(step), slope, noise)[0] - energy(nodes, h * np.exp(-step), slope, noise)[0]
        assert abs(change / 2e-5 - gradient[i]) <= 1e-6 * (largest + size) + rounding[i]


def test_block_factor():
    rng = np.random.default_rng(3)
    n, b = 5, 4
    full = np.zeros((n * b, n * b))
    diag, off = np.zeros((n, b, b)), np.zeros((n, b, b))
    for j in range(n):
        a = rng.normal(size=(b, b))
        diag[j] = a @ a.T + 10 * np.eye(b)
        full[j * b : (j + 1) * b, j * b : (j + 1) * b] = diag[j]
        if j < n - 1:
            off[j] = rng.normal(size=(b, b))
            full[j * b : (j + 1) * b, (j + 1) * b : (j + 2) * b] = off[j]
            full[(j + 1) * b : (j + 2) * b, j * b : (j + 1) * b] = off[j].T
    lower, across, rhs, out = np.zeros_like(diag), np.zeros_like(diag), rng.normal(size=(n, b)), np.zeros((n, b))
    assert factorise(diag, off, 0.0, lower, across)
    solve(lower, across, rhs, out)
    np.testing.assert_allclose(full @ out.reshape(-1), rhs.reshape(-1), atol=1e-10)
    diag[2, 1, 1] = -100.0
    assert not factorise(diag, off, 0.0, lower, across)
