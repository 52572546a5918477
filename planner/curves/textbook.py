"""The forms that textbooks teach, with their condition numbers: to learn from, not to plan with."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def vandermonde(times: ArrayLike, points: ArrayLike) -> tuple[Array, float]:
    """Return the monomial coefficients a (N, D) of p(t) = sum_j a_j t^j, and the condition number of V_ij = t_i^j.

    Their digits are worth little where the condition number nears 1e16: equispaced on [0, 1] that is N = 20.
    """
    matrix = np.vander(np.asarray(times, dtype=np.float64), increasing=True)
    return np.asarray(np.linalg.solve(matrix, np.asarray(points)), dtype=np.float64), float(np.linalg.cond(matrix))


def freedoms(segments: int, degree: int, continuity: int) -> int:
    """Return how many conditions a spline leaves open: (m + 1) N - 2 N - k (N - 1), which is k for m = k + 1."""
    return (degree + 1) * segments - 2 * segments - continuity * (segments - 1)


def cubic_system(times: ArrayLike, points: ArrayLike, start: ArrayLike, end: ArrayLike) -> tuple[Array, Array]:
    """Return the dense system of the clamped cubic spline in powers of absolute time: (4 (N - 1)) squared, and (…, D).

    Rows: 2 (N - 1) positions, N - 2 velocities, N - 2 accelerations [0 0 2 6t | 0 0 -2 -6t], both end velocities.
    """
    t, x = np.asarray(times, dtype=np.float64), np.asarray(points, dtype=np.float64)
    count = len(t)
    size = 4 * (count - 1)
    matrix, right = np.zeros((size, size)), np.zeros((size, x.shape[1]))

    def powers(time: float, order: int) -> Array:
        rows = ([1.0, time, time**2, time**3], [0.0, 1.0, 2 * time, 3 * time**2], [0.0, 0.0, 2.0, 6 * time])
        return np.array(rows[order])

    row = 0
    for k in range(count - 1):
        for i in (k, k + 1):
            matrix[row, 4 * k : 4 * k + 4], right[row] = powers(t[i], 0), x[i]
            row += 1
    for order in (1, 2):
        for k in range(1, count - 1):
            matrix[row, 4 * k - 4 : 4 * k], matrix[row, 4 * k : 4 * k + 4] = powers(t[k], order), -powers(t[k], order)
            row += 1
    matrix[row, :4], right[row] = powers(t[0], 1), start
    matrix[row + 1, -4:], right[row + 1] = powers(t[-1], 1), end
    return matrix, right
