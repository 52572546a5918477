"""Shared by all tests: hypothesis profile with reproducible failures, and random problems from a printed seed."""

import os

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(name, "1")

# The same examples in each run, so that a change is judged by what it changes; WAYWRIGHT_RANDOM=1 draws new ones.
settings.register_profile(
    "waywright",
    derandomize="WAYWRIGHT_RANDOM" not in os.environ,
    deadline=None,
    print_blob=True,
    max_examples=int(os.environ.get("WAYWRIGHT_EXAMPLES", "25")),
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
settings.load_profile("waywright")


def make_problem(seed: int) -> dict:
    """Return a random feasible plan request in the contract's shape; the seed is the whole recipe.

    Families: times without limits; times with limits that a known quintic spline keeps; limits without times (velocity,
    acceleration, jerk in mixes), with repeated waypoints, tiny moves, scales from 1e-3 to 1e3, per-segment limits,
    durations, and states at the ends.
    """
    from planner import Trajectory

    rng = np.random.default_rng(seed)
    n, dims = int(rng.integers(2, 9)), int(rng.integers(1, 8))
    size = 10.0 ** rng.uniform(-3, 3)
    points = rng.uniform(-1, 1, (n, dims)) * size
    if rng.random() < 0.2 and n > 2:
        k = int(rng.integers(1, n))
        points[k] = points[k - 1]
    if rng.random() < 0.15:
        points[:, rng.integers(dims)] = points[0, rng.integers(dims)]
    if rng.random() < 0.1:
        points[-1] = points[-2] + rng.choice([1e-16, 1e-9, 1e-6]) * size
    request: dict = {"waypoints": points.tolist()}
    family = ("times", "times_limits", "chosen")[int(rng.integers(3))]
    if family != "chosen":
        gaps = 10.0 ** rng.uniform(-1, 0.5, n - 1)
        times = rng.uniform(-10, 10) + np.concatenate([[0], np.cumsum(gaps)])
        request["times"] = times.tolist()
        if family == "times_limits":
            rates = [rng.normal(size=(n, dims)) * size for _ in range(2)]
            for r in rates:
                r[0] = r[-1] = 0.0
            known = Trajectory.from_hermite(times, points, *rates)
            found, slack = known.extrema(4), rng.uniform(1.02, 1.5)
            request["limits"] = {
                name: (found.peak(m) * slack + 1e-6 * size).tolist()
                for m, name in enumerate(("position", "velocity", "acceleration", "jerk"))
                if m and rng.random() < 0.6
            }
            if rng.random() < 0.3:
                low, high = found.low[0].min(axis=0), found.high[0].max(axis=0)
                room = 0.1 * (high - low) + 1e-3 * size
                request["limits"]["position"] = {"lower": (low - room).tolist(), "upper": (high + room).tolist()}
        return request
    v, a, j = (
        size * 10.0 ** rng.uniform(-1, 1),
        size * 10.0 ** rng.uniform(-1, 1.5),
        size * 10.0 ** rng.uniform(-0.5, 2.5),
    )
    spread = rng.uniform(0.5, 2.0, (3, dims))
    request["limits"] = {"velocity": (v * spread[0]).tolist(), "acceleration": (a * spread[1]).tolist()}
    if rng.random() < 0.3:
        request["limits"]["acceleration"] = {
            "lower": (-a * spread[1]).tolist(),
            "upper": (a * spread[2]).tolist(),
        }
    if rng.random() < 0.5:
        request["limits"]["jerk"] = (j * spread[2]).tolist()
    if rng.random() < 0.15:
        request["duration"] = {"min": float(20.0 * rng.uniform(0.5, 2))}
    if rng.random() < 0.15:
        request["segment_limits"] = [
            None if rng.random() < 0.5 else {"velocity": float(v * rng.uniform(0.3, 1))} for _ in range(n - 1)
        ]
    if rng.random() < 0.15:
        request["segment_durations"] = [
            None if rng.random() < 0.5 else {"min": float(rng.uniform(0.1, 5))} for _ in range(n - 1)
        ]
    return request


@pytest.fixture(scope="session")
def random_problem():
    """Return the function seed -> plan request."""
    return make_problem
