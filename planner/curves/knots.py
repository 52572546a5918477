"""Parameter values for waypoints that come without times."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def centripetal(points: Array) -> Array:
    """Return knots on [0, 1] whose steps are the square roots of the chord lengths.

    u_{i+1} - u_i = sqrt(|q_{i+1} - q_i|) / sum. Equal neighbours would share a knot, so each is given a small step.

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
    steps = np.maximum(steps / largest, 1e-6) if largest > 0 else np.ones(len(steps))
    knots = np.concatenate([[0.0], np.cumsum(steps)])
    return np.asarray(knots / knots[-1])
