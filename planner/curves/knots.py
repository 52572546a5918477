"""Parameter values for waypoints that come without times."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def centripetal(points: Array) -> Array:
    """Return knots on [0, 1] whose steps are the square roots of the chord lengths.

    u_{i+1} - u_i = sqrt(|q_{i+1} - q_i|) / sum. Equal neighbours would share a knot: a dwell gets the mean of the
    other steps, a very short move at least 1e-6 of the longest.

    Parameters
    ----------
    points : (N, D), N >= 2

    Returns
    -------
    (N,), increasing, from 0 to 1

    References
    ----------
    E. T. Y. Lee, Choosing nodes in parametric curve interpolation, Computer-Aided Design 21(6), 1989.
    """
    steps = np.sqrt(np.linalg.norm(np.diff(points, axis=0), axis=1))
    largest = steps.max()
    if largest > 0:
        moving = steps > 0
        steps = np.where(moving, np.maximum(steps / largest, 1e-6), steps[moving].mean() / largest)
    else:
        steps = np.ones(len(steps))
    knots = np.concatenate([[0.0], np.cumsum(steps)])
    return np.asarray(knots / knots[-1])
