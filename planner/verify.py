"""Verification: what a trajectory really does, against what was asked. Knows no method, no path builder, no solver.

Limits are judged at the exact extrema of every piece. Whatever cannot be established counts as broken (fail closed):
a jump makes the next derivative unbounded, and an unbounded quantity holds no bound.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .jumps import counted_jumps
from .limits import QUANTITIES, Boundary, DurationBounds, magnitude, segment_bounds
from .trajectory import Trajectory
from .types import Certificate, Check, Demands, Followed

Array = NDArray[np.float64]

#: Largest relative violation of anything asked that may still be called kept.
TOLERANCE = 1e-6


def verify(
    trajectory: Trajectory,
    demands: Demands,
    waypoint_times: Array | None = None,
    path: Followed | None = None,
) -> Certificate:
    """Check a trajectory against what was asked of it.

    Parameters
    ----------
    trajectory : Trajectory
    demands : Demands
        Limits, waypoints, times, boundary states and durations that must be kept.
    waypoint_times : (N,)
        When the waypoints are passed; where ``demands.times`` is set, those count instead.
    path : Followed
        The path the trajectory claims to follow exactly.

    Returns
    -------
    Certificate
        ``holds`` is true only if everything asked is kept to 1e-6 relative.
    """
    at = demands.times if demands.times is not None else waypoint_times
    inner = trajectory if at is None else trajectory.split(at)
    motion = _measure(inner, demands, at)
    checks = [row for order in range(4) if (row := _limit_row(motion, order)) is not None]
    checks += _duration_rows(trajectory, demands, at)
    waypoint_error = _waypoint_error(trajectory, demands, at, motion.span)
    boundary_error = _boundary_error(motion)
    deviation = None if path is None else _path_deviation(trajectory, path)
    errors = [
        waypoint_error,
        boundary_error,
        None if deviation is None else deviation / motion.span,
    ]
    jerk_bounded = not motion.unbounded[3].any()
    return Certificate(
        holds=all(c.holds for c in checks) and all(e is None or e <= TOLERANCE for e in errors),
        basis="exact",
        checks=tuple(checks),
        waypoint_error=waypoint_error,
        boundary_error=boundary_error,
        continuity=_continuity(trajectory, motion.span),
        path_deviation=deviation,
        cost={
            "squared_jerk": trajectory.squared_integral(3) if jerk_bounded else None,
            "path_length": path_length(trajectory),
        },
        peaks={
            name: tuple(None if bad else float(v) for v, bad in zip(motion.peaks[m], motion.unbounded[m], strict=True))
            for m, name in enumerate(QUANTITIES)
        },
    )


@dataclass(frozen=True, eq=False)
class _Motion:
    """What a trajectory does, piece by piece: extrema and jumps of position, velocity, acceleration and jerk."""

    trajectory: Trajectory
    demands: Demands
    segment: NDArray[np.int64]  # (K,)
    span: float  # what errors of positions are relative to
    low: Array  # (4, K, D)
    high: Array
    at_low: Array
    at_high: Array
    peaks: Array  # (4, D)
    jumps: NDArray[np.bool_]  # (4, K - 1, D): at which breaks a lower derivative jumps, so that this one is unbounded

    @property
    def unbounded(self) -> NDArray[np.bool_]:
        """Which derivatives are unbounded somewhere, (4, D)."""
        return np.asarray(self.jumps.any(axis=1))


def _measure(trajectory: Trajectory, demands: Demands, at: Array | None) -> _Motion:
    found = trajectory.extrema(4)
    peaks = np.stack([found.peak(m) for m in range(4)])
    span = position_span(trajectory if demands.waypoints is None else demands.waypoints)
    jumps = np.zeros((4, trajectory.pieces - 1, trajectory.dims), dtype=bool)
    for m in range(3):
        jumps[m + 1] = jumps[m] | counted_jumps(trajectory, m, peaks[m], span)
    middles = 0.5 * (trajectory.breaks[:-1] + trajectory.breaks[1:])
    segment = np.zeros(len(middles), dtype=np.int64)
    if at is not None:
        segment = np.clip(np.searchsorted(at, middles, side="right") - 1, 0, max(len(at) - 2, 0))
    return _Motion(
        trajectory,
        demands,
        segment,
        span,
        found.low,
        found.high,
        found.at_low,
        found.at_high,
        peaks,
        jumps,
    )


def position_span(points: Array | Trajectory) -> float:
    """Return what errors of positions are relative to: max(1, range of the points)."""
    if isinstance(points, Trajectory):
        points = np.concatenate(points.ends(0))
    return max(1.0, float(np.ptp(points, axis=0).max()))


def _continuity(trajectory: Trajectory, span: float) -> int | None:
    """Return the class: the highest order up to which nothing jumps; -1 if the position does; None for one piece."""
    if trajectory.pieces == 1:
        return None
    found = trajectory.extrema(trajectory.degree + 1)
    for order in range(trajectory.degree + 1):
        if counted_jumps(trajectory, order, found.peak(order), span).any():
            return order - 1
    return trajectory.degree


def _limit_row(motion: _Motion, order: int) -> Check | None:
    """Return the worst joint, segment and time of one limited quantity, or None if it is not limited."""
    demands = motion.demands
    segments = int(motion.segment.max()) + 1 if demands.segment_limits is None else len(demands.segment_limits)
    limit = segment_bounds(demands.limits, demands.segment_limits, order, segments, demands.dims)
    lower, upper = limit.lower[motion.segment], limit.upper[motion.segment]
    bounded = np.isfinite(lower) | np.isfinite(upper)
    if not bounded.any():
        return None
    quantity = QUANTITIES[order]
    infinite = motion.jumps[order] & bounded[:-1] & bounded[1:]  # between segments: where both are limited
    if infinite.any():
        piece, joint = (int(i) for i in np.argwhere(infinite)[0])
        side = upper[piece, joint] if np.isfinite(upper[piece, joint]) else lower[piece, joint]
        time, segment = float(motion.trajectory.breaks[piece + 1]), int(motion.segment[piece])
        return Check(quantity, joint, segment, time, None, _finite(side), None, False)
    if not (np.isfinite(motion.high[order]).all() and np.isfinite(motion.low[order]).all()):
        return Check(quantity, None, None, None, None, None, None, False)
    scale = magnitude(lower, upper)
    high, low = motion.high[order], motion.low[order]
    excess = np.stack([(high - upper) / scale, (lower - low) / scale])
    if order == 0:
        badness = excess
    else:  # the ratio says more than the distance where the sides differ
        badness = np.stack([high / upper, low / lower])
        badness = np.where(excess > 0, np.maximum(badness, 1.0 + excess), badness)
    worst = float(badness.max())
    ties = np.argwhere(badness >= worst - 1e-9 * abs(worst))  # the earliest, whatever rounding prefers
    when = np.stack([motion.at_high, motion.at_low])[:, order]
    which, piece, joint = (int(i) for i in ties[np.argmin(when[tuple(ties.T)])])
    value = (high, low)[which][piece, joint]
    bound = (upper, lower)[which][piece, joint]
    time = when[which, piece, joint]
    if order == 0:
        half = 0.5 * (upper[piece, joint] - lower[piece, joint])
        middle = 0.5 * (upper[piece, joint] + lower[piece, joint])
        ratio = abs(value - middle) / half if np.isfinite(half) else None
    else:
        ratio = value / bound
    holds = bool(excess.max() <= TOLERANCE)
    segment = int(motion.segment[piece])
    ratio = None if ratio is None else float(ratio)
    return Check(quantity, joint, segment, float(time), float(value), float(bound), ratio, holds)


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _duration_rows(trajectory: Trajectory, demands: Demands, at: Array | None) -> list[Check]:
    rows = []
    if demands.duration is not None:
        rows.append(_duration_row("duration", trajectory.duration, demands.duration, None))
    if demands.segment_durations is not None:
        steps = np.full(len(demands.segment_durations), np.nan) if at is None else np.diff(at)
        each = [
            _duration_row("segment_duration", float(step), bounds, i)
            for i, (step, bounds) in enumerate(zip(steps, demands.segment_durations, strict=True))
            if bounds is not None
        ]
        rows += sorted(each, key=lambda c: (c.holds, -abs((c.ratio or 0.0) - 1.0) if not c.holds else 0.0))[:1]
    return rows


def _duration_row(quantity: str, value: float, bounds: DurationBounds, segment: int | None) -> Check:
    late, early = value - bounds.max, bounds.min - value
    bound = bounds.max if late >= early else bounds.min
    slack = TOLERANCE * max(bound, 1e-12)
    ratio = value / bound if bound > 0 else None
    holds = bool(late <= slack and early <= slack)
    return Check(quantity, None, segment, None, value, bound, ratio, holds)


def _waypoint_error(trajectory: Trajectory, demands: Demands, at: Array | None, span: float) -> float | None:
    if demands.waypoints is None or at is None:
        return None
    slack = 1e-9 * max(1.0, trajectory.duration)
    inside = (at >= trajectory.start - slack) & (at <= trajectory.end + slack)
    if len(at) != len(demands.waypoints) or not inside.all() or (np.diff(at) < 0).any():
        return float("inf")
    reached = trajectory(np.clip(at, trajectory.start, trajectory.end))
    return float(np.abs(reached - demands.waypoints).max() / span)


def _boundary_error(motion: _Motion) -> float | None:
    """Return the largest error of a pinned end state, relative to max(1, limit, peak) of that derivative and joint."""
    worst = None
    ends: tuple[tuple[Boundary, int], ...] = ((motion.demands.start, 0), (motion.demands.end, -1))
    for boundary, index in ends:
        for order, name in enumerate(QUANTITIES):
            asked = getattr(boundary, name, None)
            if asked is None:
                continue
            limit = motion.demands.limits.bounds(order, motion.demands.dims).scale()
            relative = np.maximum(np.maximum(1.0, limit), motion.peaks[order])
            left, right = motion.trajectory.ends(order)
            reached = (left if index == 0 else right)[index]
            error = float((np.abs(reached - asked) / relative)[~np.isnan(asked)].max(initial=0.0))
            worst = error if worst is None else max(worst, error)
    return worst


def _path_deviation(trajectory: Trajectory, path: Followed) -> float:
    """Return the largest distance between q(t) and curve(law(t)); infinite if the law runs backwards.

    Both sides are polynomials on the common pieces; more nodes than their degree cannot all hide a difference.
    """
    curve, law = path.curve, path.law
    rate = law.extrema(2)
    if -float(rate.low[1].min()) > TOLERANCE * float(rate.high[1].max()):
        return float("inf")
    nodes = 2 * max(trajectory.degree, curve.degree * law.degree) + 3
    u = 0.5 - 0.5 * np.cos(np.pi * np.arange(nodes) / (nodes - 1))
    breaks = np.union1d(trajectory.breaks, np.clip(law.breaks, trajectory.start, trajectory.end))
    times = (breaks[:-1, None] + np.diff(breaks)[:, None] * u).reshape(-1)
    times = np.clip(times, max(trajectory.start, law.start), min(trajectory.end, law.end))
    s = np.clip(law(times)[:, 0], curve.start, curve.end)
    return float(np.linalg.norm(trajectory(times) - curve(s), axis=1).max())


#: Gauss-Legendre rules on [0, 1]: (nodes, weights), a coarse and a fine one.
_RULES = [(0.5 + 0.5 * x, 0.5 * w) for x, w in map(np.polynomial.legendre.leggauss, (8, 16))]


MOST_PIECES = 1 << 16


def path_length(trajectory: Trajectory) -> float:
    """Return the integral of the Euclidean norm of the velocity, to about 1e-10 relative.

    Gauss-Legendre on each piece, halving those whose 8- and 16-point values differ (the norm has kinks at rests).
    """
    n = trajectory.degree
    if n == 0:
        return 0.0
    slopes = trajectory.coefficients[:-1] * np.arange(n, 0, -1.0)[:, None, None]  # d/du, highest power first
    piece, left, width = np.arange(trajectory.pieces), np.zeros(trajectory.pieces), np.ones(trajectory.pieces)
    noise = 64 * np.finfo(float).eps * np.sqrt((np.abs(slopes).sum(axis=0) ** 2).sum(axis=1))
    total = 0.0
    for _ in range(48):
        a, b = (_speed_integrals(slopes[:, piece], left, width, *rule) for rule in _RULES)
        scale = max(total + float(b.sum()), 1e-300)
        rough = np.abs(a - b) > np.maximum(1e-11 * scale / np.sqrt(len(a)), noise[piece] * width)
        total += float(b[~rough].sum())
        if not rough.any():
            return total
        if rough.sum() > MOST_PIECES:  # rounding, or kinks without end: what there is, is good enough
            break
        piece, half = np.repeat(piece[rough], 2), 0.5 * width[rough]
        left = np.stack([left[rough], left[rough] + half], axis=1).reshape(-1)
        width = np.repeat(half, 2)
    return total + float(b[rough].sum())


def _speed_integrals(slopes: Array, left: Array, width: Array, nodes: Array, weights: Array) -> Array:
    u = (left[:, None] + width[:, None] * nodes)[:, :, None]
    value = np.broadcast_to(slopes[0][:, None, :], (len(left), len(nodes), slopes.shape[2]))
    for c in slopes[1:]:
        value = value * u + c[:, None, :]
    return np.asarray(width * (np.sqrt(np.einsum("knd,knd->kn", value, value)) @ weights))
