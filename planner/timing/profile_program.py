"""The program of a jerk-limited profile on given stations, as the arrays of ``kernels.path_jerk``, and how it is met.

sdot² = a(s) is a C1 quadratic spline on the stations. From rest the first interval is run through at constant path
jerk, s = j t³ / 6, so that a = a_1 ((s - s_0) / h)^(4/3); with an acceleration asked for there, and where no jerk is
limited, at constant path acceleration.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.lanes import LANES
from .course import Course, LawPieces, use
from .second_order import derivatives

Array = NDArray[np.float64]

#: Caps of sdot² over the profile without a jerk limit, which no jerk-limited one exceeds but for the grid.
CAP = 4.0
#: So many intervals are near a moving end.
NEAR = 8
#: A moving end may be at its velocity limit: inside of that there is room of this, relative to squared speed.
AT_LIMIT = 8e-9


@dataclass(frozen=True, eq=False)
class End:
    """How a profile leaves the first station (or, mirrored, reaches the last).

    ``rest``: the interval next to it is run through as the module says, and the spline begins at its other station;
    there b = ``slope`` a, and the interval takes ``seconds`` / sqrt(a); ``jerky``: at constant path jerk. Otherwise the
    spline begins at the station itself. ``fixed``: a and b where the spline begins, if they are given.
    """

    rest: bool
    slope: float
    seconds: float
    fixed: tuple[float, float] | None
    jerky: bool = False

    @classmethod
    def of(cls, state: tuple[float, float], step: float, jerk: bool) -> "End":
        """Return the end of given path speed and acceleration, for motion away from it; the first step is ``step``."""
        speed, push = state
        if speed > 0.0:
            return cls(False, 0.0, 0.0, (speed * speed, push))
        if push > 0.0:
            return cls(True, 0.5 / step, 2.0 * step, (2.0 * push * step, push))
        if jerk:
            return cls(True, 2.0 / (3.0 * step), 3.0 * step, None, True)
        return cls(True, 0.5 / step, 2.0 * step, None)


@dataclass(frozen=True, eq=False)
class Problem:
    """The program on a grid, as arrays; see ``kernels.path_jerk.solve_profile`` for what they hold."""

    grid: Array
    first: End
    last: End
    maps: Array
    fixed: NDArray[np.bool_]
    sizes: tuple[int, int, int]
    forms: Array
    inverse: Array
    over_caps: Array
    ends: Array

    @property
    def nodes(self) -> Array:
        """The stations between which the spline lies."""
        return self.grid[int(self.first.rest) : len(self.grid) - int(self.last.rest)]


def pose(course: Course, grid: Array, tight: Array, ceiling: Array) -> Problem:
    """Return the program of a course on a grid.

    Parameters
    ----------
    tight : (4, n, D)
        Shares of the limits (velocity, acceleration, jerk, norm) that may be used on each interval.
    ceiling : (n + 1,)
        Values a at the stations that are not to be passed by far.
    """
    from ..kernels.path_jerk import spline_maps

    steps = np.diff(grid)
    first = End.of(course.start, float(steps[0]), course.jerk)
    last = End.of((course.end[0], -course.end[1]), float(steps[-1]), course.jerk)
    inner = slice(int(first.rest), len(steps) - int(last.rest))
    nodes = grid[int(first.rest) : len(grid) - int(last.rest)]
    count, dims = len(nodes) - 1, course.curve.dims
    ratios = np.array([_ratio(first, steps, 0), _ratio(last, steps, -1)])
    maps = np.empty((count, 3, 3))
    spline_maps(nodes, ratios, maps)
    fixed = np.zeros(count + 2, dtype=bool)
    fixed[[0, -1]] = True
    fixed[1] |= first.fixed is not None
    fixed[-2] |= last.fixed is not None
    piece = course.pieces(grid)[inner]
    lower, upper = course.lower[:, piece] * tight[:3, inner], course.upper[:, piece] * tight[:3, inner]
    h = np.diff(nodes)[:, None]
    q1, q2, q3 = derivatives(course, nodes, np.array([0.0, 0.5, 1.0]), 3)
    sides = [(2, h)] if course.even else [(0, -h), (2, h)]  # at the right and the left end, by way from the middle
    forms = [(q2[p], q1[p] + x * q2[p], 0.5 * x * q1[p] + h * h / 6.0 * q2[p]) for p, x in sides]
    bounds = [(upper[1], lower[1])] * len(sides)
    if course.jerk:
        forms.append((q3[1], 3.0 * q2[1], q1[1]))
        for p, x in ((0, -h), (2, h)) if course.stalls else ():
            jolt = q1[p] + 1.5 * x * q2[p] + x * x / 6.0 * q3[p]
            forms.append((q3[p], 3.0 * q2[p] + x * q3[p], jolt))
        bounds += [(upper[2], lower[2])] * (len(forms) - len(sides))
    width = -(-count // LANES) * LANES
    rows, pushes = len(forms) * dims + 1, len(sides) * dims + 1
    e, inverse = np.zeros((rows, 3, width)), np.zeros((rows, 2, width))
    for i, (form, bound) in enumerate(zip(forms, bounds, strict=True)):
        at = slice(i * dims + 1, (i + 1) * dims + 1)
        e[at, :, :count] = np.stack(form).transpose(2, 0, 1)
        inverse[at, :, :count] = 1.0 / np.stack(bound).transpose(2, 0, 1)
    lid = CAP * np.maximum(ceiling[:-1], ceiling[1:])[inner]
    norm = course.norm[piece] * tight[3, inner, 0]
    caps, late = (np.minimum(_caps(q1[p], upper[0], lower[0], norm), lid) for p in (1, 2))
    for end, near in ((first, slice(0, NEAR)), (last, slice(-NEAR, None))):
        if end.fixed is not None:  # nothing is lowered below the speed asked there
            share = (1.0 / tight[[0, 3], inner][:, near].min(axis=(0, 2))) ** 2
            for each in (caps, late):
                each[near] = np.maximum(each[near], np.minimum(share * each[near], end.fixed[0]))
    room = 1.0 if course.rests else 1.0 + AT_LIMIT
    e[0, :, :count] = np.stack([np.ones(count), h[:, 0], h[:, 0] ** 2 / 6.0])  # the first row: a at the right end
    inverse[0, 0, :count] = 1.0 / (late * room)
    over_caps = np.zeros(width)
    over_caps[:count] = 1.0 / (caps * room)
    ends = np.zeros((2, 4))
    for i, (end, k) in enumerate(((first, 0), (last, len(steps) - 1))):
        if end.rest and end.fixed is None:
            effort = end.slope**2 * end.seconds / (3.0 if end.jerky else 1.0)
            ends[i] = ratios[i], end.seconds, _end_cap(course, grid, end, k, tight), effort
    sizes = pushes, rows, width
    return Problem(grid, first, last, maps, fixed, sizes, e.reshape(-1), inverse.reshape(-1), over_caps, ends)


def _caps(slope: Array, upper: Array, lower: Array, norm: Array) -> Array:
    """Return the largest a that limits of velocity and of its norm allow at given slopes (m, D)."""
    with np.errstate(divide="ignore", over="ignore"):
        speed = np.where(slope > 0, upper, -lower) / np.abs(slope)
        return np.asarray(np.minimum(speed.min(axis=1), norm / np.linalg.norm(slope, axis=1)) ** 2)


def _ratio(end: End, steps: Array, at: int) -> float:
    """Return what share of the second coefficient the first one is; 0 where that is given."""
    if end.fixed is not None or not end.rest:
        return 0.0
    return 1.0 / (1.0 + end.slope * float(steps[1 if at == 0 else -2]))


def _end_cap(course: Course, grid: Array, end: End, k: int, tight: Array) -> float:
    """Return the largest a at the far station of a first interval from rest that keeps the limits."""
    a = np.zeros(2)
    far = 1 if k == 0 else 0
    a[far] = 1.0
    pieces = end_pieces(grid[k : k + 2], a, end, k == 0)
    found = use(course, grid[k : k + 2], LawPieces(pieces, np.zeros(2, dtype=np.int64))).most[:, 0]
    share = found / tight[:, k]
    most = max(share[0].max(), share[3].max()) ** 2, share[1].max(), share[2].max() ** (2.0 / 3.0)
    return float(1.0 / max(*most, 1e-300))


def end_pieces(stations: Array, a: Array, end: End, leaving: bool) -> Array:
    """Return the law's two pieces, halves of one, on an interval next to a rest, (5, 2)."""
    step = stations[1] - stations[0]
    speed = np.sqrt(max(float(a.max()), 1e-300))
    time, jerk = end.seconds / speed, 0.0
    if end.jerky:
        jerk = 6.0 * step / time**3
        push = 0.0 if leaving else -jerk * time
    else:
        push = speed / time if leaving else -speed / time
    start, x = 0.0 if leaving else speed, 0.5 * time
    early = [stations[0], start, push, jerk, x]
    late = [stations[0] + x * (start + x * (0.5 * push + x * jerk / 6.0)), start + x * (push + 0.5 * x * jerk)]
    return np.array([early, [*late, push + x * jerk, jerk, x]]).T


def coefficients(p: Problem, guess: Array) -> Array:
    """Return the spline's coefficients: 2 a(middle) - mean of a at the ends, which is exact for a quadratic."""
    begin, end = int(p.first.rest), len(p.grid) - int(p.last.rest)
    ends, middles = guess[begin:end], guess[len(p.grid) :][begin : end - 1]
    y = np.maximum(2.0 * middles - 0.5 * (ends[:-1] + ends[1:]), 1e-3 * middles)
    y = np.concatenate([[0.0], y, [0.0]])
    _put_ends(p, y, np.diff(p.nodes))
    return y


def _put_ends(p: Problem, y: Array, steps: Array) -> None:
    """Put the given coefficients in their places; those folded into their neighbours are 0."""
    y[0] = y[-1] = 0.0
    for end, at, beside, step in ((p.first, 0, 1, steps[0]), (p.last, -1, -2, steps[-1])):
        if end.fixed is not None:
            y[at], y[beside] = end.fixed[0], end.fixed[0] + end.fixed[1] * step


def ratios_of(p: Problem, y: Array) -> tuple[Array, Array]:
    """Return A, B, C of every interval, and the rows' ratios to their limits (those of jolts over phi)."""
    rows, width, m = p.sizes[1], p.sizes[2], len(p.maps)
    abc = np.einsum("kri,ik->rk", p.maps, np.stack([y[:-2], y[1:-1], y[2:]]))
    forms = (p.forms.reshape(rows, 3, width)[:, :, :m] * abc).sum(axis=1)
    return abc, (forms[:, None] * p.inverse.reshape(rows, 2, width)[:, :, :m]).max(axis=1)


def excess(p: Problem, y: Array) -> tuple[float, float]:
    """Return the largest ratios to their limits of what grows with a profile's size, and of the jolts: with its 3/2."""
    pushes, rows, _ = p.sizes
    abc, ratios = ratios_of(p, y)
    worst = max(float((abc[0] * p.over_caps[: len(p.maps)]).max()), float(ratios[:pushes].max()))
    for (share, _, cap, _), at in zip(p.ends, (1, -2), strict=True):
        worst = max(worst, share * y[at] / cap if share > 0 else 0.0)
    jolts = ratios[pushes:] * np.sqrt(np.maximum(abc[0], 0.0))
    return worst, max(float(jolts.max(initial=0.0)), 0.0)


def by_interval(p: Problem, y: Array) -> Array:
    """Return the largest ratio to a limit on every interval."""
    pushes = p.sizes[0]
    abc, ratios = ratios_of(p, y)
    ratios[pushes:] *= np.sqrt(np.maximum(abc[0], 0.0))
    return np.asarray(np.maximum(ratios.max(axis=0), abc[0] * p.over_caps[: len(p.maps)]))
