"""toppra: the call its documentation starts with, default settings throughout. It knows no jerk limits."""

from typing import Any

import numpy as np
import toppra
from scipy.optimize import minimize_scalar
from toppra import SplineInterpolator
from toppra.algorithm import TOPPRA
from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

from planner import Trajectory

from ..cases import Problem
from .entry import Answer, Array, Entry

toppra.setup_logging("ERROR")

ENDS = {"natural": "natural", "clamped": "clamped", "not_a_knot": "not-a-knot", "periodic": "periodic"}


def entries(problem: Problem) -> list[Entry]:
    """Return the entry, for paths without jerk limits."""
    asked, path = problem.asked, problem.path
    velocity, acceleration = asked.limits.velocity, asked.limits.acceleration
    if path is None or asked.limits.jerk is not None or velocity is None or acceleration is None:
        return []
    knots = np.array(path["knots"], dtype=float)
    speeds = np.column_stack([velocity.lower, velocity.upper])
    accelerations = np.column_stack([acceleration.lower, acceleration.upper])

    def run() -> Any:
        curve = SplineInterpolator(knots, asked.waypoints, bc_type=ENDS[path["boundary"]])
        constraints = [JointVelocityConstraint(speeds), JointAccelerationConstraint(accelerations)]
        instance = TOPPRA(constraints, curve)
        return instance.compute_trajectory(), instance

    def read(result: Any) -> Answer:
        found, instance = result
        if found is None:
            raise ValueError("toppra found no parametrisation")
        spline = found.cspl  # a SciPy spline: its pieces are taken over as they are
        curve = Trajectory.from_powers(spline.x, spline.c[::-1])
        return Answer(curve, _passing(curve, instance.problem_data, knots, asked.waypoints))

    return [Entry("toppra quick start", "toppra", run, read)]


def _passing(curve: Trajectory, data: Any, knots: Array, points: Array) -> Array:
    """Return when each waypoint is passed most closely: toppra does not say, but its grid tells about when."""
    grid, rate = data.gridpoints, data.sd_vec
    steps = 2.0 * np.diff(grid) / (rate[1:] + rate[:-1])
    times = np.concatenate([[curve.start], curve.start + np.cumsum(steps)])
    around = np.interp(knots, grid, times)
    passed = [curve.start]
    for guess, point in zip(around[1:-1], points[1:-1], strict=True):
        near = (max(guess - 2 * steps.max(), curve.start), min(guess + 2 * steps.max(), curve.end))
        found = minimize_scalar(lambda t, q=point: float(np.sum((curve(t) - q) ** 2)), bounds=near, method="bounded")
        passed.append(float(found.x))
    return np.array([*passed, curve.end])
