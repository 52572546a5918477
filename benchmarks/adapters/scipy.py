"""scipy: its splines through waypoints at given times, at rest at both ends. It knows no limits."""

from math import factorial
from typing import Any

import numpy as np
from scipy.interpolate import BSpline, CubicSpline, make_interp_spline

from planner import Trajectory

from ..cases import Problem
from .entry import Answer, Entry


def entries(problem: Problem) -> list[Entry]:
    """Return the cubic spline, and the quintic one, which with these ends is the curve of least squared jerk."""
    asked = problem.asked
    times, points = asked.times, asked.waypoints
    if times is None:
        return []
    still = np.zeros(asked.dims)
    rest = [(1, still), (2, still)]

    def cubic() -> Any:
        return CubicSpline(times, points, bc_type="clamped")

    def quintic() -> Any:
        return make_interp_spline(times, points, k=5, bc_type=(rest, rest))

    def read(curve: Any) -> Answer:
        """Take the pieces over by their Taylor coefficients at the breaks, where they are exact."""
        breaks = np.unique(curve.t if isinstance(curve, BSpline) else curve.x)
        degree = curve.k if isinstance(curve, BSpline) else len(curve.c) - 1
        powers = [curve(breaks[:-1], k) / factorial(k) for k in range(degree + 1)]
        return Answer(Trajectory.from_powers(breaks, powers), times)

    return [
        Entry("scipy CubicSpline", "scipy", cubic, read),
        Entry("scipy make_interp_spline(k=5)", "scipy", quintic, read),
    ]
