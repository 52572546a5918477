"""The lower bound of a request: no motion through its waypoints takes less."""

from dataclasses import dataclass

import numpy as np

from ..limits import segment_bounds
from ..timing.stops import segment_bounds_of
from ..types import Bound, Evidence, PlanRequest
from .bounds import LeastRuns


def duration_bound(request: PlanRequest) -> Bound:
    """Return evidence that holds for all motions, whatever their path."""
    count, dims = request.count - 1, request.dims
    limits = [segment_bounds(request.limits, request.segment_limits, m, count, dims) for m in (1, 2, 3)]
    least, _ = segment_bounds_of(request)
    floor = floor_of(request)
    states = np.zeros((2, 2, dims))
    for k, side in enumerate((request.start, request.end)):
        for m, given in enumerate((side.velocity, side.acceleration)):
            if given is not None:
                states[k, m] = given
    lower, upper = (np.stack([getattr(x, s) for x in limits]) for s in ("lower", "upper"))
    rests = not states[0].any(), not states[1].any()
    return Bound("all", LeastRuns(request.waypoints, lower, upper, least, floor, rests, states))


def floor_of(request: PlanRequest) -> float:
    """Return the least duration asked for the whole, s."""
    return 0.0 if request.duration is None else request.duration.min


def closer(proven: Bound, other: Bound, value: float) -> Bound:
    """Return the other bound where it says more and the value found does not disprove it."""
    low = other.evidence.lower_bound()
    return other if proven.evidence.lower_bound() < low <= value else proven


@dataclass(frozen=True, eq=False)
class LeastSum:
    """Evidence from parts that follow one another; ``floor``: least duration of the whole, s."""

    parts: tuple[Evidence, ...]
    floor: float

    def lower_bound(self) -> float:
        """Return the sum, s."""
        return max(sum(part.lower_bound() for part in self.parts), self.floor)
