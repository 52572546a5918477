"""How fully a law along a path uses the limits: the largest and the mean ratio of every interval between stations.

A piece of the law is s(t) = s + v t + b t²/2 + j t³/6; the motion is q(s(t)), whose derivatives are

    q' sd,    q'' sd² + q' sdd,    q''' sd³ + 3 q'' sd sdd + q' sddd
"""

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def _range(values):  # type: ignore[no-untyped-def]
    """Return the smallest and the largest value, those of the parabolas through three neighbours included."""
    low = high = values[0]
    for p in range(1, len(values)):
        low, high = min(low, values[p]), max(high, values[p])
    for p in range(1, len(values) - 1):
        before, here, after = values[p - 1], values[p], values[p + 1]
        bend, slope = 2.0 * here - before - after, 0.5 * (after - before)
        if abs(slope) < abs(bend):  # the vertex lies between the three
            vertex = here + 0.5 * slope * slope / bend
            low, high = min(low, vertex), max(high, vertex)
    return low, high


@njit(cache=True, error_model="numpy")
def law_use(breaks, coefficients, piece, law, owner, points, inverse, norm, most, mean):  # type: ignore[no-untyped-def]
    """Look at a law at some points of each of its pieces.

    Parameters
    ----------
    breaks, coefficients : (K + 1,), (n + 1, K, D)
        The path, as a Trajectory has it.
    piece : (n,) of int64
        The path's piece that holds each interval between stations.
    law : (5, L)
        s, v, b, j and duration of the law's pieces.
    owner : (L,) of int64
        The interval of each, not decreasing.
    points : (P,)
        Where to look, evenly over [0, 1] of the piece's duration; between them a parabola is followed.
    inverse : (2, 3, n, D)
        1 / upper and 1 / lower limit of velocity, acceleration and jerk on each interval.
    norm : (n,)
        1 / limit of the velocity's Euclidean norm.
    most, mean : (4, n, D), (n,)
        Filled: the largest ratios, of velocity, acceleration, jerk and the norm (the same for all joints); and the
        largest of the mean ratios, each as the factor by which time could shrink: v, a^(1/2), j^(1/3).
    """
    size, dims = coefficients.shape[0], coefficients.shape[2]
    count = len(points)
    total, looks = np.zeros((4, dims)), 0.0
    values, speeds = np.zeros((3, dims, count)), np.zeros(count)
    most[:] = 0.0
    mean[:] = 0.0
    for i in range(law.shape[1]):
        k = owner[i]
        if i == 0 or owner[i - 1] != k:
            total[:] = 0.0
            looks = 0.0
        p = piece[k]
        rate = 1.0 / (breaks[p + 1] - breaks[p])
        v, b, c = law[1, i], law[2, i], law[3, i]
        for x in range(count):
            t = points[x] * law[4, i]
            u = (law[0, i] - breaks[p] + t * (v + t * (0.5 * b + t * c / 6.0))) * rate
            u = min(max(u, 0.0), 1.0)
            speed, push = v + t * (b + 0.5 * t * c), b + t * c
            square = 0.0
            for j in range(dims):
                q = q1 = q2 = q3 = 0.0
                for m in range(size):  # Horner, with half the second and a sixth of the third derivative
                    q3 = q3 * u + q2
                    q2 = q2 * u + q1
                    q1 = q1 * u + q
                    q = q * u + coefficients[m, p, j]
                q1, q2, q3 = q1 * rate, 2.0 * q2 * rate * rate, 6.0 * q3 * rate * rate * rate
                values[0, j, x] = q1 * speed
                values[1, j, x] = q2 * speed * speed + q1 * push
                values[2, j, x] = speed * (q3 * speed * speed + 3.0 * q2 * push) + q1 * c
                square += values[0, j, x] * values[0, j, x]
            speeds[x] = np.sqrt(square) * norm[k]
        for m in range(3):
            for j in range(dims):
                above, below = inverse[0, m, k, j], inverse[1, m, k, j]
                low, high = _range(values[m, j])
                most[m, k, j] = max(most[m, k, j], max(high * above, low * below))
                for x in range(count):
                    total[m, j] += max(values[m, j, x] * above, values[m, j, x] * below)
        low, high = _range(speeds)
        for j in range(dims):
            most[3, k, j] = max(most[3, k, j], high)
        total[3, 0] += speeds.sum()
        looks += count
        best = total[3, 0] / looks
        for j in range(dims):
            best = max(best, total[0, j] / looks)
            best = max(best, np.sqrt(total[1, j] / looks))
            best = max(best, np.cbrt(total[2, j] / looks))
        mean[k] = best
