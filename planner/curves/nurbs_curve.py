"""Non-uniform rational B-splines."""

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from ..errors import InvalidRequest
from ..limits import DurationBounds
from ..options import Options
from ..pieces import from_bernstein
from ..trajectory import Trajectory
from .basis import MOST_DEGREE, Knots, bezier_pieces, checked_knots, parameter_knots
from .options import Number, refuse_other_span

Array = NDArray[np.float64]

#: Largest ratio of two weights: beyond, the curve cannot be told from one without the smaller one.
MOST_UNEVEN = 1e6


class NurbsOptions(Options):
    """Options of rational B-splines: the waypoints are control points."""

    degree: int = Field(default=3, description=f"degree of the pieces, 1 to {MOST_DEGREE}, below N")
    knots: Knots | None = Field(
        default=None,
        description="the full vector, N + degree + 1 (default: clamped and even, on [0, 1] or [0, duration])",
        json_schema_extra={"unit": "s"},
    )
    weights: Annotated[list[Number], Field(fail_fast=True)] | None = Field(
        default=None, description="N weights > 0 (default: all 1, which is the B-spline)"
    )

    @property
    def moves_by_itself(self) -> bool:
        """Whether the clock is the options'."""
        return self.knots is not None

    def check(self, points: Array) -> None:
        """Raise InvalidRequest where degree, knots or weights do not fit the points."""
        from_options(self, points, None)

    @property
    def control_points(self) -> bool:
        """Whether the waypoints are control points."""
        return True


def nurbs(points: ArrayLike, weights: ArrayLike, knots: ArrayLike | None = None, degree: int = 3) -> Trajectory:
    r"""Return the curve \sum_i w_i x_i B_i^p(t) / \sum_i w_i B_i^p(t) on its valid span.

    Parameters
    ----------
    points : (N, D)
        Control points.
    weights : (N,), > 0
    knots : (N + degree + 1,), not falling
        By default clamped and even, on [0, 1].
    degree : int

    Raises
    ------
    InvalidRequest
        ``bad_weights``; otherwise as ``checked_knots``.

    References
    ----------
    L. Piegl and W. Tiller, The NURBS Book, Springer, 1997, chapter 4.
    """
    x, w = np.asarray(points, dtype=np.float64), np.asarray(weights, dtype=np.float64)
    t = checked_knots(parameter_knots(None, len(x), degree, None) if knots is None else knots, len(x), degree)
    if len(w) != len(x):
        raise InvalidRequest.of("/options/weights", "shape_mismatch", f"needs {len(x)} entries, has {len(w)}")
    if not (w > 0).all():
        raise InvalidRequest.of(f"/options/weights/{int(np.argmax(~(w > 0)))}", "bad_weights", "must be > 0")
    if not w.max() <= MOST_UNEVEN * w.min():
        raise InvalidRequest.of(
            "/options/weights", "bad_weights", f"must not differ by more than {MOST_UNEVEN:g} times"
        )
    w = w / w.max()
    breaks, whole = bezier_pieces(t, np.concatenate([x * w[:, None], w[:, None]], axis=1), degree)
    coefficients = from_bernstein(whole)
    return Trajectory(breaks, coefficients[..., :-1], coefficients[..., -1])


def from_options(options: NurbsOptions, points: Array, duration: DurationBounds | None) -> Trajectory:
    """Return the curve that the options describe, over its knots or the duration."""
    weights = np.ones(len(points)) if options.weights is None else np.array(options.weights)
    knots = parameter_knots(options.knots, len(points), options.degree, duration)
    curve = nurbs(points, weights, knots, options.degree)
    refuse_other_span(curve, duration)
    return curve
