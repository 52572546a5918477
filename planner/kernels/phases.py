"""Motions of constant jerk, phase by phase for each joint: their states, their extremes, and all joints on one clock.

A phase is (duration, position, velocity, acceleration, jerk), the state being that at its start. The last phase of
a joint holds until the end of the segment, whatever its duration.
"""

import numpy as np
from numba import njit

#: What a boundary between phases may be moved by, to another joint's: so much of the segment's duration,
CLOSE = 1e-12
#: and so little that acceleration (or velocity, where the acceleration jumps) changes by no more than this, relatively.
UNSEEN = 1e-14
EPS = 2.220446049250313e-16


@njit(cache=True, error_model="numpy")
def units(numbers, smallest, largest):  # type: ignore[no-untyped-def]
    """Return what makes moves of S legs about one.

    Parameters
    ----------
    numbers : array (10, S, D)
        Velocity and acceleration at the start, the way to go, velocity and acceleration at the end; the lower and
        upper limit of velocity, those of acceleration, and the jerk's, which may be infinite.
    smallest, largest : float
        The range in which no number needs scaling.

    Returns
    -------
    second : array (S,)
        About the slowest joint's duration.
    unit : array (S, D)
        Of length.
    plain, still : arrays (S,) of bool
        Whether all numbers are in the range given, and whether nothing moves.
    """
    _, count, dims = numbers.shape
    second, unit = np.ones(count), np.ones((count, dims))
    plain, still = np.ones(count, np.bool_), np.ones(count, np.bool_)
    for i in range(count):
        longest = 0.0
        for d in range(dims):
            v0, a0, way, v1, a1, slow, fast, brake, push, jerk = numbers[:, i, d]
            v, a = min(fast, -slow), min(push, -brake)
            move, speed, hard = abs(way), max(abs(v0), abs(v1)), max(abs(a0), abs(a1))
            longest = max(longest, move / v, np.sqrt(move / a), np.cbrt(move / jerk))
            longest = max(longest, speed / a, np.sqrt(speed / jerk), hard / jerk)
            if move > 0.0 or speed > 0.0 or hard > 0.0:
                still[i] = False
            for k in range(10):
                size = abs(numbers[k, i, d])
                if size > 0.0 and size < np.inf and not smallest <= size <= largest:
                    plain[i] = False
        if longest > 0.0:
            second[i] = longest
        plain[i] = plain[i] and smallest <= second[i] <= 5e3
        for d in range(dims):
            v0, a0, way, v1, a1 = numbers[:5, i, d]
            speed, hard = max(abs(v0), abs(v1)), max(abs(a0), abs(a1))
            length = max(abs(way), speed * second[i], hard * second[i] ** 2)
            if length > 0.0:
                unit[i, d] = length
    return second, unit, plain, still


@njit(cache=True, error_model="numpy")
def scaled(numbers, second, unit, chosen, cap):  # type: ignore[no-untyped-def]
    """Return the numbers of the legs chosen in units, (n, 10, D): limits but an infinite jerk's no larger than ``cap``.

    See ``units`` for the rest.
    """
    dims = numbers.shape[2]
    out = np.empty((len(chosen), 10, dims))
    for row in range(len(chosen)):
        i = chosen[row]
        for d in range(dims):
            v, a, j = second[i] / unit[i, d], second[i] ** 2 / unit[i, d], second[i] ** 3 / unit[i, d]
            for k, factor in enumerate((v, a, 1.0, v, a, v, v, a, a, j)):
                x = numbers[k, i, d] / unit[i, d] if k == 2 else numbers[k, i, d] * factor
                if k >= 5 and not (k == 9 and np.isinf(numbers[k, i, d])):
                    x = min(max(x, -cap), cap)
                out[row, k, d] = x
    return out


@njit(cache=True, error_model="numpy")
def integrate(steps, rates, stepped, start, end):  # type: ignore[no-untyped-def]
    """Return the phases (S, D, m + 1, 5) of motions that start at position 0; the last holds the end state.

    Parameters
    ----------
    steps, rates : array (S, D, m)
        Durations of the phases, and their jerks, or, where ``stepped``, their accelerations.
    stepped : array (S, D) of bool
        Whether the joint's acceleration is constant in every phase.
    start : array (2, S, D)
        Velocity and acceleration.
    end : array (3, S, D)
        Position, velocity and acceleration.
    """
    count, dims, phases = steps.shape
    out = np.zeros((count, dims, phases + 1, 5))
    for i in range(count):
        for d in range(dims):
            p, v, a = 0.0, start[0, i, d], start[1, i, d]
            for k in range(phases):
                t, j = steps[i, d, k], rates[i, d, k]
                if stepped[i, d]:
                    a, j = j, 0.0
                out[i, d, k, 0], out[i, d, k, 1], out[i, d, k, 2], out[i, d, k, 3], out[i, d, k, 4] = t, p, v, a, j
                p += t * (v + t * (a / 2.0 + t * j / 6.0))
                v += t * (a + t * j / 2.0)
                a += t * j
            for m in range(3):
                out[i, d, phases, m + 1] = end[m, i, d]
    return out


@njit(cache=True, error_model="numpy")
def extremes(phases):  # type: ignore[no-untyped-def]
    """Return the least and the largest position, velocity, acceleration and jerk of each joint, (2, 4, S, D).

    Parameters
    ----------
    phases : array (S, D, n, 5)
        Those without duration do not count.
    """
    count, dims, size, _ = phases.shape
    out = np.empty((2, 4, count, dims))
    for i in range(count):
        for d in range(dims):
            low, high = out[0, :, i, d], out[1, :, i, d]
            for m in range(4):
                low[m] = high[m] = phases[i, d, size - 1, m + 1]
            rests = True
            for k in range(size):
                t, p, v, a, j = phases[i, d, k]
                if not t > 0.0:
                    continue
                if rests:  # the end state has a jerk only where it holds for all the time
                    rests, low[3], high[3] = False, j, j
                for u in (0.0, t):
                    _include(low, high, 0, p + u * (v + u * (a / 2.0 + u * j / 6.0)))
                    _include(low, high, 1, v + u * (a + u * j / 2.0))
                    _include(low, high, 2, a + u * j)
                _include(low, high, 3, j)
                u = -a / j if j != 0.0 else 0.0
                if 0.0 < u < t:
                    _include(low, high, 1, v + u * (a + u * j / 2.0))
                square = a * a - 2.0 * j * v  # where the velocity vanishes: v + a u + j u^2 / 2 = 0
                if square >= 0.0:
                    q = -(a + np.copysign(np.sqrt(square), a))
                    for u in (q / j if j != 0.0 else 0.0, 2.0 * v / q if q != 0.0 else 0.0):
                        if 0.0 < u < t:
                            _include(low, high, 0, p + u * (v + u * (a / 2.0 + u * j / 6.0)))
    return out


@njit(cache=True, error_model="numpy")
def _include(low, high, order, value):  # type: ignore[no-untyped-def]
    low[order] = min(low[order], value)
    high[order] = max(high[order], value)


@njit(cache=True, error_model="numpy")
def merge(times, phases, origin):  # type: ignore[no-untyped-def]
    """Return breaks (K + 1,) common to all joints and the pieces' powers (4, K, D), of segments one after the other.

    A piece's powers are those of its phase about the break as rounded: pieces join but for what rounding of the clock
    does to the highest derivatives. Boundaries of different joints that differ by rounding become one.

    Parameters
    ----------
    times : array (S + 1,)
        When the segments start and end; those that take no time have no pieces.
    phases : array (S, D, n, 5)
        Positions count from ``origin``.
    origin : array (S, D)
    """
    count, dims, size, _ = phases.shape
    breaks, segment = np.empty(count * (dims * size + 1) + 1), np.empty(count * (dims * size + 1), np.int64)
    at, slack = np.empty(dims * size), np.empty(dims * size)
    k = 0
    for i in range(count):
        if not times[i + 1] > times[i]:
            continue
        tick = 2.0 * EPS * max(abs(times[i]), abs(times[i + 1]))
        found = _boundaries(phases[i], times[i + 1] - times[i], tick, at, slack)
        breaks[k], segment[k] = times[i], i
        k += 1
        for b in np.argsort(at[:found]):
            now = times[i] + at[b]
            if now - breaks[k - 1] > slack[b] and times[i + 1] - now > slack[b]:
                breaks[k], segment[k] = now, i
                k += 1
    breaks[k] = times[count]
    powers = np.empty((4, k, dims))
    for d in range(dims):
        i, f, ends = -1, 0, 0.0
        for b in range(k):
            if segment[b] != i:
                i, f, ends = segment[b], 0, phases[segment[b], d, 0, 0]
            left = breaks[b] - times[i]
            middle = 0.5 * (left + (breaks[b + 1] - times[i]))
            while f < size - 1 and not ends > middle:
                f += 1
                ends += phases[i, d, f, 0]
            u = left - (ends - phases[i, d, f, 0])
            _, p, v, a, j = phases[i, d, f]
            powers[0, b, d] = origin[i, d] + (p + u * (v + u * (a / 2.0 + u * j / 6.0)))
            powers[1, b, d] = v + u * (a + u * j / 2.0)
            powers[2, b, d] = (a + u * j) / 2.0
            powers[3, b, d] = j / 6.0
    return breaks[: k + 1].copy(), powers


@njit(cache=True, error_model="numpy")
def _boundaries(phases, duration, tick, at, slack):  # type: ignore[no-untyped-def]
    """Write when phases of any joint end within a segment, and what each may be moved by; return how many do."""
    dims, size, _ = phases.shape
    found = 0
    for d in range(dims):
        fast = hard = 0.0
        for k in range(size):
            fast, hard = max(fast, abs(phases[d, k, 2])), max(hard, abs(phases[d, k, 3]))
        ends, before = 0.0, -1
        for k in range(size):
            t, _, _, a, j = phases[d, k]
            if not t > 0.0 and k < size - 1:
                continue
            if before >= 0 and ends < duration:
                t0, _, _, a0, j0 = phases[d, before]
                bend, jump = abs(j - j0), abs(a - (a0 + t0 * j0))
                if bend > 0.0 or jump > 0.0:
                    room = CLOSE * duration
                    if bend > 0.0:
                        room = min(room, UNSEEN * hard / bend)
                    if jump > 1e-9 * hard:
                        room = min(room, UNSEEN * fast / jump)
                    at[found], slack[found] = ends, max(room, tick)
                    found += 1
            ends += t
            before = k
    return found
