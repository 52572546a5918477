"""States that no motion within the limits can have at an end or at a waypoint, refused before any work.

Of all motions from a state, the one that applies the lowest jerk until the acceleration is at its lower limit, and
stays there, has the least acceleration, velocity and position at every time. What it goes up to before its acceleration
(or its velocity) has come to zero, every motion goes up to that has to bring it to zero at all. The other three cases
are the same in a mirror: of space, of time, and of both.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import Infeasible
from ..limits import QUANTITIES, Limit, magnitude, segment_bounds
from ..types import PlanRequest

Array = NDArray[np.float64]

#: Beyond a limit by less than this, relatively: that is rounding.
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class _View:
    """The request as seen along ``direction`` (-1: backwards in time) with positions times ``side``.

    States are those of the first R waypoints in this view, and of the last one, (R + 1, D), NaN where they are free;
    the limits of a row, (R, D), are the loosest from there on, since nobody knows when the next waypoint is passed.
    """

    direction: int
    side: int
    count: int
    position: Array
    velocity: Array
    acceleration: Array
    lower: list[Array]
    upper: list[Array]
    scale: list[Array]

    def sign(self, order: int) -> int:
        """Return the sign of a derivative in this view."""
        return self.side if order % 2 == 0 else self.side * self.direction

    def row(self, index: int) -> int:
        """Return the waypoint of a row."""
        return index if self.direction > 0 else self.count - 1 - index


@dataclass(frozen=True, eq=False)
class _Beyond:
    """The worst that a view shows of a quantity: how far beyond the limit, relatively, and what is reached there."""

    excess: float
    order: int
    view: _View
    row: int
    joint: int
    needed: float


def refuse_inadmissible(request: PlanRequest) -> None:
    """Refuse states that lead beyond a limit, or can only be reached from beyond one, whatever the motion.

    Parameters
    ----------
    request : PlanRequest
        A derivative of ``start`` or ``end`` that is None is zero, one that is NaN is free. At interior waypoints those
        of ``waypoint_states`` count.

    Raises
    ------
    Infeasible
        Certified. The fields tell the limit and the value that every motion reaches, the reason the nearest state.
    """
    velocity, acceleration = _states(request, "velocity"), _states(request, "acceleration")
    moving = (np.nan_to_num(velocity) != 0).any(axis=1) | (np.nan_to_num(acceleration) != 0).any(axis=1)
    if not moving.any():
        return
    shape = request.count - 1, request.dims
    limits = [segment_bounds(request.limits, request.segment_limits, m, *shape) for m in range(len(QUANTITIES))]
    found: list[_Beyond] = []
    with np.errstate(over="ignore", invalid="ignore"):
        for direction, rows in ((1, moving[:-1]), (-1, moving[1:])):
            for side in (1, -1) if rows.any() else ():
                view = _view(request, [velocity, acceleration], limits, direction, side)
                found += [_worst(view, 1, _peak_velocities(view)), _worst(view, 0, _farthest_positions(view))]
    worst = max(found, key=lambda x: x.excess)
    if worst.excess > ROUNDING:
        raise _refusal(request, worst)


def _states(request: PlanRequest, name: str) -> Array:
    """Return what is asked of a derivative at all waypoints, (N, D), NaN where it is free."""
    asked = np.full((request.count, request.dims), np.nan)
    if request.waypoint_states is not None:
        asked[1:-1] = getattr(request.waypoint_states, name)[1:-1]
    for index, boundary in ((0, request.start), (-1, request.end)):
        given = getattr(boundary, name)
        asked[index] = 0.0 if given is None else given
    return asked


def _view(request: PlanRequest, asked: list[Array], limits: list[Limit], direction: int, side: int) -> _View:
    slack = np.zeros_like(request.waypoints)
    if request.waypoint_tolerance is not None:
        slack[1:-1] = request.waypoint_tolerance
    rows = 1 if request.waypoint_states is None else request.count - 1
    kept = [*range(rows), request.count - 1]
    each = (side * request.waypoints - slack, side * direction * asked[0], side * asked[1])
    states = [x[::direction][kept] for x in each]
    lower, upper, scale = [], [], []
    for order, limit in enumerate(limits):
        low, high = limit.lower[::direction], limit.upper[::direction]
        if side * direction**order < 0:
            low, high = -high, -low
        if request.segment_limits is not None:
            low, high = np.minimum.accumulate(low[::-1])[::-1], np.maximum.accumulate(high[::-1])[::-1]
        lower.append(low[:rows])
        upper.append(high[:rows])
        if order < 2:
            scale.append(magnitude(lower[-1], upper[-1]))
    return _View(direction, side, request.count, states[0], states[1], states[2], lower, upper, scale)


def _peak_velocities(view: _View) -> Array:
    """Return the velocity that is reached at least, (R, D); -inf where nothing is known.

    That of the state itself is not meant, which is judged elsewhere. The acceleration must come to zero if it does not
    stay positive to the other end, by which time the velocity would have risen by no less than jerk allows.
    """
    a, jerk = view.acceleration[:-1], -view.lower[3]
    v = np.where(np.isnan(view.velocity[:-1]), view.lower[1], view.velocity[:-1])  # free: the lowest is best
    last_v, last_a = view.velocity[-1], view.acceleration[-1]
    rise = np.maximum((a - last_a) * (a + last_a), 0.0) / (2.0 * jerk)
    falls = (last_a <= 0) | (last_v < v + rise - ROUNDING * view.scale[1])
    return np.where((a > 0) & falls, v + a**2 / (2.0 * jerk), -np.inf)


def _farthest_positions(view: _View) -> Array:
    """Return the position that is reached at least, (R, D); -inf where nothing is known.

    The velocity must come to zero if it is to end so or below, or the joint is to end up behind where it was.
    """
    p, v = view.position[:-1], view.velocity[:-1]
    a = np.where(np.isnan(view.acceleration[:-1]), view.lower[2], view.acceleration[:-1])  # free: the lowest is best
    outwards = (v > 0) | ((v == 0) & (a > 0))
    stops = outwards & ((view.velocity[-1] <= 0) | (view.position[-1] < p))
    stops |= (v < 0) & (a > 0) & (view.velocity[-1] <= 0) & (view.acceleration[-1] <= 0)
    reached = np.full(p.shape, -np.inf)
    for row, joint in np.argwhere(stops & np.isfinite(view.upper[0])):
        limits = float(-view.lower[2][row, joint]), float(-view.lower[3][row, joint])
        reached[row, joint] = p[row, joint] + stopping_distance(float(v[row, joint]), float(a[row, joint]), *limits)
    return reached


def stopping_distance(velocity: float, acceleration: float, braking: float, jerk: float) -> float:
    """Return how far upwards a joint gets at least before it has come to a stop, >= 0.

    Parameters
    ----------
    velocity, acceleration : float
        With acceleration >= -braking.
    braking, jerk : float
        How far the acceleration and the jerk may fall below zero, > 0; may be infinite.
    """
    v, a = velocity, acceleration
    if math.isinf(jerk) or math.isinf(a):
        return 0.0 if v <= 0.0 else v * v / (2.0 * braking)
    square = a * a + 2.0 * jerk * v
    if square < 0.0 or (v <= 0.0 and a <= 0.0):  # it does not move upwards at all
        return 0.0
    root = math.sqrt(square)
    stop = (a + root) / jerk if a >= 0.0 else 2.0 * v / (root - a)  # while the jerk lasts; the second time, if v < 0
    full = (a + braking) / jerk
    if stop <= full:
        return max(stop * (v + stop * (a / 2.0 - stop * jerk / 6.0)), 0.0)
    left = v + full * (a - braking) / 2.0
    return max(full * (v + full * (a / 2.0 - full * jerk / 6.0)) + left * left / (2.0 * braking), 0.0)


def _worst(view: _View, order: int, reached: Array) -> _Beyond:
    excess = np.nan_to_num(
        (reached - view.upper[order]) / view.scale[order], nan=-np.inf, posinf=np.inf, neginf=-np.inf
    )
    row, joint = (int(i) for i in np.unravel_index(int(np.argmax(excess)), excess.shape))
    return _Beyond(float(excess[row, joint]), order, view, row, joint, float(reached[row, joint]))


def _refusal(request: PlanRequest, worst: _Beyond) -> Infeasible:
    view, at = worst.view, (worst.row, worst.joint)
    waypoint, sign = view.row(worst.row), view.sign(worst.order)
    where = f"at waypoint {waypoint}"
    if waypoint in (0, request.count - 1):
        where = "at the start" if waypoint == 0 else "at the end"
    leads = "leads" if view.direction > 0 else "can only come from"
    limit = f"{QUANTITIES[worst.order]} limit of joint {worst.joint}"
    return Infeasible(
        f"the state asked {where} {leads} beyond the {limit}: {_nearest(worst)}",
        joint=worst.joint,
        quantity=QUANTITIES[worst.order],
        segment=waypoint if view.direction > 0 else waypoint - 1,
        time=None if request.times is None else float(request.times[waypoint]),
        bound=sign * float(view.upper[worst.order][at]),
        needed=sign * worst.needed,
        certified=True,
    )


def _nearest(worst: _Beyond) -> str:
    """Return which acceleration the velocity would allow, and which velocity the acceleration, in words."""
    view, at = worst.view, (worst.row, worst.joint)
    v, a = float(view.velocity[at]), float(view.acceleration[at])
    low, high, jerk = float(view.lower[1][at]), float(view.upper[1][at]), -float(view.lower[3][at])
    if worst.order == 1:
        most_a = math.sqrt(2.0 * jerk * max(high - (low if math.isnan(v) else v), 0.0))
        accelerations = f"the acceleration may be {_bounded(most_a, view.sign(2))}"
        if math.isnan(v):
            return f"whatever the velocity, {accelerations}"
        most_v = high - a * a / (2.0 * jerk)
        velocities = f"the velocity {_bounded(most_v, view.sign(1))}" if most_v >= low else "no velocity will do"
        return f"with this velocity {accelerations} (with this acceleration {velocities})"
    braking, room = -float(view.lower[2][at]), max(float(view.upper[0][at] - view.position[at]), 0.0)
    from_a = -braking if math.isnan(a) else a
    least = -(max(from_a, 0.0) ** 2) / (2.0 * jerk)  # with this one it does not move upwards
    below, above = least, v
    for _ in range(100):
        middle = 0.5 * (below + above)
        if stopping_distance(middle, from_a, braking, jerk) <= room:
            below = middle
        else:
            above = middle
    velocities = f"the velocity may be {_bounded(below, view.sign(1))}" if below >= low else "no velocity will do"
    return velocities if math.isnan(a) else f"with this acceleration {velocities}"


def _bounded(most: float, sign: int) -> str:
    """Return ``at most`` the value, or for a mirrored one ``at least``, rounded to the side that is allowed."""
    digits = 0 if most == 0.0 else 5 - math.floor(math.log10(abs(most)))
    rounded = round(most, digits)
    if rounded > most + ROUNDING * abs(most):
        rounded -= 10.0**-digits
    return f"at {'most' if sign > 0 else 'least'} {sign * rounded + 0.0:.6g}"
