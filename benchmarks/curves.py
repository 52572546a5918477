"""The making of curves, beside the same from SciPy. The quintic spline has its own part: ``minimum_jerk``."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
from scipy.interpolate import BarycentricInterpolator, CubicSpline, make_interp_spline

from planner import Trajectory
from planner.curves import (
    bspline,
    chebyshev_nodes,
    cubic_spline,
    interpolating_points,
    interpolation_knots,
    polynomial,
    septic_spline,
)

from .figures import JOINTS, Array, Task, power, random_walk, relative


def groups(sizes: tuple[int, ...]) -> Iterator[Callable[[], list[Task]]]:
    """Yield what makes the tasks that are measured together, for these numbers of waypoints."""
    yield partial(_growing, _cubic, sizes)
    yield partial(_growing, _septic, sizes)
    yield partial(_growing, _bspline, sizes[:3])
    yield _polynomial


def _growing(make: Callable[[int], Task], sizes: tuple[int, ...]) -> list[Task]:
    return [make(count) for count in sizes]


def _curve(
    name: str,
    what: str,
    points: tuple[Array, Array],
    ours: Callable[[], Trajectory],
    peer: str,
    theirs: Callable[[], Any],
    goal: float | None = 1.0,
) -> Task:
    """Return the task of making a curve; curves are compared by q, v and a at some times."""
    count = len(points[0])
    times = np.random.default_rng(5).uniform(points[0][0], points[0][-1], 1000)

    def difference(mine: Trajectory, other: Any) -> float:
        return relative(mine.states(times, 3), [other(times, order) for order in range(3)])

    return Task(f"{name}, N = {power(count)}", what, count, ours, peer, theirs, goal, difference, tolerance=1e-8)


def _cubic(count: int) -> Task:
    t, x = random_walk(count)
    return _curve(
        "cubic_spline",
        "at rest at the ends",
        (t, x),
        lambda: cubic_spline(t, x),
        "CubicSpline",
        lambda: CubicSpline(t, x, bc_type="clamped"),
    )


def _still(orders: int) -> Any:
    """Return SciPy's boundary condition of vanishing derivatives at both ends."""
    end = [(order, np.zeros(JOINTS)) for order in range(1, orders + 1)]
    return end, end


def _septic(count: int) -> Task:
    t, x = random_walk(count)
    return _curve(
        "septic_spline",
        "zero v, a and j at the ends",
        (t, x),
        lambda: septic_spline(t, x),
        "make_interp_spline(k=7)",
        lambda: make_interp_spline(t, x, k=7, bc_type=_still(3)),
    )


def _bspline(count: int) -> Task:
    t, x = random_walk(count)

    def ours() -> Trajectory:
        knots = interpolation_knots(t, 3)
        return bspline(interpolating_points(t, x, knots, 3), knots, 3)

    return _curve(
        "bspline",
        "through the points, degree 3",
        (t, x),
        ours,
        "make_interp_spline(k=3)",
        lambda: make_interp_spline(t, x, k=3),
        goal=None,
    )


def _polynomial() -> list[Task]:
    nodes = chebyshev_nodes(50, 0.0, 1.0)
    points = np.random.default_rng(6).normal(size=(len(nodes), JOINTS))
    times = np.random.default_rng(7).uniform(0.0, 1.0, 1000)
    return [
        Task(
            "polynomial",
            f"through {len(nodes)} Chebyshev nodes, and its values at {len(times)} times",
            len(nodes),
            ours=lambda: polynomial(nodes, points, 0.0, 1.0)(times),
            peer="BarycentricInterpolator",
            theirs=lambda: BarycentricInterpolator(nodes, points)(times),
            difference=lambda mine, other: relative([mine], [other]),
        )
    ]
