"""Parameter values for waypoints that come without times."""

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

Spacing = Literal["centripetal", "chord_length", "uniform"]

#: Power of the chord length that each spacing takes its steps from.
POWERS: dict[Spacing, float] = {"centripetal": 0.5, "chord_length": 1.0, "uniform": 0.0}


def knots(points: ArrayLike, spacing: Spacing = "centripetal") -> Array:
    r"""Return knots on [0, 1] whose steps are powers of the chord lengths.

    .. math:: u_{i+1} - u_i = |q_{i+1} - q_i|^p / \sum_j |q_{j+1} - q_j|^p

    with p = 1/2 (centripetal), 1 (chord_length) or 0 (uniform). Equal neighbours would share a knot: a dwell gets the
    mean of the other steps, a very short move at least 1e-6 of the longest.

    Parameters
    ----------
    points : (N, D), N >= 2
    spacing : str

    Returns
    -------
    (N,), increasing, from 0 to 1

    References
    ----------
    E. T. Y. Lee, Choosing nodes in parametric curve interpolation, Computer-Aided Design 21(6), 1989.
    """
    chords = np.linalg.norm(np.diff(np.asarray(points, dtype=np.float64), axis=0), axis=1)
    steps = np.ones(len(chords))
    largest = chords.max()
    if largest > 0 and spacing != "uniform":
        moving = chords > 0
        steps = np.maximum((chords / largest) ** POWERS[spacing], 1e-6)
        steps[~moving] = steps[moving].mean()
    values = np.concatenate([[0.0], np.cumsum(steps)])
    return np.asarray(values / values[-1])


def shortest_turns(points: ArrayLike, turning: ArrayLike, period: float = 2 * np.pi) -> Array:
    """Return the points with whole turns added, so that each is the nearest equivalent of the one before it.

    Parameters
    ----------
    points : (N, D)
    turning : (D,) of bool
        The joints that turn without end; the others stay as they are.
    period : float
        One turn.
    """
    q = np.array(points, dtype=np.float64)
    turning = np.asarray(turning, dtype=bool)
    turns = np.round(np.diff(q[:, turning], axis=0) / period)
    q[1:, turning] -= period * np.cumsum(turns, axis=0)
    return q
