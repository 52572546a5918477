"""Method ``trapezoidal``."""

import numpy as np
from numpy.typing import NDArray

from problems.rest_to_rest import double_integrator

from ..curves.polyline import linear
from ..limits import segment_bounds
from ..method import Capabilities, Method, Reference
from ..options import Options
from ..timing.stops import segment_durations, stops_bound
from ..trajectory import Trajectory
from ..types import Followed, PlanRequest, Solution, Stats

Array = NDArray[np.float64]


#: Steepest acceleration used, over the square of the velocity of a unit move.
GENTLE = 1e7

Phase = tuple[float, tuple[float, float, float]]


class TrapezoidalOptions(Options):
    """The trapezoidal profile has no options."""


def solve(request: PlanRequest, options: TrapezoidalOptions) -> Solution:
    """Return bang-bang acceleration along the straight line of each segment, all joints in step, at rest between."""
    velocity, *steepest = _along(request)
    rising, falling = steepest
    gentle = GENTLE * velocity**2  # of a unit move: ramps of at least 1e-7 of the cruise, or the clock cannot hold them
    rising, falling = np.minimum(rising, gentle), np.minimum(falling, gentle)
    ones = np.ones_like(velocity)
    moving = np.abs(np.diff(request.waypoints, axis=0)).max(axis=1) > 0
    shortest = np.where(
        moving, double_integrator(ones, velocity, *(np.where(moving, a, 1) for a in (rising, falling))), 0.0
    )
    durations = segment_durations(shortest, request)
    times = np.concatenate([[0.0], np.cumsum(durations)])
    breaks, powers = [0.0], []
    for i, (duration, least) in enumerate(zip(durations, shortest, strict=True)):
        if not moving[i]:  # a dwell: the law runs on, the curve stands
            pieces = [(duration, (float(i), 1.0 / duration, 0.0))]
        else:
            pieces = _trapezoid(i, velocity[i], rising[i], falling[i], duration / least)
        for length, power in pieces:
            breaks.append(breaks[-1] + length)
            powers.append(power)
        breaks[-1] = times[i + 1]
    law = Trajectory.from_powers(breaks, np.array(powers).T[:, :, None])
    curve = linear(np.arange(request.count), request.waypoints)
    true = double_integrator(ones, velocity, *(np.where(moving, a, 1) for a in steepest))
    bound = stops_bound(np.where(moving, true, 0.0)[:, None], request)
    return Solution(curve.compose(law), times, Stats("closed_form"), Followed(curve, law), bound)


def _along(request: PlanRequest) -> tuple[Array, Array, Array]:
    """Return each segment's largest path velocity, acceleration and deceleration; infinite where nothing moves."""
    move = np.diff(request.waypoints, axis=0)
    size = np.abs(move)
    count, dims = move.shape

    def along(order: int, forward: bool) -> Array:
        limit = segment_bounds(request.limits, request.segment_limits, order, count, dims)
        side = np.where((move > 0) == forward, limit.upper, -limit.lower)
        ratio = np.divide(side, size, out=np.full_like(size, np.inf), where=size > 0)
        return np.asarray(ratio.min(axis=1))

    return along(1, True), along(2, True), along(2, False)


def _trapezoid(start: int, velocity: float, rising: float, falling: float, slower: float) -> list[Phase]:
    """Return (duration, powers of the local time) of the phases of a unit move that starts at ``start``."""
    peak = min(velocity, np.sqrt(2.0 / (1.0 / rising + 1.0 / falling)))
    up, down = peak / rising, peak / falling
    cruise = (1.0 - 0.5 * peak * (up + down)) / peak
    phases = [(up, (float(start), 0.0, 0.5 * rising))]
    if cruise > 1e-12 * (up + down):
        phases.append((cruise, (start + 0.5 * peak * up, peak, 0.0)))
    phases.append((down, (start + 1.0 - 0.5 * peak * down, peak, -0.5 * falling)))
    return [(length * slower, (p, v / slower, a / slower**2)) for length, (p, v, a) in phases]


TRAPEZOIDAL = Method(
    id="trapezoidal",
    title="Trapezoidal velocity",
    solve=solve,
    options=TrapezoidalOptions,
    family="time_optimal",
    summary="Full acceleration, cruise, full deceleration on straight lines, with a stop at every waypoint.",
    formula="T = d / v + v / a, or 2 sqrt(d / a) where v is not reached",
    reference=Reference(
        "L. Biagiotti and C. Melchiorri", "Trajectory Planning for Automatic Machines and Robots", 2008, "Springer"
    ),
    capabilities=lambda options: Capabilities(
        "chosen",
        1,
        requires=frozenset({"acceleration"}),
        honours=frozenset({"position", "velocity", "acceleration", "segment_limits", "segment_durations", "duration"}),
        rests=frozenset({"velocity"}),
    ),
    path="fixed",
    objective="duration",
)
