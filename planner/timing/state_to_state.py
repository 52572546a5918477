"""Time-optimal state-to-state motion by the ruckig library, in units in which every number is near one.

ruckig compares with absolute tolerances and refuses limits above 1e9, so that a move of 1e-16 beside one of 1e6 fails.
Each joint gets a unit of length of its own and all share a unit of time; only time couples the joints.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import Infeasible, SolverFailed
from ..limits import QUANTITIES, Limit
from ..trajectory import Trajectory

Array = NDArray[np.float64]

#: In scaled units every move takes about one, so limits above such a cap hardly bind; where ruckig fails with the first
#: cap (it takes limits up to 1e9, but mixes of scales trouble it) the next is tried.
CAPS = (9e8, 1e8, 1e6, 1e4)
#: Numbers in this range need no scaling.
PLAIN = (1e-3, 1e5)


@dataclass(frozen=True, eq=False)
class Segment:
    """From one state to another under limits; arrays (D,), jerk may be infinite."""

    p0: Array
    v0: Array
    a0: Array
    p1: Array
    v1: Array
    a1: Array
    velocity: Limit
    acceleration: Limit
    jerk: Array
    least: float = 0.0

    @property
    def rests(self) -> bool:
        """Whether it starts and ends at rest."""
        return not (self.v0.any() or self.a0.any() or self.v1.any() or self.a1.any())


def time_optimal(segment: Segment) -> Trajectory:
    """Return the shortest motion (at least ``segment.least`` long) as cubic pieces, starting at time 0.

    Raises
    ------
    SolverFailed
        ruckig finds no motion.
    """
    second, unit = _units(segment)
    attempts = [(second, unit, cap) for cap in CAPS]
    if _plain(segment, second):
        attempts.insert(0, (1.0, np.ones_like(unit), CAPS[0]))
    for second, unit, cap in attempts:
        scaled = _scaled(segment, second, unit, cap)
        try:
            duration, phases = _ruckig(scaled)
            break
        except SolverFailed:
            if cap == CAPS[-1]:
                raise
    pieces = _pieces(duration, phases)
    coefficients = pieces.coefficients * unit
    coefficients[-1] += segment.p0
    return Trajectory(pieces.breaks * second, coefficients)


def _plain(s: Segment, second: float) -> bool:
    """Return whether all numbers are of ordinary size as they stand."""
    numbers = [s.p1 - s.p0, s.velocity.upper, s.velocity.lower, s.acceleration.upper, s.acceleration.lower, s.jerk]
    sizes = np.abs(np.concatenate([*numbers, s.v0, s.v1, s.a0, s.a1]))
    sizes = sizes[np.isfinite(sizes) & (sizes > 0)]
    return bool(sizes.min() >= PLAIN[0] and sizes.max() <= PLAIN[1] and PLAIN[0] <= second <= 5e3)


def _units(s: Segment) -> tuple[float, Array]:
    """Return the unit of time, about the slowest joint's duration, and each joint's unit of length."""
    move = np.abs(s.p1 - s.p0)
    v = np.minimum(s.velocity.upper, -s.velocity.lower)
    a = np.minimum(s.acceleration.upper, -s.acceleration.lower)
    speed, push = np.maximum(np.abs(s.v0), np.abs(s.v1)), np.maximum(np.abs(s.a0), np.abs(s.a1))
    durations = np.stack(
        [move / v, np.sqrt(move / a), np.cbrt(move / s.jerk), speed / a, np.sqrt(speed / s.jerk), push / s.jerk]
    )
    second = float(durations.max())
    second = second if second > 0 else 1.0
    unit = np.maximum(np.maximum(move, speed * second), push * second**2)
    return second, np.where(unit > 0, unit, 1.0)


def _scaled(s: Segment, second: float, unit: Array, cap: float) -> Segment:
    v, a, j = second / unit, second**2 / unit, second**3 / unit
    return replace(
        s,
        p0=np.zeros_like(s.p0),
        v0=s.v0 * v,
        a0=s.a0 * a,
        p1=(s.p1 - s.p0) / unit,
        v1=s.v1 * v,
        a1=s.a1 * a,
        velocity=Limit(np.maximum(s.velocity.lower * v, -cap), np.minimum(s.velocity.upper * v, cap)),
        acceleration=Limit(np.maximum(s.acceleration.lower * a, -cap), np.minimum(s.acceleration.upper * a, cap)),
        jerk=np.where(np.isfinite(s.jerk), np.minimum(s.jerk * j, cap), np.inf),
        least=s.least / second,
    )


def _ruckig(s: Segment) -> tuple[float, Array]:
    """Return the duration and every joint's phases, (D, 10, 5): duration, position, velocity, acceleration, jerk.

    Two of braking, seven of motion, and the rest at the end; some take no time.
    """
    import ruckig

    dims = len(s.p0)
    given = ruckig.InputParameter(dims)
    given.current_position, given.target_position = s.p0.tolist(), s.p1.tolist()
    given.current_velocity, given.target_velocity = s.v0.tolist(), s.v1.tolist()
    given.current_acceleration, given.target_acceleration = s.a0.tolist(), s.a1.tolist()
    given.max_velocity, given.min_velocity = s.velocity.upper.tolist(), s.velocity.lower.tolist()
    given.max_acceleration, given.min_acceleration = s.acceleration.upper.tolist(), s.acceleration.lower.tolist()
    given.max_jerk = s.jerk.tolist()
    if s.least > 0:
        given.minimum_duration = s.least
    made = ruckig.Trajectory(dims)
    try:
        result = ruckig.Ruckig(dims).calculate(given, made)
    except (ruckig.RuckigError, ValueError) as error:
        raise SolverFailed("ruckig", str(error).strip().splitlines()[0][:300]) from None
    if result not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise SolverFailed("ruckig", str(result))
    phases = np.zeros((dims, 10, 5))
    for d, profile in enumerate(made.profiles[0]):
        brake = profile.brake
        phases[d, :2] = np.array([brake.t, brake.p, brake.v, brake.a, brake.j]).T
        phases[d, 2:9] = np.array([profile.t, profile.p[:7], profile.v[:7], profile.a[:7], profile.j]).T
    phases[:, 9, 0], phases[:, 9, 1] = np.inf, s.p1
    return float(made.duration), phases


def _pieces(duration: float, phases: Array) -> Trajectory:
    """Return the joints' phases on common breaks; breaks closer than rounding are one."""
    ends = np.cumsum(phases[:, :, 0], axis=1)
    found = np.unique(np.append(ends[:, :9], 0.0))
    found = found[found < duration * (1.0 - 1e-12)]
    breaks = np.append(found[np.append(True, np.diff(found) > 1e-12 * duration)], duration)
    middles = 0.5 * (breaks[:-1] + breaks[1:])
    phase = (ends[:, :9, None] <= middles).sum(axis=1)  # (D, K)
    starts = np.concatenate([np.zeros((len(ends), 1)), ends[:, :9]], axis=1)
    u = breaks[:-1] - np.take_along_axis(starts, phase, axis=1)
    p, v, a, j = (np.take_along_axis(phases[:, :, k], phase, axis=1) for k in range(1, 5))
    powers = (p + u * (v + u * (a / 2 + u * j / 6)), v + u * (a + u * j / 2), (a + u * j) / 2, j / 6)
    return Trajectory.from_powers(breaks, np.stack(powers).transpose(0, 2, 1))


def refuse_overshoot(segment: Segment, motion: Trajectory, index: int) -> None:
    """Refuse where the asked end state itself leads beyond a limit, so that ruckig brakes outside of it."""
    if segment.rests:
        return
    found = motion.extrema(4)
    for order, limit in ((1, segment.velocity), (2, segment.acceleration)):
        over = np.maximum(found.high[order] - limit.upper, limit.lower - found.low[order]) / limit.scale()
        if over.max() > 1e-9:
            piece, joint = (int(i) for i in np.unravel_index(int(np.argmax(over)), over.shape))
            high = found.high[order][piece, joint] > limit.upper[joint]
            raise Infeasible(
                f"the state asked at an end leads beyond the {QUANTITIES[order]} limit of joint {joint}",
                joint=joint,
                quantity=QUANTITIES[order],
                segment=index,
                bound=float((limit.upper if high else limit.lower)[joint]),
                needed=float((found.high if high else found.low)[order][piece, joint]),
            )
