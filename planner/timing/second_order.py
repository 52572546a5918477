"""The fastest profile of a course on given stations, without jerk limits: sdot² = a(s) linear between stations.

The path acceleration is constant on each interval, so the law is of class C1 and quadratic in time by pieces; see
``kernels.path_speeds`` for how a is found.
"""

import numpy as np
from numpy.typing import NDArray

from ..errors import Infeasible, SolverFailed
from .course import Course, LawPieces

Array = NDArray[np.float64]


def fastest_profile(course: Course, grid: Array, tight: Array | None = None) -> Array:
    """Return a at the stations, (n + 1,), of the fastest profile.

    Parameters
    ----------
    tight : (4, n, D)
        Shares of the limits (velocity, acceleration, jerk, norm) that may be used on each interval; None: all.

    Raises
    ------
    Infeasible
        The path speeds asked at the ends cannot be joined within the limits.
    """
    if tight is None:
        tight = np.ones((4, len(grid) - 1, course.curve.dims))
    status, where, a, best = _passes(course, grid, tight, 1.0)
    if status:
        _explain(course, grid, tight, status, where, best)
    return a


def _passes(course: Course, grid: Array, tight: Array, relaxed: float) -> tuple[int, int, Array, Array]:
    """Run the passes with accelerations relaxed by a factor; return status, station, a and the largest controllable."""
    from ..kernels.path_speeds import fastest_speeds, speed_caps

    count = len(grid) - 1
    slopes, bends = derivatives(course, grid, np.array([0.0, 1.0]), 2)
    piece = course.pieces(grid)
    caps, best, least, a = (np.empty(count + 1) for _ in range(4))
    share = np.minimum(tight[0].min(axis=1), tight[3].min(axis=1)) ** 2
    speed_caps(slopes, course.lower[0][piece], course.upper[0][piece], course.norm[piece], share, caps)
    scale = tight[1] * relaxed
    lower, upper = course.lower[1][piece] * scale, course.upper[1][piece] * scale
    first, last = course.start[0] ** 2, course.end[0] ** 2
    caps[0], caps[-1] = max(caps[0], first), max(caps[-1], last)  # what is asked there keeps the limits themselves
    status, where = fastest_speeds(np.diff(grid), slopes, bends, caps, lower, upper, first, last, best, least, a)
    if status == 0 and not np.isfinite(a).all():
        raise OverflowError("the path speeds leave the range of floating point")
    return status, where, a, best


def derivatives(course: Course, grid: Array, shares: Array, orders: int) -> Array:
    """Return the path's derivatives of order 1 … at shares of every interval, one-sided, (orders, P, n, D)."""
    if course.curve.rational:
        inside = np.clip(shares, 1e-9, 1.0 - 1e-9)[:, None]
        return course.curve.states(grid[:-1] + inside * np.diff(grid), orders, first=1)
    from ..kernels.path_speeds import interval_derivatives

    out = np.empty((orders, len(shares), len(grid) - 1, course.curve.dims))
    interval_derivatives(course.curve.breaks, course.curve.coefficients, grid, shares, out)
    return out


def law_of(grid: Array, a: Array) -> LawPieces:
    """Return the law: constant path acceleration between stations.

    Raises
    ------
    SolverFailed
        The speed vanishes at two neighbouring stations.
    """
    speed = np.sqrt(a)
    step, total = np.diff(grid), speed[:-1] + speed[1:]
    if not (total > 0).all():
        raise SolverFailed("timing", "the path speed vanishes on a whole interval")
    pieces = np.zeros((5, len(step)))
    pieces[0], pieces[1], pieces[2], pieces[4] = grid[:-1], speed[:-1], np.diff(a) / (2.0 * step), 2.0 * step / total
    return LawPieces(pieces, np.arange(len(step)))


def _explain(course: Course, grid: Array, tight: Array, status: int, where: int, best: Array) -> None:
    """Raise Infeasible: which joint's acceleration is short where, and by how much."""
    low, high = 1.0, 2.0
    while _passes(course, grid, tight, high)[0] and high < 1e12:
        low, high = high, 2.0 * high
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _passes(course, grid, tight, middle)[0] else (low, middle)
    start = status == 2  # otherwise no speed, or only a higher one, leads to the end
    speed, at = (course.start[0], 0) if start else (course.end[0], len(grid) - 1)
    slope = course.curve(grid[at], 1)
    k = min(max(where - 1 if where == len(grid) - 1 else where, 0), len(grid) - 2)
    piece = course.pieces(grid)[k]
    limit = np.minimum(course.upper[1, piece], -course.lower[1, piece])
    joint = int(np.argmax(np.abs(derivatives(course, grid[k : k + 2], np.array([0.5]), 1)[0, 0, 0]) / limit))
    enough = high < 1e12
    possible = f"; the largest speed there is {np.sqrt(best[0]) / speed:.6g} of that asked" if status == 2 else ""
    side = "start" if start else "end"
    message = f"the velocity asked at the {side} breaks a limit of velocity"
    if enough:
        verb = "left" if start else "reached"
        message = f"the velocity asked at the {side} cannot be {verb} within the limits: joint {joint} would need "
        message += f"{high:.6g} times its acceleration"
    raise Infeasible(
        message + possible,
        joint=joint if enough else int(np.argmax(np.abs(slope))),
        quantity="acceleration" if enough else "velocity",
        bound=float(limit[joint]) if enough else None,
        needed=float(high * limit[joint]) if enough else None,
    )
