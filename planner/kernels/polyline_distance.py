"""The largest distance of a curve in Bézier form from the straight lines of its segments, enclosed.

The distance from a line is a convex function of the position, and a position is a convex combination of the control
points: none is farther than the farthest of those. Halving a piece brings its control points to the curve, four times
closer every time; only pieces that may hold the maximum are halved.
"""

import numpy as np
from numba import njit

#: Depth at which halving ends: numbers in [0, 1] can no longer be told apart.
DEEPEST = 52


@njit(cache=True, error_model="numpy")
def _distance(control, dims, weighted, point, step, square):  # type: ignore[no-untyped-def]
    """Return the distance of a control point from a segment; infinite where its weight is not positive."""
    scale = 1.0
    if weighted:
        if not control[dims] > 0.0:
            return np.inf
        scale = 1.0 / control[dims]
    share = 0.0
    if square > 0.0:
        for d in range(dims):
            share += (control[d] * scale - point[d]) * step[d]
        share = min(max(share / square, 0.0), 1.0)
    total = 0.0
    for d in range(dims):
        off = (control[d] * scale - point[d]) - share * step[d]
        total += off * off
    return np.sqrt(total)


@njit(cache=True, error_model="numpy")
def _enclosed(control, dims, weighted, point, step, square):  # type: ignore[no-untyped-def]
    """Return the larger distance of the two ends of a piece, and the largest of all its control points."""
    n = len(control) - 1
    at_ends = _distance(control[0], dims, weighted, point, step, square)
    if n == 0:
        return at_ends, at_ends
    at_ends = max(at_ends, _distance(control[n], dims, weighted, point, step, square))
    most = at_ends
    for k in range(1, n):
        most = max(most, _distance(control[k], dims, weighted, point, step, square))
    return at_ends, most


@njit(cache=True, error_model="numpy")
def _halve(control, right):  # type: ignore[no-untyped-def]
    """Write the control points of the right half, and those of the left one over ``control`` (de Casteljau)."""
    n, columns = len(control) - 1, control.shape[1]
    right[:] = control
    for r in range(n + 1):
        for d in range(columns):
            control[r, d] = right[0, d]
        for k in range(n - r):
            for d in range(columns):
                right[k, d] = 0.5 * (right[k, d] + right[k + 1, d])


@njit(cache=True, error_model="numpy")
def largest_distance(control, weighted, points, segment, relative, absolute):  # type: ignore[no-untyped-def]
    """Return an upper bound of the largest Euclidean distance, attained but for the tolerances.

    Parameters
    ----------
    control : array (K, n + 1, D) or, if ``weighted``, (K, n + 1, D + 1)
        Control points; with weights homogeneous ones, the weight last.
    weighted : bool
    points : array (N, D)
    segment : array (K,) of int64
        Piece i is to be near the straight line from points[segment[i]] to the next one.
    relative, absolute : float
        By how much the bound may exceed a distance that is attained.
    """
    pieces, size, columns = control.shape
    dims = points.shape[1]
    steps = points[1:] - points[:-1]
    squares = np.zeros(len(steps))
    for s in range(len(steps)):
        for d in range(dims):
            squares[s] += steps[s, d] * steps[s, d]
    most = np.zeros(pieces)
    attained = bound = 0.0
    first = 0
    for i in range(pieces):
        s = segment[i]
        at_ends, most[i] = _enclosed(control[i], dims, weighted, points[s], steps[s], squares[s])
        attained = max(attained, at_ends)
        if most[i] > most[first]:
            first = i
    room = np.empty((DEEPEST + 1, size, columns))
    far, depth = np.zeros(DEEPEST + 1), np.zeros(DEEPEST + 1, np.int64)
    for turn in range(-1, pieces):  # the most promising piece first; to see it once more is no harm
        i = first if turn < 0 else turn
        s = segment[i]
        room[0], far[0], depth[0] = control[i], most[i], 0
        top = 0
        while top >= 0:
            if far[top] <= attained * (1.0 + relative) + absolute or depth[top] == DEEPEST:
                bound = max(bound, far[top])
                top -= 1
                continue
            _halve(room[top], room[top + 1])
            depth[top] += 1
            depth[top + 1] = depth[top]
            for half in range(top, top + 2):
                at_ends, far[half] = _enclosed(room[half], dims, weighted, points[s], steps[s], squares[s])
                attained = max(attained, at_ends)
            top += 1
    return max(bound, attained)
