"""How fully a law uses the limits, against the law and the path evaluated densely."""

import numpy as np
import pytest

from planner import PlanRequest
from planner.deadline import Deadline
from planner.paths import PathOptions, build_path
from planner.timing.course import exact_use, use
from planner.timing.fastest import best_law
from planner.timing.following import cut_at_corners
from planner.timing.second_order import fastest_profile, law_of

DENSE = np.linspace(0.0, 1.0, 41)


@pytest.mark.parametrize("seed", range(6))
def test_ratios_are_those_of_the_motion(seed):
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(5, 3))
    limits = {"velocity": 1.0, "acceleration": [2.0, 3.0, 4.0], "jerk": 30.0, "velocity_norm": 1.2}
    request = PlanRequest.of(points, limits=limits)
    course = cut_at_corners(build_path(PathOptions().path, points), request)[0]
    grid = np.unique(np.concatenate([np.linspace(course.curve.start, course.curve.end, 200), course.curve.breaks]))
    law = law_of(grid, fastest_profile(course, grid))
    found = use(course, grid, law)
    s, v, b, _, step = law.pieces
    t = DENSE[:, None] * step
    at = np.clip(s + v * t + 0.5 * b * t * t, grid[:-1], grid[1:])
    q1, q2 = course.curve.states(at, 2, first=1)
    speed = (v + b * t)[:, :, None]
    velocity, acceleration = q1 * speed, q2 * speed**2 + q1 * b[:, None]
    for order, values in ((0, velocity), (1, acceleration)):
        expected = (np.abs(values) / course.upper[order, 0]).max(axis=0)
        np.testing.assert_allclose(found.most[order], expected, rtol=2e-3, atol=2e-3)
    norm = np.linalg.norm(velocity, axis=2).max(axis=0) / 1.2
    np.testing.assert_allclose(found.most[3, :, 0], norm, rtol=1e-3, atol=1e-3)
    exact = exact_use(course, grid, law)
    assert (exact.most[:2] <= found.most[:2] + 2e-3).all() and (exact.most >= found.most).all()
    assert found.mean.max() <= found.factors.max() * (1 + 1e-12)


def test_a_solved_law_uses_its_limits():
    points = np.random.default_rng(1).normal(size=(4, 2))
    request = PlanRequest.of(points, limits={"velocity": 1.0, "acceleration": 3.0, "jerk": 40.0})
    course = cut_at_corners(build_path(PathOptions().path, points), request)[0]
    answer = best_law(course, None, 0.0, Deadline(None))
    motion = course.curve.compose(answer.timed.law)
    found = motion.extrema(4)
    worst = [found.peak(m).max() / limit for m, limit in ((1, 1.0), (2, 3.0), (3, 40.0))]
    assert max(worst) <= 1 + 1e-3 and min(worst[1:]) >= 0.99
