"""Laws along a fixed curve through the waypoints: copp-py with jerk limits, toppra without, as users call them."""

from collections.abc import Callable
from dataclasses import dataclass
from math import factorial
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline
from toppra import SplineInterpolator
from toppra.algorithm import TOPPRA
from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

from planner import PlanRequest, Trajectory
from planner.timing.course import Course

from ..figures import Array
from ..path_timing.peers import COPP, copp_jerk
from ..path_timing.problems import uniform
from ..path_timing.rows import of_profile


@dataclass(frozen=True, eq=False)
class Law:
    """How long copp-py's profile takes, and when slowed until no limit is exceeded; by how much it is before."""

    duration: float
    strict: float
    beyond: float


@dataclass(frozen=True, eq=False)
class CoppTask:
    """copp-py on so many stations a segment; its derivatives and rows are ready."""

    course: Course
    grid: Array
    run: Callable[[], Any]

    @classmethod
    def of(cls, asked: PlanRequest, times: Array, stations: int) -> "CoppTask":
        """Return the task on the quintic spline whose knots are the times (N,) of the waypoints."""
        course = quintic_course(asked, times)
        grid = uniform(course, stations * course.curve.pieces + 1)
        return cls(course, grid, copp_jerk(course, grid))

    def judged(self, profile: Any) -> Law:
        """Return what a profile comes to."""
        taken = float(COPP.interpolation.s_to_t_topp3(self.grid, profile)[0])
        slow = of_profile(self.course, self.grid, profile.a, profile.b, taken)
        return Law(taken, slow.strict, slow.beyond)


def quintic_course(asked: PlanRequest, times: Array) -> Course:
    """Return the quintic spline and the limits along it.

    Second and third derivative are zero at its ends: of all such pairs, what copp-py gets the shortest motions with.
    """
    none = np.zeros(asked.dims)
    ends = [(2, none), (3, none)]
    spline = make_interp_spline(times, asked.waypoints, k=5, bc_type=(ends, ends))
    curve = Trajectory.from_powers(times, np.stack([spline(times[:-1], nu=m) / factorial(m) for m in range(6)]))
    limits = [asked.limits.bounds(m, asked.dims) for m in (1, 2, 3)]
    lower, upper = (np.stack([getattr(x, side) for x in limits]) for side in ("lower", "upper"))
    pieces = curve.pieces
    return Course(curve, *(np.tile(x[:, None], (1, pieces, 1)) for x in (lower, upper)), np.full(pieces, np.inf))


def toppra_run(asked: PlanRequest, times: Array) -> Callable[[], Any]:
    """Return a call for toppra's trajectory: its quick start on a cubic spline at rest at its ends, without jerk."""
    limits = [asked.limits.bounds(m, asked.dims) for m in (1, 2)]
    speeds, pushes = (np.column_stack([x.lower, x.upper]) for x in limits)

    def run() -> Any:
        path = SplineInterpolator(times, asked.waypoints, bc_type="clamped")
        return TOPPRA([JointVelocityConstraint(speeds), JointAccelerationConstraint(pushes)], path).compute_trajectory()

    return run
