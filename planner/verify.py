"""Verification: what a trajectory really does, against what was asked. Knows no method, no path builder, no solver.

Limits are judged at the exact extrema of every piece. Whatever cannot be established counts as broken (fail closed):
a jump makes the next derivative unbounded, and an unbounded quantity holds no bound.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .corridors import norm_row, polyline_distance, tolerance_row, tube_row
from .jumps import GROWTH, JUMP, Jumps
from .kernels.motion import survey
from .kernels.speed import length
from .limits import QUANTITIES, DurationBounds, Limit, is_limited, magnitude, segment_bounds
from .quadrature import LOW, MOST_PIECES, NODES, WEIGHTS, integral
from .rational import noise_of
from .trajectory import Trajectory
from .types import TOLERANCE, Certificate, Check, Demands, Followed
from .worst import TIE, Worst, measures, peaks, worst

Array = NDArray[np.float64]


def verify(
    trajectory: Trajectory,
    demands: Demands,
    waypoint_times: Array | None = None,
    path: Followed | None = None,
    polyline: bool = False,
) -> Certificate:
    """Check a trajectory against what was asked of it.

    Parameters
    ----------
    trajectory : Trajectory
    demands : Demands
        Limits, waypoints, times, boundary states, durations, tolerances and tubes that must be kept.
    waypoint_times : (N,)
        When the waypoints are passed; where ``demands.times`` is set, those count instead.
    path : Followed
        The path the trajectory claims to follow exactly.
    polyline : bool
        Whether, without such a path, the distance from the waypoints' polyline is told even where no tube is asked;
        it is not judged.

    Returns
    -------
    Certificate
        ``holds`` is true only if everything asked is kept to 1e-6 relative.
    """
    at = demands.times if demands.times is not None else waypoint_times
    inner = trajectory if at is None or at is trajectory.breaks else trajectory.split(at)
    motion = _measure(inner, demands, at)
    missed = _missed(motion, at)
    checks = _limit_rows(motion)
    if is_limited(demands.limits, demands.segment_limits, "velocity_norm"):
        row = norm_row(inner, demands, motion.segment, motion.jumps[1])
        checks += [] if row is None else [row]
    checks += _duration_rows(trajectory, demands, at)
    checks += _corridor_rows(motion, missed, at)
    waypoint_error = _waypoint_error(missed, demands, at, motion.span)
    boundary_error = _boundary_error(motion, at if missed is not None else None)
    deviation = None if path is None else _path_deviation(trajectory, path)
    errors = [waypoint_error, boundary_error, None if deviation is None else deviation / motion.span]
    polyline = path is None and (polyline or demands.tube is not None)
    if polyline and demands.waypoints is not None and missed is not None:
        deviation = polyline_distance(inner, demands.waypoints, motion.segment)  # told; what is judged is the tube
    highest, unbounded = motion.peaks.tolist(), motion.unbounded.tolist()
    return Certificate(
        holds=all(c.holds for c in checks) and all(e is None or e <= TOLERANCE for e in errors),
        basis="enclosure" if trajectory.rational else "exact",
        checks=tuple(checks),
        waypoint_error=waypoint_error,
        boundary_error=boundary_error,
        continuity=_continuity(trajectory, motion),
        path_deviation=deviation,
        cost={
            "squared_jerk": None if any(unbounded[3]) else trajectory.squared_integral(3),
            "path_length": path_length(trajectory),
        },
        peaks={
            name: tuple(None if bad else v for v, bad in zip(values, jumping, strict=True))
            for name, values, jumping in zip(QUANTITIES, highest, unbounded, strict=True)
        },
    )


@dataclass(frozen=True, eq=False)
class _Motion:
    """What a trajectory does: its peaks, and the breaks at which it jumps."""

    trajectory: Trajectory
    demands: Demands
    at: Array | None
    span: float  # what errors of positions are relative to
    peaks: Array  # (4, D)
    jumps: NDArray[np.bool_]  # (4, K - 1, D): at which breaks a lower derivative jumps, so that this one is unbounded
    unbounded: NDArray[np.bool_]  # (4, D): whether it is so anywhere
    judge: Jumps
    lost: tuple[bool, ...]  # whether the derivative of order 0, 1, … jumps by more than rounding explains

    @cached_property
    def segment(self) -> NDArray[np.int64]:
        """The segment each piece belongs to, (K,)."""
        breaks, at = self.trajectory.breaks, self.at
        if at is None:
            return np.zeros(self.trajectory.pieces, dtype=np.int64)
        middles = 0.5 * (breaks[:-1] + breaks[1:])
        return np.clip(np.searchsorted(at, middles, side="right") - 1, 0, max(len(at) - 2, 0))

    def end(self, order: int, index: int) -> Array:
        """Return a derivative at the start (index 0) or at the end (-1), (D,)."""
        return np.asarray(self.judge.ends(order)[index, index])


def _measure(trajectory: Trajectory, demands: Demands, at: Array | None) -> _Motion:
    span = position_span(trajectory if demands.waypoints is None else demands.waypoints)
    if not trajectory.rational:
        run = trajectory.breaks, trajectory.coefficients, trajectory.rates
        ends, highest, jumps, unbounded, lost = survey(*run, span, JUMP, GROWTH)
        judge = Jumps(trajectory, span, ends)
        return _Motion(trajectory, demands, at, span, highest, jumps, unbounded, judge, tuple(lost.tolist()))
    highest, judge = peaks(trajectory, 4), Jumps(trajectory, span)
    jumps, told = np.zeros((4, trajectory.pieces - 1, trajectory.dims), dtype=bool), []
    for m in range(3):
        counted, smoothness_lost = judge.judged(m, highest[m])
        np.logical_or(jumps[m], counted, out=jumps[m + 1])
        told.append(smoothness_lost)
    return _Motion(trajectory, demands, at, span, highest, jumps, np.asarray(jumps.any(axis=1)), judge, tuple(told))


def position_span(points: Array | Trajectory) -> float:
    """Return what errors of positions are relative to: max(1, range of the points)."""
    if isinstance(points, Trajectory):
        points = np.concatenate(points.ends(0))
    return max(1.0, float((points.max(axis=0) - points.min(axis=0)).max()))


def _continuity(trajectory: Trajectory, motion: _Motion) -> int | None:
    """Return the class: the highest order up to which nothing jumps; -1 if the position does.

    None for one piece, and for pieces of one and the same polynomial.
    """
    if trajectory.pieces == 1:
        return None
    same = motion.trajectory is trajectory
    judge, highest = motion.judge if same else Jumps(trajectory, motion.span), motion.peaks
    for order in range(trajectory.degree + 1):
        if same and order < len(motion.lost):
            lost = motion.lost[order]
        elif order < len(highest) and not trajectory.rational:
            lost = judge.judged(order, highest[order])[1]
        else:
            lost = judge.judged(order, np.abs(judge.ends(order)).max(axis=(0, 1)))[1]
            if lost and not trajectory.rational:  # the larger the peak, the less is a jump; most often none is near
                highest = peaks(trajectory, trajectory.degree + 1)
                lost = judge.judged(order, highest[order])[1]
        if lost:
            return order - 1
    return trajectory.degree if trajectory.rational else None


def _limit_rows(motion: _Motion) -> list[Check]:
    """Return a row for every limited quantity: the worst joint, segment and time."""
    demands = motion.demands
    if demands.segment_limits is None:
        if all(getattr(demands.limits, name) is None for name in QUANTITIES):
            return []
        row, present = np.zeros(motion.trajectory.pieces, dtype=np.int64), np.zeros(1, dtype=np.int64)
        bounds = (demands.limits.bounds(m, demands.dims) for m in range(len(QUANTITIES)))
        each = [Limit(x.lower[None], x.upper[None]) for x in bounds]
    else:
        segments = len(demands.segment_limits)
        row = np.minimum(motion.segment, segments - 1)
        present = np.unique(row)
        both = demands.limits, demands.segment_limits
        each = [segment_bounds(*both, m, segments, demands.dims) for m in range(len(QUANTITIES))]
    lower, upper = np.array([x.lower for x in each]), np.array([x.upper for x in each])  # (4, S, D)
    limited = (np.isfinite(lower) | np.isfinite(upper))[:, present].any(axis=(1, 2)).tolist()
    if not any(limited):
        return []
    ratio, lopsided = measures(lower, upper, None), bool((lower[1:] != -upper[1:]).any())
    if limited[0] or lopsided:
        distance = measures(lower, upper, np.array([magnitude(x.lower, x.upper) for x in each]))
        for by_ratio, by_distance in zip(ratio, distance, strict=True):  # for derivatives the ratio says more
            by_ratio[:, 0] = by_distance[:, 0]
    told = worst(motion.trajectory, *ratio, row)
    excess = told.most - np.array([0.0, 1.0, 1.0, 1.0])[:, None]
    if lopsided:  # what counts is the distance over the larger side
        excess = worst(motion.trajectory, *distance, row).most
    holds = (excess.max(axis=1) <= TOLERANCE).tolist()
    return [_limit_row(motion, each[m], row, m, told, holds[m]) for m in range(len(QUANTITIES)) if limited[m]]


def _limit_row(motion: _Motion, limit: Limit, row: NDArray[np.int64], order: int, found: Worst, holds: bool) -> Check:
    quantity = QUANTITIES[order]
    if motion.unbounded[order].any():
        lower, upper = limit.lower[row], limit.upper[row]
        bounded = np.isfinite(lower) | np.isfinite(upper)
        infinite = motion.jumps[order] & bounded[:-1] & bounded[1:]  # between segments: where both are limited
        if infinite.any():
            piece, joint = (int(i) for i in np.argwhere(infinite)[0])
            side = upper[piece, joint] if np.isfinite(upper[piece, joint]) else lower[piece, joint]
            time, segment = float(motion.trajectory.breaks[piece + 1]), int(motion.segment[piece])
            return Check(quantity, joint, segment, time, None, _finite(side), None, False)
    badness, most = found.badness[order], float(found.most[order].max())
    if not (np.isfinite(motion.peaks[order]).all() and np.isfinite(most)):  # beyond floating point: nothing is held
        return Check(quantity, None, None, None, None, None, None, False)
    ties = np.flatnonzero(badness >= most - TIE * abs(most))  # the earliest, whatever rounding prefers
    joint = int(ties[np.argmin(found.time[order, ties])]) if len(ties) else int(np.argmax(badness))
    piece, value = int(found.piece[order, joint]), float(found.value[order, joint])
    low, high = float(limit.lower[row[piece], joint]), float(limit.upper[row[piece], joint])
    bound = low if found.side[order, joint] else high
    ratio: float | None = None
    if order > 0:
        ratio = value / bound
    elif np.isfinite(high - low):
        ratio = abs(value - 0.5 * (low + high)) / (0.5 * (high - low))
    time, segment = float(found.time[order, joint]), int(motion.segment[piece])
    return Check(quantity, joint, segment, time, value, bound, ratio, holds)


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _duration_rows(trajectory: Trajectory, demands: Demands, at: Array | None) -> list[Check]:
    rows = []
    if demands.duration is not None:
        rows.append(_duration_row("duration", trajectory.duration, demands.duration, None))
    if demands.segment_durations is not None:
        steps = np.full(len(demands.segment_durations), np.nan) if at is None else np.diff(at)
        pairs = enumerate(zip(steps, demands.segment_durations, strict=True))
        each = [_duration_row("segment_duration", float(x), own, i) for i, (x, own) in pairs if own is not None]
        rows += sorted(each, key=lambda c: (c.holds, -abs((c.ratio or 0.0) - 1.0) if not c.holds else 0.0))[:1]
    return rows


def _duration_row(quantity: str, value: float, bounds: DurationBounds, segment: int | None) -> Check:
    late, early = value - bounds.max, bounds.min - value
    bound = bounds.max if late >= early else bounds.min
    slack = TOLERANCE * max(bound, 1e-12)
    ratio = value / bound if bound > 0 else None
    holds = bool(late <= slack and early <= slack)
    return Check(quantity, None, segment, None, value, bound, ratio, holds)


def _corridor_rows(motion: _Motion, missed: Array | None, at: Array | None) -> list[Check]:
    demands = motion.demands
    rows = [tolerance_row(missed, demands, at, motion.span)]
    if demands.tube is not None and missed is None:  # which segment a position belongs to is not known
        rows.append(Check("tube", None, None, None, None, None, None, False))
    elif demands.tube is not None:
        rows.append(tube_row(motion.trajectory, demands, motion.segment, motion.span))
    return [row for row in rows if row is not None]


def _missed(motion: _Motion, at: Array | None) -> Array | None:
    """Return the distances from the waypoints at their times, from the side that is further off, (N, D).

    The trajectory has breaks at the times. None where there are no such times, or they are not the trajectory's.
    """
    trajectory, demands = motion.trajectory, motion.demands
    if demands.waypoints is None or at is None:
        return None
    if len(at) != len(demands.waypoints):
        return None
    if at is not trajectory.breaks:
        slack = 1e-9 * max(1.0, trajectory.duration)
        inside = (at >= trajectory.start - slack) & (at <= trajectory.end + slack)
        if not inside.all() or (np.diff(at) < 0).any():
            return None
    return np.asarray(np.abs(_on_both_sides(motion, at, 0) - demands.waypoints).max(axis=0))


def _on_both_sides(motion: _Motion, at: Array, order: int) -> Array:
    """Return a derivative at times, from the right and from the left of them, (2, N, D)."""
    trajectory, pieces = motion.trajectory, motion.trajectory.pieces
    if at is trajectory.breaks:
        states, both = motion.judge.ends(order), np.empty((2, len(at), trajectory.dims))
        both[0, :-1], both[0, -1] = states[0], states[1, -1]
        both[1, 1:], both[1, 0] = states[1], states[0, 0]
        return both
    index = np.searchsorted(trajectory.breaks, at)
    if (trajectory.breaks[np.minimum(index, pieces)] == at).all():  # as is usual: no time is beyond the clock
        starts, stops = motion.judge.ends(order)
        right, left = starts[np.minimum(index, pieces - 1)], stops[np.maximum(index - 1, 0)]
        right[index == pieces], left[index == 0] = stops[-1], starts[0]
        return np.stack([right, left])
    right = trajectory(np.clip(at, trajectory.start, trajectory.end), order)
    left = right.copy()
    before = index - 1  # the piece that ends there, if one does
    ends = (before >= 0) & (trajectory.breaks[np.minimum(index, pieces)] == at)
    if ends.any():
        left[ends] = motion.judge.ends(order)[1, before[ends]]
    return np.stack([right, left])


def _waypoint_error(missed: Array | None, demands: Demands, at: Array | None, span: float) -> float | None:
    """Return the largest miss of a waypoint; of an interior one only what lies beyond its tolerance counts."""
    if demands.waypoints is None or at is None:
        return None
    if missed is None:
        return float("inf")
    if demands.waypoint_tolerance is not None:
        missed = missed.copy()
        missed[1:-1] = np.maximum(missed[1:-1] - demands.waypoint_tolerance, 0.0)
    return float(missed.max() / span)


def _boundary_error(motion: _Motion, at: Array | None) -> float | None:
    """Return the largest error of a state asked at an end, or at a waypoint (at times ``at``) from either side.

    Where the motion is to be closed, the ends' derivatives are asked of one another.

    Relative to max(1, limit, peak) of that derivative and joint.
    """
    demands, errors = motion.demands, []
    asked: list[tuple[int, Array, Array]] = []  # order, what is asked, what is reached
    for boundary, index in ((demands.start, 0), (demands.end, -1)):
        for order, name in enumerate(QUANTITIES):
            if getattr(boundary, name, None) is not None:
                asked.append((order, getattr(boundary, name), motion.end(order, index)))
    for order in range(1, min(demands.closed, len(QUANTITIES) - 1) + 1):
        asked.append((order, motion.end(order, 0), motion.end(order, -1)))
    states = demands.waypoint_states
    if states is not None:
        if at is None:
            return float("inf")
        for order, rows in ((1, states.velocity), (2, states.acceleration)):
            asked.append((order, rows, _on_both_sides(motion, at, order)))
    relative = {m: np.maximum(1.0, motion.peaks[m]) for m in {order for order, _, _ in asked}}
    for m in relative:
        if getattr(demands.limits, QUANTITIES[m]) is not None:
            relative[m] = np.maximum(relative[m], demands.limits.bounds(m, demands.dims).scale())
    for order, wanted, reached in asked:
        off = np.abs(reached - wanted) / relative[order]
        if np.isnan(most := float(off.max())):  # where nothing is asked
            most = float(off[~np.isnan(np.broadcast_to(wanted, off.shape))].max(initial=0.0))
        errors.append(most)
    return max(errors, default=None)


def _path_deviation(trajectory: Trajectory, path: Followed) -> float:
    """Return the largest distance between q(t) and curve(law(t)); infinite if the law runs backwards.

    Both sides are polynomials on the common pieces; more nodes than their degree cannot all hide a difference.
    """
    curve, law = path.curve, path.law
    slowest, fastest = _rates(law)
    if -slowest > TOLERANCE * fastest:
        return float("inf")
    nodes = 2 * max(trajectory.degree, curve.degree * law.degree) + 3  # for quotients: of both denominators
    u = 0.5 - 0.5 * np.cos(np.pi * np.arange(nodes) / (nodes - 1))
    if not (trajectory.rational or curve.rational or law.rational):
        from .kernels.deviation import largest_deviation

        each = ((x.breaks, x.coefficients) for x in (trajectory, law, curve))
        return float(largest_deviation(*(array for pair in each for array in pair), u))
    breaks = np.union1d(trajectory.breaks, np.clip(law.breaks, trajectory.start, trajectory.end))
    times = (breaks[:-1, None] + np.diff(breaks)[:, None] * u).reshape(-1)
    times = np.clip(times, max(trajectory.start, law.start), min(trajectory.end, law.end))
    s = np.clip(law(times)[:, 0], curve.start, curve.end)
    return float(np.linalg.norm(trajectory(times) - curve(s), axis=1).max())


def _rates(law: Trajectory) -> tuple[float, float]:
    """Return the slowest and the fastest rate of a law."""
    if law.rational:
        found = law.extrema(2)
        return float(found.low[1].min()), float(found.high[1].max())
    from .kernels.extrema import extrema

    low, _, high, _ = extrema(law.coefficients, 2)[:, 1, :, 0] * law.rates
    return float(low.min()), float(high.max())


def path_length(trajectory: Trajectory) -> float:
    """Return the integral of the Euclidean norm of the velocity, to about 1e-10 relative."""
    if trajectory.degree == 0 or trajectory.duration == 0.0:
        return 0.0
    if trajectory.rational:
        return _rational_length(trajectory)
    return float(length(trajectory.coefficients, NODES, WEIGHTS, LOW, MOST_PIECES, max(1 << 18, 8 * trajectory.pieces)))


def _rational_length(trajectory: Trajectory) -> float:
    assert trajectory.weights is not None
    noise = noise_of(np.concatenate([trajectory.coefficients, trajectory.weights[:, :, None]], axis=2), 1)
    h = np.diff(trajectory.breaks)

    def speed(piece: NDArray[np.int64], u: Array) -> Array:
        times = trajectory.breaks[piece, None] + u * h[piece, None]
        rate = trajectory(np.clip(times, trajectory.start, trajectory.end), 1)
        return np.asarray(np.linalg.norm(rate, axis=-1) * h[piece, None])

    return integral(speed, trajectory.pieces, noise)
