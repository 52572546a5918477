"""The first stretch of the road: is the request complete, does the method honour it, what exactly is it held to."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .curves.options import Spaced
from .curves.spacing import Spacing, knots, shortest_turns
from .errors import InvalidRequest, Unsupported
from .feasibility import refuse_empty_boxes, refuse_hopeless
from .limits import Boundary, WaypointStates
from .method import Capabilities, Method
from .options import Options
from .paths import PathOptions
from .types import MIN_STEP, NO_STATE, Demands, Note, PlanRequest, altered

Array = NDArray[np.float64]

#: Waypoints closer than this, relative to their range, cannot be told apart.
SAME = 1e-12
#: A whole motion smaller than this underflows in its derivatives.
TINY = 1e-100
#: What may be asked at a waypoint.
_STATES = ("velocity", "acceleration")


@dataclass(frozen=True, eq=False)
class Asked:
    """A checked request, as the method gets it, and what its answer is held to.

    ``kept[i]`` is the index, among the request's waypoints, of the caller's waypoint i (merged ones share it);
    ``still``: nothing moves, so that every method's answer is the hold.
    """

    request: PlanRequest
    demands: Demands
    kept: NDArray[np.int64]
    still: bool
    notes: tuple[Note, ...]


def check(request: PlanRequest, method: Method, options: Options, methods: Iterable[Method]) -> Asked:
    """Check a request against what a method requires and honours.

    Raises
    ------
    Unsupported
        Something is asked that the method does not honour.
    InvalidRequest
        Something the method requires is missing, or what is given contradicts itself.
    Infeasible
        A waypoint, a state asked for or a mean velocity breaks a limit, so that nothing can help.
    """
    can, original = method.capabilities(options), request
    _refuse_unsupported(request, method, can, methods, options.control_points)
    _require(request, can)
    if request.segment_limits is not None or request.limits.position is not None:
        refuse_empty_boxes(request)
    _refuse_contradiction(request)
    spacing = options.spacing if isinstance(options, Spaced) else "centripetal"
    fixed = request.times is not None and can.timing == "given"
    if spacing != "centripetal" and (fixed or can.timing == "chosen"):
        raise InvalidRequest.of("/options/spacing", "conflict", "the times are known: nothing is left to be spread")
    notes = []
    if request.wrap is not None:
        turned = shortest_turns(request.waypoints, request.wrap)
        if (turned != request.waypoints).any():
            notes.append(Note("turns_added", "waypoints of joints that wrap were moved by whole turns to the nearest"))
        request = original = altered(request, waypoints=turned)
    extent = float((request.waypoints.max(axis=0) - request.waypoints.min(axis=0)).max())
    if 0 < extent < TINY:
        request = altered(request, waypoints=np.broadcast_to(request.waypoints[0], request.waypoints.shape).copy())
        extent = 0.0
        notes.append(Note("moves_snapped", f"all waypoints lie within {TINY:g} of one another and were made equal"))
    if request.times is None and not options.control_points and not options.fixes_knots:
        request, kept = _merged(request, extent)
        if len(request.waypoints) < len(kept):
            count = len(kept) - len(request.waypoints)
            notes.append(Note("waypoints_merged", f"{count} waypoint(s) equal to the one before were merged with it"))
    else:
        kept = np.arange(request.count)
    start, end = (_resolved(request, can, side) for side in ("start", "end"))
    given = request.start.given() or request.end.given() or request.waypoint_states is not None
    moving = bool(given) and (_moving(start) or _moving(end))
    still = not extent and not moving
    still = still and not options.moves_by_itself and not _moving_waypoints(request.waypoint_states)
    if still and options.model_fields_set:
        options.check(request.waypoints)
    if request.times is None and can.timing == "given":
        assert request.duration is not None  # _require saw to it
        if not still:
            request = altered(request, times=_spread(request, spacing))
            how = {"centripetal": "centripetally", "chord_length": "by chord length", "uniform": "uniformly"}[spacing]
            notes.append(Note("times_chosen", f"no times were given: spread {how} over the duration"))
    request = altered(request, start=start, end=end)
    times = request.times if can.timing == "given" else None
    timed = times is not None
    if timed or moving or _bounded_or_asked(request):
        refuse_hopeless(request, not options.control_points, timed)
    rounding = None if options.rounding is None else np.full(request.dims, options.rounding)
    demands = Demands(
        dims=request.dims,
        limits=request.limits,
        waypoints=None if options.control_points else original.waypoints,
        times=times if times is None or request.count == len(kept) else times[kept],
        segment_limits=original.segment_limits,
        segment_durations=original.segment_durations,
        duration=request.duration,
        start=start,
        end=end,
        waypoint_states=original.waypoint_states,
        waypoint_tolerance=original.waypoint_tolerance if rounding is None else rounding,
        tube=original.tube if rounding is None else rounding,
        closed=can.continuity if options.closed else 0,
    )
    return Asked(request, demands, kept, still, tuple(notes))


def _bounded_or_asked(request: PlanRequest) -> bool:
    """Return whether a position is limited, or a state asked at a waypoint, so that it may break a limit by itself.

    Rates are limited on both sides of zero: rest at the ends breaks none.
    """
    if request.segment_limits is not None or request.waypoint_states is not None:
        return True
    limits = request.limits
    each = [x for x in (limits.velocity, limits.acceleration, limits.jerk) if x is not None]
    return limits.position is not None or any((x.lower > 0).any() or (x.upper < 0).any() for x in each)


def asked_words(request: PlanRequest) -> set[str]:
    """Return the capability words that a request needs a method to honour."""
    words = set(request.limits.given())
    for each in request.segment_limits or ():
        words |= set() if each is None else {"segment_limits", *each.given()}
    for side in (request.start, request.end):
        words |= {f"boundary_{name}" for name in side.given()}
    plain = ("times", "segment_durations", "duration", "waypoint_states", "waypoint_tolerance", "tube", "robot")
    return words | {name for name in plain if getattr(request, name) is not None}


def _refuse_unsupported(
    request: PlanRequest, method: Method, can: Capabilities, methods: Iterable[Method], control_points: bool
) -> None:
    words = asked_words(request)
    refused = words - set(can.words)
    for side in ("start", "end"):
        taken: frozenset[str] = getattr(can, side)
        given = getattr(request, side).given()
        if given and can.with_jerk and not _jerk_limited(request).all():
            taken -= can.with_jerk
        refused |= {f"boundary_{name}" for name in given if name not in taken}
        if request.waypoint_states is None:
            continue
        rests = can.rests & set(_STATES)  # what is zero at the ends cannot be set there as a waypoint's state either
        refused |= {f"boundary_{n}" for n in rests if np.nan_to_num(_end_states(request, side)[n]).any()}
    if not refused:
        return
    what = ", ".join(sorted(refused))
    others = [m for m in methods if m.id != method.id]
    full = [m.id for m in others if m.honours(words)]
    along = [m.id for m in others if m.honours(words) and issubclass(m.options, PathOptions)]
    if control_points and can.timing == "parameter" and along:
        reason = f"{method.id} does not honour {what}: send the curve as the option path of a method that follows it"
        raise Unsupported(method.id, what, along, reason)
    raise Unsupported(method.id, what, full or [m.id for m in others if m.honours(refused)])


def _require(request: PlanRequest, can: Capabilities) -> None:
    duration = request.duration
    if "times" in can.requires and request.times is None and not (duration is not None and duration.exact):
        raise InvalidRequest.of("/times", "missing", "the method needs times (or a duration with min equal to max)")
    needed = [name for name in ("velocity", "acceleration", "jerk") if name in can.requires]
    moving = _moving_joints(request) if needed else np.empty(0)
    for quantity in needed:
        limit = getattr(request.limits, quantity)
        if limit is None:
            raise InvalidRequest.of(
                f"/limits/{quantity}",
                "missing",
                f"the method needs {'an' if quantity == 'acceleration' else 'a'} {quantity} limit",
            )
        lacking = moving & ~(np.isfinite(limit.lower) & np.isfinite(limit.upper))
        if lacking.any():
            reason = f"joint {int(np.argmax(lacking))} moves, so its {quantity} must be limited on both sides"
            raise InvalidRequest.of(f"/limits/{quantity}", "bad_limits", reason)
    if request.times is None:
        return
    span = float(request.times[-1] - request.times[0])
    if can.timing == "given" and duration is not None and not _within(span, duration.min, duration.max):
        raise InvalidRequest.of("/duration", "conflict", f"the times span {span:g} s")
    for i, bounds in enumerate(request.segment_durations or ()):
        step = float(request.times[i + 1] - request.times[i])
        if can.timing == "given" and bounds is not None and not _within(step, bounds.min, bounds.max):
            raise InvalidRequest.of(f"/segment_durations/{i}", "conflict", f"the times give the segment {step:g} s")


def _moving_joints(request: PlanRequest) -> NDArray[np.bool_]:
    moving = request.waypoints.min(axis=0) < request.waypoints.max(axis=0)
    for side in (request.start, request.end):
        for name in side.given():
            moving |= getattr(side, name) != 0
    if request.waypoint_states is not None:
        for name in _STATES:
            moving |= (np.nan_to_num(getattr(request.waypoint_states, name)) != 0).any(axis=0)
    return np.asarray(moving)


def _spread(request: PlanRequest, spacing: Spacing) -> Array:
    """Return times over the exact duration: the spacing's steps, stretched alike as far as segment durations allow."""
    assert request.duration is not None
    total, steps = request.duration.min, np.diff(knots(request.waypoints, spacing))
    bounds = request.segment_durations or [None] * len(steps)
    least = np.array([0.0 if b is None else b.min for b in bounds])
    most = np.array([np.inf if b is None else b.max for b in bounds])
    if not least.sum() <= total * (1 + 1e-9) or not most.sum() >= total * (1 - 1e-9):
        raise InvalidRequest.of("/segment_durations", "conflict", f"they cannot add up to the duration of {total:g} s")
    low, high = 0.0, max(total / steps.min(), 1.0)
    for _ in range(200):
        scale = 0.5 * (low + high)
        if np.clip(steps * scale, least, most).sum() < total:
            low = scale
        else:
            high = scale
    spread = np.clip(steps * high, least, most)
    times = np.concatenate([[0.0], np.cumsum(spread)])
    times[-1] = total
    if not (np.diff(times) >= MIN_STEP).all():
        raise InvalidRequest.of("/duration", "bad_duration", f"leaves less than {MIN_STEP:g} s to a segment")
    return times


def _within(value: float, low: float, high: float) -> bool:
    return low * (1 - 1e-9) <= value <= high * (1 + 1e-9)


def _merged(request: PlanRequest, extent: float) -> tuple[PlanRequest, NDArray[np.int64]]:
    """Merge consecutive waypoints that are equal (or closer than rounding) on segments that may take no time.

    ``extent``: the largest range of a joint, which rounding is relative to.
    """
    points = request.waypoints
    same = np.abs(points[1:] - points[:-1]).max(axis=1) <= SAME * extent
    if not same.any():
        return request, np.arange(request.count)
    for i, bounds in enumerate(request.segment_durations or ()):
        if bounds is not None and bounds.min > 0:
            same[i] = False
    states = request.waypoint_states
    if states is not None and same.any():
        same &= _compatible(request, same)
    keep = np.concatenate([[True], ~same])
    if keep[1:].any() and same[-1]:  # the ends stay exact: of a last run of equals the very last waypoint is kept
        keep[np.flatnonzero(keep)[-1]] = False
        keep[-1] = True
    kept = np.cumsum(np.concatenate([[True], ~same])) - 1
    if not keep[1:].any():
        keep[-1], kept[-1] = True, 1  # two waypoints remain, even where nothing moves
    segments = np.flatnonzero(~same) if (~same).any() else np.array([0])

    def shorter(entries: tuple[Any, ...] | None) -> tuple[Any, ...] | None:
        return None if entries is None else tuple(entries[i] for i in segments)

    if keep.all():
        return request, kept
    return altered(
        request,
        waypoints=points[keep],
        segment_limits=shorter(request.segment_limits),
        segment_durations=shorter(request.segment_durations),
        waypoint_states=None if states is None else _united(states, kept, int(keep.sum())),
    ), kept


def _compatible(request: PlanRequest, same: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which waypoints, (N - 1,), ask for no other state than the run of equal ones before them does."""
    states = request.waypoint_states
    assert states is not None
    asked = np.stack([getattr(states, name) for name in _STATES], axis=1)  # (N, 2, D)
    for side, index in (("start", 0), ("end", -1)):
        for m, name in enumerate(_STATES):
            given = getattr(getattr(request, side), name)
            asked[index, m] = asked[index, m] if given is None else given
    agree, run = np.ones(len(same), dtype=bool), asked[0]
    for i, row in enumerate(asked[1:]):
        agree[i] = not (same[i] and (run != row)[~np.isnan(run) & ~np.isnan(row)].any())
        run = np.where(np.isnan(row), run, row) if same[i] and agree[i] else row
    return agree


def _united(states: WaypointStates, kept: NDArray[np.int64], count: int) -> WaypointStates:
    """Return the states of the waypoints that remain: whatever one of those merged asks for."""
    united = {name: np.full((count, getattr(states, name).shape[1]), np.nan) for name in _STATES}
    for name, rows in united.items():
        for i, row in zip(kept, getattr(states, name), strict=True):
            rows[i] = np.where(np.isnan(rows[i]), row, rows[i])
    return WaypointStates(**united)


def _resolved(request: PlanRequest, can: Capabilities, side: str) -> Boundary:
    """Return the end state with the method's defaults filled in: zero where it takes or forces a derivative.

    What the states at waypoints ask of the first and the last one takes the place of a default, joint by joint.
    """
    given: Boundary = getattr(request, side)
    names, states = getattr(can, side) | can.rests, _end_states(request, side)
    if not states and not given.given() and not can.with_jerk:  # as is usual
        return Boundary(**dict.fromkeys(names, np.zeros(request.dims))) if names else NO_STATE
    moving = given.velocity is not None and bool(given.velocity.any())
    values = {}
    for name in names | states.keys():
        value = getattr(given, name)
        values[name] = np.zeros(request.dims) if value is None else value
        if value is None and name not in names:
            values[name] = np.full(request.dims, np.nan)
        elif value is None and name in can.with_jerk:  # zero along the path, which in a bend is not zero in the joints
            values[name] = np.where(_jerk_limited(request) & (not moving), 0.0, np.nan)
        if name in states:
            values[name] = np.where(np.isnan(states[name]), values[name], states[name])
    return Boundary(**{n: v for n, v in values.items() if not np.isnan(v).all()})


def _end_states(request: PlanRequest, side: str) -> dict[str, Array]:
    """Return what the states at waypoints ask of the first or the last one, by derivative; NaN for a free joint."""
    if request.waypoint_states is None:
        return {}
    index = 0 if side == "start" else -1
    return {name: getattr(request.waypoint_states, name)[index] for name in _STATES}


def _refuse_contradiction(request: PlanRequest) -> None:
    """Raise ``conflict`` where the state at the first or last waypoint is not the one given for that end."""
    for side, index in (("start", 0), ("end", request.count - 1)):
        for name, asked in _end_states(request, side).items():
            given = getattr(getattr(request, side), name)
            both = np.zeros(request.dims, dtype=bool) if given is None else ~np.isnan(asked) & ~np.isnan(given)
            if both.any() and (asked[both] != given[both]).any():
                joint = int(np.flatnonzero(both & (asked != given))[0])
                reason = f"/{side} asks joint {joint} for another {name} at the same waypoint"
                raise InvalidRequest.of(f"/waypoint_states/{index}/{name}", "conflict", reason)


def _moving_waypoints(states: WaypointStates | None) -> bool:
    return states is not None and any(np.nan_to_num(getattr(states, name)).any() for name in _STATES)


def _jerk_limited(request: PlanRequest) -> NDArray[np.bool_]:
    """Return which joints have a jerk limit on both sides, (D,)."""
    jerk = request.limits.bounds(3, request.dims)
    return np.asarray(np.isfinite(jerk.lower) & np.isfinite(jerk.upper))


def _moving(state: Boundary) -> bool:
    values = (getattr(state, name) for name in state.given())
    return any((np.abs(x) > 0).any() for x in values)
