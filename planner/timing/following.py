"""From speeds along a path to a trajectory: split at corners, compose exactly, slow down until the limits hold."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import Infeasible, SolverFailed
from ..jumps import counted_jumps
from ..limits import Limits
from ..paths import Path, refuse_position_limits
from ..trajectory import Trajectory
from ..types import MIN_STEP, Followed, Note, PlanRequest, Solution, Stats
from .course import Course, State, courses
from .scaling import local_factors, norm_factor, slowdown, stretched

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Units:
    """Scales in which a stretch of path and its limits are near one.

    ``length`` (D,) of each joint, ``parameter`` about a gap between waypoints, ``second`` about the time for that;
    ``moving`` (D,) says which joints move at all.
    """

    length: Array
    parameter: float
    second: float
    moving: NDArray[np.bool_]

    @classmethod
    def of(cls, stretch: Trajectory, limits: Limits) -> "Units":
        """Return the scales of a stretch of path under limits."""
        found = stretch.extrema(1)
        length = found.high[0].max(axis=0) - found.low[0].min(axis=0)
        moving = length > 1e-14 * max(float(length.max()), 1e-300)
        parameter = stretch.duration / stretch.pieces
        second = float(local_factors(stretch, replace(limits, jerk=None)).max()) * parameter
        gap = stretch.extrema(2).peak(1) * parameter
        for order in (2, 3):  # a straight line has no curvature to tell how long a start from rest takes
            limit = limits.bounds(order, stretch.dims)
            second = max(second, float((gap / np.minimum(limit.upper, -limit.lower)).max()) ** (1.0 / order))
        if not np.isfinite(np.float64(second) ** 3):
            raise OverflowError("the limits are too small for this move")
        return cls(np.where(moving, length, 1.0), parameter, second if second > 0 else 1.0, moving)


@dataclass(frozen=True, eq=False)
class Timed:
    """A law s(t) that starts at time 0, the seconds spent in the solver, what it had to say, and its rounds."""

    law: Trajectory
    seconds: float
    notes: tuple[Note, ...] = ()
    rounds: int = 1


#: What a dwell takes of the whole motion: the path asks for one, nothing says how long.
DWELL = 1e-6

#: Between moving ends, which no slow-down leaves alone, limits may be passed by this in speed.
UNKEPT = 2e-7

#: Times one course, from its start to its end state.
TimeCourse = Callable[[Course], Timed]

REST: State = (0.0, 0.0)


def cut_at_corners(
    path: Path, request: PlanRequest, start: State = (0.0, 0.0), end: State = (0.0, 0.0)
) -> list[Course]:
    """Return the path's courses: cut where only a stop passes within finite acceleration (with a jerk limit: jerk).

    ``start``, ``end``: path speed and acceleration at the ends of the whole.

    Raises
    ------
    Infeasible
        The path leaves the position limits.
    """
    refuse_position_limits(path, request)
    limits = [request.limits, *(own for own in request.segment_limits or () if own is not None)]
    corners = _corners(path.curve, 2 if any(x.jerk is not None for x in limits) else 1)
    return courses(path, request, corners, start, end)


def follow(
    path: Path, request: PlanRequest, each: Sequence[Course], timed: Sequence[Timed | None], solver: str
) -> Solution:
    """Return the trajectory along the path by laws of its courses, one after the other (None: one that stands still).

    From rest to rest it is slowed (or sped up) until the exact extrema touch the limits, and further as the duration
    asks; a moving end would be changed by that.

    Raises
    ------
    Infeasible
        It takes longer than the duration allows, or breaks limits between moving ends.
    SolverFailed
        The laws do not fit together.
    """
    total = sum(t.law.duration for t in timed if t)
    dwell = max(DWELL * total, MIN_STEP)
    laws = [_still(c.curve.breaks, dwell) if t is None else t.law for c, t in zip(each, timed, strict=True)]
    notes = dict.fromkeys(note for t in timed if t for note in t.notes)
    law = in_a_row(laws)
    times = _reached(law, path.knots)
    trajectory = path.curve.compose(law)
    if each[0].start == each[-1].end == REST:
        needed = max(slowdown(trajectory, request, times).factor, norm_factor(trajectory, request, times), 1e-300)
        duration = stretched(needed * trajectory.duration, request.duration)
        factor = duration / trajectory.duration
        trajectory, law, times = trajectory.scaled(factor), law.scaled(factor), times * factor
    else:
        needed = max(slowdown(trajectory, request, times).factor, norm_factor(trajectory, request, times))
        if needed > 1.0 + UNKEPT:
            raise Infeasible(
                "no law with the velocities and accelerations asked at the ends was found within the limits; the best "
                f"found is {needed:.6g} times too fast somewhere: ask for less at the ends"
            )
        stretched(trajectory.duration, request.duration)
    if len(each) > 1:
        kind = "corner" if not any(c.jerk for c in each) else "corner or jump of curvature"
        message = f"the path has {len(each) - 1} {kind}(s); the motion stops at each"
        notes[Note("stops_at_corners", message)] = None
    return Solution(
        trajectory,
        times if path.passes else None,
        Stats(solver, "solved", sum(t.rounds for t in timed if t), sum(t.seconds for t in timed if t)),
        Followed(path.curve, law),
        notes=tuple(notes),
    )


def time_each(each: Sequence[Course], time_course: TimeCourse) -> list[Timed | None]:
    """Return the laws of the courses; None for those that stand still."""
    return [time_course(course) if course.moves else None for course in each]


def _still(breaks: Array, dwell: float) -> Trajectory:
    """Return the law that passes the breaks of a path that stands still, in the time of a dwell."""
    return Trajectory.from_hermite(dwell * (breaks - breaks[0]) / (breaks[-1] - breaks[0]), breaks[:, None])


def _corners(curve: Trajectory, order: int) -> Array:
    """Return the interior breaks at which a derivative of order 1 … ``order`` jumps."""
    if curve.pieces == 1:
        return np.empty(0)
    found = curve.extrema(order + 1)
    jumps = np.zeros(curve.pieces - 1, dtype=bool)
    for m in range(1, order + 1):
        jumps |= counted_jumps(curve, m, found.peak(m)).any(axis=1)
    return np.asarray(curve.breaks[1:-1][jumps])


def in_a_row(laws: Sequence[Trajectory]) -> Trajectory:
    """Return laws that each start at time 0 as one, each starting where the one before it ends."""
    starts = np.cumsum([0.0, *(law.duration for law in laws)])
    return Trajectory.concatenate([law.shifted(start) for law, start in zip(laws, starts, strict=False)])


def split(curve: Trajectory, corners: Array) -> list[Trajectory]:
    """Return the curve cut at some of its breaks."""
    cuts = np.concatenate([[0], np.searchsorted(curve.breaks, corners), [curve.pieces]])
    return [curve.part(int(a), int(b)) for a, b in zip(cuts[:-1], cuts[1:], strict=True)]


def _reached(law: Trajectory, knots: Array) -> Array:
    """Return when a law reaches the knots, which lie at its breaks' values."""
    left, right = (x[:, 0] for x in law.ends(0))
    values = np.append(left, right[-1])
    after = np.clip(np.searchsorted(values, knots), 1, len(values) - 1)
    index = np.where(knots - values[after - 1] <= values[after] - knots, after - 1, after)
    if np.abs(values[index] - knots).max() > 1e-9 * max(float(np.ptp(knots)), 1e-300):
        raise SolverFailed("timing", "a waypoint is not on the grid")
    return np.asarray(law.breaks[index])
