"""Joint velocities and accelerations asked at the ends of a path, as path speed and path acceleration."""

import numpy as np
from numpy.typing import NDArray

from ..errors import InvalidRequest
from ..limits import Boundary
from ..trajectory import Trajectory

Array = NDArray[np.float64]

#: Velocities and accelerations below this are rest.
STILL = 3e-7
#: What is asked may leave the path's direction by this, relatively.
ALIGNED = 1e-9


def path_state(curve: Trajectory, state: Boundary, side: str) -> tuple[float, float]:
    """Return path speed and acceleration at an end: velocity = q' sd, acceleration = q'' sd² + q' sdd.

    Parameters
    ----------
    side : str
        ``start`` or ``end``. What the state leaves open is zero in the path.

    Raises
    ------
    InvalidRequest
        ``bad_boundary``: a velocity that is no non-negative multiple of the path's tangent, or an acceleration that
        no path acceleration gives.
    """
    left, right = (curve.ends(m) for m in (1, 2))
    tangent, bend = (x[0][0] if side == "start" else x[1][-1] for x in (left, right))
    speed = 0.0
    if state.velocity is not None and np.nan_to_num(state.velocity).any():
        speed = _multiple(np.nan_to_num(state.velocity), tangent, f"/{side}/velocity", "the path's tangent there")
        if speed < 0:
            reason = "must point along the path, which is not run backwards"
            raise InvalidRequest.of(f"/{side}/velocity", "bad_boundary", reason)
    if speed * float(np.abs(tangent).max()) <= STILL:  # within what a state at rest may differ from the one asked
        speed = 0.0
    push = 0.0
    if state.acceleration is not None and not np.isnan(state.acceleration).all():
        rest = np.nan_to_num(state.acceleration) - bend * speed * speed
        if np.abs(rest).max() > ALIGNED * max(float(np.abs(bend).max()) * speed * speed, 1e-300):
            push = _multiple(rest, tangent, f"/{side}/acceleration", "what the path allows at that speed")
        if speed == 0.0 and (push < 0.0 if side == "start" else push > 0.0):
            reason = "would move backwards along the path from rest"
            raise InvalidRequest.of(f"/{side}/acceleration", "bad_boundary", reason)
    if abs(push) * float(np.abs(tangent).max()) <= STILL:
        push = 0.0
    return speed, push


def _multiple(value: Array, of: Array, field: str, what: str) -> float:
    """Return the factor that makes ``of`` the value."""
    square = float(of @ of)
    factor = float(value @ of) / square if square > 0 else 0.0
    if np.abs(value - factor * of).max() > ALIGNED * float(np.abs(value).max()):
        raise InvalidRequest.of(field, "bad_boundary", f"must be a multiple of {what}")
    return factor
