"""The pipeline: program, exact motion, check; other starts and the plan with stops where that fails; the best wins."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..deadline import Deadline
from ..errors import Infeasible, Unsupported
from ..limits import DurationBounds, Limit, segment_bounds
from ..timing.stop_plan import stop_durations, two_sided_jerk
from ..timing.stops import segment_bounds_of
from ..types import PlanRequest
from .candidates import KEPT, Answer, Program, exact, stopping
from .duration_bound import duration_bound
from .first_guess import passing, spline_durations, spline_start
from .lasting import lasting, not_smoothed, wished
from .program import solve
from .transcription import Case, asked_states, transcribe

Array = NDArray[np.float64]

#: By how much, relatively, limits next to states asked are loosened in the program, in turn: by what a state at a limit
#: needs, and one that leads up to it, on pieces that do not end where its acceleration does.
EASED = (4e-6, 0.03)
#: A state asked beyond this part of its limit leaves the program no room.
TIGHT = 1.0 - 1e-5
#: Largest size of durations, and of inverse limits.
HUGE = 1e70
#: A jerk beyond this many times what the shortest stop-to-stop segment's time asks for an acceleration saves no time.
JOLT = 1e6
#: Parts of the durations with stops to begin with.
STARTS = (0.75, 0.45, 1.2)
#: How much longer than the program's own shortest a smooth motion is at least, relatively.
SLACK = 1e-3


def fastest(request: PlanRequest, pieces: tuple[int, ...], smoothness: float, deadline: Deadline) -> Answer:
    """Return the fastest motion found, or one of least jerk where more time is asked or allowed.

    Parameters
    ----------
    request : PlanRequest
    pieces : tuple of int
        Pieces a segment; the best of the answers counts.
    smoothness : float
        Share of the shortest duration that is added and spent on least jerk.

    Raises
    ------
    Infeasible
        No motion was found, or none within the durations asked.
    """
    _refuse_too_short(request)
    stops = _scale(request)
    request = _within_reason(request, stops)
    if two_sided_jerk(request):  # which ruckig does not take, so that the program's own pieces count
        pieces = tuple(2 * count for count in pieces)
    case, program, answer = _shortest(request, stops, pieces, deadline)
    if request.duration is not None and answer.trajectory.duration > request.duration.max * (1.0 + KEPT):
        raise too_long(request, answer.trajectory.duration)
    shortest = answer.trajectory.duration
    wanted = wished(request, shortest, smoothness)
    if wanted <= shortest * (1.0 + 1e-12):
        return replace(answer, program=program)
    try:
        return replace(lasting(request, case, program, answer, wanted, deadline), program=program)
    except Unsupported:
        if wished(request, shortest, 0.0) > shortest * (1.0 + 1e-12):  # the duration was asked for
            raise
        return replace(answer, program=program, notes=(not_smoothed(wanted),))


def _shortest(
    request: PlanRequest, stops: Array, pieces: tuple[int, ...], deadline: Deadline
) -> tuple[Case, Program | None, Answer]:
    """Return the shortest motion, the program behind it, and the case that it came from."""
    best: Answer | None = None
    program: Program | None = None
    iterations = 0
    for eased in _easings(request):
        case = transcribe(request, stops, eased)
        for count in pieces:
            for durations in _starts(case, stops, program):
                deadline.left()
                problem = case.with_pieces(count, durations)
                found = solve(problem, spline_start(problem, durations), deadline=deadline)
                iterations += found.iterations
                answer = exact(request, case, problem, found, deadline)  # also of one that has come to no end
                if answer is not None and (best is None or answer.trajectory.duration < best.trajectory.duration):
                    best, program = answer, Program(problem, found) if found.solved else program
                if answer is not None and found.solved:
                    break
        if program is not None:
            break
    if best is None or best.trajectory.duration > stops.sum() * (1.0 - 1e-6):
        stops_too = stopping(request, deadline)
        if stops_too is not None and (best is None or stops_too.trajectory.duration < best.trajectory.duration):
            best, program = stops_too, None
    if best is None:
        raise _unfound(request, stops, pieces, deadline)
    return case, program, replace(best, stats=replace(best.stats, iterations=iterations))


def _easings(request: PlanRequest) -> tuple[float, ...]:
    """Return by how much to loosen limits next to states asked that move: not at first, unless one is at a limit."""
    asked = np.nan_to_num(np.stack(asked_states(request)))
    if not asked.any():
        return (0.0,)
    for order, states in enumerate(asked, 1):
        limit = segment_bounds(request.limits, request.segment_limits, order, request.count - 1, request.dims)
        for rows in (slice(None, -1), slice(1, None)):
            if ((states[rows] >= limit.upper * TIGHT) | (states[rows] <= limit.lower * TIGHT)).any():
                return (*EASED, 0.0)
    return (0.0, *EASED)


def _starts(case: Case, stops: Array, program: Program | None) -> Iterator[Array]:
    """Return durations (S,) to begin with, one after the other: those of an answer that is there come first."""
    rough = case.with_pieces(4, stops)
    if program is not None:
        yield program.found.spline.durations * (1.0 + SLACK)
    yield spline_durations(rough, STARTS[0] * stops)
    yield spline_durations(rough, np.minimum(STARTS[0] * stops, passing(case.problem)))
    for part in STARTS[1:]:
        yield spline_durations(rough, part * stops)


def _within_reason(request: PlanRequest, stops: Array) -> PlanRequest:
    """Return the request with jerk limits that rounding can bear: far more than what the motion has use for.

    Raises
    ------
    Unsupported
        ``precision``: limits so small, or so large, that products of them leave the range of floating point.
    """
    whole, count = request.limits, request.count - 1
    assert whole.jerk is not None and whole.acceleration is not None  # the method requires them
    size = np.abs(
        np.stack([segment_bounds(whole, request.segment_limits, m, count, request.dims).upper for m in (1, 2, 3)])
    )
    if not (stops.max() < HUGE and size.min() > 1.0 / HUGE):
        raise Unsupported("time_optimal_waypoints", "precision", reason="limits this small are beyond double precision")
    push = np.maximum(whole.acceleration.upper, -whole.acceleration.lower)
    cap = JOLT * np.where(np.isfinite(push), push, np.inf) / stops[stops > 0].min()
    jerk = Limit(np.maximum(whole.jerk.lower, -cap), np.minimum(whole.jerk.upper, cap))
    return replace(request, limits=replace(whole, jerk=jerk))


def _scale(request: PlanRequest) -> Array:
    """Return about how long the segments take with stops, (S,) s."""
    stops = stop_durations(request)
    unknown = ~np.isfinite(stops)
    if unknown.any():
        move = np.abs(np.diff(request.waypoints, axis=0))
        v, a, j = (
            segment_bounds(request.limits, request.segment_limits, m, request.count - 1, request.dims).upper
            for m in (1, 2, 3)
        )
        rough = np.where(move > 0, move / v + v / a + a / j, 0.0)
        stops = np.where(unknown, np.maximum(np.nan_to_num(rough).max(axis=1), 1e-6), stops)
    least, _ = segment_bounds_of(request)
    stops = np.maximum(stops, least)
    if (stops == 0.0).any() and stops.any():  # a loop from a waypoint to itself, with states that move
        stops = np.where(stops == 0.0, np.median(stops[stops > 0.0]), stops)
    return np.asarray(np.maximum(stops, 1e-9 * max(float(stops.max()), 1e-9)))


def too_long(request: PlanRequest, shortest: float) -> Infeasible:
    """Return what to say where the fastest motion takes longer than the whole may."""
    assert request.duration is not None
    least = duration_bound(replace(request, duration=None)).evidence.lower_bound()
    proven = least > request.duration.max * (1.0 + KEPT)
    return Infeasible(
        f"every motion takes at least {least:.9g} s" if proven else f"the fastest motion found takes {shortest:.9g} s",
        quantity="duration",
        bound=request.duration.max,
        needed=shortest,
        minimum_duration=shortest,
        certified=proven,
    )


def _refuse_too_short(request: PlanRequest) -> None:
    """Refuse durations of segments that the velocity limits alone exceed."""
    _, most = segment_bounds_of(request)
    limit = segment_bounds(request.limits, request.segment_limits, 1, request.count - 1, request.dims)
    move = np.diff(request.waypoints, axis=0)
    each = np.where(move > 0, move / limit.upper, move / limit.lower)
    quickest = each.max(axis=1)
    short = quickest > most * (1.0 + KEPT)
    if short.any():
        i = int(np.argmax(np.where(short, quickest - most, -np.inf)))
        raise Infeasible(
            f"the velocity limits alone need longer on segment {i}",
            joint=int(np.argmax(each[i])),
            quantity="segment_duration",
            segment=i,
            bound=float(most[i]),
            needed=float(quickest[i]),
            certified=True,
        )


def _unfound(request: PlanRequest, stops: Array, pieces: tuple[int, ...], deadline: Deadline) -> Infeasible:
    """Return what to say where neither the program nor stops give a motion."""
    least, most = segment_bounds_of(request)
    if not np.isfinite(most).any():
        return Infeasible("no motion was found that keeps the limits between the states asked")
    freed = replace(request, segment_durations=tuple(DurationBounds(float(x)) for x in least))
    _, _, answer = _shortest(freed, stops, pieces, deadline)
    steps = np.diff(answer.times)
    i = int(np.argmax(steps / most))
    return Infeasible(
        "no motion was found that keeps the longest durations of the segments",
        quantity="segment_duration",
        segment=i,
        bound=float(most[i]),
        needed=float(steps[i]),
    )
