"""Straight from waypoint to waypoint: on each line the motion of one joint, its distance; a stop at every corner."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..deadline import Deadline
from ..errors import Infeasible, InvalidRequest, Unsupported
from ..limits import Boundary, DurationBounds, Limit, Limits, segment_bounds
from ..timing.scaling import stretched
from ..timing.stops import segment_bounds_of
from ..trajectory import Trajectory
from ..types import Bound, PlanRequest, Solution, Stats
from .admissible import refuse_inadmissible
from .candidates import Answer
from .duration_bound import LeastSum, duration_bound, floor_of
from .fastest import fastest, too_long
from .lasting import not_smoothed, wished

Array = NDArray[np.float64]

#: Waypoints this near a line, relative to their range, are on it; so are end states, relative to their size.
ON_LINE = 1e-12


@dataclass(frozen=True, eq=False)
class Line:
    """Waypoints ``first`` … ``last`` on the line  origin + s direction, and the request for s alone."""

    first: int
    last: int
    origin: Array
    direction: Array
    request: PlanRequest


def along_lines(request: PlanRequest, pieces: tuple[int, ...], smoothness: float, deadline: Deadline) -> Solution:
    """Return the fastest motion on the straight lines between the waypoints.

    Raises
    ------
    InvalidRequest
        ``bad_boundary``: a state asked at an end leads off the line there.
    Infeasible
        As ``fastest`` does.
    """
    lines = list(_lines(request))
    for line in lines:
        _refuse_leaving(line)
    answers = [_fastest(line.request, pieces, deadline) for line in lines]
    total = sum(a.trajectory.duration for a in answers)
    if request.duration is not None and total > request.duration.max * (1.0 + 1e-9):
        raise too_long(request, total)
    wanted = wished(request, total, smoothness)
    if wanted > total * (1.0 + 1e-12):
        each = [a.trajectory.duration for a in answers]
        seconds = _shared(wanted, np.array(each), np.array([segment_bounds_of(x.request)[1].sum() for x in lines]))
        try:
            answers = [
                _fastest(replace(line.request, duration=DurationBounds(s, s)), pieces, deadline)
                for line, s in zip(lines, seconds.tolist(), strict=True)
            ]
        except Unsupported:
            if wished(request, total, 0.0) > total * (1.0 + 1e-12):  # the duration was asked for
                raise
            answers[0] = replace(answers[0], notes=(not_smoothed(wanted),))
    bound = LeastSum(
        tuple(duration_bound(line.request).evidence for line in lines),
        floor_of(request),
    )
    trajectory, times = _joined(lines, answers)
    names = {a.stats.name for a in answers} - {"hold"}
    stats = Stats(
        names.pop() if len(names) == 1 else "interior_point", iterations=sum(a.stats.iterations for a in answers)
    )
    notes = tuple(dict.fromkeys(n for a in answers for n in a.notes))
    return Solution(trajectory, times, stats, bound=Bound("method", bound), notes=notes, polyline=True)


def _refuse_leaving(line: Line) -> None:
    """Refuse states at the ends that lead beyond the line, or the limits along it."""
    if not line.request.waypoints.any():
        return
    try:
        refuse_inadmissible(line.request)
    except Infeasible as error:
        reason = f"along the straight line, waypoints {line.first} to {line.last}: {error}"
        raise Infeasible(
            reason.replace(" of joint 0", ""), quantity=error.quantity, segment=line.first, certified=True
        ) from None


def _fastest(request: PlanRequest, pieces: tuple[int, ...], deadline: Deadline) -> Answer:
    if request.waypoints.any():
        return fastest(request, pieces, 0.0, deadline)
    seconds = stretched(float(segment_bounds_of(request)[0][0]), request.duration)
    return Answer(Trajectory.hold([0.0], 0.0, seconds), np.array([0.0, seconds]), Stats("hold", iterations=0))


def _shared(wanted: float, shortest: Array, longest: Array) -> Array:
    """Return durations of the lines that add up to ``wanted``: all longer by one factor, as far as each may be."""
    if longest.sum() < wanted * (1.0 - 1e-9):
        raise Infeasible(
            "the segments' longest durations add up to less than the whole must take",
            quantity="duration",
            bound=wanted,
            needed=float(longest.sum()),
            certified=True,
        )
    found = shortest.copy()
    for _ in range(len(shortest)):  # those that are as long as they may be drop out, at least one a round
        room = found < longest * (1.0 - 1e-12)
        if not room.any():
            break
        found = np.where(room, np.minimum(found * (wanted - found[~room].sum()) / found[room].sum(), longest), found)
    return found


def _joined(lines: list[Line], answers: list[Answer]) -> tuple[Trajectory, Array]:
    """Return the lines' motions one after the other in all joints, and when they pass the waypoints."""
    parts, times = [], [np.zeros(1)]
    for line, answer in zip(lines, answers, strict=True):
        start = times[-1][-1]
        motion = answer.trajectory
        breaks = start + motion.breaks
        powers = motion.powers() @ line.direction[None, :]
        powers[0] += line.origin
        if motion.duration > 0:
            parts.append(Trajectory.from_powers(breaks, powers))
        times.append(start + answer.times[1:])
    return Trajectory.concatenate(parts), np.concatenate(times)


def _lines(request: PlanRequest) -> Iterator[Line]:
    """Return the longest runs of segments in one direction; a segment without length, a rest, is one of its own."""
    points, last = request.waypoints, request.count - 1
    span = float(np.ptp(points, axis=0).max())
    first = 0
    while first < last:
        way = points[first + 1] - points[first]
        length = float(np.linalg.norm(way))
        if length == 0.0:
            yield Line(first, first + 1, points[first], np.zeros(len(way)), _at_rest(request, first))
            first += 1
            continue
        direction = way / length
        end = first + 1
        while end < last and (points[end + 1] - points[end]) @ direction > 0.0:
            if _off(points[end + 1] - points[first], direction) > ON_LINE * span:
                break
            end += 1
        yield Line(first, end, points[first], direction, _on_line(request, first, end, direction))
        first = end


def _at_rest(request: PlanRequest, first: int) -> PlanRequest:
    """Return the request for a segment without length."""
    for asked, side, here in ((request.start, "start", first == 0), (request.end, "end", first == request.count - 2)):
        for name in asked.given() if here else ():
            if np.nan_to_num(getattr(asked, name)).any():
                raise InvalidRequest.of(f"/{side}/{name}", "bad_boundary", "straight motion rests on this segment")
    bounds = request.segment_durations
    return PlanRequest(np.zeros((2, 1)), segment_durations=None if bounds is None else (bounds[first],))


def _off(way: Array, direction: Array) -> float:
    """Return the distance from the line."""
    return float(np.linalg.norm(way - (way @ direction) * direction))


def _on_line(request: PlanRequest, first: int, last: int, direction: Array) -> PlanRequest:
    """Return the request for the distance along the line alone."""
    count, dims = request.count - 1, request.dims
    limits = []
    along_line = ((request.waypoints[first : last + 1] - request.waypoints[first]) @ direction)[:, None]
    for order in range(4):
        limit = segment_bounds(request.limits, request.segment_limits, order, count, dims)
        low, high = limit.lower[first:last], limit.upper[first:last]
        if order == 0:
            low, high = low - request.waypoints[first], high - request.waypoints[first]
        along = np.abs(direction) > 1e-15
        a, b = low[:, along] / direction[along], high[:, along] / direction[along]
        least, most = np.minimum(a, b).max(axis=1, keepdims=True), np.maximum(a, b).min(axis=1, keepdims=True)
        if order == 0:  # not beyond the waypoints, either
            least, most = np.maximum(least, along_line[:-1]), np.minimum(most, along_line[1:])
        limits.append(Limit(least, most))
    names = ("position", "velocity", "acceleration", "jerk")
    whole: dict[str, Any] = {
        n: Limit(x.lower.min(axis=0), x.upper.max(axis=0)) for n, x in zip(names, limits, strict=True)
    }
    each: list[dict[str, Any]] = [
        {n: Limit(x.lower[i], x.upper[i]) for n, x in zip(names, limits, strict=True)} for i in range(last - first)
    ]
    bounds = request.segment_durations
    return PlanRequest(
        waypoints=along_line,
        limits=Limits(**whole),
        segment_limits=tuple(Limits(**e) for e in each),
        segment_durations=None if bounds is None else tuple(bounds[first:last]),
        start=_state(request.start if first == 0 else Boundary(), direction, "start"),
        end=_state(request.end if last == count else Boundary(), direction, "end"),
    )


def _state(asked: Boundary, direction: Array, side: str) -> Boundary:
    """Return the state along the line."""
    found = {}
    for name in asked.given():
        value = np.nan_to_num(getattr(asked, name))
        if _off(value, direction) > 1e-9 * float(np.linalg.norm(value)):
            reason = f"straight motion cannot have this {name}: it leads off the line to the nearest waypoint"
            raise InvalidRequest.of(f"/{side}/{name}", "bad_boundary", reason)
        found[name] = np.array([value @ direction])
    return Boundary(**found)
