"""What goes in and what comes out: frozen dataclasses over NumPy arrays, checked on creation by their ``of``."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import reading
from .errors import FieldError, InvalidRequest
from .limits import Boundary, DurationBounds, Limits, WaypointStates, entries, positive
from .options import MAX_TIME
from .trajectory import Trajectory

Array = NDArray[np.float64]
T = TypeVar("T")

#: What is shared by all that ask for nothing.
NO_LIMITS, NO_STATE = Limits(), Boundary()
#: Shortest time between two waypoints, s; below it derivatives leave the range of floating point.
MIN_STEP = 1e-9
#: Largest relative violation of anything asked that may still be called kept.
TOLERANCE = 1e-6


def altered(record: T, **values: Any) -> T:
    """Return a frozen dataclass with other values: ``dataclasses.replace`` where nothing is derived from them."""
    made = object.__new__(type(record))
    vars(made).update(vars(record), **values)
    return made


@dataclass(frozen=True, eq=False)
class Sampling:
    """Where to sample: every ``dt`` seconds, ``count`` times evenly, or exactly at ``times``; default 200 samples."""

    dt: float | None = None
    count: int | None = None
    times: Array | None = None

    @classmethod
    def of(cls, value: Any, field: str = "/sampling") -> "Sampling":
        """Read one of ``{"dt"}``, ``{"count"}``, ``{"times"}``."""
        if isinstance(value, Sampling):
            return value
        value = reading.fields({} if value is None else value, field, ("dt", "count", "times"))
        given = [k for k in ("dt", "count", "times") if value.get(k) is not None]
        if len(given) > 1:
            raise InvalidRequest.of(field, "conflict", f"give one of {', '.join(given)}, not {len(given)}")
        if "dt" in given:
            dt = reading.number(value["dt"], f"{field}/dt", high=MAX_TIME)
            if dt <= 0:
                raise InvalidRequest.of(f"{field}/dt", "out_of_range", "must be > 0")
            return cls(dt=dt)
        if "times" in given:
            times = reading.vector(value["times"], f"{field}/times", largest=MAX_TIME)
            if not len(times):
                raise InvalidRequest.of(f"{field}/times", "too_few_points", "needs at least one time")
            return cls(times=reading.increasing(times, f"{field}/times"))
        count = reading.number(value["count"], f"{field}/count", high=np.inf) if given else 200
        if count < 2 or count != int(count):
            raise InvalidRequest.of(f"{field}/count", "out_of_range", "must be a whole number of at least 2")
        return cls(count=int(count))


@dataclass(frozen=True, eq=False)
class PlanRequest:
    """Waypoints, and what the trajectory through them must keep. Make it with ``PlanRequest.of``."""

    waypoints: Array
    times: Array | None = None
    limits: Limits = NO_LIMITS
    segment_limits: tuple[Limits | None, ...] | None = None
    segment_durations: tuple[DurationBounds | None, ...] | None = None
    duration: DurationBounds | None = None
    start: Boundary = NO_STATE
    end: Boundary = NO_STATE
    waypoint_states: WaypointStates | None = None
    waypoint_tolerance: Array | None = None
    tube: Array | None = None
    robot: Mapping[str, Any] | None = None
    wrap: NDArray[np.bool_] | None = None
    joint_names: tuple[str, ...] | None = None
    timeout: float | None = None
    bound: bool = False

    @property
    def dims(self) -> int:
        """Number of joints, D."""
        return int(self.waypoints.shape[1])

    @property
    def count(self) -> int:
        """Number of waypoints, N."""
        return len(self.waypoints)

    @classmethod
    def of(cls, waypoints: ArrayLike, **given: Any) -> "PlanRequest":
        """Read and check a request; the fields have the names and shapes of the HTTP contract (section 2).

        Parameters
        ----------
        waypoints : (N, D) or (N,) for one joint, N >= 2
        **given
            ``times`` (N,) s, ``limits``, ``segment_limits``, ``segment_durations``, ``duration``, ``start``, ``end``,
            ``waypoint_states``, ``waypoint_tolerance``, ``tube``, ``robot``, ``wrap`` (which joints turn without
            end: each waypoint is then reached by the shortest turn), ``joint_names``, ``timeout`` s, ``bound``
            (whether a closer lower bound is worth more time than the plan).

        Raises
        ------
        InvalidRequest
            With every finding: ``too_few_points``, ``shape_mismatch``, ``not_finite``, ``not_increasing``,
            ``bad_limits``, ``bad_duration``, ``out_of_range``, ``wrong_type``, ``unknown_field``.
        """
        unknown = sorted(given.keys() - _READERS.keys())
        if unknown:
            raise InvalidRequest([FieldError(f"/{k}", "unknown_field", "there is no such field") for k in unknown])
        points = reading.matrix(waypoints, "/waypoints")
        if points.size == 0 or len(points) < 2:
            raise InvalidRequest.of(
                "/waypoints", "too_few_points", "needs at least two waypoints of at least one joint"
            )
        n, dims = points.shape
        findings = reading.Findings()
        read: dict[str, Any] = {k: findings.take(_READERS[k], v, n, dims) for k, v in given.items() if v is not None}
        findings.close()
        return cls(points, **read)


def _times(value: Any, count: int) -> Array:
    times = reading.vector(value, "/times", count, MAX_TIME)
    steps = times[1:] - times[:-1]
    if not steps.min() >= MIN_STEP:
        reading.increasing(times, "/times")
        i = int(np.argmax(steps < MIN_STEP)) + 1
        raise InvalidRequest.of(f"/times/{i}", "out_of_range", f"must be {MIN_STEP:g} s after the time before it")
    return times


def _each(value: Any, count: int, field: str, reader: Any) -> tuple[Any, ...] | None:
    findings = reading.Findings()
    cells = enumerate(entries(value, count, field))
    read = tuple(None if e is None else findings.take(reader, e, f"{field}/{i}") for i, e in cells)
    findings.close()
    empty = all(e is None or (isinstance(e, Limits) and not e.given()) for e in read)
    return None if empty else read


def _half_width(value: Any, dims: int, field: str) -> Array:
    width = reading.per_joint(value, field, dims, np.nan)
    if not (width >= 0).all():
        raise InvalidRequest.of(field, "out_of_range", "must be >= 0 for every joint")
    return width


def _flags(value: Any, dims: int, field: str) -> NDArray[np.bool_]:
    flags = [value] * dims if isinstance(value, bool) else entries(value, dims, field)
    if not all(isinstance(f, (bool, np.bool_)) for f in flags):
        raise InvalidRequest.of(field, "wrong_type", "must be true or false, or one of them for every joint")
    return np.array(flags, dtype=bool)


def _names(value: Any, dims: int) -> tuple[str, ...]:
    names = tuple(entries(value, dims, "/joint_names"))
    if not all(isinstance(n, str) and 0 < len(n) <= 200 for n in names):
        raise InvalidRequest.of("/joint_names", "wrong_type", "must be strings of 1 to 200 characters")
    if len(set(names)) != dims:
        raise InvalidRequest.of("/joint_names", "conflict", "must differ from one another")
    return names


#: How each field of a request but the waypoints is read: from what is sent and the numbers of waypoints and joints.
_READERS: dict[str, Callable[[Any, int, int], Any]] = {
    "times": lambda v, n, dims: _times(v, n),
    "limits": lambda v, n, dims: Limits.of(v, dims),
    "segment_limits": lambda v, n, dims: _each(v, n - 1, "/segment_limits", lambda e, f: Limits.of(e, dims, f)),
    "segment_durations": lambda v, n, dims: _each(v, n - 1, "/segment_durations", DurationBounds.of),
    "duration": lambda v, n, dims: DurationBounds.of(v, "/duration"),
    "start": lambda v, n, dims: Boundary.of(v, dims, "/start"),
    "end": lambda v, n, dims: Boundary.of(v, dims, "/end"),
    "waypoint_states": lambda v, n, dims: WaypointStates.of(v, n, dims, "/waypoint_states"),
    "waypoint_tolerance": lambda v, n, dims: _half_width(v, dims, "/waypoint_tolerance"),
    "tube": lambda v, n, dims: _half_width(v, dims, "/tube"),
    "robot": lambda v, n, dims: v,
    "wrap": lambda v, n, dims: _flags(v, dims, "/wrap"),
    "joint_names": lambda v, n, dims: _names(v, dims),
    "timeout": lambda v, n, dims: positive(v, "/timeout"),
    "bound": lambda v, n, dims: bool(v),
}


@dataclass(frozen=True, eq=False)
class Demands:
    """What an answer is held to: the caller's request with its defaults resolved, and nothing of any method.

    ``closed``: the derivatives of order 1 to this at the end are to be those at the start.
    """

    dims: int
    limits: Limits = NO_LIMITS
    waypoints: Array | None = None
    times: Array | None = None
    segment_limits: tuple[Limits | None, ...] | None = None
    segment_durations: tuple[DurationBounds | None, ...] | None = None
    duration: DurationBounds | None = None
    start: Boundary = NO_STATE
    end: Boundary = NO_STATE
    waypoint_states: WaypointStates | None = None
    waypoint_tolerance: Array | None = None
    tube: Array | None = None
    closed: int = 0


@dataclass(frozen=True)
class Note:
    """Something assumed or repaired on the way, told in the answer's ``warnings``."""

    code: str
    message: str


@dataclass(frozen=True)
class Stats:
    """What ran: the back end's name, its status as a sentence or word, iterations, and seconds spent inside it."""

    name: str
    status: str = "solved"
    iterations: int = 1
    seconds: float = 0.0


@dataclass(frozen=True, eq=False)
class Followed:
    """The path a trajectory claims to follow: q(t) = curve(law(t)), law non-decreasing."""

    curve: Trajectory
    law: Trajectory


class Evidence(Protocol):
    """From which a lower bound is computed again, without trust in the solver that found it."""

    def lower_bound(self) -> float:
        """Return a value that no answer of the bound's scope can fall below."""


@runtime_checkable
class Optimality(Protocol):
    """Evidence that can also tell how well the conditions of an optimum are met, computed again by us."""

    def residuals(self) -> Mapping[str, float]:
        """Return the residuals ``primal``, ``dual`` and ``complementarity``."""


@dataclass(frozen=True)
class Minimised:
    """What a method minimised: the integral of the squared derivative of ``order``, plus a price of time.

    The value is the sum over the joints of the integral (none for order 0) + ``time_weight`` * duration.
    """

    name: str
    order: int
    time_weight: float = 0.0


@dataclass(frozen=True, eq=False)
class Bound:
    """A lower bound of the objective and for which set of answers it holds: ``all``, ``method`` or ``on_grid``."""

    scope: str
    evidence: Evidence


@dataclass(frozen=True, eq=False)
class Solution:
    """A method's answer, before anyone has checked it; ``minimised`` None: what its row of the table says.

    ``polyline``: whether the distance from the waypoints' polyline is to be told.
    """

    trajectory: Trajectory
    waypoint_times: Array | None
    stats: Stats
    path: Followed | None = None
    bound: Bound | None = None
    notes: tuple[Note, ...] = ()
    minimised: Minimised | None = None
    polyline: bool = False


@dataclass(frozen=True)
class Check:
    """One row of a certificate: the worst joint, segment and time of one quantity. None stands for unbounded."""

    quantity: str
    joint: int | None
    segment: int | None
    time: float | None
    value: float | None
    bound: float | None
    ratio: float | None
    holds: bool


@dataclass(frozen=True)
class Objective:
    """What the method minimised, its value, and how far from the lower bound it can be.

    ``kkt``: residuals ``primal``, ``dual`` and ``complementarity`` of the optimality conditions, where the bound's
    evidence can tell them.
    """

    name: str
    value: float
    lower_bound: float | None
    gap: float | None
    bound_scope: str | None
    kkt: Mapping[str, float] | None = None


@dataclass(frozen=True, eq=False)
class Certificate:
    """What verification found; ``holds`` only if every check does."""

    holds: bool
    basis: str
    checks: tuple[Check, ...]
    waypoint_error: float | None
    boundary_error: float | None
    continuity: int | None
    path_deviation: float | None
    cost: Mapping[str, float | None]
    peaks: Mapping[str, tuple[float | None, ...]]
    objective: Objective | None = None
