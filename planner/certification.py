"""Certify anyone's trajectory: a piecewise polynomial exactly, samples by divided differences."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import InvalidRequest
from .limits import QUANTITIES, Boundary, Limits
from .reading import increasing, matrix, vector
from .trajectory import Trajectory
from .types import TOLERANCE, Certificate, Check, Demands
from .verify import position_span, verify

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Recorded:
    """A trajectory known by samples only: times (M,), positions (M, D), and derivatives where they were sent."""

    time: Array
    position: Array
    velocity: Array | None = None
    acceleration: Array | None = None

    @classmethod
    def of(cls, time: Any, position: Any, velocity: Any = None, acceleration: Any = None) -> "Recorded":
        """Read and check samples; the fields' pointers start with ``/trajectory/samples``."""
        where = "/trajectory/samples"
        times = increasing(vector(time, f"{where}/time", largest=1e11), f"{where}/time")
        if len(times) < 2:
            raise InvalidRequest.of(f"{where}/time", "too_few_points", "needs at least two samples")
        points = matrix(position, f"{where}/position")
        read: dict[str, Array] = {}
        for name, value in (("velocity", velocity), ("acceleration", acceleration)):
            if value is not None:
                read[name] = matrix(value, f"{where}/{name}", points.shape[1])
        for name, rows in (("position", points), *read.items()):
            if len(rows) != len(times):
                reason = f"needs {len(times)} rows, has {len(rows)}"
                raise InvalidRequest.of(f"{where}/{name}", "shape_mismatch", reason)
        return cls(times, points, **read)


def certify(
    trajectory: Trajectory | Recorded,
    *,
    limits: Any = None,
    waypoints: Any = None,
    times: Any = None,
    start: Any = None,
    end: Any = None,
) -> Certificate:
    """Return what a trajectory keeps of limits, waypoints and end states, also where it does not hold.

    Waypoints without times are to be passed in this order at any times. Samples are judged by divided differences:
    every smooth curve through them takes, somewhere between the samples, the values reported; sent velocities and
    accelerations are held to the limits too, and must agree with the positions.

    Parameters
    ----------
    limits, start, end
        As in a plan request.
    waypoints : (N, D)
    times : (N,)

    Raises
    ------
    InvalidRequest
    """
    position = trajectory.position if isinstance(trajectory, Recorded) else trajectory.coefficients[-1]
    dims = int(position.shape[1])
    points = None if waypoints is None else matrix(waypoints, "/waypoints", dims)
    if times is not None and points is None:
        raise InvalidRequest.of("/times", "conflict", "times belong to waypoints: send those too")
    at = None
    if points is not None and times is not None:
        at = increasing(vector(times, "/times", len(points), 1e11), "/times")
    demands = Demands(
        dims=dims,
        limits=Limits() if limits is None else Limits.of(limits, dims),
        waypoints=points,
        times=at,
        start=Boundary() if start is None else Boundary.of(start, dims, "/start"),
        end=Boundary() if end is None else Boundary.of(end, dims, "/end"),
    )
    unseen = [n for n in demands.limits.given() if n not in (*QUANTITIES, "velocity_norm")]
    if unseen:
        raise InvalidRequest.of(f"/limits/{unseen[0]}", "unknown_field", "this limit cannot be certified yet")
    if isinstance(trajectory, Recorded):
        return _certify_samples(trajectory, demands)
    passing = _passing_times(trajectory, points) if points is not None and at is None else None
    return verify(trajectory, demands, passing)


#: Grid points looked at together, and how many waypoints may be missed before the rest is not looked for.
_WINDOW, _MISSES = 512, 3


def _passing_times(trajectory: Trajectory, points: Array) -> Array:
    """Return when the waypoints are passed, in order: each at the earliest time that comes within the tolerance.

    Where none does, the nearest approach counts; after 3 misses (the certificate fails anyway) the rest are put at
    the end.
    """
    degree = max(trajectory.degree, 1)
    u = np.arange(8 * degree) / (8 * degree)
    grid = (trajectory.breaks[:-1, None] + np.diff(trajectory.breaks)[:, None] * u).reshape(-1)
    grid = np.append(grid, trajectory.end)
    values, rates = trajectory(grid), np.abs(trajectory(grid, 1)).max()
    tolerance = TOLERANCE * position_span(points)
    times = np.full(len(points), trajectory.end)
    begin, misses = trajectory.start, 0
    for i, point in enumerate(points):
        times[i], miss = _next_pass(trajectory, grid, values, point, begin, tolerance)
        begin = times[i]
        misses += miss > tolerance
        if misses > _MISSES or rates == 0:
            break
    return times


def _next_pass(
    trajectory: Trajectory, grid: Array, values: Array, point: Array, begin: float, tolerance: float
) -> tuple[float, float]:
    """Return the first time from ``begin`` on within the tolerance of the point, or the nearest; and the distance."""
    best_time, best = begin, float(np.linalg.norm(trajectory(begin) - point))
    first = max(int(np.searchsorted(grid, begin, side="right")) - 1, 0)
    while best > tolerance and first < len(grid) - 1:
        last = min(first + _WINDOW, len(grid) - 1)
        distance = np.linalg.norm(values[first : last + 1] - point, axis=1)
        padded = np.concatenate([[np.inf], distance, [np.inf]])
        dips = np.flatnonzero((padded[1:-1] <= padded[:-2]) & (padded[1:-1] <= padded[2:]))
        left, right = grid[first + np.maximum(dips - 1, 0)], grid[np.minimum(first + dips + 1, len(grid) - 1)]
        found, miss = _closest(trajectory, point, np.maximum(left, begin), np.maximum(right, begin))
        near = np.flatnonzero(miss <= tolerance)
        k = int(near[0]) if len(near) else int(np.argmin(miss))
        if miss[k] < best:
            best_time, best = float(found[k]), float(miss[k])
        first = last
    return best_time, best


def _closest(trajectory: Trajectory, point: Array, left: Array, right: Array) -> tuple[Array, Array]:
    """Return the times of least distance in the intervals, by Gauss-Newton steps kept inside, and the distances."""
    time = 0.5 * (left + right)
    best_time, best = time, np.full(len(time), np.inf)
    for step in range(14):
        if step >= 12:  # the ends, last
            time = left if step == 12 else right
        position, rate = trajectory.states(time, 2)
        off = position - point
        distance = np.linalg.norm(off, axis=1)
        best_time, best = np.where(distance < best, time, best_time), np.minimum(distance, best)
        speed = (rate**2).sum(axis=1)
        move = np.divide(-(off * rate).sum(axis=1), speed, out=np.zeros_like(speed), where=speed > 0)
        time = np.clip(time + move, left, right)
    return best_time, best


def _certify_samples(recorded: Recorded, demands: Demands) -> Certificate:
    polyline = Trajectory.from_hermite(recorded.time, recorded.position)
    passing = None
    if demands.waypoints is not None and demands.times is None:
        passing = _passing_times(polyline, demands.waypoints)
    whole = verify(polyline, replace(demands, limits=Limits(), start=Boundary(), end=Boundary()), passing)
    differences = _divided_differences(recorded)
    checks = [row for order in range(4) if (row := _difference_row(recorded, differences, demands, order)) is not None]
    checks += _norm_rows(recorded, differences, demands)
    checks += _sent_rows(recorded)
    boundary_error = _sampled_boundary(recorded, demands, differences)
    errors = (whole.waypoint_error, boundary_error)
    squared = None
    if len(differences) > 3:
        at, jerk = differences[3]
        squared = float(np.sum(np.diff(_edges(at, recorded.time))[:, None] * jerk**2))
    return Certificate(
        holds=all(c.holds for c in checks) and all(e is None or e <= TOLERANCE for e in errors),
        basis="finite_differences",
        checks=tuple(checks),
        waypoint_error=whole.waypoint_error,
        boundary_error=boundary_error,
        continuity=None,
        path_deviation=None,
        cost={"squared_jerk": squared, "path_length": whole.cost["path_length"]},
        peaks={QUANTITIES[m]: tuple(float(v) for v in np.abs(d).max(axis=0)) for m, (_, d) in enumerate(differences)},
    )


def _divided_differences(recorded: Recorded) -> list[tuple[Array, Array]]:
    """Return (times, values) of the derivatives 0 … 3: m! times the divided difference over m + 1 samples.

    By the mean value theorem each is a value of the m-th derivative between those samples.
    """
    t, rows = recorded.time, [(recorded.time, recorded.position)]
    table = recorded.position
    for order in range(1, min(4, len(t))):
        table = order * np.diff(table, axis=0) / (t[order:] - t[:-order])[:, None]
        centres = np.stack([t[k : len(t) - order + k] for k in range(order + 1)]).mean(axis=0)
        rows.append((centres, table))
    return rows


def _edges(at: Array, times: Array) -> Array:
    return np.concatenate([times[:1], 0.5 * (at[:-1] + at[1:]), times[-1:]])


def _difference_row(
    recorded: Recorded, differences: list[tuple[Array, Array]], demands: Demands, order: int
) -> Check | None:
    """Return the worst of the differences, and of what was sent for this derivative, against its limit."""
    limit = getattr(demands.limits, QUANTITIES[order])
    if limit is None:
        return None
    if order >= len(differences):
        return Check(QUANTITIES[order], None, None, None, None, None, None, False)
    at, values = differences[order]
    sent = {1: recorded.velocity, 2: recorded.acceleration}.get(order)
    if sent is not None:
        at, values = np.concatenate([at, recorded.time]), np.concatenate([values, sent])
    scale = limit.scale()
    excess = np.stack([(values - limit.upper) / scale, (limit.lower - values) / scale])
    side, row, joint = (int(i) for i in np.unravel_index(int(np.argmax(excess)), excess.shape))
    value, bound = float(values[row, joint]), float((limit.upper, limit.lower)[side][joint])
    ratio: float | None = value / bound if order else None
    if order == 0:
        half = 0.5 * (limit.upper[joint] - limit.lower[joint])
        middle = 0.5 * (limit.upper[joint] + limit.lower[joint])
        ratio = float(abs(value - middle) / half) if np.isfinite(half) else None
    holds = bool(excess.max() <= TOLERANCE)
    segment = _segment_of(float(at[row]), demands)
    return Check(QUANTITIES[order], joint, segment, float(at[row]), value, bound, ratio, holds)


def _segment_of(time: float, demands: Demands) -> int | None:
    if demands.times is None or len(demands.times) < 2:
        return None
    return int(np.clip(np.searchsorted(demands.times, time, side="right") - 1, 0, len(demands.times) - 2))


def _norm_rows(recorded: Recorded, differences: list[tuple[Array, Array]], demands: Demands) -> list[Check]:
    """Return the worst norm of the difference quotients, and of the velocities sent, against its limit.

    The norm of a mean is no larger than the largest norm: every curve through the samples reaches it between them.
    """
    bound = demands.limits.velocity_norm
    if bound is None:
        return []
    at, velocity = differences[1]
    if recorded.velocity is not None:
        at, velocity = np.concatenate([at, recorded.time]), np.concatenate([velocity, recorded.velocity])
    norms = np.linalg.norm(velocity, axis=1)
    row = int(np.argmax(norms))
    time, value = float(at[row]), float(norms[row])
    holds = bool(value <= bound * (1.0 + TOLERANCE))
    return [Check("velocity_norm", None, _segment_of(time, demands), time, value, bound, value / bound, holds)]


def _sent_rows(recorded: Recorded) -> list[Check]:
    """Return whether sent derivatives agree with what they are derivatives of.

    A derivative at a sample lies between the differences of the intervals beside it, or beyond them by no more than
    twice what neighbouring differences anywhere differ by, as long as the samples resolve the motion (plus 1e-6 of
    their peak, and noise of 4e-9 of the range in what is differenced). What was sent has no part in what is allowed.
    """
    rows: list[Check] = []
    t, span = recorded.time, position_span(recorded.position)
    h = np.diff(t)[:, None]
    slopes = np.diff(recorded.position, axis=0) / h
    found = [] if recorded.velocity is None else [(1, recorded.velocity, slopes, 4e-9 * span / h.min())]
    if recorded.acceleration is not None:
        if recorded.velocity is not None:
            noise = 4e-9 * float(np.abs(recorded.velocity).max()) / h.min()
            found.append((2, recorded.acceleration, np.diff(recorded.velocity, axis=0) / h, noise))
        elif len(t) > 2:
            second = np.diff(slopes, axis=0) / (0.5 * (h[1:] + h[:-1]))
            found.append((2, recorded.acceleration, second, 16e-9 * span / h.min() ** 2))
    for order, sent, differences, noise in found:
        reach = len(t) - len(differences)  # 1: between the samples; 2: second differences, on the inner samples
        padded = np.pad(differences, ((reach, reach), (0, 0)), mode="edge")
        beside = np.stack([padded[k : k + len(t)] for k in range(reach + 1)])
        low, high = beside.min(axis=0), beside.max(axis=0)
        off = np.maximum(np.maximum(sent - high, low - sent), 0.0)
        spread = np.abs(np.diff(differences, axis=0)).max(axis=0, initial=0.0)
        allowed = np.broadcast_to(2 * spread + TOLERANCE * np.abs(differences).max(axis=0) + noise, off.shape)
        ratio = off / np.maximum(allowed, 1e-300)
        row, joint = (int(i) for i in np.unravel_index(int(np.argmax(ratio)), ratio.shape))
        name, worst = f"sent_{QUANTITIES[order]}", float(ratio[row, joint])
        value, bound = float(off[row, joint]), float(allowed[row, joint])
        rows.append(Check(name, joint, None, float(t[row]), value, bound, worst, worst <= 1.0))
    return rows


def _sampled_boundary(recorded: Recorded, demands: Demands, differences: list[tuple[Array, Array]]) -> float | None:
    """Return the error of the end states: of sent derivatives where there are some, else of one-sided differences.

    Those are known only as well as the samples resolve the motion; that much is allowed.
    """
    worst = None
    ends: tuple[tuple[Boundary, int], ...] = ((demands.start, 0), (demands.end, -1))
    for boundary, index in ends:
        for order, name in enumerate(QUANTITIES):
            asked = getattr(boundary, name, None)
            if asked is None:
                continue
            sent: Mapping[str, Array | None] = {"velocity": recorded.velocity, "acceleration": recorded.acceleration}
            values, known, reached = sent.get(name), np.zeros(demands.dims), None
            if values is None:
                if order >= len(differences):
                    return float("inf")
                values = differences[order][1]
                if (judged := _end_derivative(recorded, order, index)) is not None:
                    reached, known = judged
            limit = demands.limits.bounds(order, demands.dims).scale()
            relative = np.maximum(np.maximum(1.0, limit), np.abs(values).max(axis=0))
            off = np.abs((values[index] if reached is None else reached) - asked)
            error = float((np.maximum(off - known, 0.0) / relative).max())
            worst = error if worst is None else max(worst, error)
    return worst


def _end_derivative(recorded: Recorded, order: int, index: int) -> tuple[Array, Array] | None:
    """Return a derivative at the first (0) or last (-1) sample, (D,), and to what it is known; None if it cannot be.

    From the polynomial through the outer order + 4 samples; what it changes when it takes fewer is not known, nor what
    noise of 4e-9 of the range, or the record's own roughness, may make of it.
    """
    outer = _spaced(recorded.time if index == 0 else recorded.time[::-1], order + 4)
    rows = outer if index == 0 else len(recorded.time) - 1 - outer
    t, q = recorded.time[rows], recorded.position[rows]
    found = []
    for count in range(min(order + 2, len(t)), len(t) + 1):
        unit = abs(t[count - 1] - t[0])
        powers = np.vander((t[:count] - t[0]) / unit, increasing=True)
        if not order < count or np.linalg.matrix_rank(powers, 1e-14) < count:  # too uneven: the difference has to do
            continue
        found.append(np.linalg.solve(powers, q[:count])[order] * math.factorial(order) / unit**order)
    if not found:
        return None
    every = recorded.position
    rough = np.median(np.abs(np.diff(every, n=4, axis=0)), axis=0) if len(every) > 8 else 0.0  # noise, or what dt hides
    noise = (4e-9 * position_span(every) + 2.0 * rough) * (4.0 / float(np.abs(np.diff(t)).min())) ** order
    return found[-1], 2.0 * np.ptp(np.stack(found), axis=0) + noise


def _spaced(times: Array, most: int) -> NDArray[np.int64]:
    """Return the first samples, without those that follow another by less than a tenth of the usual step."""
    least = 0.1 * float(np.median(np.abs(np.diff(times))))
    chosen = [0]
    for k in range(1, len(times)):
        if abs(times[k] - times[chosen[-1]]) >= least:
            chosen.append(k)
        if len(chosen) == most:
            break
    return np.array(chosen)
