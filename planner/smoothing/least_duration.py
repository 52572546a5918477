"""Durations and node states within limits that hold at all times: least duration, or energy and duration weighed."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..deadline import Deadline
from ..errors import Infeasible, InvalidRequest, PlannerError, SolverFailed, TimeLimit
from ..kernels.free_times import best_energy
from ..limits import QUANTITIES, DurationBounds
from .barrier import Barrier, Task, energy, extremes, keeps, pack, slower, unpack
from .free_times import Durations, FreeTimes, Nodes, optimal_times
from .free_times_nlp import Reference

Array = NDArray[np.float64]


def optimal_times_within(
    points: Array,
    order: int,
    start: Array,
    end: Array,
    lower: Array,
    upper: Array,
    time_weight: float | None,
    duration: DurationBounds | None = None,
    segment_durations: Sequence[DurationBounds | None] | None = None,
    deadline: Deadline | None = None,
    backend: str = "auto",
) -> FreeTimes:
    """Return durations and node states within limits: with the least cost, or (no weight) the least duration.

    Parameters
    ----------
    points : (N, D)
    order : 2, 3 or 4
        One polynomial of degree 2 order - 1 per gap, derivatives up to order - 1 continuous; see ``optimal_times``.
    start, end : (order - 1, D)
        NaN where free.
    lower, upper : (4, N - 1, D)
        Limits of position, velocity, acceleration and jerk on every gap; infinite where there is none. They hold at
        all times, not at samples.
    time_weight : >= 0, or None for the least duration
    duration, segment_durations : bounds in s
    backend : "auto" or "barrier" for the method of this module, "ipopt" for CasADi's

    Raises
    ------
    Infeasible
        Waypoints or end states break limits (certified); or the search ends with limits broken, or above the largest
        duration (not certified: the problem is not convex).
    InvalidRequest, SolverFailed, TimeLimit
    """
    deadline = Deadline(None) if deadline is None else deadline
    count = len(points) - 1
    bounds = Durations.of(count, duration, segment_durations)
    _refuse_given(points, start, end, lower, upper)
    moving = (points[1:] != points[:-1]).any(axis=1)
    step = np.diff(points, axis=0)
    ahead = np.where(step > 0, np.isfinite(upper[1]), np.isfinite(lower[1])) & (step != 0)
    bent = np.isfinite(lower[2:]).any(axis=0) | np.isfinite(upper[2:]).any(axis=0)
    limited = (ahead | (bent & (step != 0))).any(axis=1) | (bounds.low > 0)
    if time_weight is None and (moving & ~limited).any():
        i = int(np.argmax(moving & ~limited))
        raise InvalidRequest.of("/limits", "missing", f"nothing limits the speed on segment {i}: no duration is least")
    first = _start(points, order, start, end, lower, upper, time_weight, duration, segment_durations, deadline)
    second = float(np.median(first.h))
    unit = np.ptp(points, axis=0)
    unit = np.where(unit > 0.0, unit, float(unit.max()) or 1.0)
    scale = second ** np.arange(4)[:, None, None] / unit
    shift = np.zeros((4, 1, len(unit)))
    shift[0, 0] = points[0]
    powers = second ** np.arange(1, order)[:, None] / unit
    ends = np.stack([start * powers, end * powers])
    fixed = ~np.isnan(ends)
    scaled = bounds.scaled(second)
    cost = np.zeros(len(unit) + 1)
    if time_weight is None:
        cost[-1] = 1.0 / float(first.h.sum() / second)
    else:
        cost[:-1], cost[-1] = unit**2 / second ** (2 * order - 1) / first.cost, time_weight * second / first.cost
    task = Task(
        (points - points[0]) / unit,
        order,
        fixed,
        np.where(fixed, ends, 0.0),
        (lower - shift) * scale,
        (upper - shift) * scale,
        scaled,
        cost,
        not np.any(ends[fixed]),
    )
    x = pack(first.h / second, first.states * powers[:, None, :])
    if time_weight is not None and keeps(task, x):
        return first
    search = _Search(task, deadline, backend)
    exact = scaled.least == scaled.most
    x = search.solve(x, scaled.least if exact else 0.0)
    h = np.exp(x[:-1, -1])
    total = float(h.sum())
    if not exact and total > scaled.most * (1.0 + 1e-9):
        if time_weight is None:
            needed = total * second
            raise Infeasible(
                f"the shortest duration found is {needed:.9g} s, longer than the {bounds.most:.9g} s allowed",
                quantity="duration",
                bound=bounds.most,
                minimum_duration=needed,
            )
        x = search.solve(x, scaled.most)
    elif not exact and total < scaled.least * (1.0 - 1e-12):
        if time_weight is None and task.movable:
            x = slower(x, scaled.least / total, order)
        else:
            x = search.solve(x, scaled.least)
    h, states = unpack(x, order)
    h, states = np.clip(h * second, bounds.low, bounds.high), states / powers[:, None, :]
    value = float(h.sum())
    if time_weight is not None:
        value = time_weight * value + energy(task, x) * first.cost
    return FreeTimes(h, states, value, search.iterations, search.status)


class _Search:
    """The barrier method, and where it finds nothing, or on request, CasADi's."""

    def __init__(self, task: Task, deadline: Deadline, backend: str) -> None:
        self.task, self.deadline, self.backend = task, deadline, backend
        self.iterations, self.status = 0, Barrier.status

    def solve(self, x: Array, total: float) -> Array:
        """Return the best that keeps all limits, from x (N, B); ``total`` > 0 is the duration asked for.

        Raises
        ------
        Infeasible
            Neither found anything.
        """
        failed: PlannerError | None = None
        for method in (Barrier, Reference) if self.backend != "ipopt" else (Reference,):
            if failed is not None and self.backend != "auto":
                break
            search = method(self.task, self.deadline)
            try:
                found = search.solve(x, total)
            except (Infeasible, SolverFailed) as error:
                failed = failed or error
                continue
            finally:
                self.iterations += search.iterations
            self.status = search.status
            return found
        assert failed is not None
        raise failed


def _start(
    points: Array,
    order: int,
    start: Array,
    end: Array,
    lower: Array,
    upper: Array,
    time_weight: float | None,
    duration: DurationBounds | None,
    segment_durations: Sequence[DurationBounds | None] | None,
    deadline: Deadline,
) -> FreeTimes:
    """Return the optimum without limits, with its speed chosen to suit them where nothing weighs the duration."""
    bounds = Durations.of(len(points) - 1, duration, segment_durations)
    rise = np.abs(np.diff(points, axis=0))
    least = np.zeros(len(rise))
    for m in (1, 2, 3):
        least = np.maximum(least, (rise / np.minimum(upper[m], -lower[m])).max(axis=1) ** (1.0 / m))
    least = np.maximum(least, 1e-3 * (float(least.mean()) or 1.0))
    weight = time_weight
    if weight is None:
        weight = float(np.ptp(points, axis=0).max() or 1.0) ** 2 / float(least.mean()) ** (2 * order)
    try:
        free = optimal_times(points, order, start, end, weight, duration, segment_durations, deadline)
    except TimeLimit:
        raise
    except PlannerError:
        h = np.clip(3.0 * least, bounds.low, bounds.high)
        free = FreeTimes(h, *_relaxed(points, order, start, end, h, weight), 0, "start")
    if time_weight is None:
        task = Task(
            points, order, ~np.isnan(np.stack([start, end])), np.zeros(0), lower, upper, bounds, np.zeros(0), False
        )
        x = pack(free.h, free.states)
        found = extremes(task, x)
        h = np.clip(free.h * max(task.slowdown(found), 1e-9) * 1.05, bounds.low, bounds.high)
        if duration is not None:
            h = h * (min(max(float(h.sum()), bounds.least), bounds.most) / float(h.sum()))
        free = FreeTimes(h, *_relaxed(points, order, start, end, h, weight), free.iterations, "start")
    return free


def _relaxed(points: Array, order: int, start: Array, end: Array, h: Array, weight: float) -> tuple[Array, float]:
    """Return the best node states at durations h, and the cost."""
    nodes, slope = Nodes.of(points, order, start, end), np.empty(len(h))
    room = nodes.room()
    energy = best_energy(h, nodes.groups, nodes.points, nodes.ends, nodes.fixed, room, slope, slope.copy())
    if not np.isfinite(energy):
        raise SolverFailed("free_times", "the first guess has no finite energy")
    states = nodes.states(room)
    return states, float(energy) + weight * float(h.sum())


def _refuse_given(points: Array, start: Array, end: Array, lower: Array, upper: Array) -> None:
    """Raise Infeasible where a waypoint or an end state itself breaks a limit."""
    given = [(0, i, points[i + e], i) for i in range(len(points) - 1) for e in (0, 1)]
    for row in range(min(len(start), 3)):
        given += [(row + 1, 0, start[row], 0), (row + 1, -1, end[row], len(points) - 2)]
    for m, gap, values, segment in given:
        room = 1e-9 * np.maximum(np.abs(values), 1e-300)
        over = (values > upper[m, gap] + room) | (values < lower[m, gap] - room)
        if over.any():
            joint = int(np.argmax(over))
            high = values[joint] > upper[m, gap, joint]
            raise Infeasible(
                f"the {QUANTITIES[m]} asked for joint {joint} on segment {segment} breaks its limit",
                joint=joint,
                quantity=QUANTITIES[m],
                segment=segment,
                bound=float((upper if high else lower)[m, gap, joint]),
                needed=float(values[joint]),
                certified=True,
            )
