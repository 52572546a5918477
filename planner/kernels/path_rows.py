"""The rows of an interval between stations, low + gain x <= y <= high + gain x, eight at a time, and their crossings.

What they stand for is told in ``path_speeds``.
"""

from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

from .lanes import _VECTOR, LANES, _operation, exceeds, lanes, larger, load, plus, product, scaled, smaller, step, store

#: Rows that depend on y by less than this, relatively, are taken as bounds of x.
FLAT = 1e-60
#: Coefficients of y below this count as this.
TINY = 1e-200
#: Crossings are pulled inwards by this, relatively: where a row is steep in x, rounding of y must not close the gap.
PULL = 1e-14
#: More crossings than any walk has.
WALK = 200


@intrinsic
def _inverse(typing: Any, x: Any) -> Any:
    """Return 1 / x, as if x were TINY where it is less."""

    def build(builder: Any, x: Any) -> Any:
        tiny, one = (ir.Constant(_VECTOR, [value] * LANES) for value in (TINY, 1.0))
        small = builder.and_(builder.fcmp_ordered("<", x, tiny), builder.fcmp_ordered(">", x, builder.fneg(tiny)))
        return builder.fdiv(one, builder.select(small, tiny, x))

    return _operation(build)


def _extreme(sign: str) -> Any:
    """Return the generator of the smallest ("<") or largest (">") of eight numbers."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        x = args[0]
        for half in (4, 2, 1):
            indices = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [(r + half) % LANES for r in range(LANES)])
            other = builder.shuffle_vector(x, x, indices)
            x = builder.select(builder.fcmp_ordered(sign, x, other), x, other)
        return builder.extract_element(x, ir.Constant(ir.IntType(32), 0))

    return types.float64(lanes), generate


@intrinsic
def _smallest(typing: Any, x: Any) -> Any:
    """Return the smallest of the eight numbers."""
    return _extreme("<")


@intrinsic
def _largest(typing: Any, x: Any) -> Any:
    """Return the largest of the eight numbers."""
    return _extreme(">")


@njit(cache=True, error_model="numpy")
def rows_of(at, plane, rate, arrays, spare, rows):  # type: ignore[no-untyped-def]
    """Write the rows low + gain * a_k <= a_{k+1} <= high + gain * a_k of one interval.

    Parameters
    ----------
    at, plane : int
        Of what the joint d has, index at + d holds that of the left end and of the limits, + plane that of the right.
    rate : float
        0.5 / step.
    arrays : tuple
        q', q'', the lower and the upper limits, all flat.
    spare : array (W,)
        -inf for joints, inf for what is read past the last one.
    rows : array (3 * 2 W,)
        Overwritten with gain, high, low, of the left end and of the right; W is a multiple of eight.

    Returns
    -------
    flat : bool
        Whether some row bounds a_k alone.
    """
    slopes, bends, lower, upper = arrays
    width = len(spare)
    flat = False
    for d in range(0, width, LANES):
        least, most, none = load(lower, at + d), load(upper, at + d), load(spare, d)
        bend, left = load(bends, at + d), scaled(load(slopes, at + d), rate)
        alpha, beta = plus(bend, scaled(left, -1.0)), left
        for end in range(2):
            inverse = _inverse(beta)
            x, y = product(most, inverse), product(least, inverse)
            store(rows, d + end * width, product(scaled(alpha, -1.0), inverse))
            store(rows, d + (2 + end) * width, larger(none, larger(x, y)))
            store(rows, d + (4 + end) * width, smaller(scaled(none, -1.0), smaller(x, y)))
            flat |= exceeds(scaled(larger(alpha, scaled(alpha, -1.0)), FLAT), larger(beta, scaled(beta, -1.0)))
            alpha = scaled(load(slopes, at + plane + d), -rate)
            beta = plus(load(bends, at + plane + d), scaled(alpha, -1.0))
    return flat


@njit(cache=True, error_model="numpy")
def own_limit(x, k, rate, slopes, bends, lower, upper):  # type: ignore[no-untyped-def]
    """Return x lowered by the rows of interval k that bound a_k alone."""
    for d in range(lower.shape[1]):
        for end in range(2):
            slope = slopes[end, k, d] * rate
            alpha = -slope if end else bends[0, k, d] - slope
            beta = slope + bends[1, k, d] if end else slope
            if abs(beta) < FLAT * abs(alpha):
                x = min(x, (upper[k, d] if alpha > 0.0 else lower[k, d]) / alpha * (1.0 - PULL))
    return x


@intrinsic
def _lane(typing: Any, x: Any, value: Any) -> Any:
    """Return which of the eight numbers, the first of them, is the value; eight if none is."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        x, value = args
        indices, empty = (ir.VectorType(ir.IntType(32), LANES), ir.Constant(_VECTOR, ir.Undefined))
        first = builder.insert_element(empty, value, ir.Constant(ir.IntType(32), 0))
        every = builder.shuffle_vector(first, empty, ir.Constant(indices, [0] * LANES))
        bits = builder.zext(builder.bitcast(builder.fcmp_ordered("==", x, every), ir.IntType(LANES)), ir.IntType(64))
        bits = builder.or_(bits, ir.Constant(ir.IntType(64), 1 << LANES))
        return builder.cttz(bits, ir.Constant(ir.IntType(1), 1))

    return types.intp(lanes, types.float64), generate


@njit(cache=True, error_model="numpy")
def highest(x, rows, best):  # type: ignore[no-untyped-def]
    """Return the largest y <= best that no row's upper side forbids with x."""
    size = len(rows) // 3
    top = step(load(rows, 0), x, load(rows, size))
    for r in range(LANES, size, LANES):
        top = smaller(step(load(rows, r), x, load(rows, size + r)), top)
    return min(_smallest(top), best)


@njit(cache=True, error_model="numpy")
def walk(x, direction, rows, best, least):  # type: ignore[no-untyped-def]
    """Return the first x from the one given, upwards (1.0) or downwards (-1.0), for which some y keeps all rows.

    That y is in [least, best]. Negative if there is none. Also which lower row was active last, -1 if none was.
    """
    size = len(rows) // 3
    active = -1
    for _ in range(WALK):
        shift = scaled(load(rows, 0), x)
        top, bottom = plus(shift, load(rows, size)), plus(shift, load(rows, 2 * size))
        for r in range(LANES, size, LANES):
            shift = scaled(load(rows, r), x)
            top = smaller(plus(shift, load(rows, size + r)), top)
            bottom = larger(plus(shift, load(rows, 2 * size + r)), bottom)
        high, low = _smallest(top), _largest(bottom)
        if max(low, least) <= min(high, best):
            return x, active
        over, under, over_gain, under_gain = best, least, 0.0, 0.0
        for r in range(0, size, LANES):  # the rows that are active
            shift = scaled(load(rows, r), x)
            lane = _lane(plus(shift, load(rows, size + r)), high)
            if high < best and lane < LANES:
                over, over_gain = rows[size + r + lane], rows[r + lane]
            lane = _lane(plus(shift, load(rows, 2 * size + r)), low)
            if low > least and lane < LANES:
                under, under_gain, active = (rows[2 * size + r + lane], rows[r + lane], r + lane)
        if direction * (over_gain - under_gain) <= 0.0:
            return -1.0, -1
        at = (over - under) / (under_gain - over_gain)
        if not direction * (at - x) > 0.0:
            # at this crossing already, but for rounding: of a steep row that is much, and hides what others ask
            at = x * (1.0 + direction * PULL)
            if at == x:
                return x, active
        x = at
    return -1.0, -1


@njit(cache=True, error_model="numpy")
def padded(k, slopes, bends, lower, upper, own):  # type: ignore[no-untyped-def]
    """Copy what interval k has to small arrays, past whose joints eights can be read."""
    width = len(own[0]) // 2
    for d in range(lower.shape[1]):
        own[0][d], own[0][width + d] = slopes[0, k, d], slopes[1, k, d]
        own[1][d], own[1][width + d] = bends[0, k, d], bends[1, k, d]
        own[2][d], own[3][d] = lower[k, d], upper[k, d]
