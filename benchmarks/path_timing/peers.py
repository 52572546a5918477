"""toppra and copp-py (an optional package: its entries are left out where it is not installed), as users call them."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np
import toppra
from toppra import SplineInterpolator
from toppra.algorithm import TOPPRA
from toppra.constraint import DiscretizationType, JointAccelerationConstraint, JointVelocityConstraint

from planner.timing.course import Course

from ..adapters.toppra import ENDS
from ..figures import Array
from .problems import Posed

toppra.setup_logging("ERROR")


def imported(name: str) -> tuple[Any, str]:
    """Return a package, or None and why it cannot be had."""
    try:
        return import_module(name), ""
    except ImportError as error:  # not installed, or without its native part
        return None, f"not measured: {error}"


COPP, WITHOUT_COPP = imported("copp_py")


def toppra_solve(problem: Posed, grid: Array) -> Callable[[], Array]:
    """Return a call for sdot² at the stations; constraints and their rows are ready."""
    speeds, pushes = problem.sides
    limits = [
        JointVelocityConstraint(speeds),
        JointAccelerationConstraint(pushes, discretization_scheme=DiscretizationType.Interpolation),
    ]
    instance = TOPPRA(limits, toppra_path(problem), gridpoints=grid, solver_wrapper="seidel")
    return lambda: instance.compute_parameterization(0.0, 0.0)[1] ** 2


def toppra_path(problem: Posed) -> SplineInterpolator:
    """Return the path, as toppra makes it."""
    ends = ENDS[problem.options["path"]["boundary"]]
    return SplineInterpolator(np.array(problem.path.knots), problem.asked.waypoints, bc_type=ends)


def toppra_instance(problem: Posed, **how: Any) -> TOPPRA:
    """Return what toppra's quick start makes: path, constraints, stations of its own choice."""
    speeds, pushes = problem.sides
    return TOPPRA([JointVelocityConstraint(speeds), JointAccelerationConstraint(pushes)], toppra_path(problem), **how)


def copp_robot(course: Course, grid: Array, orders: int) -> Any:
    """Return copp-py's constraints on stations: derivatives of the path and limits, given."""
    count, dims = len(grid), course.curve.dims
    robot = COPP.Robot(dims, capacity=count)
    robot.append_s(grid)
    q, *slopes = (np.ascontiguousarray(x) for x in course.curve.states(grid, orders + 1))
    robot.set_q(q, *slopes[:2], 0, dddq=slopes[2] if orders > 2 else None)
    adds = robot.add_velocity_limits, robot.add_acceleration_limits, robot.add_jerk_limits
    for add, low, high in zip(adds[:orders], course.lower[:orders, 0], course.upper[:orders, 0], strict=True):
        add(high, low, start_idx_s=0, length=count)
    return robot


def copp_solve(course: Course, grid: Array) -> Callable[[], Array]:
    """Return a call for sdot² at the stations; derivatives and limits are in place."""
    robot, solver = copp_robot(course, grid, 2), COPP.solver.topp2_ra
    problem = solver.Problem(robot.constraints, idx_s_interval=(0, len(grid) - 1), a_boundary=(0.0, 0.0))
    return lambda: solver.solve(problem)


def copp_jerk(course: Course, grid: Array) -> Callable[[], Any]:
    """Return a call for the profile with jerk limits, linearised once, at the profile without them."""
    first, robot, solver = copp_solve(course, grid), copp_robot(course, grid, 3), COPP.solver.topp3_socp

    def run() -> Any:
        a = first()
        robot.constraints.amax_substitute(a, 0)
        return solver.solve(solver.Problem(robot.constraints, a, num_stationary_max=1))

    return run
