"""The energy of a spline and its derivatives by the logarithms of the durations, one function for each order.

Each returns the integral of the squared k-th derivative, summed over the joints, and adds to ``slope`` (M,) each gap's
derivative by log h and to ``noise`` (M,) a bound of its rounding errors. The node states (k - 1, N, D) must be the best
ones at the durations h (M,). The derivatives of order k … 2k-2 are then continuous at inner knots: there they are taken
from the longer gap beside, where they have more digits.
"""

from numba import njit

from .lanes import minus
from .lanes import step as fused

EPS = 2.220446049250313e-16


@njit(cache=True, error_model="numpy")
def energy2(h, points, states, slope, noise):  # type: ignore[no-untyped-def]
    """Order 2: see above."""
    gaps, total = len(h), 0.0
    for d in range(points.shape[1]):
        here = blur = right = right_blur = (
            0.0  # derivative of order 2 at the last knot, and at the last gap's right end
        )
        for i in range(gaps + 1):
            before, before_blur = here, blur
            here, blur = right, right_blur
            if i < gaps:
                step, rise = h[i], points[i + 1, d] - points[i, d]
                v0, v1 = step * states[0, i, d], step * states[0, i + 1, d]
                rate = 1.0 / step
                scale = rate * rate
                c3, mean = minus(2.0, rise, v0 + v1), v1 - v0
                total = fused(fused(mean, mean, 3.0 * c3 * c3), scale * rate, total)
                left = 2.0 * (rise - v0 - c3) * scale
                right = fused(6.0 * c3, scale, left)
                right_blur = (32.0 * EPS) * (abs(rise) + abs(v0) + abs(v1)) * scale
                if i == 0 or step > h[i - 1]:
                    here, blur = left, right_blur
            if i > 0:
                v = states[0, i - 1, d]
                slope[i - 1] += minus(h[i - 1] * before, before, 2.0 * v * (here - before))
                noise[i - 1] = fused(fused(h[i - 1], abs(before), abs(v)), before_blur + blur, noise[i - 1])
    return total


@njit(cache=True, error_model="numpy")
def energy3(h, points, states, slope, noise):  # type: ignore[no-untyped-def]
    """Order 3: see above."""
    gaps, total = len(h), 0.0
    for d in range(points.shape[1]):
        here3 = here4 = right3 = right4 = blur = right_blur = 0.0
        for i in range(gaps + 1):
            before3, before4, before_blur = here3, here4, blur
            here3, here4, blur = right3, right4, right_blur
            if i < gaps:
                step, rise = h[i], points[i + 1, d] - points[i, d]
                rate = 1.0 / step
                v0, v1 = step * states[0, i, d], step * states[0, i + 1, d]
                square = step * step
                a0, a1 = square * states[1, i, d], square * states[1, i + 1, d]
                x, v, a = rise - v0 - 0.5 * a0, v1 - v0 - a0, 0.5 * (a1 - a0)
                c5, c4, c3 = 6.0 * x - 3.0 * v + a, 7.0 * v - 15.0 * x - 2.0 * a, 10.0 * x - 4.0 * v + a
                m1 = 12.0 * c4 + 30.0 * c5
                scale = rate * rate * rate
                fourth = scale * rate
                total += (4.0 * a * a + m1 * m1 * (1.0 / 3.0) + c5 * c5 * 20.0) * (fourth * rate)
                left3, left4 = 6.0 * c3 * scale, 24.0 * c4 * fourth
                right3, right4 = left3 + (24.0 * c4 + 60.0 * c5) * scale, left4 + 120.0 * c5 * fourth
                right_blur = (1600.0 * EPS) * (abs(rise) + abs(v0) + abs(v1) + abs(a0) + abs(a1)) * fourth
                if i == 0 or step > h[i - 1]:
                    here3, here4, blur = left3, left4, right_blur
            if i > 0:
                v, a, step = states[0, i - 1, d], states[1, i - 1, d], h[i - 1]
                slope[i - 1] += step * (2.0 * a * before4 - before3 * before3) - 2.0 * v * (here4 - before4)
                noise[i - 1] += (abs(v) + step * (abs(a) + step * abs(before3))) * (before_blur + blur)
    return total


@njit(cache=True, error_model="numpy")
def energy4(h, points, states, slope, noise):  # type: ignore[no-untyped-def]
    """Order 4: see above."""
    gaps, total = len(h), 0.0
    for d in range(points.shape[1]):
        here4 = here5 = here6 = right4 = right5 = right6 = blur = right_blur = 0.0
        for i in range(gaps + 1):
            before4, before5, before6, before_blur = here4, here5, here6, blur
            here4, here5, here6, blur = right4, right5, right6, right_blur
            if i < gaps:
                step, rise = h[i], points[i + 1, d] - points[i, d]
                rate, square = 1.0 / step, step * step
                v0, v1 = step * states[0, i, d], step * states[0, i + 1, d]
                a0, a1 = square * states[1, i, d], square * states[1, i + 1, d]
                j0, j1 = square * step * states[2, i, d], square * step * states[2, i + 1, d]
                j = (j1 - j0) * (1.0 / 6.0)
                x = rise - v0 - 0.5 * a0 - (1.0 / 6.0) * j0
                v, a = v1 - v0 - a0 - 0.5 * j0, 0.5 * (a1 - a0 - j0)
                c4 = minus(15.0, v, 35.0 * x) + fused(5.0, a, -j)
                c5 = minus(84.0, x, 39.0 * v) + minus(14.0, a, 3.0 * j)
                c6 = minus(34.0, v, 70.0 * x) + minus(3.0, j, 13.0 * a)
                c7 = minus(20.0, x, 10.0 * v) + minus(4.0, a, j)
                m1, m2 = fused(60.0, c5, fused(180.0, c6, 378.0 * c7)), fused(60.0, c6, 210.0 * c7)
                fourth = rate * rate * rate * rate
                fifth = fourth * rate
                sixth = fifth * rate
                energy = fused(m1 * m1, 1.0 / 3.0, 36.0 * j * j) + fused(m2 * m2, 0.2, c7 * c7 * 252.0)
                total = fused(energy, sixth * rate, total)
                left4, left5, left6 = 24.0 * c4 * fourth, 120.0 * c5 * fifth, 720.0 * c6 * sixth
                right4 = left4 + (120.0 * c5 + 360.0 * c6 + 840.0 * c7) * fourth
                right5, right6 = left5 + (720.0 * c6 + 2520.0 * c7) * fifth, left6 + 5040.0 * c7 * sixth
                size = abs(rise) + abs(v0) + abs(v1) + abs(a0) + abs(a1) + abs(j0) + abs(j1)
                right_blur = (200000.0 * EPS) * size * sixth
                if i == 0 or step > h[i - 1]:
                    here4, here5, here6, blur = left4, left5, left6, right_blur
            if i > 0:
                v, a, j, step = states[0, i - 1, d], states[1, i - 1, d], states[2, i - 1, d], h[i - 1]
                rate = 2.0 * (j * before5 - a * before6) - before4 * before4
                slope[i - 1] += step * rate + 2.0 * v * (here6 - before6)
                size = abs(v) + step * (abs(a) + step * (abs(j) + step * abs(before4)))
                noise[i - 1] += size * (before_blur + blur)
    return total
