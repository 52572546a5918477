"""Smoothest trajectories whose times are free: first the times, then the trajectory at those times."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from problems.free_times import Stationary
from problems.rest_to_rest import SegmentTimes

from ..deadline import Deadline
from ..errors import Infeasible, InvalidRequest, SolverFailed, Unsupported
from ..limits import QUANTITIES, Boundary, magnitude, segment_bounds
from ..solvers import select
from ..trajectory import Trajectory
from ..types import TOLERANCE, Bound, Minimised, PlanRequest, Solution, Stats
from .evidence import Optimum
from .free_times import FreeTimes, optimal_times
from .least_duration import optimal_times_within
from .minimum_jerk import ELIMINATION, Conflict, Smoothing, at_times

Array = NDArray[np.float64]

#: What a unit of time costs where nothing is limited and nothing else was asked.
TIME_WEIGHT = 1.0


def freely_timed(request: PlanRequest, how: Smoothing, time_weight: float | None, name: str) -> Solution:
    """Return the trajectory of least cost plus weight times duration, or (limits, no weight) of least duration.

    Of the motions at the times found, the smoothest within the limits is taken. ``name`` is what the cost is called.

    Raises
    ------
    Infeasible
        No times are found at which the limits can be kept; or a waypoint or end state breaks one (certified).
    InvalidRequest, SolverFailed, TimeLimit
    """
    deadline = Deadline(request.timeout)
    k, points = how.order, request.waypoints
    start, end = (_given(side, k, request.dims) for side in (request.start, request.end))
    bounds = [
        segment_bounds(request.limits, request.segment_limits, m, request.count - 1, request.dims) for m in range(4)
    ]
    lower, upper = (np.stack([getattr(b, side) for b in bounds]) for side in ("lower", "upper"))
    asked = (request.duration, request.segment_durations, deadline)
    limited = bool(np.isfinite(lower).any() or np.isfinite(upper).any())
    if how.backend == "ipopt" and not limited:
        raise InvalidRequest.of("/options/backend", "conflict", "ipopt is for free times within limits: there are none")
    _refuse_short(request, lower[1], upper[1])
    weight = time_weight if limited or time_weight is not None else TIME_WEIGHT
    if limited:
        backend = how.backend if how.backend == "ipopt" else "auto"
        found = optimal_times_within(points, k, start, end, lower, upper, weight, *asked, backend)
    else:
        assert weight is not None
        found = optimal_times(points, k, start, end, weight, *asked)
    minimised = Minimised("duration", 0, 1.0)
    if weight is not None:
        minimised = Minimised(f"{name}_plus_time", k, weight)
    times = np.concatenate([[0.0], np.cumsum(found.h)])
    if request.duration is not None and abs(times[-1] - request.duration.nearest(times[-1])) <= 1e-9 * times[-1]:
        times[-1] = request.duration.nearest(times[-1])
    bound = _slowest_joint(request, lower[1], upper[1]) if weight is None else None
    return _at(request, how, times, found, minimised, bound, (lower, upper), deadline)


def _slowest_joint(request: PlanRequest, lower: Array, upper: Array) -> Bound | None:
    """Return the bound that no joint covers a segment faster than at its largest velocity (S, D), or None."""
    step = np.diff(request.waypoints, axis=0)
    shortest = np.where(step > 0, step / upper, step / lower)
    least = np.array([0.0 if b is None else b.min for b in request.segment_durations or [None] * len(step)])
    total = 0.0 if request.duration is None else request.duration.min
    evidence = SegmentTimes(np.maximum(shortest, 0.0), least, total)
    return Bound("all", evidence) if evidence.lower_bound() > 0 else None


def _at(
    request: PlanRequest,
    how: Smoothing,
    times: Array,
    found: FreeTimes,
    minimised: Minimised,
    bound: Bound | None,
    sides: tuple[Array, Array],
    deadline: Deadline,
) -> Solution:
    """Return the smoothest trajectory at the times found; the one found with them where limits leave no other."""
    stats = Stats("free_times" if found.status == "optimal" else found.status, "solved", found.iterations)
    free = request.duration is None and request.segment_durations is None and minimised.order > 0
    fixed = replace(request, times=times, duration=None, segment_durations=None, timeout=deadline.left())
    backend = "auto" if how.backend == "ipopt" else how.backend
    try:
        inner = at_times(fixed, how, 1, select("qp", backend), deadline)
    except (Conflict, InvalidRequest, Unsupported, SolverFailed):
        trajectory = Trajectory.from_states(times, request.waypoints, np.ascontiguousarray(found.states))
        if not _keeps(trajectory, *sides):
            raise Infeasible(
                "no times are found at which the limits can be kept; that there are none is not proved"
            ) from None
        return Solution(trajectory, times, stats, bound=bound, minimised=minimised)
    if (
        free
        and inner.stats.name == ELIMINATION
        and inner.bound is not None
        and isinstance(inner.bound.evidence, Optimum)
    ):
        rates = np.stack([inner.trajectory(times, m) for m in range(1, how.order)])
        states = np.concatenate([request.waypoints[None], rates])
        evidence = Stationary(np.diff(times), states, minimised.time_weight, inner.bound.evidence.point)
        bound = Bound("method", evidence)
    return Solution(inner.trajectory, times, stats, bound=bound, minimised=minimised)


def _keeps(trajectory: Trajectory, lower: Array, upper: Array) -> bool:
    """Return whether the limits (4, M, D) of the gaps are kept, to what verification calls that."""
    found = trajectory.extrema(4)
    slack = TOLERANCE * magnitude(lower, upper)
    return bool((found.high <= upper + slack).all() and (found.low >= lower - slack).all())


def _refuse_short(request: PlanRequest, lower: Array, upper: Array) -> None:
    """Raise Infeasible where a segment, or the whole, may not take as long as its velocity limits need."""
    step = np.diff(request.waypoints, axis=0)
    least = np.maximum(np.where(step > 0, step / upper, step / lower), 0.0)  # (M, D)
    bounds = [np.inf if b is None else b.max for b in request.segment_durations or [None] * len(step)]
    for i, most in enumerate(bounds):
        joint = int(np.argmax(least[i]))
        if least[i, joint] > most * (1 + TOLERANCE):
            needed = float(np.abs(step[i, joint]) / most)
            raise Infeasible(
                f"joint {joint} cannot cover segment {i} within {most:g} s at its velocity limit",
                joint=joint,
                quantity="velocity",
                segment=i,
                bound=float((upper if step[i, joint] > 0 else lower)[i, joint]),
                needed=needed if step[i, joint] > 0 else -needed,
                minimum_duration=float(least[i, joint]),
                certified=True,
            )
    total = float(least.max(axis=1).sum())
    if request.duration is not None and total > request.duration.max * (1 + TOLERANCE):
        raise Infeasible(
            f"the velocity limits alone need {total:.6g} s",
            quantity="duration",
            bound=request.duration.max,
            minimum_duration=total,
            certified=True,
        )


def _given(side: Boundary, order: int, dims: int) -> Array:
    """Return the derivatives of order 1 … k-1 asked at an end, (k - 1, D); NaN where free."""
    free = np.full(dims, np.nan)
    values = [getattr(side, QUANTITIES[m]) for m in range(1, order)]
    return np.stack([free if v is None else v for v in values])
