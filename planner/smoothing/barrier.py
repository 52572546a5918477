"""The barrier method for durations and node states within limits, and the task that it and its reference share.

Limits are kept at places of every gap: a fixed grid, and the exact extrema of the motion so far, looked up again as
the barrier falls. What is then left between the places is cured by slowing down uniformly, exactly, where the ends are
at rest; else limits are tightened until the extrema keep them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from problems.free_times import basis, energy_matrix

from ..deadline import Deadline
from ..errors import Infeasible
from ..kernels.extrema import extrema
from ..kernels.free_times_limits import newton, set_places
from ..kernels.hermite import hermite_pieces
from ..limits import QUANTITIES
from .free_times import Durations

Array = NDArray[np.float64]

#: Places of every gap that are looked at from the start: Chebyshev's, ends included.
GRID = 0.5 - 0.5 * np.cos(np.pi * np.arange(9) / 8)
#: Places for extrema beside them: the present ones and those before.
EXTRA = 6
#: Extrema below this part of a limit are not looked at.
NEAR = 0.3
#: In the end the barrier, and the slowing down, are each worth about this part of the objective.
CLOSE = 3e-4
#: Limits are tightened by this part of themselves where the whole may not be slowed down.
TIGHTER = 4e-6
STRICT = 1e-12
PRICES = (10.0, 1e3, 1e5)
ROUNDS = 16
#: Newton steps for one height of the barrier.
STEPS = 40


@dataclass(frozen=True, eq=False)
class Task:
    """The problem in units in which the start's median gap and each joint's range are one; bounds (4, M, D)."""

    points: Array
    order: int
    fixed: NDArray[np.bool_]
    ends: Array
    lower: Array
    upper: Array
    bounds: Durations
    cost: Array
    at_rest: bool

    @property
    def movable(self) -> bool:
        """Whether the whole may be slowed down uniformly."""
        return self.at_rest and not np.isfinite(self.bounds.high).any()

    def ratios(self, found: Array) -> Array:
        """Return how far the extrema go toward the limits of rates, (4, M, D); 1 is at the limit, 0 for positions."""
        with np.errstate(invalid="ignore"):
            ratio = np.maximum(found[2] / self.upper, found[0] / self.lower)
        ratio[0] = 0.0
        return np.asarray(ratio)

    def outside(self, found: Array) -> Array:
        """Return by how much positions leave their bounds, (M, D)."""
        return np.asarray(np.maximum(found[2, 0] - self.upper[0], self.lower[0] - found[0, 0]))

    def slowdown(self, found: Array) -> float:
        """Return the factor of time that makes the rates keep their limits."""
        ratio = self.ratios(found)
        return float(max(max(ratio[m].max(), 0.0) ** (1.0 / m) for m in (1, 2, 3)))

    def value(self, x: Array) -> float:
        """Return the objective."""
        return energy(self, x) + float(self.cost[-1]) * float(np.exp(x[:-1, -1]).sum())

    def broken(self, x: Array) -> Infeasible:
        """Return the error that names the place where limits are broken most."""
        found = extremes(self, x)
        worst = np.nan_to_num(self.ratios(found), nan=np.inf)
        worst[0] = np.where(self.outside(found) > 0, 1.0 + self.outside(found), 0.0)
        m, segment, joint = (int(i) for i in np.unravel_index(int(np.argmax(worst)), worst.shape))
        return Infeasible(
            f"no motion of one polynomial of degree {2 * self.order - 1} per gap was found within the limits; that "
            "none exists is not proved",
            joint=joint,
            quantity=QUANTITIES[m],
            segment=segment,
        )


class Barrier:
    """The barrier method on one task."""

    status = "barrier"

    def __init__(self, task: Task, deadline: Deadline) -> None:
        self.task, self.deadline, self.iterations = task, deadline, 0
        gaps, dims, k = len(task.points) - 1, task.points.shape[1], task.order
        self.basis, self.quad = basis(k), energy_matrix(k)
        self.where = np.full((gaps, dims, 4, len(GRID) + EXTRA), -1.0)
        self.where[:, :, :, : len(GRID)] = GRID
        self.where[:, :, 0, [0, len(GRID) - 1]] = -1.0
        self.weights = np.zeros((*self.where.shape, 2 * k - 1))
        self.z, self.zh = np.ones((2, *self.where.shape)), np.ones((2, gaps))
        self.pinned = np.zeros((gaps + 1, (k - 1) * dims + 1), dtype=bool)
        self.pinned[[0, -1], :-1] = task.fixed.reshape(2, -1)
        self.pinned[-1, -1] = True
        self.pinned[:-1, -1] = task.bounds.low == task.bounds.high
        self.pinned[:, :dims] |= self._touching()

    def _touching(self) -> NDArray[np.bool_]:
        """Return where a waypoint lies on a bound of position, (N, D): it can only be reached at rest."""
        q, low, high = self.task.points, self.task.lower[0], self.task.upper[0]
        touching = np.zeros(q.shape, dtype=bool)
        for nodes in (slice(None, -1), slice(1, None)):
            touching[nodes] |= (q[nodes] >= high - 1e-9) | (q[nodes] <= low + 1e-9)
        return touching

    def _rows(self, tighter: float) -> tuple[Array, Array]:
        """Return gain and offset (2, M, D, 4) of the limits, tightened by a part of themselves."""
        task = self.task
        sides = np.stack([task.upper, task.lower]).transpose(0, 2, 3, 1)  # (2, M, D, 4)
        finite = np.isfinite(sides)
        sign = np.array([1.0, -1.0])[:, None, None, None]
        size = np.where(finite, np.abs(sides), 1.0)
        span = task.upper[0] - task.lower[0]
        size[..., 0] = np.where(np.isfinite(span), span, 1.0)
        gain = np.where(finite, -sign / size, 0.0)
        offset = np.where(finite, sign * sides / size, 0.0)
        room = np.full(sides.shape, np.inf)
        q = task.points
        for nodes in (q[:-1], q[1:]):
            room[..., 0] = np.minimum(room[..., 0], offset[..., 0] + gain[..., 0] * nodes)
        for r in range(min(task.order - 1, 3)):
            for e, gap in ((0, 0), (1, -1)):
                here = offset[:, gap, :, r + 1] + gain[:, gap, :, r + 1] * task.ends[e, r]
                known = task.fixed[e, r]
                room[:, gap, :, r + 1] = np.where(known, np.minimum(room[:, gap, :, r + 1], here), np.inf)
        return gain, offset - np.clip(0.5 * room, 0.0, tighter) * finite

    def solve(self, x: Array, total: float) -> Array:
        """Return the best that keeps all limits, from x (N, B); ``total`` > 0 is the duration asked for.

        Raises
        ------
        Infeasible
        """
        x = self._inside(x, total)
        for price in PRICES:
            best = self._follow(x, total, price)
            if best is not None:
                return best
        raise self.task.broken(x)

    def _inside(self, x: Array, total: float) -> Array:
        bounds = self.task.bounds
        h, _ = unpack(x, self.task.order)
        if total > 0.0:
            h = h * (total / h.sum())
        width = np.minimum(bounds.high - bounds.low, h)
        h = np.clip(h, bounds.low + 1e-3 * width, bounds.high - 1e-3 * width)
        x = x.copy()
        x[:-1, -1] = np.log(h)
        dims = self.task.points.shape[1]
        x[:, :dims][self._touching()] = 0.0
        for e, node in ((0, 0), (1, -1)):
            x[node, :-1] = np.where(self.task.fixed[e].reshape(-1), self.task.ends[e].reshape(-1), x[node, :-1])
        return x

    def _follow(self, start: Array, total: float, price: float) -> Array | None:
        """Return the best found that keeps all limits, at this price of breaking one; None if there was none."""
        task, x, count = self.task, start.copy(), int((~self.pinned).sum())
        free = task.movable and total == 0.0
        tighter = 0.0 if free and not np.isfinite(task.lower[0]).any() else TIGHTER
        gain, offset = self._rows(tighter)
        self.where = self.where[..., : len(GRID) + EXTRA].copy()
        self.where[..., len(GRID) :] = -1.0
        self.weights = np.zeros((*self.where.shape, 2 * task.order - 1))
        self.z = np.ones((2, *self.where.shape))
        found = self._look(x)
        best, lowest = None, np.inf
        if free and task.outside(found).max(initial=-np.inf) <= 0.0:
            best = slower(x, task.slowdown(found) * (1.0 + STRICT), task.order)
            lowest = task.value(best)
        mu = 1.0 / max(int((gain != 0).sum()) * len(GRID), 10)
        floor = CLOSE / count
        for _ in range(ROUNDS):
            self._newton(x, gain, offset, total, mu, price)
            if total > 0.0:  # Newton's steps keep the sum to first order
                h, free_gaps = np.exp(x[:-1, -1]), ~self.pinned[:-1, -1]
                x[:-1, -1][free_gaps] += np.log1p((total - h.sum()) / h[free_gaps].sum())
            found = self._look(x, keep=not free)
            outside = float(task.outside(found).max(initial=-np.inf))
            over = max(float(task.ratios(found).max()) - 1.0, outside)
            factor = max(task.slowdown(found), 1.0)
            if not np.isfinite(factor):
                return best
            if outside <= 0.0 and (over <= 0.0 or free):
                kept = slower(x, factor * (1.0 + STRICT), task.order) if free else x.copy()
                value = task.value(kept)
                if value < lowest:
                    best, lowest = kept, value
                if mu <= floor and factor <= 1.0 + CLOSE:
                    return best
            if free:
                x = slower(x, factor * (1.0 + 0.5 * mu * count), task.order) if factor > 1.0 else x
            elif 0.0 < over < 1e-3 and mu <= floor:
                tighter += 2.0 * over
                gain, offset = self._rows(tighter)
            mu = max(0.1 * mu, floor, min(0.5 * over / count, mu))
        return best

    def _newton(self, x: Array, gain: Array, offset: Array, total: float, mu: float, price: float) -> None:
        self.deadline.left()
        task = self.task
        steps, _ = newton(
            x,
            self.pinned,
            task.points,
            self.weights,
            self.where,
            gain,
            offset,
            np.where(task.bounds.low == task.bounds.high, 0.0, task.bounds.low),
            np.where(task.bounds.low == task.bounds.high, np.inf, task.bounds.high),
            task.cost,
            self.quad,
            total,
            mu,
            price,
            self.z,
            self.zh,
            STEPS,
            True,
        )
        self.iterations += steps

    def _look(self, x: Array, keep: bool = False) -> Array:
        """Return the extrema (4, 4, M, D), and put their places among those that are looked at.

        The oldest give way, unless they are kept.
        """
        found = extremes(self.task, x)
        n = len(GRID)
        if keep:
            self.where = np.concatenate([self.where[..., :n], self.where[..., n : n + 2], self.where[..., n:]], axis=-1)
            self.weights = np.zeros((*self.where.shape, 2 * self.task.order - 1))
            self.z = np.ones((2, *self.where.shape))
        else:
            self.where[..., n + 2 :] = self.where[..., n:-2].copy()
        with np.errstate(invalid="ignore"):
            high, low = found[2] > NEAR * self.task.upper, found[0] < NEAR * self.task.lower
        high[0], low[0] = np.isfinite(self.task.upper[0]), np.isfinite(self.task.lower[0])
        at_low, at_high = np.where(low, found[1], -1.0), np.where(high, found[3], -1.0)
        for slot, at in ((n, at_low), (n + 1, at_high)):
            at = np.where((at <= 1e-9) | (at >= 1.0 - 1e-9), -1.0, at)  # on the grid
            self.where[..., slot] = at.transpose(1, 2, 0)
        set_places(self.basis, self.where, self.weights)
        return np.asarray(found)


def pack(h: Array, states: Array) -> Array:
    """Return x (N, B) of the kernel from durations and states (k - 1, N, D)."""
    n = len(h) + 1
    x = np.zeros((n, states.shape[0] * states.shape[2] + 1))
    x[:, :-1] = states.transpose(1, 0, 2).reshape(n, -1)
    x[:-1, -1] = np.log(h)
    return x


def unpack(x: Array, order: int) -> tuple[Array, Array]:
    """Return durations and states."""
    states = x[:, :-1].reshape(len(x), order - 1, -1).transpose(1, 0, 2)
    return np.exp(x[:-1, -1]), states


def slower(x: Array, factor: float, order: int) -> Array:
    """Return x with all times multiplied."""
    h, states = unpack(x, order)
    return pack(h * factor, states / factor ** np.arange(1, order)[:, None, None])


def energy(task: Task, x: Array) -> float:
    """Return the part of the objective that is energy."""
    h, states = unpack(x, task.order)
    quad, total = energy_matrix(task.order), 0.0
    for d in range(task.points.shape[1]):
        powers = h ** np.arange(1, task.order)[:, None]
        y = np.vstack([np.diff(task.points[:, d]), powers * states[:, :-1, d], powers * states[:, 1:, d]])
        total += task.cost[d] * float((np.einsum("ri,rs,si->i", y, quad, y) * h ** (1 - 2 * task.order)).sum())
    return total


def keeps(task: Task, x: Array) -> bool:
    """Return whether all limits are kept at all times."""
    found = extremes(task, x)
    return bool(task.ratios(found).max() <= 1.0 and (task.outside(found) <= 0.0).all())


def extremes(task: Task, x: Array) -> Array:
    """Return the exact extrema of the derivatives 0 … 3 on every gap as ``extrema`` does, (4, 4, M, D), in time."""
    h, states = unpack(x, task.order)
    pieces = np.empty((2 * task.order, len(h), task.points.shape[1]))
    hermite_pieces(h, task.points, np.ascontiguousarray(states), pieces)
    found = extrema(pieces, 4)
    found[::2] /= h[:, None] ** np.arange(4)[:, None, None]
    return np.asarray(found)
