"""Time-optimal state-to-state motion by the ruckig library, in units in which every number is near one.

ruckig compares with absolute tolerances and refuses limits above 1e9, so that a move of 1e-16 beside one of 1e6 fails.
Each joint gets a unit of length of its own and all share a unit of time; only time couples the joints.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..deadline import Deadline
from ..errors import Infeasible
from ..limits import QUANTITIES, Limit, magnitude
from ..trajectory import Trajectory

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: In scaled units every move takes about one, so limits above such a cap hardly bind; where ruckig fails with the first
#: cap (it takes limits up to 1e9, but mixes of scales trouble it) the next is tried.
CAPS = (9e8, 1e8, 1e6, 1e4)
#: Numbers in this range need no scaling.
PLAIN = (1e-3, 1e5)
#: Phases of a joint: two of braking and seven of motion.
PHASES = 9


@dataclass(frozen=True, eq=False)
class Legs:
    """S motions, each from one state to another under limits; arrays (S, D), jerk may be infinite.

    ``least`` (S,): how long each takes at least, s.
    """

    p0: Array
    v0: Array
    a0: Array
    p1: Array
    v1: Array
    a1: Array
    velocity: Limit
    acceleration: Limit
    jerk: Array
    least: Array

    def __len__(self) -> int:
        return len(self.p0)

    @property
    def rests(self) -> NDArray[np.bool_]:
        """Whether each starts and ends at rest, (S,)."""
        return ~np.asarray(np.stack([self.v0, self.a0, self.v1, self.a1]).any(axis=(0, 2)))

    @property
    def still(self) -> NDArray[np.bool_]:
        """Whether nothing moves, (S,)."""
        return np.asarray(self.rests & (self.p0 == self.p1).all(axis=1))

    def chosen(self, index: Indices) -> "Legs":
        """Return some of them."""
        velocity, acceleration = (Limit(x.lower[index], x.upper[index]) for x in (self.velocity, self.acceleration))
        p0, v0, a0, p1, v1, a1, jerk, least = (
            x[index] for x in (self.p0, self.v0, self.a0, self.p1, self.v1, self.a1, self.jerk, self.least)
        )
        return Legs(p0, v0, a0, p1, v1, a1, velocity, acceleration, jerk, least)


def profiles(legs: Legs, deadline: Deadline | None = None) -> tuple[Array, Array]:
    """Return the shortest durations (S,), NaN where ruckig finds none, and every joint's phases, (S, D, 10, 5).

    A phase is duration, position from the leg's start, velocity, acceleration and jerk at its start. Two are of
    braking, seven of motion, some take no time; the last has the end state and holds.

    Raises
    ------
    TimeLimit
        The deadline has passed.
    """
    from ..kernels.phases import integrate

    durations, rows, second, unit = _solved(legs, deadline, True)
    steps = rows[:, :, 0] * second[:, None, None]
    stepped = np.isinf(legs.jerk)
    rates = rows[:, :, 1] * (unit / second[:, None] ** np.where(stepped, 2.0, 3.0))[:, :, None]
    start, end = np.stack([legs.v0, legs.a0]), np.stack([legs.p1 - legs.p0, legs.v1, legs.a1])
    return durations, integrate(steps, rates, stepped, start, end)


def shortest(legs: Legs, deadline: Deadline | None = None) -> Array:
    """Return the shortest durations alone, (S,), NaN where ruckig finds none."""
    return _solved(legs, deadline, False)[0]


def _solved(legs: Legs, deadline: Deadline | None, moved: bool) -> tuple[Array, Array, Array, Array]:
    """Return durations (s), the phases' durations and rates (S, D, 2, 9) as ruckig has them, and their units.

    The units are of time, (S,), and of length, (S, D). Without ``moved`` the phases are not asked for.
    """
    from ..kernels.phases import units

    count, dims = legs.p0.shape
    v, a = legs.velocity, legs.acceleration
    move = legs.p1 - legs.p0
    numbers = np.stack([legs.v0, legs.a0, move, legs.v1, legs.a1, v.lower, v.upper, a.lower, a.upper, legs.jerk])
    second, unit, plain, still = units(numbers, *PLAIN)
    time, length = np.where(plain, 1.0, second), np.where(plain[:, None], 1.0, unit)
    durations, rows = np.where(still, legs.least, np.nan), np.zeros((count, dims, 2, PHASES))
    for attempt, cap in enumerate((CAPS[0], *CAPS)):
        now = np.flatnonzero(np.isnan(durations))
        if len(now) == 0:
            break
        if attempt > 0:
            time[now], length[now] = second[now], unit[now]
        _ruckig(numbers, legs.least, now, time, length, cap, deadline, durations, rows if moved else None)
    return durations, rows, time, length


def _ruckig(
    numbers: Array,
    least: Array,
    chosen: Indices,
    second: Array,
    unit: Array,
    cap: float,
    deadline: Deadline | None,
    durations: Array,
    rows: Array | None,
) -> None:
    """Write durations (S,), s, and the phases' durations and rates (S, D, 2, 9) of those chosen for which one is found.

    A rate is the jerk, or, where that is not limited, the acceleration.
    """
    import ruckig

    from ..kernels.phases import scaled

    dims = numbers.shape[2]
    solver, given, made = ruckig.Ruckig(dims), ruckig.InputParameter(dims), ruckig.Trajectory(dims)
    given.current_position = [0.0] * dims
    flat: list[float] = []
    good: list[int] = []
    listed = scaled(numbers, second, unit, chosen, cap).tolist()
    for i, state, longer in zip(chosen.tolist(), listed, (least[chosen] / second[chosen]).tolist(), strict=True):
        if deadline is not None:
            deadline.left()
        given.current_velocity, given.current_acceleration = state[0], state[1]
        given.target_position, given.target_velocity, given.target_acceleration = state[2], state[3], state[4]
        given.min_velocity, given.max_velocity = state[5], state[6]
        given.min_acceleration, given.max_acceleration = state[7], state[8]
        given.max_jerk = jerk = state[9]
        given.minimum_duration = longer if longer > 0.0 else None
        try:
            result = solver.calculate(given, made)
        except (ruckig.RuckigError, ValueError):
            continue
        if result not in (ruckig.Result.Working, ruckig.Result.Finished):
            continue
        durations[i] = made.duration * second[i]
        if rows is None:
            continue
        good.append(i)
        for d, profile in enumerate(made.profiles[0]):
            stepped = jerk[d] == np.inf
            flat += profile.t
            flat += profile.a[:7] if stepped else profile.j
            braking = profile.brake
            if braking.duration > 0.0:
                rows[i, d, :, :2] = braking.t, braking.a if stepped else braking.j
    if rows is not None:
        rows[good, :, :, 2:] = np.array(flat).reshape(-1, dims, 2, 7)


def joined(durations: Array, phases: Array, origin: Array) -> tuple[Trajectory, Array]:
    """Return the motions one after the other from time 0 on breaks common to all joints, and when each starts or ends.

    Parameters
    ----------
    durations : (S,)
        Those that take no time leave nothing.
    phases : (S, D, n, 5)
        See ``profiles``; any number of them.
    origin : (S, D)
        What positions count from.
    """
    from ..kernels.phases import merge

    times = np.concatenate([[0.0], np.cumsum(durations)])
    if not times[-1] > 0.0:
        return Trajectory.hold(origin[0], 0.0, 0.0), times
    return Trajectory.from_powers(*merge(times, np.ascontiguousarray(phases), np.ascontiguousarray(origin))), times


def slowed(phases: Array, factor: Array) -> Array:
    """Return the phases of motions that take ``factor`` (S,) times as long."""
    return np.asarray(phases * np.power(factor[:, None, None, None], [1.0, 0.0, -1.0, -2.0, -3.0]))


def refuse_overshoot(legs: Legs, phases: Array) -> None:
    """Refuse where the asked end state itself leads beyond a limit, so that ruckig brakes outside of it."""
    from ..kernels.phases import extremes

    moving = np.flatnonzero(~legs.rests)
    low, high = extremes(np.ascontiguousarray(phases[moving]))
    for row, index in enumerate(moving.tolist()):
        for order, limit in ((1, legs.velocity), (2, legs.acceleration)):
            lower, upper = limit.lower[index], limit.upper[index]
            below, above = low[order, row], high[order, row]
            over = np.maximum(above - upper, lower - below) / magnitude(lower, upper)
            if over.max() > 1e-9:
                joint = int(np.argmax(over))
                beyond = above[joint] > upper[joint]
                raise Infeasible(
                    f"the state asked at an end leads beyond the {QUANTITIES[order]} limit of joint {joint}",
                    joint=joint,
                    quantity=QUANTITIES[order],
                    segment=index,
                    bound=float((upper if beyond else lower)[joint]),
                    needed=float((above if beyond else below)[joint]),
                )
