"""The road: check, solve, verify. No branch on any method's name."""

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .bounds import objective
from .check import Asked, check
from .errors import Infeasible, InvalidRequest, NotVerified, TimeLimit, UnknownMethod
from .method import Method
from .methods import METHODS
from .options import Options, read_options
from .trajectory import Trajectory
from .types import Certificate, Note, PlanRequest, Solution, Stats
from .verify import verify

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Plan:
    """A certified trajectory, where it came from, and the seconds spent on each stretch of the road."""

    method: str
    picked_because: str | None
    request: PlanRequest
    options: Options
    trajectory: Trajectory
    waypoint_times: Array | None
    certificate: Certificate
    stats: Stats
    notes: tuple[Note, ...]
    seconds: Mapping[str, float]


def plan(request: PlanRequest, method: str = "auto", options: Options | Mapping[str, Any] | None = None) -> Plan:
    """Plan a trajectory through the waypoints and certify it.

    Parameters
    ----------
    request : PlanRequest
    method : str
        An id of the catalogue, or ``auto`` (see ``pick``).
    options : mapping or Options
        The method's options; defaults are filled in.

    Raises
    ------
    InvalidRequest, UnknownMethod, Unsupported
        What was asked is not valid, or not honoured by the method.
    Infeasible
        Nothing of the method's kind keeps what was asked.
    SolverFailed, TimeLimit, NotVerified
        No answer that passes verification was found; none is returned.
    """
    started = time.perf_counter()
    row, because = pick(request, method)
    chosen = read_options(row.options, dict(options) if isinstance(options, Mapping) else options)
    asked = check(request, row, chosen, METHODS.values())
    checked = time.perf_counter()
    solution = hold(asked) if asked.still else row.solve(asked.request, chosen)
    solved = time.perf_counter()
    if request.timeout is not None and solved - started > request.timeout:
        raise TimeLimit(request.timeout)
    times = None if solution.waypoint_times is None else solution.waypoint_times[asked.kept]
    certificate = verify(solution.trajectory, asked.demands, times, solution.path)
    name = row.objective
    judged = replace(certificate, objective=objective(name, certificate, solution.trajectory.duration, solution.bound))
    if not certificate.holds:
        raise NotVerified(row.id, asdict(judged))
    done = time.perf_counter()
    pose = max(solved - checked - solution.stats.seconds, 0.0)
    return Plan(
        row.id,
        because,
        request,
        chosen,
        solution.trajectory,
        times,
        judged,
        solution.stats,
        asked.notes + solution.notes,
        {"validate": checked - started, "pose": pose, "solve": solved - checked - pose, "verify": done - solved},
    )


def pick(request: PlanRequest, method: str) -> tuple[Method, str | None]:
    """Return the method of that id; for ``auto`` the one that fits the times and limits, and why.

    ``auto``: times -> ``minimum_jerk``; velocity, acceleration and jerk limits -> ``ruckig``; an acceleration limit ->
    ``toppra``; otherwise the request must say more.
    """
    if method != "auto":
        if method not in METHODS:
            raise UnknownMethod(method, [*METHODS, "auto"])
        return METHODS[method], None
    limits = request.limits
    if request.times is not None:
        return METHODS["minimum_jerk"], "times were given"
    if limits.jerk is not None and limits.velocity is not None and limits.acceleration is not None:
        return METHODS["ruckig"], "no times, but velocity, acceleration and jerk limits were given"
    if limits.jerk is None and limits.acceleration is not None:
        return METHODS["toppra"], "no times, but an acceleration limit was given"
    missing = "/limits/acceleration" if limits.acceleration is None else "/limits/velocity"
    raise InvalidRequest.of(missing, "missing", "give times, or limits on acceleration or on velocity to jerk")


def hold(asked: Asked) -> Solution:
    """Return the answer where nothing moves: the position is held, for as long as times or durations ask."""
    request = asked.request
    if request.times is not None:
        times = request.times
    else:
        least = [0.0 if b is None else b.min for b in request.segment_durations or [None] * (request.count - 1)]
        times = np.concatenate([[0.0], np.cumsum(least)])
        if request.duration is not None:
            if times[-1] > request.duration.max:
                raise Infeasible(
                    "the segments' minimum durations add up to more than the duration allows",
                    quantity="duration",
                    bound=request.duration.max,
                    needed=float(times[-1]),
                    minimum_duration=float(times[-1]),
                    certified=True,
                )
            times[-1] = max(times[-1], request.duration.min)
    trajectory = Trajectory.hold(request.waypoints[0], float(times[0]), float(times[-1]))
    return Solution(trajectory, times, Stats("hold", "nothing moves", 0))
