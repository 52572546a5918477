r"""A lower bound on the duration of every law along a path q(s), from an upper envelope of a = sdot².

Where q'_j > 0 on an interval, the limit q'' a + q' a' / 2 <= upper says a' <= 2 (upper - q'' a) / q'. That is linear in
a: a line z + 2 U t over the distance t from the interval's left end, with a <= z there and

    (q' + 2 t q'') U >= upper - q'' z   on the whole interval,

stays above every law (comparison of a linear differential inequality). Where q'_j < 0 its lower limit does the same,
and from the right end the reversed path. All is polynomial in t, so it holds on the interval if it holds for the
Bernstein coefficients; that loses O(h²). Such lines, carried forth and back over the intervals, together with what the
limits at the stations allow and with chords above (v / q')², leave a <= min (lines), and ds / sqrt(min) is integrated
in closed form. Nothing here supposes a law of a certain shape: it may accelerate as it likes, between stations too.
"""

import numpy as np
from numba import njit

#: Subtracted from the bound, relatively, for rounding.
SLACK = 1e-11
#: Values of q' below this are zero, relative to what they are summed from.
NOISE = 2e-15
#: More crossings than any walk has.
WALK = 200


@njit(cache=True, error_model="numpy")
def _controls(breaks, coefficients, grid, controls):  # type: ignore[no-untyped-def]
    """Write the Bernstein coefficients of q' on every interval, (n, D, m) for paths of degree m."""
    count, dims, size = controls.shape
    degree, pieces = len(coefficients) - 1, len(breaks) - 1
    own = np.empty(degree + 1)
    i = 0
    for k in range(count):
        middle = 0.5 * (grid[k] + grid[k + 1])
        while i < pieces - 1 and middle >= breaks[i + 1]:
            i += 1
        rate = 1.0 / (breaks[i + 1] - breaks[i])
        start = min(max((grid[k] - breaks[i]) * rate, 0.0), 1.0)
        width = (grid[k + 1] - grid[k]) * rate
        for d in range(dims):
            controls[k, d, :] = 0.0
            noise = 0.0
            for r in range(degree + 1):
                own[r] = coefficients[degree - r, i, d]
                noise += NOISE * rate * r * abs(own[r])
            for r in range(degree):  # the Taylor coefficients at the interval's left end
                for j in range(degree - 1, r - 1, -1):
                    own[j] += start * own[j + 1]
            factor = rate
            for r in range(degree):  # those of q' in the interval's own variable, divided by binomials
                controls[k, d, r] = factor * (r + 1.0) * own[r + 1]
                factor *= width * (r + 1.0) / (size - 1.0 - r) if r < size - 1 else 1.0
            for r in range(1, size):
                for j in range(size - 1, r - 1, -1):
                    controls[k, d, j] += controls[k, d, j - 1]
            for r in range(size):
                if abs(controls[k, d, r]) <= noise:
                    controls[k, d, r] = 0.0


@njit(cache=True, error_model="numpy")
def _changes(control):  # type: ignore[no-untyped-def]
    """Return how often the Bernstein coefficients (m,) change sign, and the last sign; 0 if all are zero."""
    count, sign = 0, 0
    for i in range(len(control)):
        x = control[i]
        if x != 0.0:
            now = 1 if x > 0.0 else -1
            count += now == -sign
            sign = now
    return count, sign


@njit(cache=True, error_model="numpy")
def _turn(control, own):  # type: ignore[no-untyped-def]
    """Return the integrals over [0, x] and [x, 1] of a polynomial whose coefficients change sign once, at its root x.

    ``own`` (2, m) is scratch.
    """
    size = len(control)
    low, high = 0.0, 1.0
    falls = control[0] > 0.0 or control[size - 1] < 0.0
    for _ in range(50):
        x = 0.5 * (low + high)
        for i in range(size):
            own[1, i] = control[i]
        left = own[1, 0]
        for r in range(1, size):
            for i in range(size - r):
                own[1, i] += x * (own[1, i + 1] - own[1, i])
            left += own[1, 0]
        if (own[1, 0] > 0.0) == falls:
            low = x
        else:
            high = x
    right = 0.0
    for i in range(size):
        right += own[1, i]
    return left * x / size, right * (1.0 - x) / size


@njit(cache=True, error_model="numpy")
def _carried(z, step, control, lower, upper, way, own):  # type: ignore[no-untyped-def]
    """Return the largest sdot² at an interval's other end of the laws that start it with sdot² <= z.

    Every joint bounds it by itself: where q_j is monotone, its squared speed grows by at most twice the limit times the
    way; where it turns round, it is at rest. ``control`` (D, m) are the Bernstein coefficients of q', ``lower`` and
    ``upper`` (D,) the acceleration limits.
    """
    dims, size = control.shape
    best, backwards = np.inf, way < 0.0
    for d in range(dims):
        start, end = (control[d, size - 1], control[d, 0]) if backwards else (control[d, 0], control[d, size - 1])
        changes = _changes(control[d])[0]
        if changes > 1 or end == 0.0:
            continue
        length = 0.0
        if changes == 1:
            before, after = _turn(control[d], own)
            length, square = abs(before if backwards else after), 0.0
        else:
            for i in range(size):
                length += control[d, i]
            length, square = abs(length) / size, z * start * start if start != 0.0 else 0.0
        limit = upper[d] if (end > 0.0) != backwards else -lower[d]
        best = min(best, (square + 2.0 * limit * length * step) / (end * end))
    return best


@njit(cache=True, error_model="numpy")
def _line(z, step, control, lower, upper, way):  # type: ignore[no-untyped-def]
    """Return the ends of a line over an interval that stays above every law with sdot² <= z where it starts."""
    dims, size = control.shape
    m = size - 1
    best_start, best_end, backwards = np.inf, np.inf, way < 0.0
    for d in range(dims):
        changes, sign = _changes(control[d])
        if sign == 0:
            continue
        if changes > 0:
            # a <= limit / |q''| where q_j turns round; from there on the same with the least |q''|
            least, most = np.inf, -np.inf
            for i in range(m):
                bend = sign * m * (control[d, i + 1] - control[d, i]) / step
                least = min(least, bend)
            limit = upper[d] if sign > 0 else -lower[d]
            if changes == 1 and least > 0.0 and limit / least < best_end:
                best_start = best_end = limit / least
            continue
        limit = upper[d] if (sign > 0) != backwards else -lower[d]
        start, least, most = z, -np.inf, np.inf
        first = sign * control[d, m if backwards else 0]
        if first == 0.0 and m > 0:
            # a itself is limited where the joint stands still: from a larger one on there is a line
            bend = m * sign * control[d, m - 1 if backwards else 1] / step
            start = max(start, limit / bend) if bend > 0.0 else start
        if start == np.inf:
            continue
        for i in range(size):
            at = m - i if backwards else i
            q = sign * control[d, at]
            before = q - sign * control[d, at + 1 if backwards else at - 1] if i > 0 else 0.0
            after = sign * control[d, at - 1 if backwards else at + 1] - q if i < m else 0.0
            bend = ((m - i) * after + i * before) / step
            lever = q + 2.0 * i * before
            need = limit - bend * start
            if lever > 0.0:
                least = max(least, need / lever)
            elif lever < 0.0:
                most = min(most, need / lever)
            elif need > 4e-15 * limit:
                most = -np.inf
        if least <= most and start + 2.0 * least * step < best_end:
            best_start, best_end = start, start + 2.0 * least * step
    return best_start, best_end


@njit(cache=True, error_model="numpy")
def _ceiling(x, slopes, bends, lower, upper):  # type: ignore[no-untyped-def]
    """Return the largest sdot² <= x with which some sddot keeps the acceleration limits at a place; all are (D,)."""
    for _ in range(WALK):
        top, bottom, over, under, over_gain, under_gain = np.inf, -np.inf, 0.0, 0.0, 0.0, 0.0
        for d in range(len(slopes)):
            if slopes[d] == 0.0:
                if bends[d] != 0.0:
                    x = min(x, (upper[d] if bends[d] > 0.0 else lower[d]) / bends[d])
                continue
            inverse = 1.0 / slopes[d]
            gain = -bends[d] * inverse
            high = (upper[d] if slopes[d] > 0.0 else lower[d]) * inverse
            low = (lower[d] if slopes[d] > 0.0 else upper[d]) * inverse
            if x == np.inf:  # as good as that
                x = 1e100
            if high + gain * x < top:
                top, over, over_gain = high + gain * x, high, gain
            if low + gain * x > bottom:
                bottom, under, under_gain = low + gain * x, low, gain
        if bottom <= top or under_gain <= over_gain:
            return x
        at = (over - under) / (under_gain - over_gain)
        if not at < x:
            return x
        x = at
    return x


@njit(cache=True, error_model="numpy")
def _chord(control, v_lower, v_upper, norm, squares, own):  # type: ignore[no-untyped-def]
    """Return the ends of a line over an interval that stays above every sdot² that the velocity limits allow.

    It is a chord of one joint's (v / q')², or of that of the norm, raised until the Bernstein coefficients of the line
    times (q' / v)² are all >= 1. ``squares`` and ``own`` (2 m - 1,) are scratch.
    """
    dims, size = control.shape
    m = size - 1
    chosen, fastest = -1, 0.0
    for d in range(dims):
        ratio = np.inf
        for i in range(0, size, max(m, 1)):
            q = control[d, i]
            ratio = min(ratio, q / (v_upper[d] if q > 0.0 else v_lower[d]))
        if ratio > fastest and control[d, 0] * control[d, m] > 0.0:
            chosen, fastest = d, ratio
    start = end = np.inf
    for turn in range(2):
        if (norm == np.inf) if turn else chosen < 0:
            continue
        squares[:] = 0.0
        for d in range(dims):
            if turn or d == chosen:
                limit = norm if turn else v_upper[d] if control[d, 0] > 0.0 else v_lower[d]
                left = 1.0
                for i in range(size):
                    right = 1.0
                    for j in range(size):
                        squares[i + j] += left * right * (control[d, i] / limit) * (control[d, j] / limit)
                        right *= (m - j) / (j + 1.0)
                    left *= (m - i) / (i + 1.0)
        binomial = 1.0
        for i in range(2 * m + 1):
            own[i] = squares[i] / binomial
            binomial *= (2 * m - i) / (i + 1.0)
        if own[0] <= 0.0 or own[2 * m] <= 0.0:
            continue
        left, right, least = 1.0 / own[0], 1.0 / own[2 * m], 1.0
        for i in range(1, 2 * m + 1):
            least = min(least, ((2 * m + 1 - i) * left * own[i] + i * right * own[i - 1]) / (2 * m + 1))
        if least > 0.0 and (left + right) / least < start + end:
            start, end = left / least, right / least
    return start, end


@njit(cache=True, error_model="numpy")
def _time(step, lines, at):  # type: ignore[no-untyped-def]
    """Return the integral of ds / sqrt(a) over an interval, a being the least of lines (3, 2) given by their ends.

    Lines that are not finite do not count. ``at`` (5,) is scratch.
    """
    count = 1
    at[0] = 0.0
    for i in range(3):
        for j in range(i):
            left, right = lines[i, 0] - lines[j, 0], lines[i, 1] - lines[j, 1]
            if left * right < 0.0 and abs(left) < np.inf and abs(right) < np.inf:
                at[count] = left / (left - right)
                count += 1
    at[count] = 1.0
    count += 1
    for i in range(2, count):
        for j in range(i, 1, -1):
            at[j - 1], at[j] = min(at[j - 1], at[j]), max(at[j - 1], at[j])
    total = 0.0
    for r in range(count - 1):
        x0, x1 = at[r], at[r + 1]
        left = right = np.inf
        for i in range(3):
            y0, y1 = lines[i, 0], lines[i, 1]
            if y0 < np.inf and y1 < np.inf:
                noise = 1e-15 * max(y0, y1)  # of x, where lines cross: a too large only makes the bound too low
                left = min(left, y0 * (1.0 - x0) + y1 * x0 + (noise if x0 > 0.0 else 0.0))
                right = min(right, y0 * (1.0 - x1) + y1 * x1 + (noise if x1 < 1.0 else 0.0))
        if x1 > x0:
            total += (x1 - x0) * 2.0 / (np.sqrt(max(left, 0.0)) + np.sqrt(max(right, 0.0)))
    return total * step


@njit(cache=True, error_model="numpy")
def least_duration(  # type: ignore[no-untyped-def]
    breaks, coefficients, grid, lower, upper, v_lower, v_upper, norm, first, last, seconds
):
    """Return a duration in s that no law along the path undercuts, and write what every interval takes at least.

    Parameters
    ----------
    breaks : array (K + 1,)
    coefficients : array (m + 1, K, D)
        The path; highest power first, in the local variable in [0, 1] of the piece.
    grid : array (n + 1,)
        Increasing stations, the breaks among them.
    lower, upper, v_lower, v_upper : array (n, D)
        Limits of acceleration and velocity on the intervals, <= 0 <=, may be infinite.
    norm : array (n,)
        Limit of the Euclidean norm of the velocity, may be infinite.
    first, last : float
        sdot² at the two ends.
    seconds : array (n,)
        Overwritten.
    """
    count, dims = lower.shape
    size = max(len(coefficients) - 1, 1)
    controls = np.empty((count, dims, size))
    _controls(breaks, coefficients, grid, controls)
    slopes, bends, lines, at = np.empty(dims), np.empty(dims), np.empty((3, 2)), np.empty(5)
    squares, own = np.empty(2 * size - 1), np.empty(2 * size - 1)
    most, chords = np.empty(count + 1), np.empty((count, 2))
    most[:] = np.inf
    most[0], most[count] = first, last
    for k in range(count):
        step = grid[k + 1] - grid[k]
        for end in range(2):
            x, total = most[k + end], 0.0
            for d in range(dims):
                i, j = (size - 1, max(size - 2, 0)) if end else (min(1, size - 1), 0)
                slopes[d] = q = controls[k, d, end * (size - 1)]
                bends[d] = (size - 1) * (controls[k, d, i] - controls[k, d, j]) / step
                ratio = q / (v_upper[k, d] if q > 0.0 else v_lower[k, d])
                x = min(x, 1.0 / (ratio * ratio)) if ratio > 0.0 else x
                total += q * q
            x = min(x, norm[k] * norm[k] / total) if total > 0.0 else x
            most[k + end] = min(most[k + end], _ceiling(x, slopes, bends, lower[k], upper[k]))
        chords[k, 0], chords[k, 1] = _chord(controls[k], v_lower[k], v_upper[k], norm[k], squares, own)
    turn = np.empty((2, size))
    for k in range(count):
        step = grid[k + 1] - grid[k]
        most[k + 1] = min(most[k + 1], _carried(most[k], step, controls[k], lower[k], upper[k], 1.0, turn))
    duration = 0.0
    for k in range(count - 1, -1, -1):
        step = grid[k + 1] - grid[k]
        most[k] = min(most[k], _carried(most[k + 1], step, controls[k], lower[k], upper[k], -1.0, turn))
        line = _line(most[k + 1], step, controls[k], lower[k], upper[k], -1.0)
        lines[0, 0], lines[0, 1] = line[1], line[0]
        lines[1, 0], lines[1, 1] = _line(most[k], step, controls[k], lower[k], upper[k], 1.0)
        lines[2, 0], lines[2, 1] = chords[k, 0], chords[k, 1]
        seconds[k] = (1.0 - SLACK) * _time(step, lines, at)
        duration += seconds[k]
    return duration
