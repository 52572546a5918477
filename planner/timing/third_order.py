"""The profile of a course on given stations by the banded interior point, and the law of constant path jerk by pieces.

sdot² = a(s) is a C1 quadratic spline on the stations (``kernels.path_jerk``). A law that is polynomial in time passes
through its states (s, sdot, sddot) at the stations with two pieces of constant path jerk on each interval: the time
tau solves h = tau (v0 + v1) / 2 - (b1 - b0) tau² / 12, which makes the law of class C2.

From rest the first interval is run through at constant path jerk, s = j t³ / 6, so that a = a_1 ((s - s_0) / h)^(4/3);
with an acceleration asked for there, and where no jerk is limited, at constant path acceleration.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import Infeasible, SolverFailed
from ..kernels.lanes import LANES
from .course import Course, LawPieces, use
from .second_order import derivatives

Array = NDArray[np.float64]

#: Where a profile is scaled to before the interior point starts: this far inside the nearest bound.
INSIDE = 0.9
#: Caps of sdot² over the profile without a jerk limit, which no jerk-limited one exceeds but for the grid.
CAP = 4.0
#: Complementarity to begin with, as a share of the duration.
START = 0.1
ITERATIONS = 150
#: Least share of the complementarity that an iteration aims at.
CENTRING = 1e-4
#: How a gentle profile within limits that are still too large is approached: start, centring, tolerance, iterations.
GENTLE = 2.0, 1.0, 0.0, 8
#: It is to take about so many times as long as the fastest one without jerk limits.
SLOWER = 2.0
#: Rounds in which limits that a first guess breaks are lowered to what they are.
LOWERINGS = 60
#: So many intervals are near a moving end.
NEAR = 8
#: No progress in that.
STUCK = 0.05
#: A moving end may be at its velocity limit: inside of that there is room of this, relative to squared speed.
AT_LIMIT = 8e-9
#: Limits are lowered to a little more than what a profile needs; one that needs less than ``TOUCHING`` is inside.
WIDER, TOUCHING = (1e-7, 0.05), 1.0 - 1e-10


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
class Spline:
    """A profile: a and b at the stations, (n + 1,) each, with what the interior point leaves behind.

    ``values`` (m + 2,) are the coefficients, ``multipliers`` those of rows and caps, and those of single values.
    """

    grid: Array
    a: Array
    b: Array
    problem: "Problem"
    values: Array
    multipliers: tuple[Array, Array]
    iterations: int

    def guess(self, grid: Array) -> Array:
        """Return the profile's values a at the stations of another grid, for a first guess there."""
        return np.maximum(np.interp(grid, self.grid, self.a), 1e-300)


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
    pieces = _end_pieces(grid[k : k + 2], a, end, k == 0)
    found = use(course, grid[k : k + 2], LawPieces(pieces, np.zeros(2, dtype=np.int64))).most[:, 0]
    share = found / tight[:, k]
    most = max(share[0].max(), share[3].max()) ** 2, share[1].max(), share[2].max() ** (2.0 / 3.0)
    return float(1.0 / max(*most, 1e-300))


def _end_pieces(stations: Array, a: Array, end: End, leaving: bool) -> Array:
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


def solve(problem: Problem, guess: Array, price: tuple[float, float], tolerance: float) -> Spline:
    """Return the optimum.

    Parameters
    ----------
    guess : (n + 1,)
        Values a at the stations, any size.
    price : (float, float)
        Of time, and of squared path acceleration.

    Raises
    ------
    Infeasible
        No profile that keeps the limits was found (moving ends only).
    SolverFailed
        The numbers run out.
    """
    from ..kernels.path_jerk import solve_profile

    p = problem
    nodes, m = p.nodes, len(p.maps)
    steps = np.diff(nodes)
    y = np.empty(m + 2)
    y[1:-1] = np.interp(0.5 * (nodes[:-1] + nodes[1:]), p.grid, guess)
    _put_ends(p, y, steps)
    pushes, rows, width = p.sizes
    weights, single = np.empty((2 * rows + 1) * width), np.zeros(m + 4)
    long_steps = np.zeros(width)
    long_steps[:m] = steps
    prices = np.array(price)
    movable = not any(end.fixed is not None for end in (p.first, p.last))
    with np.errstate(all="ignore"):
        over = _excess(p, y)
        if movable:
            y *= INSIDE / max(over[0], over[1] ** (2.0 / 3.0))
            over = INSIDE, INSIDE
    if not np.isfinite(y).all():
        raise OverflowError("the path speeds leave the range of floating point")
    total, most = 0, np.inf
    length, fastest = (
        float(np.diff(p.grid).sum()),
        float((np.diff(p.grid) / np.sqrt(0.5 * (guess[:-1] + guess[1:]))).sum()),
    )
    gentle = np.array([1.0, (SLOWER * fastest) ** 4 / (36.0 * length**2)])
    for _ in range(LOWERINGS):
        before, most = most, max(over)
        wider = WIDER[1] if abs(most - before) < STUCK * abs(most - 1.0) else np.clip(most - 1.0, *WIDER)
        relax = most * (1.0 + wider) if most > TOUCHING else 1.0
        inverse, over_caps, ends = p.inverse / relax, p.over_caps / relax, p.ends.copy()
        ends[:, 2] *= relax
        final = relax == 1.0
        args = p.sizes, long_steps, p.maps, p.fixed, p.forms, inverse, over_caps, ends
        how = (START, CENTRING, tolerance, ITERATIONS) if final else GENTLE
        count, _gap = solve_profile(*args, prices if final else gentle, y, weights, single, *how)
        if count < 0 or not np.isfinite(y).all():
            raise SolverFailed("interior_point", "the profile is not strictly feasible")
        total += count
        if final:
            return _read(p, y, (weights, single), total)
        over = _excess(p, y)
    raise Infeasible(
        f"no law with the velocities and accelerations asked at the ends was found within the limits; limits of jerk, "
        f"acceleration and squared velocity {max(over):.6g} times as large would do: ask for less at the ends",
        quantity="jerk",
    )


def _put_ends(p: Problem, y: Array, steps: Array) -> None:
    """Put the given coefficients in their places; those folded into their neighbours are 0."""
    y[0] = y[-1] = 0.0
    for end, at, beside, step in ((p.first, 0, 1, steps[0]), (p.last, -1, -2, steps[-1])):
        if end.fixed is not None:
            y[at], y[beside] = end.fixed[0], end.fixed[0] + end.fixed[1] * step


def _excess(p: Problem, y: Array) -> tuple[float, float]:
    """Return the largest ratios to their limits of what grows with a profile's size, and of the jolts: with its 3/2."""
    pushes, rows, _ = p.sizes
    abc, ratios = _ratios(p, y)
    worst = max(float((abc[0] * p.over_caps[: len(p.maps)]).max()), float(ratios[:pushes].max()))
    for (share, _, cap, _), at in zip(p.ends, (1, -2), strict=True):
        worst = max(worst, share * y[at] / cap if share > 0 else 0.0)
    jolts = ratios[pushes:] * np.sqrt(np.maximum(abc[0], 0.0))
    return worst, max(float(jolts.max(initial=0.0)), 0.0)


def _read(p: Problem, y: Array, multipliers: tuple[Array, Array], iterations: int) -> Spline:
    """Return the profile at the stations."""
    nodes, c = p.nodes, y.copy()
    for end, at, beside, share in ((p.first, 0, 1, p.ends[0, 0]), (p.last, -1, -2, p.ends[1, 0])):
        if end.fixed is None:
            c[at] = share * y[beside]
    before, after = np.concatenate([nodes[:1], nodes[:-2]]), np.concatenate([nodes[2:], nodes[-1:]])
    wide, h = nodes[1:] - before, np.diff(nodes)
    left_b, right_b = np.diff(c)[:-1] / wide, np.diff(c)[1:] / (after - nodes[:-1])
    left_a = (h * c[:-2] + (nodes[:-1] - before) * c[1:-1]) / wide
    a = np.append(left_a, left_a[-1] + h[-1] * (left_b[-1] + right_b[-1]))
    b = np.append(left_b, right_b[-1])
    if p.first.rest:
        a, b = np.append(0.0, a), np.append(0.0, b)
    if p.last.rest:
        a, b = np.append(a, 0.0), np.append(b, 0.0)
    return Spline(p.grid, a, b, p, y, multipliers, iterations)


def mixed(x: Spline, y: Spline, share: float) -> Spline:
    """Return the spline (1 - share) x + share y of two on the same grid."""
    return _read(x.problem, (1.0 - share) * x.values + share * y.values, x.multipliers, x.iterations)


def first_guess(ceiling: Array) -> Array:
    """Return values a to begin with: those of the fastest profile without jerk limits, but nowhere near 0."""
    return np.asarray(np.maximum(ceiling, 1e-2 * ceiling[ceiling > 0].min()))


def law_of(spline: Spline) -> LawPieces:
    """Return the law of class C2 through the profile's states, of constant path jerk by pieces."""
    p, grid = spline.problem, spline.grid
    begin, end = int(p.first.rest), len(grid) - int(p.last.rest)
    s, a, b = grid[begin:end], spline.a[begin:end], spline.b[begin:end]
    h, v = np.diff(s), np.sqrt(np.maximum(a, 0.0))
    v0, b0, rise, bend = v[:-1], b[:-1], np.diff(v), np.diff(b)
    half = 0.5 * (v[:-1] + v[1:])
    with np.errstate(all="ignore"):
        tau = 2.0 * h / (half + np.sqrt(half * half - bend * h / 3.0))
        early = 4.0 * (rise - b0 * tau) / tau**2 - bend / tau
        late = 2.0 * bend / tau - early
        slowest = v0 + 0.5 * tau * (b0 + 0.25 * tau * early)
    broken = ~(np.isfinite(tau) & (tau > 0) & (slowest > 0) & (v[:-1] > 0) & (v[1:] > 0))
    if broken.any():  # stands in for a law, so that the rest can be looked at
        floor = 1e-9 * float(v.max())
        tau = np.where(broken, h / np.maximum(half, floor), tau)
        v0, b0, early, late = (np.where(broken, x, y) for x, y in ((half, v0), (0.0, b0), (0.0, early), (0.0, late)))
    x = 0.5 * tau
    pieces = np.empty((5, 2 * len(h)))
    pieces[:, 0::2] = s[:-1], v0, b0, early, x
    pieces[:, 1::2] = (
        s[:-1] + x * (v0 + x * (0.5 * b0 + x * early / 6.0)),
        v0 + x * (b0 + 0.5 * x * early),
        b0 + x * early,
        late,
        x,
    )
    owner = np.repeat(np.arange(len(h)), 2)
    if p.first.rest:
        pieces = np.concatenate([_end_pieces(grid[:2], spline.a[:2], p.first, True), pieces], axis=1)
        owner = np.append([0, 0], owner + 1)
    if p.last.rest:
        pieces = np.concatenate([pieces, _end_pieces(grid[-2:], spline.a[-2:], p.last, False)], axis=1)
        owner = np.append(owner, owner[-1:].repeat(2) + 1)
    if not broken.any():
        return LawPieces(pieces, owner)
    marked = np.zeros(len(grid) - 1, dtype=bool)
    marked[begin : end - 1] = broken
    return LawPieces(pieces, owner, marked)


def shares(spline: Spline, tight: Array) -> Array:
    """Return the shares of the limits that the program's rows use, (4, n, D); where there is no row, as allowed."""
    p, y = spline.problem, spline.values
    pushes, rows, width = p.sizes
    m, dims = len(p.maps), tight.shape[2]
    abc, ratios = _ratios(p, y)
    inner = slice(int(p.first.rest), tight.shape[1] - int(p.last.rest))
    share = tight.copy()
    push = ratios[1:pushes].reshape(-1, dims, m).max(axis=0)
    share[1, inner] *= np.maximum(push.T, 0.0)
    if rows > pushes:
        jolts = ratios[pushes:].reshape(-1, dims, m).max(axis=0) * np.sqrt(np.maximum(abc[0], 0.0))
        share[2, inner] *= np.maximum(jolts.T, 0.0)
    return np.where(share > 0, share, tight)


def _ratios(p: Problem, y: Array) -> tuple[Array, Array]:
    """Return A, B, C of every interval, and the rows' ratios to their limits (those of jolts over phi)."""
    rows, width, m = p.sizes[1], p.sizes[2], len(p.maps)
    abc = np.einsum("kri,ik->rk", p.maps, np.stack([y[:-2], y[1:-1], y[2:]]))
    forms = (p.forms.reshape(rows, 3, width)[:, :, :m] * abc).sum(axis=1)
    return abc, (forms[:, None] * p.inverse.reshape(rows, 2, width)[:, :, :m]).max(axis=1)
