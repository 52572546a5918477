"""Retime anyone's trajectory: its geometric path, run through as fast as the limits allow."""

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .certification import Recorded
from .check import SAME
from .curves import cubic_spline, knots
from .deadline import Deadline
from .errors import FieldError, Infeasible, InvalidRequest, PlannerError, TimeLimit, Unsupported
from .fitting import smoothed
from .limits import Limits
from .planning import Plan, plan
from .reading import number
from .trajectory import Trajectory
from .types import TOLERANCE, Check, Note, PlanRequest

Array = NDArray[np.float64]

#: Times a path, and follows one that this refuses.
USUAL, SECOND = "time_optimal_path", "time_optimal_nlp"
#: Slower than this, relative to the fastest sample, a velocity is a stop: it has no direction.
STOPPED = 1e-3
#: Positions of at most so many decimals are looked at for being rounded; in a dense record most of whose highest
#: differences that the limits see are below so many units of the last one, the path is mostly rounding. (Measured: at 5
#: units the timing is up to 12 % slower than along the path itself, at 2 it takes 1.4 to 6 times as long.)
DECIMALS, UNITS, DENSE = 9, 8.0, 50


@dataclass(frozen=True, eq=False)
class _Route:
    """A path to be timed.

    The points (N, D) that are passed, and the curve with its parameter values ``at`` (N,) there (without: the default
    spline); ``kept[i]``: which point is the caller's sample i; ``check``: how near the samples the path comes;
    ``rests``: the curve is the caller's own motion, at rest at both ends.
    """

    points: Array
    curve: Trajectory | None = None
    at: Array | None = None
    notes: tuple[Note, ...] = ()
    kept: NDArray[np.int64] | None = None
    check: Check | None = None
    rests: bool = False

    def options(self) -> dict[str, Any]:
        """Return the options of a path method that follow the curve."""
        if self.curve is None or self.at is None:
            return {}
        curve, weights = self.curve, self.curve.weight_powers()
        polynomial = {"breaks": curve.breaks.tolist(), "coefficients": curve.powers().tolist()}
        if weights is not None:
            polynomial["weights"] = weights.tolist()
        return {"path": {"polynomial": polynomial, "knots": self.at.tolist()}}


def retime(
    trajectory: Trajectory | Recorded,
    *,
    limits: Any,
    tolerance: float | None = None,
    duration: Any = None,
    joint_names: Any = None,
    timeout: float | None = None,
    bound: bool = False,
) -> Plan:
    """Return the same geometric path with the best timing under the limits, from rest to rest, certified.

    A ``Trajectory`` is followed exactly; the answer's ``waypoint_times`` are when its breaks are passed. Samples are
    all passed, at the ``waypoint_times``: the path is the natural C2 cubic spline over centripetal knots or, where
    velocities were sent, the quintic spline of least squared jerk that has their directions as tangents. Equal
    neighbours are one. A dense record whose digits are rounded makes a rough path; a note says so (``rounded``).

    Parameters
    ----------
    trajectory : Trajectory or Recorded
    limits
        As in a plan request: an acceleration limit at least.
    tolerance : float
        Samples only: the path is smoothed (see ``fitting.smoothed``) and comes within this distance of every sample in
        every joint; its ends are exact, and the ``waypoint_times`` are theirs. The certificate has a check
        ``tolerance``, and its ``path_deviation`` is the largest distance of a sample, in any joint.
    duration, joint_names
        As in a plan request.
    timeout : float
        Seconds that it may take.
    bound : bool
        Whether a closer lower bound is worth more time.

    Raises
    ------
    InvalidRequest, Unsupported, Infeasible, SolverFailed, TimeLimit, NotVerified
        As ``plan`` does; fields are those of a retiming request.
    """
    deadline = Deadline(timeout)
    samples = isinstance(trajectory, Recorded)
    try:
        with np.errstate(all="ignore"):  # what overflows is refused, or does not verify
            route = _route(trajectory, tolerance, deadline)
        request = PlanRequest.of(
            route.points,
            limits=limits,
            duration=duration,
            joint_names=joint_names,
            timeout=deadline.left(),
            bound=bound,
        )
        if isinstance(trajectory, Recorded) and tolerance is None:
            route = replace(route, notes=(*route.notes, *_rough(trajectory.position, request.limits)))
        made = _told(_fastest(request, route, deadline), route)
    except InvalidRequest as error:
        raise _own_fields(error, samples) from None
    except Unsupported as error:  # the alternatives cannot be asked for here
        raise Unsupported(error.method, error.what, (), error.reason) from None
    except TimeLimit as error:  # which knows what was left when it began
        raise TimeLimit(error.seconds if timeout is None else timeout) from None
    spent = time.perf_counter() - deadline.started
    pose = made.seconds.get("pose", 0.0) + spent - sum(made.seconds.values())  # the path, and what came out slower
    return replace(made, seconds={**made.seconds, "pose": max(pose, 0.0)})


def _route(trajectory: Trajectory | Recorded, tolerance: float | None, deadline: Deadline) -> _Route:
    if isinstance(trajectory, Recorded):
        return _of_samples(trajectory, tolerance, deadline)
    if tolerance is not None:
        reason = "a polynomial is followed exactly: send samples of it to have them smoothed"
        raise InvalidRequest.of("/tolerance", "conflict", reason)
    return _of_polynomial(trajectory)


def _of_polynomial(motion: Trajectory) -> _Route:
    """Return the curve itself; its parameter is scaled, so that its pieces have length one on average."""
    left, right = motion.ends(0)
    points = np.concatenate([left, right[-1:]])
    found = motion.extrema(1)
    if not (found.high[0].max(axis=0) > found.low[0].min(axis=0)).any():  # nothing moves
        return _Route(points[[0, -1]], kept=np.array([0] + [1] * motion.pieces))
    at = (motion.breaks - motion.start) * (motion.pieces / motion.duration)
    rates = np.abs(np.stack([motion(t, 1) for t in (motion.start, motion.end)]))
    slow = bool((rates <= TOLERANCE * motion.extrema(2).peak(1)).all())
    notes = () if slow else (_at_rest(),)
    return _Route(points, replace(motion, breaks=at), at, notes, rests=slow)


def _of_samples(recorded: Recorded, tolerance: float | None, deadline: Deadline) -> _Route:
    """Return the path through the samples, or within a tolerance of them."""
    points, notes = recorded.position, []
    if recorded.velocity is not None and (_paces(recorded)[[0, -1]] > TOLERANCE).any():
        notes.append(_at_rest())
    if recorded.acceleration is not None:
        told = "the path is that of the positions and the directions of the velocities: the accelerations had no part"
        notes.append(Note("accelerations_unused", told))
    keep, kept = _distinct(points)
    if len(keep) < len(points):
        count = len(points) - len(keep)
        notes.append(Note("samples_merged", f"{count} sample(s) equal to the one before were merged with it"))
    if not np.ptp(points, axis=0).any():
        return _Route(points[[0, -1]], notes=tuple(notes), kept=np.array([0] + [1] * (len(points) - 1)))
    if tolerance is not None:
        allowed = number(tolerance, "/tolerance", low=0.0)
        if (points[0] == points[-1]).all() and (np.abs(points - points[0]) <= allowed).all():
            near = _nearness(Trajectory.hold(points[0], 0.0, 1.0), np.zeros(len(points)), points, allowed)
            return _Route(points[[0, -1]], notes=tuple(notes), check=near)
        fit = smoothed(points[keep], allowed, deadline) if allowed > 0 else None
        if fit is not None:
            if recorded.velocity is not None:
                notes.append(Note("velocities_unused", "the path is smoothed: the velocities had no part in it"))
            curve, near = fit[0], _nearness(*fit, points[keep], allowed)
            return _Route(points[[0, -1]], curve, curve.breaks[[0, -1]], tuple(notes), check=near)
        notes.append(Note("not_smoothed", "no smoother curve comes so near to the samples: all are passed"))
    chosen = points[keep]
    check = None if tolerance is None else Check("tolerance", None, None, None, 0.0, tolerance, None, True)
    if recorded.velocity is None:
        return _Route(chosen, notes=tuple(notes), kept=kept, check=check)
    pace = _paces(recorded)[keep]
    curve = _along(chosen, recorded.velocity[keep], pace > STOPPED, deadline)
    slow = int(((pace > TOLERANCE) & (pace <= STOPPED)).sum())
    if slow:
        notes.append(Note("tangents_free", f"{slow} sample(s) are too slow for their velocities to tell a direction"))
    return _Route(chosen, curve, curve.breaks, tuple(notes), kept, check)


def _rough(points: Array, limits: Limits) -> tuple[Note, ...]:
    """Return a note if the path is rough from rounding: within a tolerance of the record it is much faster."""
    unit = next((10.0**-k for k in range(DECIMALS + 1) if _whole(points * 10.0**k)), None)
    if unit is None or len(points) < DENSE:
        return ()
    bends = np.abs(np.diff(points, n=2 if limits.jerk is None else 3, axis=0)).max(axis=1)
    bends = bends[bends > 0.5 * unit]
    if not len(bends) or np.median(bends) > UNITS * unit:
        return ()
    told = f"rounded to {unit:g}, the positions make a rough path that slows the motion: tolerance {unit:g} smooths it"
    return (Note("rounded", told),)


def _whole(values: Array) -> bool:
    """Return whether all are whole numbers, but for what the product of two rounded numbers is off."""
    return bool((np.abs(values - np.rint(values)) <= 1e-7 + 1e-15 * np.abs(values)).all())


def _paces(recorded: Recorded) -> Array:
    """Return the speed sent for every sample, (M,), relative to the fastest one or to the mean of the motion."""
    assert recorded.velocity is not None
    speed = np.linalg.norm(recorded.velocity, axis=1)
    length = np.linalg.norm(np.diff(recorded.position, axis=0), axis=1).sum()
    return np.asarray(speed / max(float(speed.max()), float(length / np.ptp(recorded.time)), 1e-300))


def _at_rest() -> Note:
    return Note("starts_and_ends_at_rest", "the trajectory moves at an end; the answer starts and ends at rest")


def _distinct(points: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return which samples remain of runs of equal ones, and, for each sample, its index among those."""
    same = np.abs(np.diff(points, axis=0)).max(axis=1) <= SAME * float(np.ptp(points, axis=0).max())
    keep = np.concatenate([[True], ~same])
    kept = np.cumsum(keep) - 1
    if keep[1:].any() and same[-1]:  # of a last run of equals the very last is kept, so that the end stays exact
        keep[np.flatnonzero(keep)[-1]] = False
        keep[-1] = True
    return np.flatnonzero(keep), kept


def _along(points: Array, velocity: Array, moving: NDArray[np.bool_], deadline: Deadline) -> Trajectory:
    """Return the curve through the points (N, D) that has the directions of the velocities where they are moving.

    Over the knots u_i the tangent is v / |v| times the speed of the cubic spline through the points; the second
    derivatives are those of least integral of the squared third one.
    """
    at = knots(points) * (len(points) - 1)
    speed = np.where(moving, np.linalg.norm(velocity, axis=1), 1.0)
    slopes = np.linalg.norm(cubic_spline(at, points, "natural")(at, 1), axis=1)
    tangents = velocity * (slopes / speed)[:, None]
    states = [{"velocity": t.tolist()} if m else None for t, m in zip(tangents, moving, strict=True)]
    request = PlanRequest.of(points, times=at, waypoint_states=states, timeout=deadline.left())
    try:
        return plan(request, "minimum_jerk", {"ends": "free"}).trajectory
    except Unsupported as error:
        raise Unsupported("minimum_jerk", "path", reason=f"no curve has these velocities: {error}") from None


def _nearness(curve: Trajectory, at: Array, points: Array, allowed: float) -> Check:
    """Return how far the points are from the curve at their parameter values, judged by evaluating it."""
    off = np.abs(curve(at) - points)
    row, joint = (int(i) for i in np.unravel_index(int(np.argmax(off)), off.shape))
    value = float(off[row, joint])
    return Check("tolerance", joint, None, None, value, allowed, value / allowed, value <= allowed)


def _fastest(request: PlanRequest, route: _Route, deadline: Deadline) -> Plan:
    """Return the plan along the route that takes least time: the usual method's, or the caller's own law, scaled."""
    found: list[Plan] = []
    refused: list[PlannerError] = []
    ids = [USUAL, *(["time_scaled"] if route.rests else [])]
    for id in ids:
        try:
            found.append(plan(replace(request, timeout=deadline.left()), id, route.options()))
        except (Unsupported, Infeasible) as error:
            refused.append(error)
            if isinstance(error, Unsupported) and error.what == "path" and SECOND not in ids:
                ids.append(SECOND)
    if not found:
        raise next((error for error in refused if isinstance(error, Infeasible)), refused[0])
    return min(found, key=lambda made: made.trajectory.duration)


def _told(made: Plan, route: _Route) -> Plan:
    """Return the plan in terms of the caller's trajectory: its samples, what was assumed, what is kept of them."""
    times, certificate = made.waypoint_times, made.certificate
    if times is not None and route.kept is not None:
        times = times[route.kept]
    if route.check is not None:  # how far the answer is from the path and its points is known too, and counts
        span = max(1.0, float(np.ptp(route.points, axis=0).max()))
        value = (route.check.value or 0.0) + (certificate.path_deviation or 0.0)
        value += span * (certificate.waypoint_error or 0.0)
        bound = route.check.bound or 0.0
        ratio = value / bound if bound > 0 else None
        check = replace(route.check, value=value, ratio=ratio, holds=value <= bound + TOLERANCE * span)
        certificate = replace(
            certificate,
            checks=(*certificate.checks, check),
            holds=certificate.holds and check.holds,
            path_deviation=value,
        )
    return replace(made, notes=route.notes + made.notes, waypoint_times=times, certificate=certificate)


def _own_fields(error: InvalidRequest, samples: bool) -> InvalidRequest:
    """Return the findings with the fields of a retiming request in place of those of a plan request."""
    positions = "/trajectory/samples/position" if samples else "/trajectory/polynomial"
    own = {"/waypoints": positions, "/options/path/polynomial": "/trajectory/polynomial", "/options": "/trajectory"}
    moved = []
    for finding in error.errors:
        prefix = next((p for p in own if finding.field.startswith(p)), None)
        field = finding.field if prefix is None else own[prefix] + finding.field.removeprefix(prefix)
        moved.append(FieldError(field, finding.code, finding.reason))
    return InvalidRequest(moved, error.errors_total)
