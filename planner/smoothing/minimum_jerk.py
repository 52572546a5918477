"""Minimum jerk at fixed times: free by elimination, with limits by cutting planes at the exact extrema.

The free optimum is the answer wherever it keeps the limits. Otherwise a row is added at each extremum that breaks one
and the quadratic program is solved again, until none does: limits then hold at all times, not at samples. All of it in
units in which the median gap and each joint's range are one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from problems.banded_qp import BandedQP, DualPoint
from problems.minimum_jerk import MinimumJerk

from ..deadline import Deadline
from ..errors import Infeasible, InvalidRequest, SolverFailed
from ..limits import magnitude, segment_bounds
from ..solvers import Backend, select
from ..solvers.qp import solve_qp
from ..trajectory import Trajectory
from ..types import Bound, PlanRequest, Solution, Stats
from .cuts import Cuts, JointBounds
from .elastic import least_relaxation

Array = NDArray[np.float64]

#: Neighbouring gaps with a smaller ratio leave too few digits for the elimination.
UNEVEN = 1e-6
ROUNDS = 40
#: Most gaps for which the smallest relaxation is looked for.
EXPLAINED = 60


def minimum_jerk(request: PlanRequest, backend: str) -> Solution:
    """Return the minimum-jerk trajectory through the waypoints at their times, within the limits.

    Raises
    ------
    InvalidRequest
        Times too uneven for double precision (``out_of_range``).
    Infeasible
        One quintic per gap cannot keep a joint's limits at these times; certified, with the smallest relaxation.
    TimeLimit
    """
    assert request.times is not None
    deadline = Deadline(request.timeout)
    gaps = np.diff(request.times)
    _refuse_uneven(gaps)
    second = float(np.median(gaps))
    unit = np.ptp(request.waypoints, axis=0)
    unit = np.where(unit > 0, unit, max(float(unit.max()), 1.0))
    problem = _statement(request, gaps / second, second, unit)
    programs = [problem.joint(d) for d in range(request.dims)]
    solved = [_Joint(p.free_minimum() if len(p.gradient) else np.zeros(0), np.zeros(0), p) for p in programs]
    stats = Stats("block_elimination")
    free = _trajectory(request, problem, solved, second, unit)
    for d in (int(i) for i in np.flatnonzero(_broken(free, request) | (backend != "auto"))):
        cuts = Cuts(problem.only(d), d, _joint_bounds(request, d, second, unit[d]))
        solved[d], name, rounds, seconds = _within_limits(cuts, backend, deadline)
        before = stats.iterations if stats.name != "block_elimination" else 0
        stats = Stats(name, "solved", before + rounds, stats.seconds + seconds)
    evidence = DualPoint(tuple(s.program for s in solved), tuple(s.z for s in solved), unit**2 / second**5)
    trajectory = _trajectory(request, problem, solved, second, unit)
    return Solution(trajectory, request.times, stats, bound=Bound("method", evidence))


@dataclass(frozen=True, eq=False)
class _Joint:
    """One joint's node states and multipliers, and the program (with the limits as asked) they belong to."""

    y: Array
    z: Array
    program: BandedQP


def _trajectory(
    request: PlanRequest, problem: MinimumJerk, solved: Sequence[_Joint], second: float, unit: Array
) -> Trajectory:
    """Return the joints' node states as the trajectory in the caller's units."""
    assert request.times is not None
    velocity, acceleration = problem.states(np.stack([s.y for s in solved], axis=1))
    return Trajectory.from_hermite(
        request.times, request.waypoints, velocity * unit / second, acceleration * unit / second**2
    )


def _broken(trajectory: Trajectory, request: PlanRequest) -> NDArray[np.bool_]:
    """Return which joints break a limit by more than rounding, (D,)."""
    found = trajectory.extrema(4)
    broken = np.zeros(request.dims, dtype=bool)
    for order in range(4):
        limit = segment_bounds(request.limits, request.segment_limits, order, request.count - 1, request.dims)
        slack = 1e-12 * magnitude(limit.lower, limit.upper)
        over = (found.high[order] > limit.upper + slack) | (found.low[order] < limit.lower - slack)
        broken |= over.any(axis=0)
    return broken


def _refuse_uneven(gaps: Array) -> None:
    ratio = gaps[1:] / gaps[:-1]
    ratio = np.minimum(ratio, 1.0 / ratio)
    if len(ratio) and ratio.min() < UNEVEN:
        i = int(np.argmin(ratio)) + 1
        reason = (
            f"neighbouring gaps differ by a factor of {1.0 / ratio.min():.3g}; more than 1e6 cannot be solved safely"
        )
        raise InvalidRequest.of(f"/times/{i}", "out_of_range", reason)


def _statement(request: PlanRequest, h: Array, second: float, unit: Array) -> MinimumJerk:
    zero = np.zeros(request.dims)
    rates = [
        [zero if v is None else np.asarray(v) * second**m / unit for m, v in ((1, b.velocity), (2, b.acceleration))]
        for b in (request.start, request.end)
    ]
    # positions relative to the first waypoint: only steps matter, and none of their digits is lost
    return MinimumJerk(h, (request.waypoints - request.waypoints[0]) / unit, np.stack(rates[0]), np.stack(rates[1]))


def _joint_bounds(request: PlanRequest, joint: int, second: float, unit: float) -> JointBounds:
    lower, upper = np.zeros((4, request.count - 1)), np.zeros((4, request.count - 1))
    for order in range(4):
        limit = segment_bounds(request.limits, request.segment_limits, order, request.count - 1, request.dims)
        offset = request.waypoints[0, joint] if order == 0 else 0.0
        lower[order] = (limit.lower[:, joint] - offset) * second**order / unit
        upper[order] = (limit.upper[:, joint] - offset) * second**order / unit
    assert request.times is not None
    units = np.array([unit / second**m for m in range(4)])
    return JointBounds(lower, upper, units, float(request.waypoints[0, joint]), request.times)


def _within_limits(cuts: Cuts, backend: str, deadline: Deadline) -> tuple[_Joint, str, int, float]:
    """Return the joint's optimum within its limits, the back end's name, the rounds and the seconds in the solver.

    Limits are first tightened by 1e-7 so that the answer keeps them strictly; where that alone makes the program
    infeasible, they are kept to rounding. A failure is explained by the smallest relaxation, where that can be found.

    Raises
    ------
    Infeasible
        Certified if the relaxation proves it; otherwise no solver found a motion, and neither was it proved.
    """
    chosen = select("qp", backend)
    attempts = [(cuts, b) for b in chosen]
    try:
        return _rounds(*attempts[0], deadline)
    except SolverFailed:
        relaxation_known = _explain(cuts, deadline)
    if relaxation_known:
        attempts.insert(1, (cuts.exact(), chosen[0]))
        for attempt in attempts[1:]:
            try:
                return _rounds(*attempt, deadline)
            except SolverFailed:
                continue
    raise Infeasible(
        f"no solver finds a motion of one quintic per gap within the limits of joint {cuts.joint} at these times; "
        "that none exists is not proved",
        joint=cuts.joint,
    )


def _explain(cuts: Cuts, deadline: Deadline) -> bool:
    """Raise Infeasible where that is proved; return whether the limits were found to be possible.

    Above ``EXPLAINED`` gaps the linear programs take too long: then only a mean speed beyond its limit is a proof.
    """
    if len(cuts.problem.h) > EXPLAINED:
        _refuse_mean_speed(cuts)
        return True
    try:
        least_relaxation(cuts, deadline)
    except SolverFailed:
        return False
    return True


def _refuse_mean_speed(cuts: Cuts) -> None:
    """Raise Infeasible where the mean velocity of a gap breaks its limit: somewhere the velocity takes that value."""
    mean = np.diff(cuts.problem.positions[:, 0]) / cuts.problem.h
    over = np.maximum(mean - cuts.bounds.upper[1], cuts.bounds.lower[1] - mean)
    gap = int(np.argmax(over))
    if over[gap] > 1e-9 * cuts.scale()[1, gap]:
        bound = float((cuts.bounds.upper if mean[gap] > 0 else cuts.bounds.lower)[1, gap])
        raise Infeasible(
            f"the mean velocity of joint {cuts.joint} on segment {gap} breaks its limit",
            joint=cuts.joint,
            quantity="velocity",
            segment=gap,
            time=cuts.bounds.clock(gap, 0.5),
            bound=cuts.bounds.physical(1, bound),
            certified=True,
        )


def _rounds(cuts: Cuts, backend: Backend, deadline: Deadline) -> tuple[_Joint, str, int, float]:
    program = cuts.program([], tightened=True)
    y = program.free_minimum() if len(program.gradient) else np.zeros(0)
    rows: Sequence[tuple[int, float, int, int]] = []
    z, seconds, iterations = np.zeros(0), 0.0, 0
    for _ in range(ROUNDS):
        found = cuts.new_rows(y)
        if rows and not found:
            return _Joint(y, z, cuts.program(rows, tightened=False)), backend.name, iterations, seconds
        if not len(y):
            raise SolverFailed(backend.name, "nothing is free")
        rows = [*rows, *found]
        answer = solve_qp(cuts.program(rows, tightened=True), backend, deadline.left())
        y, z = answer.y, answer.z
        seconds, iterations = seconds + answer.seconds, iterations + max(answer.iterations, 1)
        if not found:
            return _Joint(y, z, cuts.program(rows, tightened=False)), backend.name, iterations, seconds
    raise SolverFailed(backend.name, f"limits still broken after {ROUNDS} rounds")
