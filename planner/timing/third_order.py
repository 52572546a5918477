"""The profile of a course on given stations by the banded interior point, and the law of constant path jerk by pieces.

A law that is polynomial in time passes through the profile's states (s, sdot, sddot) at the stations with two pieces of
constant path jerk on each interval: the time tau solves h = tau (v0 + v1) / 2 - (b1 - b0) tau² / 12, which makes the
law of class C2. What the program is, and how ends are treated, is told in ``profile_program``.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import Infeasible, SolverFailed
from .course import LawPieces
from .first_profiles import first_profiles
from .profile_program import Problem, by_interval, coefficients, end_pieces, excess, pose, ratios_of

Array = NDArray[np.float64]

#: Where a profile is scaled to before the interior point starts: this far inside the nearest bound.
INSIDE = 0.9
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
#: No progress in that.
STUCK = 0.05
#: Limits are lowered to a little more than what a profile needs; one that needs less than ``TOUCHING`` is inside.
WIDER, TOUCHING = (1e-7, 0.05), 1.0 - 1e-10


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
        """Return the profile's values a at the stations of another grid and, after those, at the middles between."""
        at = np.append(grid, 0.5 * (grid[:-1] + grid[1:]))
        k = np.clip(np.searchsorted(self.grid, at, "right") - 1, 0, len(self.grid) - 2)
        h, x = np.diff(self.grid)[k], at - self.grid[k]
        a = self.a[k] + x * (2.0 * self.b[k] + x * np.diff(self.b)[k] / h)
        for end, at_end, far in ((self.problem.first, k == 0, 0.0), (self.problem.last, k == len(self.grid) - 2, 1.0)):
            if end.rest:
                share = np.abs(far - x / h) ** (4.0 / 3.0 if end.jerky else 1.0)
                a = np.where(at_end, np.maximum(self.a[k], self.a[k + 1]) * share, a)
        return np.maximum(a, 1e-300)


def solve(problem: Problem, guess: Array, price: tuple[float, float], tolerance: float) -> Spline:
    """Return the optimum.

    Parameters
    ----------
    guess : (2 n + 1,)
        Values a at the stations and, after those, at the middles between them, any size.
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
    y = coefficients(p, guess)
    pushes, rows, width = p.sizes
    weights, single = np.empty((2 * rows + 1) * width), np.zeros(m + 4)
    long_steps = np.zeros(width)
    long_steps[:m] = steps
    prices = np.array(price)
    movable = not any(end.fixed is not None for end in (p.first, p.last))
    seconds = float((np.diff(p.grid) / np.sqrt(guess[len(p.grid) :])).sum())
    with np.errstate(all="ignore"):
        over = excess(p, y)
        if movable:
            y *= INSIDE / max(over[0], over[1] ** (2.0 / 3.0))
            over = INSIDE, INSIDE
        elif max(over) > TOUCHING:
            y, over = _likeliest(p, y, seconds)
    if not np.isfinite(y).all():
        raise OverflowError("the path speeds leave the range of floating point")
    total, most = 0, np.inf
    gentle = np.array([1.0, (SLOWER * seconds) ** 4 / (36.0 * float(np.diff(p.grid).sum()) ** 2)])
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
        over = excess(p, y)
    raise Infeasible(
        f"no law with the velocities and accelerations asked at the ends was found within the limits; limits of jerk, "
        f"acceleration and squared velocity {max(over):.6g} times as large would do: ask for less at the ends",
        quantity="jerk",
    )


def _likeliest(p: Problem, y: Array, seconds: float) -> tuple[Array, tuple[float, float]]:
    """Return, of a profile and some smooth ones between the end states, the one nearest to the limits."""
    nodes = p.nodes
    states = [
        (0.0, 0.0) if end.fixed is None else (float(np.sqrt(end.fixed[0])), sign * end.fixed[1])
        for end, sign in ((p.first, 1.0), (p.last, -1.0))
    ]
    grid = p.grid
    at = np.append(grid, 0.5 * (grid[:-1] + grid[1:])) - nodes[0]

    def whole(a: Array) -> Array:
        return coefficients(p, np.maximum(a, 1e-12 * a.max()))

    length = float(nodes[-1] - nodes[0])
    smooth = first_profiles(at, length, states[0], states[1], seconds, lambda a: by_interval(p, whole(a)))
    found = [y, *(whole(a) for a in smooth)]
    over = [excess(p, x) for x in found]
    best = min(range(len(found)), key=lambda i: max(over[i]) if ratios_of(p, found[i])[0][0].min() > 0 else np.inf)
    return found[best], over[best]


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
    a = np.maximum(ceiling, 1e-2 * ceiling[ceiling > 0].min())
    return np.append(a, 0.5 * (a[:-1] + a[1:]))


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
        pieces = np.concatenate([end_pieces(grid[:2], spline.a[:2], p.first, True), pieces], axis=1)
        owner = np.append([0, 0], owner + 1)
    if p.last.rest:
        pieces = np.concatenate([pieces, end_pieces(grid[-2:], spline.a[-2:], p.last, False)], axis=1)
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
    abc, ratios = ratios_of(p, y)
    inner = slice(int(p.first.rest), tight.shape[1] - int(p.last.rest))
    share = tight.copy()
    push = ratios[1:pushes].reshape(-1, dims, m).max(axis=0)
    share[1, inner] *= np.maximum(push.T, 0.0)
    if rows > pushes:
        jolts = ratios[pushes:].reshape(-1, dims, m).max(axis=0) * np.sqrt(np.maximum(abc[0], 0.0))
        share[2, inner] *= np.maximum(jolts.T, 0.0)
    return np.where(share > 0, share, tight)


__all__ = ["Problem", "Spline", "first_guess", "law_of", "mixed", "pose", "shares", "solve"]
