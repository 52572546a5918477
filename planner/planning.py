"""The road: check, solve, verify. No branch on any method's name."""

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .bounds import minimised_by, objective
from .check import Asked, check
from .errors import InvalidRequest, NotVerified, TimeLimit, UnknownMethod, Unsupported
from .method import Method
from .methods import METHODS
from .options import Options, read_options
from .timing.stops import segment_durations
from .trajectory import Trajectory
from .types import TOLERANCE, Certificate, Note, PlanRequest, Solution, Stats, altered
from .verify import position_span, verify

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
    with np.errstate(all="ignore"):  # what overflows does not verify
        solution = hold(asked) if asked.still else _solve(row, asked.request, chosen)
        solved = time.perf_counter()
        if request.timeout is not None and solved - started > request.timeout:
            raise TimeLimit(request.timeout)
        times = None if chosen.control_points else solution.waypoint_times
        if times is not None and len(times) < len(asked.kept):
            times = times[asked.kept]
        certificate = verify(solution.trajectory, asked.demands, times, solution.path, solution.polyline)
    if request.timeout is not None and time.perf_counter() - started > request.timeout:
        raise TimeLimit(request.timeout)
    minimised = solution.minimised or row.minimises(chosen) or minimised_by(row.objective)
    judged = altered(certificate, objective=objective(minimised, solution.trajectory, certificate, solution.bound))
    if not certificate.holds:
        if (reason := beyond_precision(solution.trajectory, asked.request.waypoints)) is not None:
            raise Unsupported(row.id, "precision", reason=reason)
        raise NotVerified(row.id, asdict(judged))
    notes = asked.notes + solution.notes
    promised, found = row.capabilities(chosen).continuity, certificate.continuity
    if found is not None and found < promised:
        if found < 0:
            raise Unsupported(row.id, "precision", reason="rounding leaves a curve whose pieces do not meet")
        message = f"rounding leaves no more than class C{found} of the C{promised} of this method"
        notes += (Note("smoothness_lost", message),)
    done = time.perf_counter()
    inside = solution.stats.seconds  # 0: the method has no solver to tell apart, all of it is solving
    pose = max(solved - checked - inside, 0.0) if inside else 0.0
    return Plan(
        row.id,
        because,
        request,
        chosen,
        solution.trajectory,
        times,
        judged,
        solution.stats,
        notes,
        {"validate": checked - started, "pose": pose, "solve": solved - checked - pose, "verify": done - solved},
    )


def _solve(row: Method, request: PlanRequest, options: Options) -> Solution:
    try:
        return row.solve(request, options)
    except InvalidRequest as error:
        if error.errors[0].field:
            raise
        # no field of the caller's: a trajectory on the way was not one, which only extreme numbers bring about
        reason = f"the numbers of this request lead beyond double precision: {error.errors[0].reason}"
    except OverflowError as error:
        reason = f"the numbers of this request lead beyond double precision: {error}"
    raise Unsupported(row.id, "precision", reason=reason)


def pick(request: PlanRequest, method: str) -> tuple[Method, str | None]:
    """Return the method of that id; for ``auto`` the one that fits the times and limits, and why.

    ``auto``: times -> ``minimum_jerk``; velocity, acceleration and jerk limits -> ``time_optimal_waypoints``; an
    acceleration limit -> ``time_optimal_path``; otherwise the request must say more.
    """
    if method != "auto":
        if method not in METHODS:
            raise UnknownMethod(method, [*METHODS, "auto"])
        return METHODS[method], None
    limits = request.limits
    if request.times is not None:
        return METHODS["minimum_jerk"], "times were given"
    if limits.jerk is not None and limits.velocity is not None and limits.acceleration is not None:
        return METHODS["time_optimal_waypoints"], "no times, but velocity, acceleration and jerk limits were given"
    if limits.acceleration is not None:
        return METHODS["time_optimal_path"], "no times, but an acceleration limit was given"
    raise InvalidRequest.of("/limits/acceleration", "missing", "give times, or at least limits on acceleration")


def beyond_precision(trajectory: Trajectory, waypoints: Array) -> str | None:
    """Return why double precision cannot hold such a motion, or None: that is then no excuse."""
    extent = position_span(waypoints)
    span = max(extent, float(np.abs(waypoints).max()))
    shortest, latest = float(np.diff(trajectory.breaks).min()), float(np.abs(trajectory.breaks).max())
    if np.finfo(float).eps * latest > 1e-9 * shortest:
        return f"a phase of {shortest:.3g} s at {latest:.3g} s on the clock is beyond double precision: rescale"
    largest = float(np.abs(trajectory.coefficients).max())
    swing = float(np.abs(trajectory.coefficients[:-1]).max(initial=0.0))
    if largest > 1e8 * span or 64 * np.finfo(float).eps * swing > TOLERANCE * extent:
        return f"the curve leaves the waypoints' range by a factor of {swing / extent:.3g}, beyond double precision"
    return None


def hold(asked: Asked) -> Solution:
    """Return the answer where nothing moves: the position is held, for as long as times or durations ask."""
    request = asked.request
    given = np.zeros(request.count - 1) if request.times is None else np.diff(request.times)
    steps = segment_durations(given, request)
    times = np.concatenate([[0.0], np.cumsum(steps)])
    if request.times is not None:
        times = request.times if (steps == given).all() else request.times[0] + times
    trajectory = Trajectory.hold(request.waypoints[0], float(times[0]), float(times[-1]))
    return Solution(trajectory, times, Stats("hold", "nothing moves", 0))
