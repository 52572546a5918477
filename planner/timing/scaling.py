"""Uniform scaling of time: t -> factor t divides the i-th derivative by factor^i and leaves the path alone."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..corridors import highest_speeds
from ..errors import Infeasible
from ..jumps import Jumps
from ..limits import QUANTITIES, DurationBounds, Limit, Limits, magnitude, norm_bounds, segment_bounds
from ..trajectory import Trajectory
from ..types import PlanRequest
from ..worst import measures, peaks, worst

Array = NDArray[np.float64]

#: Factors are raised by this, so that rounding cannot break the limit that binds.
STRICT = 1e-13


@dataclass(frozen=True)
class Slowdown:
    """The smallest factor that keeps every limit, and the quantity that binds (None if nothing is limited)."""

    factor: float
    binding: str | None


def slowdown(trajectory: Trajectory, request: PlanRequest, waypoint_times: Array) -> Slowdown:
    """Return the smallest uniform factor that makes a trajectory keep its limits, from the exact extrema.

    factor = max over joints and segments of v/v_max, sqrt(a/a_max), cbrt(j/j_max); below 1 there is room.

    Raises
    ------
    Infeasible
        A limited derivative is unbounded because a lower one jumps: no factor helps.
    """
    trajectory = trajectory.split(waypoint_times)
    middles = 0.5 * (trajectory.breaks[:-1] + trajectory.breaks[1:])
    segment = np.clip(np.searchsorted(waypoint_times, middles, side="right") - 1, 0, request.count - 2)
    if request.segment_limits is None:
        segment = np.zeros_like(segment)
        bounds = (request.limits.bounds(m, request.dims) for m in range(4))
        each = [Limit(x.lower[None], x.upper[None]) for x in bounds]
    else:
        segments = request.count - 1
        each = [segment_bounds(request.limits, request.segment_limits, m, segments, request.dims) for m in range(4)]
    ratios = worst(trajectory, *measures(np.array([x.lower for x in each]), np.array([x.upper for x in each])), segment)
    bounded = np.array([(np.isfinite(x.lower) | np.isfinite(x.upper)).any(axis=0) for x in each])  # (4, D)
    judge, highest = Jumps(trajectory), None
    best, jumping = Slowdown(0.0, None), np.zeros(trajectory.dims, dtype=bool)
    for order in (1, 2, 3):
        lower_order, limit = order - 1, each[order]
        if bounded[order:].any():  # the larger the peak, the less is a jump; most often none is near
            counted, _ = judge.judged(lower_order, np.abs(judge.ends(lower_order)).max(axis=(0, 1)))
            if counted.any():
                highest = peaks(trajectory, 3) if highest is None else highest
                counted, _ = judge.judged(lower_order, highest[lower_order])
            jumping = jumping | counted.any(axis=0)
        if (jumping & bounded[order]).any():
            joint = int(np.argmax(jumping & bounded[order]))
            raise Infeasible(
                f"the path's derivative of order {lower_order} jumps in joint {joint}, so its {QUANTITIES[order]} is "
                "unbounded at any speed: choose a smoother path, or a method that stops there",
                joint=joint,
                quantity=QUANTITIES[order],
                bound=float(magnitude(limit.lower, limit.upper)[0, joint]),
                certified=True,
            )
        factor = max(float(ratios.most[order].max()), 0.0) ** (1.0 / order)
        if factor > best.factor:
            best = Slowdown(factor, QUANTITIES[order])
    return Slowdown(best.factor * (1.0 + STRICT), best.binding)


def norm_factor(trajectory: Trajectory, request: PlanRequest, waypoint_times: Array) -> float:
    """Return the factor by which the limits of the velocity's Euclidean norm need the trajectory slowed; 0: none."""
    bounds = norm_bounds(request.limits, request.segment_limits, request.count - 1)
    if not np.isfinite(bounds).any():
        return 0.0
    trajectory = trajectory.split(waypoint_times)
    middles = 0.5 * (trajectory.breaks[:-1] + trajectory.breaks[1:])
    segment = np.clip(np.searchsorted(waypoint_times, middles, side="right") - 1, 0, request.count - 2)
    return float((highest_speeds(trajectory) / bounds[segment]).max()) * (1.0 + STRICT)


def local_factors(trajectory: Trajectory, limits: Limits) -> Array:
    """Return the factor by which each piece alone would have to be slowed (or could be sped up), (K,)."""
    found = trajectory.extrema(4)
    factors = np.zeros(trajectory.pieces)
    for order in (1, 2, 3):
        limit = limits.bounds(order, trajectory.dims)
        ratio = np.maximum(found.high[order] / limit.upper, found.low[order] / limit.lower).max(axis=1)
        factors = np.maximum(factors, np.maximum(ratio, 0.0) ** (1.0 / order))
    return factors


def stretched(least: float, bounds: DurationBounds | None, segment: int | None = None) -> float:
    """Return the shortest allowed duration that is at least ``least``.

    Raises
    ------
    Infeasible
        Even the shortest the method can do is longer than ``bounds.max``.
    """
    if bounds is None:
        return least
    if least > bounds.max * (1.0 + 1e-9):
        raise Infeasible(
            f"{'the whole' if segment is None else f'segment {segment}'} takes at least {least:.9g} s with this method "
            f"and what else was asked, longer than the {bounds.max:.9g} s allowed",
            quantity="duration" if segment is None else "segment_duration",
            segment=segment,
            bound=bounds.max,
            needed=least,
            minimum_duration=least if segment is None else None,
        )
    return max(min(least, bounds.max), bounds.min)
