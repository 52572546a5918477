"""Longer than the shortest: where a duration is asked, or smoothness wished, the squared jerk is made least."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from problems.waypoint_timing import Spline

from ..deadline import Deadline
from ..errors import Infeasible, Unsupported
from ..limits import DurationBounds
from ..timing.scaling import stretched
from ..timing.stops import segment_bounds_of
from ..types import Note, PlanRequest, Stats
from .candidates import KEPT, Answer, Program, exact, keeps
from .first_guess import spline_start
from .program import solve
from .realisation import realise
from .transcription import Case, asked_states

Array = NDArray[np.float64]

#: Where the whole duration is given and the jerk is to be least: pieces a segment, and in how many parts the shortest
#: motion is lengthened to it, one try after the other; iterations of each.
EASED = ((12, 1), (12, 4), (32, 1))
GENTLE = 600
#: How near the least squared jerk, relatively.
EVEN = 1e-4


def wished(request: PlanRequest, shortest: float, smoothness: float) -> float:
    """Return the duration that is asked for: at least the shortest one; smoothness may not lead beyond a bound."""
    _, most = segment_bounds_of(request)
    longest = min(np.inf if request.duration is None else request.duration.max, float(most.sum()))
    return max(stretched(shortest, request.duration), min(shortest * (1.0 + smoothness), longest))


def not_smoothed(wanted: float) -> Note:
    """Return the note that a wish for smoothness came to nothing."""
    return Note("not_smoothed", f"no motion of {wanted:.9g} s was found: this is the shortest, without smoothness")


def lasting(
    request: PlanRequest, case: Case, program: Program | None, shortest: Answer, wanted: float, deadline: Deadline
) -> Answer:
    """Return the motion of that duration with the least squared jerk, each joint's relative to its limit."""
    factor = wanted / shortest.trajectory.duration
    _, most = segment_bounds_of(request)
    if most.sum() < wanted * (1.0 - KEPT):
        raise Infeasible(
            "the segments' longest durations add up to less than the whole must take",
            quantity="duration",
            bound=wanted,
            needed=float(most.sum()),
            certified=True,
        )
    iterations = shortest.stats.iterations
    close = program is not None and wanted < program.found.spline.durations.sum()  # fewer pieces are slower than that
    for count, parts in EASED[-1:] if close else EASED:
        eased = _eased(case, np.diff(shortest.times), count, wanted, parts, deadline)
        iterations += eased.found.iterations
        answer = exact(request, case, eased.problem, eased.found, deadline, own=True) if eased.found.solved else None
        if answer is not None:
            return replace(answer, stats=replace(answer.stats, iterations=iterations))
    slowed, times = shortest.trajectory.scaled(factor), shortest.times * factor
    if not np.nan_to_num(np.stack(asked_states(request))).any() and keeps(request, slowed, times):
        return Answer(slowed, times, shortest.stats)
    if close and program is not None:
        answer = _hardly_longer(request, case, program, np.diff(shortest.times), wanted, deadline)
        if answer is not None:
            return answer
    raise Unsupported("time_optimal_waypoints", "duration", reason=f"no motion of {wanted:.9g} s was found")


def _hardly_longer(
    request: PlanRequest, case: Case, program: Program, shortest: Array, wanted: float, deadline: Deadline
) -> Answer | None:
    """Return the motion by ruckig with durations between its shortest (S,) and the program's, None where it fails.

    Segments for which it finds none of that length keep the program's own.
    """
    longest, whole = program.found.spline.durations, np.zeros(len(shortest), dtype=bool)
    for _ in range(len(shortest)):
        room = np.where(whole, 0.0, longest - shortest)
        part = (wanted - shortest.sum() - (longest - shortest)[whole].sum()) / max(room.sum(), 1e-300)
        if not 0.0 <= part <= 1.0:
            return None
        planned = np.where(whole, longest, shortest + part * room)
        bounds = tuple(DurationBounds(float(x)) for x in planned)
        motion = realise(
            replace(request, segment_durations=bounds),
            case,
            program.problem.nodes,
            program.found.spline,
            False,
            deadline,
        )
        steps = np.diff(motion.times)
        longer = steps > planned * (1.0 + KEPT)
        if not longer.any():
            met = abs(motion.times[-1] - wanted) <= KEPT * wanted
            stats = Stats("interior_point", iterations=program.found.iterations)
            kept = met and keeps(request, motion.trajectory, motion.times)
            return Answer(motion.trajectory, motion.times, stats) if kept else None
        whole |= longer
    return None


def _eased(case: Case, durations: Array, count: int, wanted: float, parts: int, deadline: Deadline) -> Program:
    """Return the program of that whole duration and its answer, reached from durations (S,) in so many parts."""
    total = float(durations.sum())
    factor = (wanted / total) ** (1.0 / parts)
    start: Spline | None = None
    for k in range(1, parts + 1):
        deadline.left()
        durations = durations * factor
        problem = replace(case.with_pieces(count, durations), total=total * factor**k)
        if start is None:
            start = spline_start(problem, durations)
        else:
            start = Spline(durations, start.velocity / factor, start.acceleration / factor**2, start.control)
        found = solve(problem, start, EVEN, GENTLE, deadline=deadline)
        start, durations = found.spline, found.spline.durations
    return Program(problem, found)
