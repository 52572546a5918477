r"""The fastest speeds along a path q(s) under limits on velocity and acceleration, in one pass back and one forth.

With a = sdot², linear between the stations s_0 < … < s_n, u = sddot = (a_{k+1} - a_k) / (2 h_k) is constant on an
interval, velocity is q' sqrt(a) and acceleration q'' a + q' u. At both ends of an interval every joint thus has a row
linear in x = a_k and y = a_{k+1}: with p = q' / (2 h),

    lower <= (q'' - p) x + p y <= upper    at the left end,
    lower <= -p x + (p + q'') y <= upper   at the right end,

that is, D + M x <= y <= U + M x. Backwards, the controllable x are those for which some controllable y keeps all rows:
hi(x) = min (U + M x) and lo(x) = max (D + M x) with hi - lo concave, so the walk from crossing to crossing of the two
lines that are active reaches the largest x, and from below the least, monotonically. Forwards, y = hi(x) from x = a_k
is the largest a_{k+1}: greed is optimal, as with more speed everywhere no time is lost.
"""

import numpy as np
from numba import njit

from .lanes import LANES, load, plus, scaled, store
from .lanes import step as fused
from .path_rows import PULL, highest, own_limit, padded, rows_of, walk

#: sdot² is never more than this times what velocity or acceleration limits allow where the path is at its steepest:
#: where the path stands still nothing else bounds it.
REACH = 1e16
#: Given end values may miss the controllable ones by this, relatively.
MISS = 1e-9


@njit(cache=True, error_model="numpy")
def interval_derivatives(breaks, coefficients, grid, fractions, out):  # type: ignore[no-untyped-def]
    """Write the path's derivatives at the same fractions of every interval, each on the interval's own piece.

    Parameters
    ----------
    breaks : array (K + 1,)
    coefficients : array (m + 1, K, D)
        Highest power first, in the local variable in [0, 1] of the piece.
    grid : array (n + 1,)
        Increasing stations, the breaks among them.
    fractions : array (P,)
        In [0, 1]; at 0 and 1 the derivatives are one-sided.
    out : array (R, P, n, D)
        Overwritten with the derivatives of order 1 … R <= 3 with respect to the parameter.
    """
    orders, points, count, dims = out.shape
    size, pieces = coefficients.shape[:2]
    c, to = coefficients.reshape(-1), out.reshape(-1)
    row, plane = pieces * dims, points * count * dims
    width = (dims + LANES - 1) // LANES * LANES
    eights = size == 4 and 2 * dims > LANES and row >= width
    for p in range(points):
        i = 0
        for k in range(count):
            left, step = grid[k], grid[k + 1] - grid[k]
            middle = left + 0.5 * step
            while i < pieces - 1 and middle >= breaks[i + 1]:
                i += 1
            rate = 1.0 / (breaks[i + 1] - breaks[i])
            x = (left + fractions[p] * step - breaks[i]) * rate
            x = 0.0 if x < 0.0 else 1.0 if x > 1.0 else x
            if eights and k * dims + width <= count * dims:  # the next interval overwrites what is too much
                for d in range(0, dims, LANES):
                    at, own = (p * count + k) * dims + d, i * dims + d
                    c3, c2 = load(c, own), load(c, own + row)
                    third = scaled(c3, 3.0)
                    p2 = fused(third, x, c2)
                    store(to, at, scaled(fused(plus(p2, c2), x, load(c, own + 2 * row)), rate))
                    if orders > 1:
                        store(to, at + plane, scaled(p2, 2.0 * rate * rate))
                    if orders > 2:
                        store(to, at + 2 * plane, scaled(third, 2.0 * rate * rate * rate))
                continue
            for d in range(dims):
                p0 = coefficients[0, i, d]
                p1 = p2 = p3 = 0.0
                for r in range(1, size):
                    p3 = p3 * x + p2
                    p2 = p2 * x + p1
                    p1 = p1 * x + p0
                    p0 = p0 * x + coefficients[r, i, d]
                out[0, p, k, d] = p1 * rate
                if orders > 1:
                    out[1, p, k, d] = 2.0 * p2 * rate * rate
                if orders > 2:
                    out[2, p, k, d] = 6.0 * p3 * rate * rate * rate


@njit(cache=True, error_model="numpy")
def speed_caps(slopes, v_lower, v_upper, norm, tighten, caps):  # type: ignore[no-untyped-def]
    """Write the largest sdot² at the stations that the velocity limits of both adjacent intervals allow.

    Parameters
    ----------
    slopes : array (2, n, D)
        q' at the left and the right end of every interval.
    v_lower, v_upper : array (n, D)
        Velocity limits, <= 0 <=, may be infinite.
    norm : array (n,)
        Limit of the Euclidean norm of the velocity, may be infinite.
    tighten : array (n,)
        Factor of sdot² by which the limits of an interval are lowered.
    caps : array (n + 1,)
        Overwritten; infinite where nothing limits.
    """
    count, dims = v_lower.shape
    caps[:] = np.inf
    for k in range(count):
        for end in range(2):
            most = total = 0.0
            for d in range(dims):
                w = slopes[end, k, d]
                ratio = w / (v_upper[k, d] if w > 0.0 else v_lower[k, d])
                most = ratio if ratio > most else most
                total += w * w
            total = total / (norm[k] * norm[k])
            most = max(most * most, total)
            cap = tighten[k] / most if most > 0.0 else np.inf
            caps[k + end] = min(caps[k + end], cap)


@njit(cache=True, error_model="numpy")
def _reach(steps, slopes, caps, lower, upper, first, last):  # type: ignore[no-untyped-def]
    """Return the largest sdot² that is considered at all."""
    count, dims = lower.shape
    length, unit, most = 0.0, np.inf, 0.0
    for k in range(count + 1):
        unit = min(unit, caps[k] if caps[k] > 0.0 else np.inf)
        most = max(most, caps[k])
    if most < np.inf and most <= REACH * unit:
        return most
    steepest, least = np.zeros(dims), np.zeros(dims)
    least[:] = np.inf
    for k in range(count):
        length += steps[k]
        for d in range(dims):
            steepest[d] = max(steepest[d], max(abs(slopes[0, k, d]), abs(slopes[1, k, d])))
            least[d] = min(least[d], upper[k, d] if upper[k, d] > 0.0 else np.inf)
            least[d] = min(least[d], -lower[k, d] if lower[k, d] < 0.0 else np.inf)
    for d in range(dims):
        if steepest[d] > 0.0:
            unit = min(unit, least[d] * length / steepest[d])
    unit = unit if unit < np.inf else length * length
    return max(REACH * unit, 2.0 * max(first, last))


@njit(cache=True, error_model="numpy")
def fastest_speeds(steps, slopes, bends, caps, lower, upper, first, last, best, least, a):  # type: ignore[no-untyped-def]
    """Write the fastest sdot² at the stations, and the set of those from which the end can be reached.

    Parameters
    ----------
    steps : array (n,)
        Lengths of the intervals in the parameter.
    slopes, bends : array (2, n, D)
        q' and q'' at the left and the right end of every interval.
    caps : array (n + 1,)
        Upper bounds of sdot², may be infinite.
    lower, upper : array (n, D)
        Acceleration limits, < 0 <, may be infinite.
    first, last : float
        sdot² at the two ends; 0 is rest.
    best, least : array (n + 1,)
        Overwritten with the largest and the least sdot² from which the end can be reached.
    a : array (n + 1,)
        Overwritten with the fastest profile.

    Returns
    -------
    status, where : int
        0: solved. 1: no sdot² at station ``where`` lets the end be reached. 2: ``first`` is too much, 3: too little.
    """
    count, dims = lower.shape
    reach = _reach(steps, slopes, caps, lower, upper, first, last)
    if last > caps[count] * (1.0 + MISS):
        return 1, count
    width = (dims + LANES - 1) // LANES * LANES
    rows, spare = np.zeros(6 * width), np.zeros(width)
    for d in range(width):
        spare[d] = -np.inf if d < dims else np.inf
    arrays = slopes.reshape(-1), bends.reshape(-1), lower.reshape(-1), upper.reshape(-1)
    own = np.zeros(2 * width), np.zeros(2 * width), np.zeros(width), np.zeros(width)
    safe = count - (width + dims - 1) // dims  # after it eights would be read past the arrays
    best[count] = least[count] = last
    active = -1
    for k in range(count - 1, -1, -1):
        rate = 0.5 / steps[k]
        if k <= safe:
            flat = rows_of(k * dims, count * dims, rate, arrays, spare, rows)
        else:
            padded(k, slopes, bends, lower, upper, own)
            flat = rows_of(0 * k, width, rate, own, spare, rows)
        limit = min(caps[k], reach)
        if flat:
            limit = own_limit(limit, k, rate, slopes, bends, lower, upper)
        top, bottom = best[k + 1], least[k + 1]
        start = limit
        if active >= 0 and rows[active] > 0.0:  # the row that was active at the last station mostly is so here, too
            guess = (top - rows[4 * width + active]) / rows[active] * (1.0 - PULL)
            start = max(min(guess, limit), 0.0)
        x, now = walk(start, -1.0, rows, top, bottom)
        active = now if now >= 0 else active
        x = x * (1.0 - PULL) if x < limit else x
        if bottom <= 0.0:  # resting is always possible
            best[k], least[k] = max(x, 0.0), 0.0
            continue
        low = min(walk(0.0, 1.0, rows, top, bottom)[0] * (1.0 + PULL), limit)
        if x < 0.0 or low < 0.0 or low > x * (1.0 + MISS):
            return 1, k
        best[k], least[k] = x, min(low, x)
    if first > best[0] * (1.0 + MISS):
        return 2, 0
    if first < least[0] * (1.0 - MISS):
        return 3, 0
    a[0] = x = max(min(first, best[0]), least[0])
    for k in range(count):
        rate = 0.5 / steps[k]
        if k <= safe:
            rows_of(k * dims, count * dims, rate, arrays, spare, rows)
        else:
            padded(k, slopes, bends, lower, upper, own)
            rows_of(0 * k, width, rate, own, spare, rows)
        a[k + 1] = x = max(highest(x, rows, best[k + 1]), least[k + 1])
    return 0, 0
