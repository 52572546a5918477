"""Robot controllers that take a position every period: the samples as they see them, checked before any is written."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner import Limits, Samples
from planner.limits import QUANTITIES, Limit, segment_bounds
from planner.sampling import refuse_too_many, sample_count
from planner.types import Sampling

from .draft import ORDERS, Draft, Drawn
from .formats.samples import nanoseconds, samples_of
from .schemas import PlanBody, RetimeBody

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Controller:
    """A controller.

    Parameters
    ----------
    period
        Between two positions, s.
    multiples
        Whether it may be given a position every so many periods.
    joints
        Number of joints of its robot.
    rest
        Orders that have to be zero at the start and at the end.
    limits
        What the maker publishes, per quantity: lower and upper bounds of each joint, in rad and s.
    source
        Where the maker publishes it.
    """

    name: str
    period: float
    multiples: bool
    joints: int
    rest: tuple[int, ...]
    limits: dict[str, tuple[tuple[float, ...], tuple[float, ...]]]
    source: str


def _symmetric(*bounds: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return tuple(-bound for bound in bounds), bounds


CONTROLLERS = {
    row.name: row
    for row in (
        Controller(
            "franka",
            0.001,
            False,
            7,
            (1, 2),
            {  # the Franka Emika Robot, "Panda"
                "position": (
                    (-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973),
                    (2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973),
                ),
                "velocity": _symmetric(2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61),
                "acceleration": _symmetric(15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0),
                "jerk": _symmetric(7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0),
            },
            "https://frankaemika.github.io/docs/control_parameters.html",
        ),
        Controller(
            "ur",
            0.002,
            True,
            6,
            (1,),
            {},
            "https://www.universal-robots.com/articles/ur/programming/servoj-command/",
        ),
    )
}

#: Relative, on limits, as in certificates; and on positions, what the numbers' own rounding may be.
TOLERANCE = 1e-6
ROUNDING = 1e-13


class Unfit(Exception):
    """The trajectory, as samples, is not what the controller takes."""


@dataclass(frozen=True, eq=False)
class Held(Drawn):
    """Samples whose last times may lie after the trajectory's end: there it rests."""

    def part(self, begin: int = 0, end: int | None = None) -> Samples:
        """Return the samples begin … end - 1."""
        inside = Drawn(self.trajectory, np.minimum(self.times[begin:end], self.trajectory.end), self.method).part()
        after = self._after(begin, end)
        rates = [np.where(after, 0.0, getattr(inside, name)) for name in ORDERS[1:]]
        return Samples(self.times[begin:end], inside.position, *rates)

    def _after(self, begin: int, end: int | None) -> NDArray[np.bool_]:
        return (self.times[begin:end] > self.trajectory.end)[:, None]


def limits_of(body: PlanBody | RetimeBody, dims: int) -> tuple[Limits, list[Limits | None] | None]:
    """Return a request's limits on the whole trajectory, and those on each segment where there are any."""
    limits = Limits.of({} if body.limits is None else body.limits.model_dump(exclude_none=True), dims)
    segments = getattr(body, "segment_limits", None)
    if segments is None:
        return limits, None
    return limits, [None if s is None else Limits.of(s.model_dump(exclude_none=True), dims) for s in segments]


def fitted(
    draft: Draft, controller: Controller, dt: float, limits: Limits, segments: Any, most: int
) -> tuple[Draft, str]:
    """Return the draft with samples every ``dt`` s, the last one at rest at or after the end, and what was checked.

    Parameters
    ----------
    limits, segments
        Of the request: on the whole trajectory, and on each segment or None.
    most : int
        Cap on samples x joints.

    Raises
    ------
    Unfit, TooLarge, InvalidRequest
    """
    drawn = samples_of(draft)
    if drawn.dims != controller.joints:
        raise Unfit(f"{controller.name} has {controller.joints} joints, the trajectory {drawn.dims}")
    trajectory = drawn.trajectory
    sampling = Sampling(dt=dt)
    count = sample_count(sampling, trajectory.duration)
    refuse_too_many(count, drawn.dims, most, sampling, trajectory.duration)
    times = trajectory.start + dt * np.arange(count, dtype=np.float64)
    if abs(times[-1] - trajectory.end) <= 1e-8 * dt:  # whole periods, but for rounding
        times[-1] = trajectory.end
    held = Held(trajectory, times, drawn.method)
    tree = {**draft.tree, "samples": held}
    if times[-1] > trajectory.end:
        tree["warnings"] = [*tree["warnings"], _note(trajectory.duration, dt, count)]
    made = replace(draft, tree=tree)
    _check_clock(made, dt)
    _check_rest(held, controller)
    positions = held.order(0, 0, count)
    waypoint_times = tree["waypoint_times"] if segments else None
    for order in range(4):
        asked = _asked(limits, segments, waypoint_times, order, held, dt)
        _check_differences(positions, order, dt, asked, "the request's limit")
        if QUANTITIES[order] in controller.limits:
            lower, upper = (np.array(side) for side in controller.limits[QUANTITIES[order]])
            _check_differences(positions, order, dt, (lower, upper), f"{controller.name}'s published limit")
    return made, f"{count:,} samples every {dt:g} s were checked as {controller.name} sees them"


def _note(duration: float, dt: float, count: int) -> dict[str, str]:
    message = (
        f"the trajectory takes {duration:.9g} s; the last of {count:,} samples, {dt:g} s apart, is at "
        f"{(count - 1) * dt:.9g} s, at rest at the end"
    )
    return {"code": "held", "message": message}


def _check_clock(draft: Draft, dt: float) -> None:
    """Refuse samples that are not one period apart on the clock that they are written on."""
    times = samples_of(draft).times
    if len(times) > 2 or times[-1] > times[0]:
        nanoseconds(draft)
    off = np.abs(np.diff(times) - dt) > 1e-3 * dt
    if len(times) > 2 and off.any():
        k = int(np.argmax(off))
        raise Unfit(f"samples {k} and {k + 1} are {times[k + 1] - times[k]:.9g} s apart, not {dt:g} s")


def _check_rest(held: Held, controller: Controller) -> None:
    """Refuse a trajectory that does not start and end at rest."""
    trajectory = held.trajectory
    for order in controller.rest:
        peak = trajectory.extrema(order).peak(0)
        for k, at in ((0, trajectory.start), (len(held.times) - 1, trajectory.end)):
            state = trajectory.states(np.array([at]), 1, first=order)[0][0]
            moving = np.abs(state) > TOLERANCE * np.maximum(1.0, peak)
            if moving.any():
                joint = int(np.argmax(moving))
                where = "start" if k == 0 else "end"
                raise Unfit(
                    f"{controller.name} has to {where} at rest: joint {joint}, sample {k}: "
                    f"{QUANTITIES[order]} {state[joint]:.6g}, bound 0"
                )


def _asked(
    limits: Limits, segments: Any, waypoint_times: Any, order: int, held: Held, dt: float
) -> tuple[Array, Array]:
    """Return the bounds of the request on every difference; where it reaches over segments, the loosest of theirs."""
    whole: Limit = limits.bounds(order, held.dims)
    if not segments or waypoint_times is None:
        return whole.lower, whole.upper
    count = len(waypoint_times) - 1
    bounds = segment_bounds(limits, segments, order, count, held.dims)
    last = np.concatenate([held.times, held.times[-1] + dt * np.arange(1, order + 1)])
    inner = np.asarray(waypoint_times)[1:-1]
    # an instant on a waypoint belongs to both sides of it; a difference of order k spans k periods
    first = np.searchsorted(inner, last - order * dt - 1e-9 * dt, side="left")
    final = np.searchsorted(inner, last + 1e-9 * dt, side="right")
    lower, upper = np.full((len(last), held.dims), np.inf), np.full((len(last), held.dims), -np.inf)
    for step in range(int((final - first).max()) + 1):
        segment = np.minimum(first + step, final)
        lower, upper = np.minimum(lower, bounds.lower[segment]), np.maximum(upper, bounds.upper[segment])
    return lower, upper


def _check_differences(positions: Array, order: int, dt: float, bounds: tuple[Array, Array], whose: str) -> None:
    """Refuse a finite difference beyond its bounds; before and after the samples the robot stands still."""
    still = np.repeat(positions[:1], order, axis=0), np.repeat(positions[-1:], order, axis=0)
    found = np.diff(np.concatenate([still[0], positions, still[1]]), order, axis=0) / dt**order
    lower, upper = (np.broadcast_to(side, found.shape) for side in bounds)
    slack = TOLERANCE * np.maximum(*(np.where(np.isfinite(side), np.abs(side), 0.0) for side in (lower, upper)))
    slack = slack + 2.0**order * ROUNDING * np.maximum(1.0, np.abs(positions).max(axis=0)) / dt**order
    over = np.maximum(found - upper, lower - found) - slack
    if not (over > 0).any():
        return
    k, joint = (int(i) for i in np.unravel_index(int(np.argmax(over)), over.shape))
    bound = upper[k, joint] if found[k, joint] > upper[k, joint] else lower[k, joint]
    raise Unfit(
        f"joint {joint}, sample {min(k, len(positions) - 1)}: the {QUANTITIES[order]} that the controller sees is "
        f"{found[k, joint]:.9g}, beyond {whose} {bound:.9g}"
    )
