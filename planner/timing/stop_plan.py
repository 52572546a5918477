"""The plan that stops at every waypoint, by the ruckig library: from state to state, as fast as the limits allow."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..deadline import Deadline
from ..errors import Infeasible, SolverFailed
from ..limits import Boundary, Limit, segment_bounds
from ..trajectory import Trajectory
from ..types import PlanRequest
from .state_to_state import Legs, joined, profiles, refuse_overshoot, shortest, slowed
from .stops import refuse_longer, segment_durations

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StopPlan:
    """The whole motion from time 0, when it passes the waypoints (N,), and what each segment asked for."""

    trajectory: Trajectory
    times: Array
    legs: Legs


def stop_plan(request: PlanRequest, deadline: Deadline) -> StopPlan:
    """Return time-optimal segments from waypoint to waypoint, at rest in between, as long as the durations ask.

    Raises
    ------
    Infeasible
        No motion from or to a state asked at an end, or none of the durations asked.
    SolverFailed
        ruckig finds no motion between two stops: a mix of scales that it does not take.
    """
    legs = stop_legs(request)
    rests, still = legs.rests, legs.still
    fastest, phases = profiles(legs, deadline)
    _refuse_failed(fastest, rests)
    asked = segment_durations(fastest, request)
    made = fastest.copy()
    longer = asked > fastest * (1.0 + 1e-12)
    scaled, again = longer & rests, np.flatnonzero(longer & ~rests)
    made[scaled] = asked[scaled]
    moving = scaled & ~still
    phases[moving] = slowed(phases[moving], asked[moving] / fastest[moving])
    if len(again):
        given = replace(legs, least=np.where(longer, asked, 0.0))
        made[again], phases[again] = profiles(given.chosen(again), deadline)
        _refuse_failed(made, rests)
    refuse_longer(made, asked, request)
    trajectory, times = joined(made, phases, legs.p0)
    refuse_overshoot(legs, phases)
    return StopPlan(trajectory, times, legs)


def stop_durations(request: PlanRequest) -> Array:
    """Return the segments' shortest durations with stops at all waypoints, (N - 1,); NaN where ruckig finds none."""
    return shortest(stop_legs(request))


def stop_legs(request: PlanRequest) -> Legs:
    """Return what lies between neighbouring waypoints: at rest at all but the ends of the whole."""
    count, dims = request.count - 1, request.dims
    limits = [segment_bounds(request.limits, request.segment_limits, m, count, dims) for m in (1, 2, 3)]
    loose = [Limit(np.nan_to_num(b.lower, neginf=-1e9), np.nan_to_num(b.upper, posinf=1e9)) for b in limits[:2]]
    states = np.zeros((2, request.count, dims))  # velocity, acceleration
    for index, boundary in ((0, request.start), (-1, request.end)):
        states[:, index] = _state(boundary, dims)
    return Legs(
        p0=request.waypoints[:-1],
        v0=states[0, :-1],
        a0=states[1, :-1],
        p1=request.waypoints[1:],
        v1=states[0, 1:],
        a1=states[1, 1:],
        velocity=loose[0],
        acceleration=loose[1],
        jerk=np.minimum(limits[2].upper, -limits[2].lower),
        least=np.zeros(count),
    )


def _state(boundary: Boundary, dims: int) -> Array:
    """Return velocity and acceleration, (2, D): zero where nothing is asked."""
    given = (boundary.velocity, boundary.acceleration)
    return np.array([np.zeros(dims) if x is None else np.nan_to_num(x) for x in given])


def two_sided_jerk(request: PlanRequest) -> bool:
    """Return whether a jerk limit has sides of different size, of which ruckig takes the smaller."""
    jerk = segment_bounds(request.limits, request.segment_limits, 3, request.count - 1, request.dims)
    return bool((jerk.lower != -jerk.upper).any())


def _refuse_failed(durations: Array, rests: NDArray[np.bool_]) -> None:
    for index in np.flatnonzero(np.isnan(durations)).tolist():
        if rests[index]:  # mixes of scales that ruckig does not take
            raise SolverFailed("ruckig", f"no motion was found on segment {index}")
        raise Infeasible(
            f"ruckig finds no motion within the limits from or to the state asked at the end of segment {index}",
            segment=index,
        )
