"""Lower bounds of the duration along a path, each computed again from what is handed over."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..deadline import Deadline
from ..types import Bound
from . import second_order, third_order
from .course import Course

Array = NDArray[np.float64]

#: Where the bound is asked for: parts of each interval, and how many stations that may make.
FINER, MOST = 16, 200_000
#: Tolerance of the interior point where its multipliers are to prove something.
PRECISE = 1e-10


@dataclass(frozen=True, eq=False)
class LeastDuration:
    """Evidence that no law takes less: an envelope above sdot² of every one that keeps velocity and acceleration.

    A jerk limit only adds to that. ``grids``: stations of each course; ``floor``: a duration that was asked for.
    """

    courses: tuple[Course, ...]
    grids: tuple[Array, ...]
    floor: float

    def lower_bound(self) -> float:
        """Return the sum of the courses' least durations, s."""
        from ..kernels.path_speeds_bound import least_duration

        total = 0.0
        for course, grid in zip(self.courses, self.grids, strict=True):
            piece, curve = course.pieces(grid), course.curve
            limits = [getattr(course, side)[m][piece] for m in (1, 0) for side in ("lower", "upper")]
            ends = course.start[0] ** 2, course.end[0] ** 2
            seconds = np.empty(len(piece))
            total += least_duration(curve.breaks, curve.coefficients, grid, *limits, course.norm[piece], *ends, seconds)
        rests = all(course.rests for course in self.courses)  # else limits and durations are kept to 1e-8 only
        return max(float(total), self.floor) * (1.0 if rests else 1.0 - 3e-8)


@dataclass(frozen=True, eq=False)
class Relaxation:
    """Evidence from the multipliers of the jerk-limited programs: the dual value of their convex relaxation.

    With Lambda the sum of an interval's jolt multipliers, lowered to its step h where it is more, the Lagrangian
    sum h phi(A) + ends - multipliers * slacks is convex in y: its tangent at the point found, at its least over
    0 <= y <= (what the caps allow), is below the duration of every spline profile on the grid.
    """

    splines: tuple[third_order.Spline, ...]
    floor: float

    def lower_bound(self) -> float:
        """Return the sum over the courses, s."""
        return float(max(sum(dual_value(s) for s in self.splines), self.floor))


def dual_value(spline: third_order.Spline) -> float:
    """Return the value of the dual function of a program's relaxation at its multipliers."""
    p, y = spline.problem, spline.values
    pushes, rows, width = p.sizes
    m = len(p.maps)
    sides, caps = spline.multipliers[0][: 2 * rows * width], spline.multipliers[0][2 * rows * width :][:m]
    sides = np.maximum(sides.reshape(rows, 2, width)[:, :, :m], 0.0)
    steps = np.diff(p.nodes)
    jolts = sides[pushes:].sum(axis=(0, 1))
    sides[pushes:] *= np.minimum(1.0, steps / np.maximum(jolts, 1e-300))
    jolts = np.minimum(jolts, steps)
    pulls = (sides * p.inverse.reshape(rows, 2, width)[:, :, :m]).sum(axis=1)
    by_form = np.einsum("rk,rck->ck", pulls, p.forms.reshape(rows, 3, width)[:, :, :m])
    by_form[0] += caps * p.over_caps[:m]
    local = np.stack([y[:-2], y[1:-1], y[2:]])
    mean = np.einsum("ki,ik->k", p.maps[:, 0], local)
    value = float(((steps - jolts) / np.sqrt(mean)).sum() - sides[:pushes].sum() - caps.sum())
    value += float((by_form * np.einsum("kri,ik->rk", p.maps, local)).sum())
    slopes = by_form + np.stack([-0.5 * (steps - jolts) * mean**-1.5, np.zeros(m), np.zeros(m)])
    each = np.einsum("ck,kci->ik", slopes, p.maps)
    gradient = np.zeros(m + 2)
    for i in range(3):
        gradient[i : m + i] += each[i]
    for (share, seconds, cap, _), at, single in zip(p.ends, (1, m), spline.multipliers[1][:2], strict=True):
        if share > 0:
            time = seconds / np.sqrt(share * y[at])
            value += time - single * (1.0 - share * y[at] / cap)
            gradient[at] += -0.5 * time / y[at] + single * share / cap
    highest = np.full(m + 2, np.inf)
    with np.errstate(divide="ignore"):
        for i in range(3):
            np.minimum(highest[i : m + i], 1.0 / (p.over_caps[:m] * p.maps[:, 0, i]), out=highest[i : m + i])
    free = ~p.fixed
    down, up = gradient[free] * -y[free], gradient[free] * (highest - y)[free]
    return value + float(np.minimum(down, up).sum())


def duration_bound(
    courses: Sequence[Course], grids: Sequence[Array], floor: float, thorough: bool, deadline: Deadline
) -> Bound | None:
    """Return the bound: cheap, of all laws along the path; ``thorough``: closer, at a price.

    ``courses``: those that move. With a jerk limit the closer one holds for profiles on the grid. None where the path
    is rational.
    """
    if any(c.curve.rational for c in courses):
        return None
    if not thorough:
        return Bound("all", LeastDuration(tuple(courses), tuple(grids), floor))
    if not any(c.jerk for c in courses):
        parts = [max(min(FINER, MOST // len(g)), 1) for g in grids]
        finer = [_divided(g, k) for g, k in zip(grids, parts, strict=True)]
        return Bound("all", LeastDuration(tuple(courses), tuple(finer), floor))
    splines = []
    for course, grid in zip(courses, grids, strict=True):
        deadline.left()
        whole = np.ones((4, len(grid) - 1, course.curve.dims))
        ceiling = second_order.fastest_profile(course.without_jerk(), grid)
        problem = third_order.pose(course, grid, whole, ceiling)
        splines.append(third_order.solve(problem, third_order.first_guess(ceiling), (1.0, 0.0), PRECISE))
    closer, cheap = Relaxation(tuple(splines), floor), LeastDuration(tuple(courses), tuple(grids), floor)
    if closer.lower_bound() > cheap.lower_bound():
        return Bound("on_grid", closer)
    return Bound("all", cheap)  # the relaxation is not tight where its multipliers had to be lowered


def _divided(grid: Array, parts: int) -> Array:
    inside = grid[:-1, None] + np.diff(grid)[:, None] * np.arange(parts) / parts
    return np.append(inside.reshape(-1), grid[-1])
