"""The least duration of a motion through waypoints, from what single joints need between their turning points.

A joint's *run* covers at least a distance between two instants. At each it is at rest, turns (velocity 0, the
acceleration free), passes (any state) or, at the very ends, has a given state. All sizes are taken along the run:
highest speed ``v``, acceleration ``a`` to speed up or slow down, and the least seconds per unit of acceleration:
``rise`` for raising it, ``fall`` for lowering it (1 / jerk). Time reversed, slowing down is speeding up, with the same
``rise`` and ``fall``.

*Half a run* starts at v = 0. Where the speed must not exceed ``top``, it is at every instant at most that of the
profile which raises the acceleration (from 0 at rest; at once where it turns, so rise = 0), holds it, and lowers it
to 0 just as ``top`` is reached. For where the speed is first about to get above the profile, the acceleration is above
the profile's, so the profile is lowering it already, at full jerk; the speed then stays above, and exceeds ``top``.
This takes that the speed is kept to until the acceleration can have been lowered; else fall = 0 gives a valid profile.

The caller rounds down by 1e-12, relatively: far more than what these sums of positive terms can be wrong by.
"""

import numpy as np
from numba import njit

#: What a joint does at the end of a run.
PASS, TURN, REST, STATE = 0, 1, 2, 3
#: Rows of a joint's limits in force somewhere in a window: velocity, acceleration, jerk; first the lower ones, negated.
SIDES = 6


#: A hump this near the distance, relatively, is taken to reach it.
HUMP = 1e-9


@njit(cache=True, error_model="numpy")
def half_run(top, a, rise, fall):  # type: ignore[no-untyped-def]
    """Return d distance / d top, the distance, the highest acceleration p, and the seconds of the three phases.

    p = min(a, sqrt(2 top / (rise + fall))) is reached in p rise, held for top / p - p (rise + fall) / 2, and given up
    in p fall. The distance is convex in ``top``.
    """
    steepness = rise + fall
    if a * a * steepness <= 2.0 * top:
        up, down = a * rise, a * fall
        hold = max(top / a - 0.5 * (up + down), 0.0)
        distance = a * (up * up / 6.0 + 0.5 * hold * (up + hold)) + down * (top - a * down / 6.0)
        return 0.5 * up + hold + down, distance, a, up, hold, down
    if not steepness > 0.0:  # nothing limits the acceleration
        return 0.0, 0.0, np.inf, 0.0, 0.0, 0.0
    peak = np.sqrt(2.0 * top / steepness)
    up, down = peak * rise, peak * fall
    distance = peak * up * up / 6.0 + down * (top - peak * down / 6.0)
    return 1.5 * distance / top, distance, peak, up, 0.0, down


@njit(cache=True, error_model="numpy")
def between_stops(distance, v, a_left, rise_left, a_right, rise_right, fall):  # type: ignore[no-untyped-def]
    """Return the least seconds to cover at least that distance from v = 0 to v = 0.

    Where the speed is highest the acceleration is 0; before and after, it is at most that of a half run to this top.
    A higher top allows both a longer way in the same time: so it is v, with a cruise, or where the halves just meet.
    """
    top, slowness = v, 1.0 / a_left + 1.0 / a_right
    if slowness > 0.0:  # more than without a jerk limit, or with nothing but one, it cannot be
        top = min(top, np.sqrt(2.0 * distance / slowness))
    unit = half_run(1.0, np.inf, rise_left, fall)[1] + half_run(1.0, np.inf, rise_right, fall)[1]
    if unit > 0.0:
        top = min(top, (distance / unit) ** (2.0 / 3.0))
    if not top < np.inf:
        return 0.0
    seconds = 0.0
    for _ in range(60):  # Newton from above
        left, right = half_run(top, a_left, rise_left, fall), half_run(top, a_right, rise_right, fall)
        excess = left[1] + right[1] - distance
        if excess <= 0.0:
            seconds = left[3] + left[4] + left[5] + right[3] + right[4] + right[5]
            return seconds - excess / v if top == v else seconds
        top -= max(excess / (left[0] + right[0]), 1e-15 * top)
    return distance / v


@njit(cache=True, error_model="numpy")
def to_passing(distance, v, a, rise, fall):  # type: ignore[no-untyped-def]
    """Return the least seconds to cover at least that distance from v = 0, in the half run to v and a cruise."""
    _, total, peak, up, hold, down = half_run(v, a, rise, fall)
    if distance >= total:
        return up + hold + down + (distance - total) / v
    if distance <= peak * up * up / 6.0:
        return np.cbrt(6.0 * distance * rise)
    rest, speed = distance - peak * up * up / 6.0, 0.5 * peak * up
    seconds = 2.0 * rest / (speed + np.sqrt(speed * speed + 2.0 * peak * rest))
    if seconds <= hold:
        return up + seconds
    rest, speed = rest - hold * (speed + 0.5 * peak * hold), speed + peak * hold
    least = 2.0 * rest / (speed + np.sqrt(speed * speed + 2.0 * peak * rest))
    seconds = down
    for _ in range(60):  # Newton from above: the distance is convex in time
        excess = seconds * (speed + seconds * (0.5 * peak - seconds / (6.0 * fall))) - rest
        if excess <= 0.0:
            return up + hold + seconds
        slope = speed + seconds * (peak - 0.5 * seconds / fall)
        seconds -= max(excess / slope, 1e-15 * seconds)
    return up + hold + least


@njit(cache=True, error_model="numpy")
def moving_half(top, a, rise, fall, speed, slope):  # type: ignore[no-untyped-def]
    """Return the highest acceleration and the seconds of the three phases as ``half_run``, from a given state instead.

    ``speed`` and ``slope``: the state's velocity and acceleration along the run; ``top`` >= ``least_top`` of them.
    """
    peak = max(a, slope)
    gain = top - speed + 0.5 * slope * slope * rise
    if 0.5 * peak * peak * (rise + fall) > gain:
        peak = np.sqrt(max(2.0 * gain / (rise + fall), 0.0))
    up, down = max(peak - slope, 0.0) * rise, peak * fall
    hold = max((gain - 0.5 * peak * peak * (rise + fall)) / peak, 0.0) if peak > 0.0 else 0.0
    return peak, up, hold, down


@njit(cache=True, error_model="numpy")
def covered(seconds, top, peak, up, hold, down, speed, slope):  # type: ignore[no-untyped-def]
    """Return the distance of such a profile, and then of a cruise at ``top``, in ``seconds``."""
    t = min(seconds, up)
    jolt = (peak - slope) / up if up > 0.0 else 0.0
    distance = t * (speed + t * (0.5 * slope + t * jolt / 6.0))
    if seconds <= up:
        return distance
    t, speed = min(seconds - up, hold), speed + 0.5 * up * (slope + peak)
    distance += t * (speed + 0.5 * t * peak)
    if seconds <= up + hold:
        return distance
    t, left = min(seconds - up - hold, down), max(up + hold + down - seconds, 0.0)
    lost = peak * (down * down * down - left * left * left) / (6.0 * down) if down > 0.0 else 0.0
    return distance + top * t - lost + top * max(seconds - up - hold - down, 0.0)


@njit(cache=True)
def least_top(rise, fall, speed, slope):  # type: ignore[no-untyped-def]
    """Return the speed at which the acceleration can first be 0."""
    return speed + 0.5 * slope * slope * (fall if slope > 0.0 else -rise)


@njit(cache=True, error_model="numpy")
def state_to_passing(distance, v, a, rise, fall, speed, slope):  # type: ignore[no-untyped-def]
    """Return the least seconds to cover at least that distance from a state, in its half run to v and a cruise."""
    low, high = 0.0, distance / v
    if not (v < np.inf and a < np.inf and least_top(rise, fall, speed, slope) <= v and speed <= v):
        return high
    profile = moving_half(v, a, rise, fall, speed, slope)
    # braking hard it may turn back before it goes on: what is covered has a hump, which may reach the distance first
    bend = slope * slope - 2.0 * speed / rise
    if slope < 0.0 and speed > 0.0 and bend > 0.0:
        turn = 2.0 * speed / (np.sqrt(bend) - slope)
        if turn <= profile[1] and covered(turn, v, *profile, speed, slope) >= distance * (1.0 - HUMP):
            high = turn
            for _ in range(50):
                middle = 0.5 * (low + high)
                if covered(middle, v, *profile, speed, slope) < distance * (1.0 - HUMP):
                    low = middle
                else:
                    high = middle
            return low
    while covered(high, v, *profile, speed, slope) < distance:
        low, high = high, 2.0 * high
    for _ in range(50):
        middle = 0.5 * (low + high)
        if covered(middle, v, *profile, speed, slope) < distance:
            low = middle
        else:
            high = middle
    return low


@njit(cache=True, error_model="numpy")
def state_to_stop(distance, v, a_left, rise_left, a_right, rise_right, fall, speed, slope):  # type: ignore[no-untyped-def]
    """Return the least seconds to cover at least that distance from a state to v = 0.

    As ``between_stops``, the top being the highest speed once the acceleration has been 0, or ``least_top`` if that is
    more: a top below it would only lower both bounds of the speed, and what the halves to ``least_top`` do not cover
    takes a higher one. If the acceleration is never 0 it stays below 0 all the way (above, the speed could not end at
    0), and the speed stays below the first one.
    """
    passing = to_passing(distance, v, a_right, rise_right, 0.0)
    low = max(least_top(rise_left, fall, speed, slope), 0.0)
    if not (low <= v and v < np.inf and a_left < np.inf and a_right < np.inf and speed <= v):
        return passing
    high, top = v, v
    least = np.inf
    for k in range(54):
        left = moving_half(top, a_left, rise_left, fall, speed, slope)
        right = moving_half(top, a_right, rise_right, fall, 0.0, 0.0)
        first, second = left[1] + left[2] + left[3], right[1] + right[2] + right[3]
        both = covered(first, top, *left, speed, slope) + covered(second, top, *right, 0.0, 0.0)
        if k == 0 and both <= distance:
            least = first + second + (distance - both) / v
            break
        if k == 1 and both > distance:
            return passing
        if both > distance:
            high = top
        else:
            low, least = top, first + second
        top = low if k == 0 else 0.5 * (low + high)
    if slope < 0.0 and speed > 0.0:
        least = min(least, distance / speed)
    return max(least, passing)


@njit(cache=True, error_model="numpy")
def run(distance, downwards, sides, left, right, lasting, state):  # type: ignore[no-untyped-def]
    """Return the least seconds of a run between two of ``PASS``, ``TURN``, ``REST`` and ``STATE``.

    ``sides`` (6,): the limits; ``lasting``: they hold beyond a passing end until the acceleration has been 0; ``state``
    (2, 2): velocity and acceleration at the start and at the end.
    """
    here, back = (0, 3) if downwards else (3, 0)
    v, a_left, a_right = sides[here], sides[here + 1], sides[back + 1]
    rise, fall = 1.0 / sides[here + 2], 1.0 / sides[back + 2]
    if left == PASS and right == PASS:
        return distance / v
    if left == STATE or right == STATE:
        way = -1.0 if downwards else 1.0
        first, last = state[0, 0] * way, state[1, 0] * way
        slope, steepness = state[0, 1] * way, -state[1, 1] * way
        if left == STATE and right == STATE:
            forth = state_to_passing(distance, v, a_left, rise, 0.0, first, slope)
            return max(forth, state_to_passing(distance, v, a_right, rise, 0.0, last, steepness))
        if right == PASS:
            return state_to_passing(distance, v, a_left, rise, fall if lasting else 0.0, first, slope)
        if left == PASS:
            return state_to_passing(distance, v, a_right, rise, fall if lasting else 0.0, last, steepness)
        other = rise if left == REST or right == REST else 0.0
        if left == STATE:
            return state_to_stop(distance, v, a_left, rise, a_right, other, fall, first, slope)
        return state_to_stop(distance, v, a_right, rise, a_left, other, fall, last, steepness)
    rise_left, rise_right = rise if left == REST else 0.0, rise if right == REST else 0.0
    if right == PASS:
        return to_passing(distance, v, a_left, rise_left, fall if lasting else 0.0)
    if left == PASS:
        return to_passing(distance, v, a_right, rise_right, fall if lasting else 0.0)
    return between_stops(distance, v, a_left, rise_left, a_right, rise_right, fall)


@njit(cache=True)
def loosest(lower, upper, d, first, last, uniform, sides):  # type: ignore[no-untyped-def]
    """Write the loosest of joint d's limits over the segments first … last - 1 to ``sides`` (6,)."""
    for k in range(3):
        sides[k], sides[3 + k] = -lower[k, first, d], upper[k, first, d]
        if not uniform:
            for i in range(first + 1, last):
                sides[k], sides[3 + k] = max(sides[k], -lower[k, i, d]), max(sides[3 + k], upper[k, i, d])


@njit(cache=True)
def least_times(points, lower, upper, least, kinds, states, lasting, uniform, most, best):  # type: ignore[no-untyped-def]
    """Write to ``best`` (N,) the least seconds from the first waypoint to each of them.

    ``points`` (N, D); ``lower``, ``upper`` (3, S, D) by order, ``least`` (S,) s; ``kinds`` (2, D): how each joint
    starts and ends, in ``states`` (D, 2, 2) if that is known; ``lasting`` (2, D): whether its limits, the same on all
    segments, let its acceleration become 0 there; ``uniform`` (D,). An interval of at most ``most`` segments (from the
    first waypoint on: of any number) is charged to one joint, or a single one to its ``least``; the intervals follow
    one another, so their times add up.

    Within an interval a joint's strict extremes e_1, e_2 … among the waypoints (the ends apart) alternate. It takes
    its maximum between the waypoints beside e_k, or the instant before if that is later, and the first lower one after
    e_k: in the interior, as both ends are lower, so it turns there, at e_k or beyond. These instants follow one
    another, as the next one's interval starts no sooner and ends later. Between two of them it covers at least
    |e_k - e_(k-1)|, and only segments from the waypoint before e_(k-1) to the first beyond e_k on its other side.
    """
    count, dims = points.shape
    segments = count - 1
    best[:] = 0.0
    sides = np.empty(SIDES)
    moves = np.zeros(dims, dtype=np.bool_)
    for d in range(dims):
        for i in range(1, count):
            moves[d] |= points[i, d] != points[0, d]
    # From turn to turn, and from a turn to a waypoint passed, by the waypoint at the far end; negative: not yet known.
    turned, passed = np.full((count, dims), -1.0), np.full((count, dims), -1.0)
    for a in range(segments):
        best[a + 1] = max(best[a + 1], best[a] + least[a])
        last = segments if a == 0 else min(a + most, segments)
        for d in range(dims):
            if not moves[d]:
                continue
            left = kinds[0, d] if a == 0 else PASS
            inner = False  # whether the run starts at a turn within the interval: then it is the same for every a
            total, anchor, first, extreme, at, way = 0.0, points[a, d], a, points[a, d], a, 0.0
            for b in range(a + 1, last + 1):
                here = points[b, d]
                step = here - extreme
                if step * way < 0.0:  # turned at ``extreme``
                    seconds = turned[at, d] if inner else -1.0
                    if seconds < 0.0:
                        loosest(lower, upper, d, first, b, uniform[d], sides)
                        length = abs(extreme - anchor)
                        seconds = run(length, way < 0.0, sides, left, TURN, lasting[0, d], states[d])
                        if inner:
                            turned[at, d] = seconds
                    total += seconds
                    left, inner, anchor, first = TURN, True, extreme, at - 1
                if step != 0.0:
                    extreme, at, way = here, b, np.sign(step)
                elif way == 0.0:
                    continue
                seconds = passed[b, d] if inner else -1.0
                if seconds < 0.0:
                    loosest(lower, upper, d, first, b, uniform[d], sides)
                    right = kinds[1, d] if b == segments else PASS
                    holds = lasting[1, d] if right == PASS else lasting[0, d]
                    seconds = run(abs(here - anchor), way < 0.0, sides, left, right, holds, states[d])
                    if inner:
                        passed[b, d] = seconds
                best[b] = max(best[b], best[a] + total + seconds)
