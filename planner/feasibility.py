"""What no motion can cure: waypoints, states and mean velocities beyond their limits, refused before any work."""

import numpy as np
from numpy.typing import NDArray

from .errors import Infeasible, InvalidRequest
from .limits import QUANTITIES, is_limited, magnitude, norm_bounds, segment_bounds
from .types import PlanRequest

Array = NDArray[np.float64]

#: Beyond a limit by less than this, relatively: that is rounding.
ROUNDING = 1e-9
#: Up to so many segments a method looks for the smallest velocity limit that would do; the mean velocity would not.
EXPLAINED = 60


def refuse_empty_boxes(request: PlanRequest) -> None:
    """Raise ``bad_limits`` where the position limits of request and segment exclude one another."""
    limit = segment_bounds(request.limits, request.segment_limits, 0, request.count - 1, request.dims)
    for i, joint in np.argwhere(limit.lower > limit.upper):
        reason = f"no position of joint {joint} keeps both the limits of the segment and those of the request"
        raise InvalidRequest.of(f"/segment_limits/{i}", "bad_limits", reason)


def refuse_hopeless(request: PlanRequest, passed: bool, timed: bool) -> None:
    """Refuse what no motion can cure, whatever the method.

    Parameters
    ----------
    request : PlanRequest
        With its end states resolved.
    passed : bool
        Whether the waypoints are passed (control points are not).
    timed : bool
        Whether they are passed at ``request.times``.

    Raises
    ------
    Infeasible
        Certified: a waypoint (with its tolerance and the tube), a state asked at an end or a waypoint, or the mean
        velocity of a segment breaks a limit.
    """

    def limited(name: str) -> bool:
        return is_limited(request.limits, request.segment_limits, name)

    if passed and limited("position"):
        told = "a waypoint" if request.waypoint_tolerance is None else "a waypoint, tolerance included,"
        _refuse_beyond(request, 0, _either_side(_nearest_positions(request)), told)
    norm = limited("velocity_norm")
    for order, name in enumerate(QUANTITIES[1:], 1):
        if not limited(name) and not (norm and order == 1):
            continue
        states = np.full((2, request.count, request.dims), np.nan)  # asked at the waypoints, and at the ends
        if request.waypoint_states is not None and order < 3:
            states[0] = getattr(request.waypoint_states, name)
        for side, index in ((request.start, 0), (request.end, -1)):
            if getattr(side, name) is not None:
                states[1, index] = getattr(side, name)
        for told, values in (("the state asked at a waypoint", states[0]), ("the state asked at an end", states[1])):
            if not np.isnan(values).all():
                _refuse_beyond(request, order, _either_side(values), told)
                if order == 1 and norm:  # joints that are free can only add to the norm
                    norms = np.sqrt(np.nansum(_either_side(values) ** 2, axis=-1))
                    _refuse_norm(request, norms, told)
    if timed and passed and (norm or limited("velocity")):
        _refuse_mean_velocity(request)


def _either_side(values: Array) -> Array:
    """Return what holds at waypoints (N, D) as what holds at the start and at the end of segments, (2, N - 1, D)."""
    return np.stack([values[:-1], values[1:]])


def _slack(request: PlanRequest) -> Array:
    """Return by how much each waypoint may be missed, (N, D): the ends not at all."""
    slack = np.zeros((request.count, request.dims))
    if request.waypoint_tolerance is not None:
        slack[1:-1] = request.waypoint_tolerance
    return slack


def _nearest_positions(request: PlanRequest) -> Array:
    """Return the position within each waypoint's tolerance, and the tubes, that is nearest to keeping its limits."""
    points, slack = request.waypoints, _slack(request)
    if not slack.any():
        return points
    low, high = points - slack, points + slack
    if request.tube is not None:
        least, most = np.minimum(points[:-1], points[1:]), np.maximum(points[:-1], points[1:])
        for rows in (slice(None, -1), slice(1, None)):
            low[rows] = np.maximum(low[rows], least - request.tube)
            high[rows] = np.minimum(high[rows], most + request.tube)
    limit = segment_bounds(request.limits, request.segment_limits, 0, request.count - 1, request.dims)
    lower, upper = np.full(points.shape, -np.inf), np.full(points.shape, np.inf)
    for rows in (slice(None, -1), slice(1, None)):  # a waypoint belongs to the segments on both sides
        lower[rows], upper[rows] = np.maximum(lower[rows], limit.lower), np.minimum(upper[rows], limit.upper)
    return np.clip(np.clip(points, lower, upper), low, high)


def _refuse_beyond(request: PlanRequest, order: int, values: Array, told: str) -> None:
    """Refuse values (2, S, D) at the starts and ends of segments (NaN: free) of which one breaks a limit: the worst."""
    limit = segment_bounds(request.limits, request.segment_limits, order, request.count - 1, request.dims)
    lower, upper = limit.lower, limit.upper
    over = np.nan_to_num(np.maximum(values - upper, lower - values) / magnitude(lower, upper), nan=-np.inf)
    if over.max() <= ROUNDING:
        return
    side, segment, joint = (int(i) for i in np.unravel_index(int(np.argmax(over)), over.shape))
    value = float(values[side, segment, joint])
    raise Infeasible(
        f"{told} breaks the {QUANTITIES[order]} limit of joint {joint} on segment {segment}",
        joint=joint,
        quantity=QUANTITIES[order],
        segment=segment,
        time=None if request.times is None else float(request.times[segment + side]),
        bound=float((upper if value > upper[segment, joint] else lower)[segment, joint]),
        needed=value,
        certified=True,
    )


def _refuse_norm(request: PlanRequest, norms: Array, told: str, places: Array | None = None) -> None:
    """Refuse norms of the velocity at the starts and ends of segments (2, S), or over them (1, S): the worst."""
    bounds = norm_bounds(request.limits, request.segment_limits, request.count - 1)
    over = norms / bounds
    if over.max() <= 1.0 + ROUNDING:
        return
    side, segment = (int(i) for i in np.unravel_index(int(np.argmax(over)), over.shape))
    times = request.times if places is None else places
    raise Infeasible(
        f"{told} breaks the limit of the velocity's norm on segment {segment}",
        quantity="velocity_norm",
        segment=segment,
        time=None if times is None else float(times[segment + side]),
        bound=float(bounds[segment]),
        needed=float(norms[side, segment]),
        certified=True,
    )


def _refuse_mean_velocity(request: PlanRequest) -> None:
    """Refuse times between which the mean velocity, the least that tolerances leave of it, breaks a limit.

    Somewhere on the segment a joint's velocity takes its mean value, and the norm is at least the norm of the means.
    """
    assert request.times is not None
    h = np.diff(request.times)[:, None]
    slack = _slack(request)
    mean, play = np.diff(request.waypoints, axis=0) / h, (slack[:-1] + slack[1:]) / h
    middles = 0.5 * (request.times[:-1] + request.times[1:])
    least = np.maximum(np.abs(mean) - play, 0.0)
    _refuse_norm(request, np.linalg.norm(least, axis=1)[None], "the mean velocity between the times", middles)
    if request.count - 1 <= EXPLAINED:
        return
    limit = segment_bounds(request.limits, request.segment_limits, 1, request.count - 1, request.dims)
    nearest = np.clip(np.clip(mean, limit.lower, limit.upper), mean - play, mean + play)
    over = np.maximum(nearest - limit.upper, limit.lower - nearest) / magnitude(limit.lower, limit.upper)
    if over.max() <= ROUNDING:
        return
    segment, joint = (int(i) for i in np.unravel_index(int(np.argmax(over)), over.shape))
    value = float(nearest[segment, joint])
    raise Infeasible(
        f"the mean velocity of joint {joint} on segment {segment} breaks its limit",
        joint=joint,
        quantity="velocity",
        segment=segment,
        time=float(middles[segment]),
        bound=float((limit.upper if value > 0 else limit.lower)[segment, joint]),
        needed=value,
        certified=True,
    )
