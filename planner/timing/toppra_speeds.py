"""Path speeds from the toppra library, read at its stations; its spline refit is not used."""

import logging

import numpy as np
from numpy.typing import NDArray

from ..errors import SolverFailed
from ..limits import Limits
from ..trajectory import Trajectory
from .following import Units

Array = NDArray[np.float64]

#: Stands for an unlimited velocity where everything else is near one.
UNLIMITED = 1e6


def toppra_speeds(stretch: Trajectory, limits: Limits, units: Units, grid: Array) -> Array:
    """Return the path speeds sdot at the stations that TOPP-RA finds, from rest to rest.

    Raises
    ------
    SolverFailed
        toppra finds no parameterisation.
    """
    import toppra
    from toppra.constraint import DiscretizationType, JointAccelerationConstraint, JointVelocityConstraint
    from toppra.interpolator import AbstractGeometricPath

    logging.getLogger("toppra").setLevel(logging.CRITICAL)
    joints = np.flatnonzero(units.moving)

    class Scaled(AbstractGeometricPath):  # type: ignore[misc]
        """The stretch in the scaled units, as toppra asks for paths."""

        dof = len(joints)
        path_interval = np.array([0.0, stretch.duration / units.parameter])

        def __call__(self, s: Array, order: int = 0) -> Array:
            at = np.clip(stretch.start + np.asarray(s) * units.parameter, stretch.start, stretch.end)
            return np.asarray((stretch(at, order) * units.parameter**order / units.length)[..., joints])

    velocity = limits.bounds(1, stretch.dims)
    acceleration = limits.bounds(2, stretch.dims)
    rate = (units.second / units.length)[joints]
    push = (units.second**2 / units.length)[joints]
    constraints = [
        JointVelocityConstraint(_pairs(velocity.lower[joints] * rate, velocity.upper[joints] * rate)),
        JointAccelerationConstraint(
            _pairs(acceleration.lower[joints] * push, acceleration.upper[joints] * push),
            discretization_scheme=DiscretizationType.Interpolation,
        ),
    ]
    stations = (grid - stretch.start) / units.parameter
    stations[-1] = Scaled.path_interval[1]
    try:
        with np.errstate(all="ignore"):
            instance = toppra.algorithm.TOPPRA(constraints, Scaled(), gridpoints=stations, solver_wrapper="seidel")
            _, speed, _ = instance.compute_parameterization(0.0, 0.0)
    except ValueError as error:  # stations that do not increase, say
        raise SolverFailed("toppra", f"it refuses the path: {error}") from None
    if speed is None or not np.isfinite(speed).all():
        raise SolverFailed("toppra", "no parameterisation found")
    return np.asarray(np.maximum(speed, 0.0) * units.parameter / units.second)


def _pairs(lower: Array, upper: Array) -> Array:
    return np.stack([np.maximum(lower, -UNLIMITED), np.minimum(upper, UNLIMITED)], axis=1)
