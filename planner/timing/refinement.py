"""Rounds of solving a course on stations, looking at the law between them, and mending: finer grid, smaller limits.

A law is piecewise: within an interval only one place of one row can be at its limit. What is lost by that on interval k
is about tau_k (1 - mean use), of second order in its step, so that splitting it into p parts leaves 1/p of it. The
splitting that brings the sum to a goal with the fewest stations is p_k = sqrt(loss_k / e) with
e = (goal / sum sqrt(loss))².
Where a limit is broken between the rows that hold it, the row's limit is lowered there to what makes it hold.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..deadline import Deadline
from ..errors import SolverFailed
from .course import Course, LawPieces, Use, exact_use, use
from .third_order import Spline

Array = NDArray[np.float64]

#: Intervals are split where limits are broken by more than this, whatever is lost there.
COARSE = 0.02
#: Neighbouring steps differ by no more than this factor.
GRADING = 3.0
#: Most parts of an interval in one round.
PARTS = 4
#: While the grid is not final, limits are lowered to no less than this share.
MILD = 0.9
#: Limits are never lowered to less than this share.
LEAST = 0.1
#: Slowing by less than this is left to the uniform slow-down at the end.
SLOW = 1e-4
#: With moving ends nothing is slowed at the end: limits must be kept to this.
EXACT = 1e-8
#: Where all limits of a kind are lowered alike at last.
ALIKE = 1e-3
#: No more is split where it would add fewer stations than this share of them.
WORTH = 0.1
SPLITTINGS = 7
ROUNDS = 24
#: The last rounds, on a grid that stays.
SETTLING = 8


@dataclass(frozen=True, eq=False)
class Attempt:
    """A law on a grid.

    ``share`` (4, n, D): the shares of the limits that its rows use; None: as the law tells. ``spline``: the profile, if
    the next attempt can begin with it.
    """

    law: LawPieces
    share: Array | None = None
    spline: Spline | None = None


#: Solves a course on a grid with lowered limits, (4, n, D); further arguments: the attempt before, and whether it may
#: be rough, as the grid will change.
Solve = Callable[[Array, Array, Attempt | None, bool], Attempt]


@dataclass(frozen=True, eq=False)
class Refined:
    """The best attempt, its grid, what is lost on the grid, in s, and the rounds that it took."""

    attempt: Attempt
    grid: Array
    loss: float
    rounds: int


def refined(course: Course, grid: Array, solve: Solve, goal: float, most: int, deadline: Deadline) -> Refined:
    """Return a law that keeps the limits, but for a uniform slow-down of ``SLOW`` (moving ends: ``EXACT``).

    Parameters
    ----------
    goal : float
        Share of the duration that may be lost by the grid; infinite: the grid is not split.
    most : int
        Stations.

    Raises
    ------
    SolverFailed
        No profile found was a law.
    """
    tight = np.ones((4, len(grid) - 1, course.curve.dims))
    splittings, best = 0, np.inf
    attempt: Attempt | None = None
    best_found: Refined | None = None
    for turn in range(ROUNDS):
        deadline.left()
        attempt = solve(grid, tight, attempt, splittings < SPLITTINGS and goal < np.inf)
        law = attempt.law
        found = use(course, grid, law)
        if not course.rests and not (found.factors > 1.0 + 100.0 * SLOW).any():
            found = exact_use(course, grid, law)
        factors = found.factors if law.broken is None else np.where(law.broken, np.inf, found.factors)
        taken = np.bincount(law.owner, law.pieces[4])
        loss = taken * (1.0 - np.minimum(found.mean, 1.0))
        over = float(factors.max()) - 1.0
        score = law.duration * max(1.0 + over, 1.0)
        if score < best:
            best, best_found = score, Refined(attempt, grid, float(loss.sum()), turn + 1)
        refines = splittings < SPLITTINGS and goal < np.inf
        coarse = goal < np.inf and over > COARSE and turn < ROUNDS - SETTLING
        parts = _parts(grid, loss if refines else np.zeros_like(loss), factors, goal * law.duration, most)
        splits = refines and parts.sum() > (1.0 + WORTH) * len(parts) or coarse and parts.sum() > len(parts)
        if over <= (SLOW if course.rests else EXACT) and not splits:
            return Refined(attempt, grid, float(loss.sum()), turn + 1)
        lowered = _lowered(tight, found, attempt.share, 1.0 - 0.3 * (SLOW if course.rests else EXACT))
        if not course.rests and not splits and over <= ALIKE:
            lowered = _lowered_alike(tight, found)
        if splits:
            splittings += 1
            owner, grid = _split(grid, parts)
            tight = 1.0 - (1.0 - np.maximum(lowered, MILD)[:, owner]) / parts[owner][:, None]
        else:
            splittings, tight = SPLITTINGS, lowered
    if best_found is None:
        raise SolverFailed("timing", "the path speed vanishes between stations")
    return best_found


def _lowered(tight: Array, found: Use, share: Array | None, target: float) -> Array:
    """Return the shares of the limits that bring what was too much down to them."""
    most = found.most
    used = tight if share is None else np.minimum(share, tight)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(most > 1.0, np.maximum(used * (target / most), LEAST), tight)


def _lowered_alike(tight: Array, found: Use) -> Array:
    """Return shares lowered everywhere by what is too much somewhere, which is little."""
    most = found.most.max(axis=(1, 2), keepdims=True)
    return np.where(most > 1.0, tight * ((1.0 - EXACT) / np.maximum(most, 1.0)), tight)


def _parts(grid: Array, loss: Array, factors: Array, goal: float, most: int) -> NDArray[np.int64]:
    """Return into how many parts each interval is to be split."""
    roots = np.sqrt(np.where(np.isfinite(loss), loss, loss[np.isfinite(loss)].max(initial=1.0)))
    each = (goal / max(roots.sum(), 1e-100)) ** 2 if goal < np.inf else np.inf
    with np.errstate(divide="ignore", invalid="ignore"):
        wanted = np.ceil(roots / np.sqrt(each) - 0.2)
        if goal < np.inf:
            wanted = np.maximum(wanted, np.ceil(np.where(np.isfinite(factors), factors - 1.0, 1.0) / COARSE))
    steps = np.diff(grid)
    wanted = np.where(steps > 1e-12 * max(abs(grid[0]), abs(grid[-1]), grid[-1] - grid[0]), wanted, 1.0)
    parts = np.clip(wanted, 1, PARTS)
    if parts.sum() > most:
        room = max(most - len(parts), 0) / max((parts - 1).sum(), 1.0)
        parts = 1.0 + np.floor((parts - 1.0) * room)
    if goal < np.inf:
        for _ in range(20):
            new = steps / parts
            beside = np.minimum(np.append(np.inf, new[:-1]), np.append(new[1:], np.inf))
            need = np.ceil(new / (GRADING * beside) - 1e-9)
            if (need <= 1).all():
                break
            parts = np.minimum(parts * np.maximum(need, 1.0), 2 * PARTS)
    return parts.astype(np.int64)


def _split(grid: Array, parts: NDArray[np.int64]) -> tuple[NDArray[np.int64], Array]:
    """Return the interval that each new one comes from, and the new grid."""
    owner = np.repeat(np.arange(len(parts)), parts)
    last = np.cumsum(parts)
    inside = (np.arange(len(owner)) - (last - parts)[owner] + 1) / parts[owner]
    new = grid[owner] + inside * np.diff(grid)[owner]
    new[last - 1] = grid[1:]
    return owner, np.append(grid[0], new)
