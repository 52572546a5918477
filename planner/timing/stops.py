"""Durations of segments between stops: how much longer than their shortest they must be."""

import numpy as np
from numpy.typing import NDArray

from problems.rest_to_rest import SegmentTimes

from ..errors import Infeasible
from ..types import Bound, PlanRequest
from .scaling import stretched

Array = NDArray[np.float64]


def segment_bounds_of(request: PlanRequest) -> tuple[Array, Array]:
    """Return the least and largest duration asked for every segment, (N - 1,) each."""
    bounds = request.segment_durations or [None] * (request.count - 1)
    least = np.array([0.0 if b is None else b.min for b in bounds])
    return least, np.array([np.inf if b is None else b.max for b in bounds])


def segment_durations(shortest: Array, request: PlanRequest) -> Array:
    """Return durations that keep every bound, as short as possible; a longer total is shared in proportion.

    Parameters
    ----------
    shortest : (N - 1,)
        What each segment needs at least.

    Raises
    ------
    Infeasible
        A segment, or the whole, needs longer than it may take; or may not take as long as it must.
    """
    least, most = segment_bounds_of(request)
    for i in np.flatnonzero(shortest > most * (1.0 + 1e-9)):
        raise Infeasible(
            f"segment {i} takes at least {shortest[i]:.9g} s with stops at both ends",
            quantity="segment_duration",
            segment=int(i),
            bound=float(most[i]),
            needed=float(shortest[i]),
        )
    durations = np.minimum(np.maximum(shortest, least), most)
    total = stretched(float(durations.sum()), request.duration)
    if total > most.sum() * (1.0 + 1e-9):
        raise Infeasible(
            "the segments' longest durations add up to less than the whole must take",
            quantity="duration",
            bound=float(total),
            needed=float(most.sum()),
            certified=True,
        )
    for _ in range(len(durations)):  # those that reach their longest drop out, at least one a round
        missing = total - durations.sum()
        room = durations < most
        if missing <= 1e-15 * total or not room.any():
            break
        weight = np.where(room, np.maximum(durations, 1e-12 * total), 0.0)
        durations = np.minimum(durations + missing * weight / weight.sum(), most)
    return durations


def refuse_longer(made: Array, asked: Array, request: PlanRequest) -> None:
    """Refuse motions longer than asked: from or to a moving state, the durations that exist have gaps."""
    _, most = segment_bounds_of(request)
    longer = made > asked * (1.0 + 1e-9)
    total = np.inf if request.duration is None else request.duration.max * (1.0 + 1e-9)
    if not (longer & (made > most)).any() and not (longer.any() and made.sum() > total):
        return
    i = int(np.argmax(longer))
    raise Infeasible(
        f"there is no motion of {asked[i]:.9g} s on segment {i}; the next one takes {made[i]:.9g} s",
        quantity="segment_duration",
        segment=i,
        bound=float(asked[i]),
        needed=float(made[i]),
    )


def stops_bound(shortest: Array, request: PlanRequest) -> Bound:
    """Return the bound for stops at every waypoint, from the joints' own shortest times on each segment (N - 1, D)."""
    least, _ = segment_bounds_of(request)
    total = 0.0 if request.duration is None else request.duration.min
    return Bound("method", SegmentTimes(shortest, least, total))
