"""Durations chosen by optimisation: the least energy plus weight times duration, over the times at the waypoints.

The node states are eliminated exactly, so only the durations are searched, in Numba (``kernels.free_times``), in units
in which the waypoints' range and the time scale of the problem are one. Bounds of single durations are kept by
projection; a bound of the whole is tried only where the optimum without it breaks it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..deadline import Deadline
from ..errors import FieldError, InvalidRequest, SolverFailed
from ..kernels.free_times import COLLAPSED, CONVERGED, ENDLESS, best_energy, descend
from ..limits import DurationBounds

Array = NDArray[np.float64]

#: Durations below this, in s, are refused.
SHORTEST = 1e-9
#: A gap between equal waypoints that is this much shorter than the longest is vanishing.
VANISHING = 1e-5
EVALUATIONS = 20_000
#: Starts that are tried until one converges.
ATTEMPTS = 4
#: Evaluations between two looks at the clock.
SLICE = 2_000


@dataclass(frozen=True, eq=False)
class FreeTimes:
    """Durations h (M,) in s and the derivatives of order 1 … k-1 at the waypoints, (k - 1, M + 1, D).

    ``cost`` is the sum over joints of the integral of the squared k-th derivative, plus weight times duration (with the
    least duration as the aim, that duration).
    """

    h: Array
    states: Array
    cost: float
    iterations: int
    status: str


@dataclass(frozen=True, eq=False)
class Durations:
    """Bounds of every gap, (M,) each (0 and inf where there is none), and of the sum."""

    low: Array
    high: Array
    least: float
    most: float

    @classmethod
    def of(
        cls, count: int, duration: DurationBounds | None, segments: Sequence[DurationBounds | None] | None
    ) -> "Durations":
        """Collect the bounds.

        Raises
        ------
        InvalidRequest
            ``conflict``: the gaps' bounds leave no sum within the bounds of the whole.
        """
        low, high = np.zeros(count), np.full(count, np.inf)
        for i, own in enumerate(segments or ()):
            if own is not None:
                low[i], high[i] = own.min, own.max
        least, most = (0.0, np.inf) if duration is None else (duration.min, duration.max)
        shortest, longest, slack = float(low.sum()), float(high.sum()), 1e-12
        errors = []
        if shortest > most * (1.0 + slack):
            errors.append(f"the segments take at least {shortest:.9g} s, longer than the {most:.9g} s for the whole")
        if longest < least * (1.0 - slack):
            errors.append(f"the segments take at most {longest:.9g} s, shorter than the {least:.9g} s for the whole")
        for gap in np.flatnonzero(high < SHORTEST):
            errors.append(f"segment {gap} may not take {SHORTEST:g} s")
        if errors:
            raise InvalidRequest([FieldError("/segment_durations", "conflict", e) for e in errors])
        return cls(low, high, least, most)

    def scaled(self, second: float) -> "Durations":
        """Return the same in another unit of time."""
        return Durations(self.low / second, self.high / second, self.least / second, self.most / second)


@dataclass(frozen=True, eq=False)
class Nodes:
    """Waypoints and end states as the kernel wants them: joints in groups with the same derivatives fixed."""

    joints: NDArray[np.int64]
    groups: NDArray[np.int64]
    points: Array
    ends: Array
    fixed: NDArray[np.bool_]
    count: int
    order: int

    @classmethod
    def of(cls, points: Array, order: int, start: Array, end: Array) -> "Nodes":
        """Sort the joints by which end states are NaN, that is free."""
        given = np.stack([start, end])  # (2, k - 1, D)
        known = ~np.isnan(given)
        dims = points.shape[1]
        if (known == known[:, :, :1]).all():
            joints, groups, fixed = np.arange(dims), np.array([0, dims]), np.ascontiguousarray(known[None, :, :, 0])
        else:
            patterns, group = np.unique(known.reshape(-1, dims), axis=1, return_inverse=True)
            joints = np.argsort(group.reshape(-1), kind="stable")
            groups = np.concatenate([[0], np.cumsum(np.bincount(group.reshape(-1)))])
            fixed = np.ascontiguousarray(patterns.T).reshape(-1, *given.shape[:2])
        ends = np.where(known, given, 0.0)
        flat_points, flat_ends = (
            np.concatenate([np.ascontiguousarray(a[..., joints[i:j]]).reshape(-1) for i, j in _pairs(groups)])
            for a in (points, ends)
        )
        return cls(joints, groups, flat_points, flat_ends, fixed, len(points), order)

    def states(self, flat: Array) -> Array:
        """Return the kernel's node states as (k - 1, N, D)."""
        rows = self.order - 1, self.count
        out = np.empty((*rows, len(self.joints)))
        size = rows[0] * rows[1]
        for i, j in _pairs(self.groups):
            out[:, :, self.joints[i:j]] = flat[size * i : size * j].reshape(*rows, j - i)
        return out

    def guess(self, steps: Array, weight: float, attempt: int) -> Array:
        """Return durations to start from: of some in proportion to a power of the steps, the best.

        From rest to rest E ~ s^(1 - 2k) where all durations are multiplied by s: then dJ / ds = 0 at
        s^(2k) = (2k - 1) E / (weight T). With other end states, shorter ones are tried as well.
        """
        k, room, slope = self.order, self.room(), np.empty((2, len(steps)))
        best, lowest = np.ones(len(steps)), np.inf

        def energy(h: Array, ends: Array) -> float:
            return float(best_energy(h, self.groups, self.points, ends, self.fixed, room, slope[0], slope[1]))

        for power in ((0.5, 1.0), (0.75,), (0.25,), (0.0,))[attempt]:
            h = steps**power
            free = energy(h, np.zeros_like(self.ends))
            if weight > 0.0 and 0.0 < free < np.inf:
                h *= ((2 * k - 1) * free / (weight * float(h.sum()))) ** (0.5 / k)
            starts = [shorter * h for shorter in ((1.0, 0.3, 0.1, 0.01) if self.ends.any() else (1.0,))]
            speed = self.speed()
            if speed > 0.0:  # steadily, as fast as at the ends
                starts.append(steps * (self.length(steps) / speed))
            for start in starts:
                value = energy(start, self.ends) + weight * float(start.sum())
                if value < lowest:
                    best, lowest = start, value
        return best

    def speed(self) -> float:
        """Return the largest speed given at an end, over all joints."""
        found = [0.0, 0.0]
        size = 2 * (self.order - 1)
        for i, j in _pairs(self.groups):
            ends = self.ends[size * i : size * j].reshape(2, self.order - 1, j - i)
            for side in range(2):
                found[side] += float((ends[side, 0] ** 2).sum())
        return float(max(found) ** 0.5)

    def length(self, steps: Array) -> float:
        """Return the waypoints' mean distance over the mean of ``steps``."""
        total = np.zeros(self.count - 1)
        for i, j in _pairs(self.groups):
            points = self.points[self.count * i : self.count * j].reshape(self.count, j - i)
            total += (np.diff(points, axis=0) ** 2).sum(axis=1)
        return float(np.sqrt(total).mean() / steps.mean())

    def room(self) -> Array:
        """Return an array for node states."""
        return np.empty((self.order - 1) * self.count * len(self.joints))


def optimal_times(
    points: Array,
    order: int,
    start: Array,
    end: Array,
    time_weight: float,
    duration: DurationBounds | None = None,
    segment_durations: Sequence[DurationBounds | None] | None = None,
    deadline: Deadline | None = None,
    guess: Array | None = None,
) -> FreeTimes:
    """Return the durations with the least energy plus weight times duration, and the node states.

    Parameters
    ----------
    points : (N, D)
        N >= 2; consecutive ones should differ, or the gap have a least duration.
    order : 2, 3 or 4
        The energy is the sum over joints of the integral of the squared derivative of this order.
    start, end : (order - 1, D)
        Derivatives of order 1 … at the ends; NaN where free.
    time_weight : >= 0
    duration, segment_durations : bounds in s
    guess : (M,), optional
        Durations to start from.

    Raises
    ------
    InvalidRequest
        Bounds contradict each other (``conflict``); a duration has no least value above 1e-9 s or no largest one
        (``out_of_range``).
    SolverFailed
        The gradient by log h did not come down to 1e-9 of the cost, nor to rounding.
    TimeLimit
    """
    deadline = Deadline(None) if deadline is None else deadline
    count = len(points) - 1
    bounds = Durations.of(count, duration, segment_durations)
    exact = bounds.least == bounds.most
    length = float(np.ptp(points, axis=0).max()) or 1.0
    if exact or not time_weight > 0.0:
        second = bounds.most / count if np.isfinite(bounds.most) else 1.0
    else:
        second = (length * length / time_weight) ** (0.5 / order)
    powers = (second ** np.arange(1, order) / length)[:, None]
    nodes = Nodes.of((points - points[0]) / length, order, start * powers, end * powers)
    weight = time_weight * second ** (2 * order) / (length * length)
    scaled = bounds.scaled(second)
    steps = np.sqrt(((points[1:] - points[:-1]) ** 2).sum(axis=1))
    mean = float(steps.mean())
    steps = np.maximum(steps / mean, 1e-6) if mean > 0.0 else np.ones(count)
    done = _Search(nodes, weight, deadline)
    for attempt in range(ATTEMPTS if guess is None else 1):
        first = nodes.guess(steps, weight, attempt) if guess is None else guess / second
        if exact:
            done.run(first, scaled, scaled.least)
        else:
            done.run(first, scaled, 0.0)
            total = float(done.h.sum())
            over = done.outcome == ENDLESS or total > scaled.most
            under = done.outcome == COLLAPSED or total < scaled.least
            if (over and np.isfinite(scaled.most)) or (under and scaled.least > 0.0):
                done.run(first, scaled, scaled.most if over else scaled.least)
        if done.outcome in (CONVERGED, ENDLESS):
            break
    if done.outcome == ENDLESS:
        raise InvalidRequest.of(
            "/duration", "out_of_range", "the cost falls for ever as time goes on: weigh the duration, or bound it"
        )
    h = np.clip(done.h * second, bounds.low, bounds.high)
    _refuse_vanishing(points, h, bounds.low)
    if done.outcome != CONVERGED:
        raise SolverFailed("free_times", "the durations did not converge", {"gradient": done.residual})
    unscaled = nodes.states(done.states) / powers[:, :, None]
    cost = done.value * length * length / second ** (2 * order - 1)
    return FreeTimes(h, unscaled, cost, done.evaluations, "optimal")


class _Search:
    """The kernel's descent, in slices, with its outcome."""

    def __init__(self, nodes: Nodes, weight: float, deadline: Deadline) -> None:
        self.nodes, self.weight, self.deadline = nodes, weight, deadline
        self.h, self.states = np.zeros(0), nodes.room()
        self.outcome, self.evaluations, self.value, self.residual = CONVERGED, 0, 0.0, 0.0

    def run(self, guess: Array, bounds: Durations, total: float) -> None:
        """Search from a guess; ``total`` > 0 is the sum asked for."""
        n = self.nodes
        self.h = np.array(guess, dtype=np.float64)
        for _ in range(EVALUATIONS // SLICE):
            self.deadline.left()
            self.outcome, count, self.value, self.residual = descend(
                self.h,
                self.weight,
                total,
                bounds.low,
                bounds.high,
                n.groups,
                n.points,
                n.ends,
                n.fixed,
                self.states,
                SLICE,
            )
            self.evaluations += count
            if count < SLICE:
                return


def _refuse_vanishing(points: Array, h: Array, low: Array) -> None:
    """Raise InvalidRequest where a duration has gone to nothing."""
    equal = (points[1:] == points[:-1]).all(axis=1)
    gone = (h < SHORTEST) | (equal & (h < VANISHING * h.max()) & (h > low))
    if gone.any():
        i = int(np.argmax(gone))
        why = "its waypoints are equal: merge them" if equal[i] else "nothing holds the motion back"
        raise InvalidRequest.of(
            f"/waypoints/{i + 1}",
            "out_of_range",
            f"the best duration of segment {i} is below {SHORTEST:g} s: {why}, or give it a least duration",
        )


def _pairs(groups: NDArray[np.int64]) -> list[tuple[int, int]]:
    return [(int(i), int(j)) for i, j in zip(groups.tolist()[:-1], groups.tolist()[1:], strict=True)]
