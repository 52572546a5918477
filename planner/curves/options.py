"""Options that curves share."""

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from ..errors import InvalidRequest
from ..limits import DurationBounds
from ..options import MAX_VALUE, Options
from ..pieces import finite
from ..reading import increasing, matrix
from ..trajectory import Trajectory
from .spacing import Spacing

Array = NDArray[np.float64]

Number = Annotated[float, Field(ge=-MAX_VALUE, le=MAX_VALUE, allow_inf_nan=False)]
Matrix = Annotated[list[Annotated[list[Number], Field(fail_fast=True)]], Field(fail_fast=True)]


class Spaced(Options):
    """Base of the options of curves through waypoints at given times."""

    spacing: Spacing = Field(
        default="centripetal",
        description="how the waypoints are spread where no times or knots are sent: by steps that grow as the square "
        "root of the distance, as the distance, or all alike",
    )


def checked(times: ArrayLike, points: ArrayLike, fewest: int = 2) -> tuple[Array, Array]:
    """Return times (N,) and points (N, D) as contiguous arrays; points (N,) are one joint.

    Raises
    ------
    InvalidRequest
        ``too_few_points``, ``shape_mismatch``, ``not_finite`` or ``not_increasing``.
    """
    t, x = (np.ascontiguousarray(a, dtype=np.float64) for a in (times, points))
    x = x[:, None] if x.ndim == 1 else x
    if t.ndim != 1 or x.ndim != 2 or len(t) != len(x):
        raise InvalidRequest.of(
            "/times", "shape_mismatch", f"times {t.shape} and points {x.shape} do not belong together"
        )
    if len(x) < fewest or not x.shape[1]:
        raise InvalidRequest.of("/waypoints", "too_few_points", f"needs at least {fewest}, of one joint or more")
    for name, values in (("/times", t), ("/waypoints", x)):
        if not finite(values):
            raise InvalidRequest.of(name, "not_finite", "must be finite")
    return increasing(t, "/times"), x


def derivatives(values: ArrayLike, points: Array, field: str) -> Array:
    """Return derivatives at the points, (N, D); (N,) are those of one joint.

    Raises
    ------
    InvalidRequest
        ``shape_mismatch`` or ``not_finite``.
    """
    v = np.asarray(values, dtype=np.float64)
    v = v[:, None] if v.ndim == 1 else v
    if v.shape != points.shape:
        raise InvalidRequest.of(field, "shape_mismatch", f"needs the points' shape {points.shape}, has {v.shape}")
    if not finite(v):
        raise InvalidRequest.of(field, "not_finite", "must be finite")
    return v


def rows_of(value: list[list[float]], shape: tuple[int, ...], field: str) -> NDArray[np.float64]:
    """Return an option that holds a row for every waypoint as an array of that shape.

    Raises
    ------
    InvalidRequest
        ``shape_mismatch``
    """
    rows = matrix(value, field, shape[1])
    if len(rows) != shape[0]:
        raise InvalidRequest.of(field, "shape_mismatch", f"needs {shape[0]} rows, has {len(rows)}")
    return rows


def clock(duration: DurationBounds | None) -> float:
    """Return how long a curve by control points takes: 1, or the duration asked that is nearest to it."""
    span = 1.0 if duration is None else duration.nearest(1.0)
    if span <= 0:
        raise InvalidRequest.of("/duration", "bad_duration", "must be > 0")
    return span


def refuse_other_span(curve: Trajectory, duration: DurationBounds | None) -> None:
    """Raise ``conflict`` where knots and the duration asked contradict each other."""
    if duration is not None and not duration.min * (1 - 1e-9) <= curve.duration <= duration.max * (1 + 1e-9):
        raise InvalidRequest.of("/duration", "conflict", f"the knots span {curve.duration:g} s")
