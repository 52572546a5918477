"""Options that curves share."""

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ..errors import InvalidRequest
from ..limits import DurationBounds
from ..options import MAX_VALUE, Options
from ..reading import matrix
from ..trajectory import Trajectory
from .spacing import Spacing

Number = Annotated[float, Field(ge=-MAX_VALUE, le=MAX_VALUE, allow_inf_nan=False)]
Matrix = Annotated[list[Annotated[list[Number], Field(fail_fast=True)]], Field(fail_fast=True)]


class Spaced(Options):
    """Base of the options of curves through waypoints at given times."""

    spacing: Spacing = Field(
        default="centripetal",
        description="how the waypoints are spread where no times or knots are sent: by steps that grow as the square "
        "root of the distance, as the distance, or all alike",
    )


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
