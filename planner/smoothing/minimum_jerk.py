"""Minimum acceleration, jerk or snap at fixed times: free by elimination, with limits by cutting planes.

The free optimum is the answer wherever it keeps the limits. Where one polynomial per gap cannot keep them, gaps are
divided before it is said that nothing does.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..deadline import Deadline
from ..errors import Infeasible, InvalidRequest, SolverFailed, Unsupported
from ..kernels.splines import hermite_states
from ..limits import norm_bounds
from ..solvers import Backend, select
from ..types import Bound, Note, PlanRequest, Solution, Stats
from .cones import fastest
from .evidence import Found, Optimum
from .infeasible import Search, explained
from .posing import Posed, given_states, joined, pose
from .rounds import TIGHTER, Cuts, Kept, NoPoint
from .within import kept

Array = NDArray[np.float64]

#: Neighbouring gaps with a smaller ratio leave too few digits for the elimination.
UNEVEN = 1e-6
#: Pieces per gap that are tried, one after the other, where the caller leaves it open.
PARTS = (1, 2, 4)
#: The name under which the optimum without limits is told.
ELIMINATION = "block_elimination"


@dataclass(frozen=True)
class Smoothing:
    """What is minimised and how: the derivative's order, ``fixed``, ``free`` or ``periodic`` ends, pieces per gap."""

    order: int = 3
    ends: str = "fixed"
    parts: int | None = None
    backend: str = "auto"


def smoothest(request: PlanRequest, how: Smoothing) -> Solution:
    """Return the smoothest trajectory through the waypoints at their times, within the limits.

    Raises
    ------
    InvalidRequest
        Times too uneven for double precision (``out_of_range``), periodic ends that differ (``not_periodic``), a back
        end that cannot do it (``conflict``).
    Unsupported
        Accelerations at waypoints with order 2, or times and ranges beyond double precision.
    Infeasible
        Nothing of this kind keeps a joint's limits at these times; certified where that is proved, with the smallest
        relaxation and the shortest duration.
    SolverFailed, TimeLimit
    """
    deadline = Deadline(request.timeout)
    _refuse(request, how)
    backends = select("qp", how.backend)
    tried = PARTS if how.parts is None else (how.parts,)
    for parts in tried:
        try:
            solution = at_times(request, how, parts, backends, deadline)
        except SolverFailed as failed:
            if parts == tried[-1]:
                raise Infeasible(
                    f"no motion within the limits is found ({failed}); that there is none is not proved"
                ) from None
            continue
        except Conflict as conflict:
            if how.backend != "auto" and not conflict.proof.proved:
                raise Infeasible(
                    f"{how.backend} finds no motion within the limits; that there is none is not proved"
                ) from None
            if parts == tried[-1]:
                search = Search(backends, deadline, parts, _at_rest(request, how))
                raise explained(conflict.posed, conflict.at, conflict.proof, search) from None
            continue
        if parts > 1 and how.parts is None:
            message = f"one polynomial per gap was not enough for the limits: every gap has {parts} of them"
            solution = replace(solution, notes=(*solution.notes, Note("sub_segments_used", message)))
        return solution
    raise AssertionError("nothing was tried")


class Conflict(Exception):
    """Limits that cannot be kept: the statements that broke any, which of them, and the proof."""

    def __init__(self, posed: tuple[Posed, ...], at: int, proof: NoPoint) -> None:
        super().__init__("conflict")
        self.posed, self.at, self.proof = posed, at, proof


def at_times(
    request: PlanRequest, how: Smoothing, parts: int, backends: Sequence[Backend], deadline: Deadline
) -> Solution:
    """Return the smoothest trajectory with so many polynomials per gap.

    Raises
    ------
    Conflict
        The limits cannot be kept, or no back end can.
    InvalidRequest, Unsupported, SolverFailed, TimeLimit
        As for ``smoothest``.
    """
    assert request.times is not None
    free = _spline(request, how) if parts == 1 else None
    try:
        whole = _from_free(pose(request, how.order, how.ends, parts, alike=True), free)
        broken = list(range(request.dims)) if how.backend != "auto" else _broken(whole)
        if not broken:
            found = [_free(whole)]
        elif whole.statement.bound:
            found = _each([whole], backends, deadline)
        else:
            _refuse_uneven(request.times)
            rest = [d for d in range(request.dims) if d not in broken]
            some = [_from_free(pose(request, how.order, how.ends, parts, broken), free)]
            try:
                found = [Found(some[0], kept(some[0], some[0].limits, None, backends[:1], deadline, giving=False))]
            except (NoPoint, SolverFailed):  # one by one, to see which
                some = [_from_free(pose(request, how.order, how.ends, parts, [d]), free) for d in broken]
                found = _each(some, backends, deadline)
            if rest:
                found.append(_free(_from_free(pose(request, how.order, how.ends, parts, rest, alike=True), free)))
    except SolverFailed:
        _refuse_uneven(request.times)  # where a Hessian is singular in double precision
        raise
    trajectory = joined([f.posed for f in found], [f.kept.y for f in found], request, parts)
    solved = [f.kept for f in found if f.kept.name != ELIMINATION]
    stats = Stats(ELIMINATION)
    if solved:
        stats = Stats(solved[0].name, "solved", sum(f.iterations for f in solved), sum(f.seconds for f in solved))
    gave = max(f.kept.gave for f in found)
    message = f"the limits leave no room: they are kept to {gave:g} of their sizes only"
    notes = (Note("limits_widened", message),) if gave > 0 else ()
    return Solution(trajectory, request.times, stats, bound=Bound("method", Optimum(tuple(found))), notes=notes)


def _free(posed: Posed) -> Found:
    """Return the optimum without limits, from which the unknowns count."""
    return Found(
        posed, Kept(np.zeros(posed.statement.size), np.zeros(0), posed.statement.program(), ELIMINATION, 1, 0.0)
    )


def _broken(posed: Posed) -> list[int]:
    """Return the joints that break a limit without being held to it; all of them where they are bound."""
    if not posed.limited:
        return []
    rows, worst = Cuts.of(posed, posed.limits, TIGHTER).at(np.zeros(posed.statement.size), 0.0, False)
    if posed.statement.bound:
        fast = posed.norm is not None and len(fastest(posed, posed.norm)[0]) > 0
        return list(posed.joints) if fast or worst > 0.0 else []
    if worst <= 0.0:
        return []
    return sorted({posed.limits.joints[c] for c in rows.place[1]})


def _each(posed: Sequence[Posed], backends: Sequence[Backend], deadline: Deadline) -> list[Found]:
    found: list[Found] = []
    for one in posed:
        try:
            found.append(Found(one, kept(one, one.limits, one.norm, backends, deadline)))
        except NoPoint as proof:
            raise Conflict(tuple(posed), len(found), proof) from None
    return found


def _from_free(posed: Posed, free: Array | None) -> Posed:
    """Return the statement with unknowns that count from the optimum without limits.

    That may be known by its node derivatives ``free`` (k - 1, N, D), in the request's units.
    """
    statement = posed.statement
    if not statement.size:
        return posed
    if free is None:
        once = posed.rebased(Cuts.of(posed, posed.limits, TIGHTER).free())
        return once.rebased(Cuts.of(once, posed.limits, TIGHTER).free())  # refined
    scale = posed.second ** np.arange(1, statement.order)[:, None] / posed.unit
    rates = free[:, :, list(posed.joints)] * scale[:, None]
    return posed.rebased(statement.unknowns(np.concatenate([np.zeros((1, *rates.shape[1:])), rates])))


def _spline(request: PlanRequest, how: Smoothing) -> Array | None:
    """Return the node derivatives (k - 1, N, D) of the optimum without limits, if only the ends' are given.

    Raises
    ------
    Unsupported
        Times so uneven that double precision cannot keep the derivatives continuous.
    """
    assert request.times is not None
    given = given_states(request, how.order, how.ends, 1)
    known = ~np.isnan(given)
    alike = (known == known[:, :, :1]).all()
    if how.ends == "periodic" or not known[0].all() or known[1:, 1:-1].any() or not alike:
        return None
    h, points = np.diff(request.times), np.ascontiguousarray(request.waypoints)
    states = np.empty((how.order - 1, *points.shape))
    ends = np.ascontiguousarray(np.nan_to_num(given[1:, [0, -1]]).transpose(1, 0, 2))
    fixed = np.ascontiguousarray(known[1:, [0, -1], 0].T)
    if not hermite_states(h, points - points[0], ends, fixed, states):
        raise Unsupported("minimum_jerk", "precision", reason="these times and ranges leave double precision")
    return states


def _refuse(request: PlanRequest, how: Smoothing) -> None:
    """Raise where the statement cannot say what is asked."""
    gap = np.abs(request.waypoints[-1] - request.waypoints[0])
    if how.ends == "periodic" and (gap > 1e-9 * np.maximum(np.ptp(request.waypoints, axis=0), 1e-300)).any():
        joint = int(np.argmax(gap))
        raise InvalidRequest.of("/waypoints", "not_periodic", f"joint {joint}: first and last waypoint must be equal")
    states = request.waypoint_states
    if how.ends == "periodic" and states is not None:
        for name in ("velocity", "acceleration"):
            values = getattr(states, name)
            if (np.abs(values[0] - values[-1]) > 0).any():
                reason = f"with periodic ends the {name} is the same at the first and the last waypoint"
                raise InvalidRequest.of("/waypoint_states", "conflict", reason)
    if how.order == 2 and states is not None and not np.isnan(states.acceleration).all():
        reason = "order 2 has no acceleration of its own at a waypoint: it may jump there; order 3 takes it"
        raise Unsupported("minimum_jerk", "waypoint_states", reason=reason)
    norms = norm_bounds(request.limits, request.segment_limits, request.count - 1)
    if np.isfinite(norms).any() and request.dims > 1 and how.backend not in ("auto", "clarabel"):
        reason = "the norm of the velocity is a second-order cone: clarabel takes it"
        raise InvalidRequest.of("/options/backend", "conflict", reason)


def _at_rest(request: PlanRequest, how: Smoothing) -> bool:
    """Return whether what is given stays given when the motion is slowed: no derivative other than zero."""
    given = [getattr(side, n) for side in (request.start, request.end) for n in side.given()]
    if request.waypoint_states is not None:
        given += [request.waypoint_states.velocity, request.waypoint_states.acceleration]
    return not any(np.nan_to_num(g).any() for g in given)


def _refuse_uneven(times: Array) -> None:
    gaps = np.diff(times)
    ratio = gaps[1:] / gaps[:-1]
    ratio = np.minimum(ratio, 1.0 / ratio)
    if len(ratio) and ratio.min() < UNEVEN:
        i = int(np.argmin(ratio)) + 1
        reason = (
            f"neighbouring gaps differ by a factor of {1.0 / ratio.min():.3g}; more than 1e6 cannot be solved safely"
        )
        raise InvalidRequest.of(f"/times/{i}", "out_of_range", reason)
