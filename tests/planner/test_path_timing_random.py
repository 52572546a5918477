"""Random paths of seven joints: no longer than toppra's and IPOPT's laws are, once those keep the limits.

`make check` runs a few, `make check-slow` 200; WAYWRIGHT_SEEDS=first:last runs any others. A failure names its seeds.
"""

import os

import numpy as np
import pytest
import toppra
from toppra.algorithm import TOPPRA
from toppra.constraint import DiscretizationType, JointAccelerationConstraint, JointVelocityConstraint
from toppra.interpolator import AbstractGeometricPath

from planner import PlanRequest, plan
from planner.paths import PathOptions, build_path

pytestmark = pytest.mark.slow

JOINTS = 7


def seeds(default):
    given = os.environ.get("WAYWRIGHT_SEEDS")
    first, last = (int(x) for x in given.split(":")) if given else default
    return range(first, last)


def problem(seed):
    """Return waypoints, limits and options: 2 to 15 waypoints, four kinds of path, any limit prevailing."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 16))
    points = rng.uniform(-2, 2, (n, JOINTS)) * 10 ** rng.uniform(-2, 2)
    size = float(np.abs(np.diff(points, axis=0)).max())
    v, a = size * 10 ** rng.uniform(-1, 1), size * 10 ** rng.uniform(-0.5, 1.5)
    limits = {
        "velocity": (v * rng.uniform(0.5, 2, JOINTS)).tolist(),
        "acceleration": (a * rng.uniform(0.5, 2, JOINTS)).tolist(),
        "jerk": (a * 10 ** rng.uniform(0.3, 2) * rng.uniform(0.5, 2, JOINTS)).tolist(),
    }
    path = {"kind": "cubic_spline", "boundary": "natural"}
    if n > 3:
        path = [path, {"kind": "cubic_spline", "boundary": "clamped"}, {"kind": "bezier"}, {"kind": "quintic_spline"}][
            int(rng.choice(4, p=[0.6, 0.15, 0.1, 0.15]))
        ]
    return points, limits, path


def ours(points, limits, path, **given):
    done = plan(PlanRequest.of(points, limits=limits, **given), "time_optimal_path", {"path": path})
    assert done.certificate.holds
    assert max(c.ratio for c in done.certificate.checks) <= 1 + 1e-8
    assert done.certificate.path_deviation <= 1e-9 * max(1.0, float(np.ptp(points)))
    assert done.certificate.objective.lower_bound <= done.trajectory.duration * (1 + 1e-12)
    assert not {"not_optimal", "smoothness_lost"} & {n.code for n in done.notes}
    return done


def free(limits):
    return {k: v for k, v in limits.items() if k != "jerk"}


class Curve(AbstractGeometricPath):
    """A trajectory as toppra asks for paths, over [0, 1] and in the limits' velocities."""

    def __init__(self, curve, scale):
        self.curve, self.scale, self.span = curve, scale, curve.duration

    dof = JOINTS
    path_interval = np.array([0.0, 1.0])

    def __call__(self, s, order=0):
        at = np.clip(self.curve.start + np.asarray(s) * self.span, self.curve.start, self.curve.end)
        return self.curve(at, order) * self.span**order / self.scale


def by_toppra(points, limits, path, stations=600):
    """Return toppra's duration on a fixed grid, slowed until densely sampled limits hold; None: it found nothing."""
    toppra.setup_logging("CRITICAL")
    curve = build_path(PathOptions.model_validate({"path": path}).path, points).curve
    v, a = np.array(limits["velocity"]), np.array(limits["acceleration"])
    size = v / v.max()  # lengths in which all joints are alike
    second = float(np.ptp(points, axis=0).max() / v.max())
    scheme = DiscretizationType.Interpolation
    constraints = [
        JointVelocityConstraint(np.stack([-v, v], axis=1) / size[:, None] / v.max()),
        JointAccelerationConstraint(
            np.stack([-a, a], axis=1) / size[:, None] / v.max() * second, discretization_scheme=scheme
        ),
    ]
    each = int(np.ceil(stations / curve.pieces))
    knots = (curve.breaks - curve.start) / curve.duration
    grid = np.append((knots[:-1, None] + np.diff(knots)[:, None] * np.arange(each) / each).reshape(-1), 1.0)
    first = grid[1] * 0.5 ** np.arange(8, 0, -1)  # graded towards rest
    grid = np.unique(np.concatenate([grid, first, 1 - first]))
    scaled = Curve(curve, size * v.max() * second)
    _, sd, _ = TOPPRA(constraints, scaled, gridpoints=grid, solver_wrapper="seidel").compute_parameterization(0.0, 0.0)
    if sd is None or not np.isfinite(sd).all() or not (sd[1:] + sd[:-1] > 0).all():
        return None
    steps = np.diff(grid)
    duration = float((2 * steps / (sd[1:] + sd[:-1])).sum()) * second
    inside = np.linspace(1e-6, 1 - 1e-6, 9)  # where sd² is linear
    x = (sd[:-1, None] ** 2 + np.diff(sd**2)[:, None] * inside).reshape(-1, 1)
    u = np.repeat(np.diff(sd**2) / (2 * steps), 9)[:, None]
    at = (grid[:-1, None] + steps[:, None] * inside).reshape(-1)
    slope, bend = scaled(at, 1), scaled(at, 2)
    over = np.abs(slope) * np.sqrt(x) / constraints[0].vlim[:, 1]
    push = np.abs(bend * x + slope * u) / constraints[1].alim[:, 1]
    return duration * max(1.0, float(over.max()), float(np.sqrt(push.max())))


def against_toppra(chosen):
    longer = {}
    for seed in chosen:
        points, limits, path = problem(seed)
        done = ours(points, free(limits), path)
        assert done.certificate.objective.gap <= 3e-3, seed
        with_jerk = ours(points, limits, path)
        assert with_jerk.trajectory.duration >= done.certificate.objective.lower_bound, seed
        theirs = by_toppra(points, limits, path)
        if theirs is not None and done.trajectory.duration > theirs * (1 + 1e-3):
            longer[seed] = done.trajectory.duration / theirs - 1
    print(f"longer than toppra: {longer}")
    assert longer == {}


def test_a_few_against_toppra():
    against_toppra(seeds((0, 6)))


def test_two_hundred_against_toppra():
    """All solved, strict, with and without jerk; none longer than toppra's slowed to be strict too."""
    against_toppra(seeds((0, 200)))


def against_ipopt(chosen):
    longer = {}
    for seed in chosen:
        points, limits, path = problem(seed)
        if path["kind"] != "cubic_spline" or path["boundary"] != "natural":
            continue
        done = ours(points, limits, path)
        theirs = plan(PlanRequest.of(points, limits=limits), "time_optimal_nlp", {"path": path}).trajectory.duration
        if done.trajectory.duration > theirs * (1 + 1e-3):
            longer[seed] = done.trajectory.duration / theirs - 1
    print(f"longer than IPOPT: {longer}")
    assert longer == {}


@pytest.mark.slow
@pytest.mark.skipif("WAYWRIGHT_SEEDS" not in os.environ, reason="a campaign: WAYWRIGHT_SEEDS=first:last")
def test_with_jerk_against_ipopt():
    against_ipopt(seeds((0, 20)))
