"""A course: a smooth stretch of path with what limits the motion along it, and laws on it by their pieces."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..jumps import counted_jumps
from ..limits import norm_bounds, segment_bounds
from ..paths import Path
from ..trajectory import Trajectory
from ..types import PlanRequest

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: Path speed and path acceleration.
State = tuple[float, float]

#: Where pieces of the path are looked at for a standstill: a slope below this share of the mean is one.
SHARES = (np.arange(32) + 0.5) / 32.0
STALL = 0.3
#: Where an interval with one piece of law, or each of two pieces, is looked at, in shares of the piece's duration.
POINTS = {1: np.array([0.0, 0.25, 0.5, 0.75, 1.0]), 2: np.array([0.0, 0.5, 1.0])}


@dataclass(frozen=True, eq=False)
class Course:
    """A smooth stretch of path and the limits along it.

    ``lower``, ``upper`` (3, K, D): of velocity, acceleration and jerk on every piece of the curve; ``norm`` (K,): of
    the velocity's Euclidean norm; infinite where there is none. ``start``, ``end``: path speed and path acceleration
    there. ``moving`` (D,): the joints that move at all.
    """

    curve: Trajectory
    lower: Array
    upper: Array
    norm: Array
    start: State = (0.0, 0.0)
    end: State = (0.0, 0.0)

    @property
    def jerk(self) -> bool:
        """Whether any jerk is limited."""
        return bool(np.isfinite(self.lower[2]).any() or np.isfinite(self.upper[2]).any())

    @cached_property
    def even(self) -> bool:
        """Whether acceleration and its limits are continuous along the course, so that one side of a station tells."""
        same = all((x == x[:, :1]).all() for x in (self.lower, self.upper))
        if self.curve.pieces == 1 or not same:
            return same
        return not counted_jumps(self.curve, 2, self.curve.extrema(3).peak(2)).any()

    @cached_property
    def stalls(self) -> bool:
        """Whether the path nearly stands still inside, so that joints hardly tell how its parameter moves."""
        inside = self.curve.breaks[:-1, None] + np.diff(self.curve.breaks)[:, None] * SHARES
        slope = np.abs(self.curve.states(inside, 1, first=1)[0])
        slope = (slope / np.minimum(self.upper[2], -self.lower[2])[:, None]).max(axis=2).reshape(-1)
        return bool(slope[len(SHARES) // 4 : -len(SHARES) // 4].min(initial=np.inf) < STALL * slope.mean())

    @property
    def rests(self) -> bool:
        """Whether it starts and ends at rest, with no path acceleration asked for."""
        return not any((*self.start, *self.end))

    @cached_property
    def moves(self) -> bool:
        """Whether the curve is anything but one point."""
        if not self.curve.rational:
            return bool(self.curve.coefficients[:-1].any())
        found = self.curve.extrema(1)
        return bool((found.high - found.low > 1e-12 * np.abs(found.high)).any())

    def pieces(self, grid: Array) -> Index:
        """Return the curve's piece that holds each interval of a grid which has the curve's breaks."""
        middles = 0.5 * (grid[:-1] + grid[1:])
        return np.asarray(np.clip(np.searchsorted(self.curve.breaks, middles, "right") - 1, 0, self.curve.pieces - 1))

    def without_jerk(self) -> "Course":
        """Return the course with no limit of jerk, and no path acceleration asked at its ends."""
        lower, upper = self.lower.copy(), self.upper.copy()
        lower[2], upper[2] = -np.inf, np.inf
        return replace(self, lower=lower, upper=upper, start=(self.start[0], 0.0), end=(self.end[0], 0.0))


@dataclass(frozen=True, eq=False)
class LawPieces:
    """A law by its pieces: s, v, b, j and duration of each, (5, L); ``owner`` (L,), the interval of each.

    ``broken`` (n,): intervals on which the profile is no law, as the path speed would vanish.
    """

    pieces: Array
    owner: Index
    broken: NDArray[np.bool_] | None = None

    @cached_property
    def law(self) -> Trajectory:
        """The law as a trajectory that starts at time 0, of degree 2 or 3."""
        s, v, b, j, step = self.pieces
        times = np.concatenate([[0.0], np.cumsum(step)])
        powers = [s, v, 0.5 * b] + ([j / 6.0] if j.any() else [])
        return Trajectory.from_powers(times, np.stack(powers)[:, :, None])

    @property
    def duration(self) -> float:
        """Duration of the whole, s."""
        return float(self.pieces[4].sum())


@dataclass(frozen=True, eq=False)
class Use:
    """How fully a law uses the limits on every interval of the grid.

    ``most`` (4, n, D): the largest ratio to the limit, of velocity, acceleration, jerk and the velocity's norm.
    ``mean`` (n,): the factor by which the interval's time could shrink, were its best used limit used in full.
    """

    most: Array
    mean: Array

    @property
    def factors(self) -> Array:
        """The factor by which each interval would have to be slowed, (n,)."""
        each = self.most.max(axis=2)
        return np.asarray(np.maximum(np.maximum(each[0], each[3]), np.maximum(np.sqrt(each[1]), np.cbrt(each[2]))))


def courses(
    path: Path, request: PlanRequest, cuts: Array, start: tuple[float, float], end: tuple[float, float]
) -> list[Course]:
    """Return the path cut at some of its breaks, each part with the limits of its segments.

    The path's speed and acceleration at its ends are given; at the cuts it rests.
    """
    curve, count = path.curve, request.count - 1
    segment = np.zeros(curve.pieces, dtype=np.int64)
    if path.passes:
        middles = 0.5 * (curve.breaks[:-1] + curve.breaks[1:])
        segment = np.clip(np.searchsorted(path.knots, middles, side="right") - 1, 0, count - 1)
    each = [segment_bounds(request.limits, request.segment_limits, m, count, request.dims) for m in (1, 2, 3)]
    lower, upper = (np.stack([getattr(x, side)[segment] for x in each]) for side in ("lower", "upper"))
    norm = norm_bounds(request.limits, request.segment_limits, count)[segment]
    ends = [0, *np.searchsorted(curve.breaks, cuts).tolist(), curve.pieces]
    found = []
    for a, b in zip(ends[:-1], ends[1:], strict=True):
        course = Course(curve.part(a, b), lower[:, a:b], upper[:, a:b], norm[a:b])
        found.append(
            replace(course, start=start if a == 0 else (0.0, 0.0), end=end if b == curve.pieces else (0.0, 0.0))
        )
    return found


def use(course: Course, grid: Array, law: LawPieces) -> Use:
    """Return how fully a law uses the limits, from some points of each of its pieces."""
    from ..kernels.path_use import law_use

    if course.curve.rational:
        return _use_of_rational(course, grid, law)
    piece, curve = course.pieces(grid), course.curve
    inverse = np.stack([1.0 / course.upper[:, piece], 1.0 / course.lower[:, piece]])
    norm, most, mean = 1.0 / course.norm[piece], np.empty((4, len(piece), curve.dims)), np.empty(len(piece))
    points = _points(law)
    law_use(curve.breaks, curve.coefficients, piece, law.pieces, law.owner, points, inverse, norm, most, mean)
    return Use(most, mean)


def exact_use(course: Course, grid: Array, law: LawPieces) -> Use:
    """Return the same with the largest ratios of velocity, acceleration and jerk from exact extrema."""
    found = use(course, grid, law)
    motion = course.curve.compose(law.law)
    if motion.pieces != law.pieces.shape[1]:  # rounding has cut slivers off
        return found
    extremes, piece = motion.extrema(4), course.pieces(grid)[law.owner]
    ratios = np.maximum(extremes.high[1:] / course.upper[:, piece], extremes.low[1:] / course.lower[:, piece])
    most = np.maximum.reduceat(ratios, np.flatnonzero(np.diff(law.owner, prepend=-1)), axis=1)
    return Use(np.concatenate([np.maximum(most, found.most[:3]), found.most[3:]]), found.mean)


def _points(law: LawPieces) -> Array:
    return POINTS[1 if law.pieces.shape[1] < 1.5 * (law.owner[-1] + 1) else 2]


def _use_of_rational(course: Course, grid: Array, law: LawPieces) -> Use:
    s, v, b, j, step = law.pieces
    t = (
        np.clip(_points(law), 1e-9, 1.0 - 1e-9)[:, None] * step
    )  # inside, so that each piece's own derivatives are taken
    at = np.clip(s + t * (v + t * (0.5 * b + t * j / 6.0)), course.curve.start, course.curve.end)
    speed, push = (v + t * (b + 0.5 * t * j))[:, :, None], (b + t * j)[:, :, None]
    q1, q2, q3 = course.curve.states(at, 3, first=1)
    each = np.stack([q1 * speed, q2 * speed**2 + q1 * push, q3 * speed**3 + 3.0 * q2 * speed * push + q1 * j[:, None]])
    piece = course.pieces(grid)[law.owner]
    ratios = np.maximum(each / course.upper[:, None, piece], each / course.lower[:, None, piece])
    norm = np.linalg.norm(each[0], axis=2)[:, :, None] / course.norm[piece][:, None] + np.zeros_like(q1)
    ratios = np.concatenate([ratios, norm[None]])
    first = np.flatnonzero(np.diff(law.owner, prepend=-1))
    most = np.maximum.reduceat(ratios.max(axis=1), first, axis=1)
    mean = np.add.reduceat(ratios.mean(axis=1), first, axis=1) / np.bincount(law.owner)[:, None]
    roots = np.stack([mean[0], np.sqrt(mean[1]), np.cbrt(mean[2]), mean[3]])
    return Use(most, roots.max(axis=(0, 2)))
