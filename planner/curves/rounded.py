"""A polyline with its corners rounded."""

import numpy as np
from numpy.typing import NDArray

from ..trajectory import Trajectory

Array = NDArray[np.float64]

#: Turns sharper than this, by the cosine between the directions, stay corners: a rounding would turn back in itself.
SHARPEST = -0.9
#: Directions that differ by less than this need no rounding.
STRAIGHT = 1e-12


def rounded_polyline(points: Array, tolerance: float) -> tuple[Trajectory, Array]:
    r"""Return a polyline whose corners are rounded, over its length, and the parameter nearest to each point.

    A corner at w between unit directions u and n becomes the quartic with the Bézier points w - d u, w - d u / 2, w,
    w + d n / 2, w + d n over a length of 2 d: it joins the lines with equal tangent and no curvature (class C2), and is
    nowhere further from them than 3/16 d max|n - u|, in any joint. That is the tolerance, unless d would be more than
    half a segment. Turns back on itself stay corners.

    Parameters
    ----------
    points : (N, D)
        Neighbours differ.
    tolerance : float
        > 0, in any joint.

    Returns
    -------
    curve : Trajectory
        The parameter begins at 0.
    knots : (N,)
    """
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    units = steps / lengths[:, None]
    turn = np.abs(np.diff(units, axis=0)).max(axis=1)
    sharp = np.einsum("id,id->i", units[:-1], units[1:]) < SHARPEST
    with np.errstate(divide="ignore"):
        cut = np.minimum(tolerance * 16.0 / (3.0 * turn), 0.5 * np.minimum(lengths[:-1], lengths[1:]))
    cut = np.concatenate([[0.0], np.where(sharp | (turn < STRAIGHT), 0.0, cut), [0.0]])
    pieces: list[Array] = []
    widths: list[float] = []
    knots, at = [0.0], 0.0
    for i in range(len(lengths)):
        start, end = points[i] + cut[i] * units[i], points[i + 1] - cut[i + 1] * units[i]
        straight = lengths[i] - cut[i] - cut[i + 1]
        if straight > 1e-12 * lengths[i]:
            pieces.append(np.stack([start + k / 4.0 * (end - start) for k in range(5)]))
            widths.append(straight)
            at += straight
        d = cut[i + 1]
        if d > 0:
            w, u, n = points[i + 1], units[i], units[i + 1]
            pieces.append(np.stack([w - d * u, w - 0.5 * d * u, w, w + 0.5 * d * n, w + d * n]))
            widths.append(2.0 * d)
            at += 2.0 * d
        knots.append(at - d)
    breaks = np.concatenate([[0.0], np.cumsum(widths)])
    knots[-1] = breaks[-1]
    return Trajectory.from_bernstein(breaks, np.stack(pieces, axis=1)), np.array(knots)
