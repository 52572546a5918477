"""The option ``path`` of every fixed-path method: which curve through the waypoints is followed."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Discriminator, Field, Tag

from .curves.cubic_spline import BoundaryOption, cubic_spline
from .curves.knots import centripetal
from .curves.linear import linear
from .errors import Infeasible, InvalidRequest
from .limits import segment_bounds
from .options import MAX_VALUE, Options
from .reading import increasing, vector
from .trajectory import Trajectory
from .types import PlanRequest

Array = NDArray[np.float64]

Number = Annotated[float, Field(ge=-MAX_VALUE, le=MAX_VALUE, allow_inf_nan=False)]
Coefficient = Annotated[float, Field(ge=-1e100, le=1e100, allow_inf_nan=False)]
Knots = Annotated[list[Number], Field(min_length=2, fail_fast=True)]

KNOTS = "parameter values of the waypoints, increasing (default: centripetal)"


class Polynomial(Options):
    """A piecewise polynomial: ``coefficients[k][i][d]`` is that of (s - breaks[i])^k."""

    breaks: Knots = Field(description="K + 1 increasing parameter values")
    coefficients: list[list[list[Coefficient]]] = Field(description="[power, lowest first][piece][joint]")


class LinearPath(Options):
    """The polyline through the waypoints."""

    kind: Literal["linear"]
    knots: Knots | None = Field(default=None, description=KNOTS)


class CubicSplinePath(Options):
    """The C2 cubic spline through the waypoints; end values that a boundary takes are zero."""

    kind: Literal["cubic_spline"] = "cubic_spline"
    boundary: BoundaryOption | None = Field(
        default=None, description="as of the method cubic_spline (default: natural; for time_scaled clamped)"
    )
    knots: Knots | None = Field(default=None, description=KNOTS)


class PolynomialPath(Options):
    """A piecewise polynomial over the path parameter; the waypoints lie on it at its breaks, or at ``knots``."""

    model_config = ConfigDict(title="PolynomialPath")

    polynomial: Polynomial
    knots: Knots | None = Field(default=None, description="parameter values of the waypoints (default: the breaks)")


def _kind(value: Any) -> str:
    if isinstance(value, Options):
        return {"LinearPath": "#linear", "PolynomialPath": "#polynomial"}.get(type(value).__name__, "#cubic_spline")
    if isinstance(value, dict) and value.get("polynomial") is not None and "kind" not in value:
        return "#polynomial"
    return "#linear" if isinstance(value, dict) and value.get("kind") == "linear" else "#cubic_spline"


PathOption = Annotated[
    Annotated[LinearPath, Tag("#linear")]
    | Annotated[CubicSplinePath, Tag("#cubic_spline")]
    | Annotated[PolynomialPath, Tag("#polynomial")],
    Discriminator(_kind),
]


class PathOptions(Options):
    """Base of the options of methods that follow a fixed path."""

    path: PathOption = Field(
        default=CubicSplinePath(), description="the curve that is followed exactly", validate_default=False
    )

    @property
    def fixes_knots(self) -> bool:
        """Whether every waypoint has a parameter value of its own."""
        return self.path.knots is not None or self.moves_by_itself

    @property
    def moves_by_itself(self) -> bool:
        """Whether the path is a curve of its own."""
        return isinstance(self.path, PolynomialPath)


@dataclass(frozen=True, eq=False)
class Path:
    """A curve over a parameter, and the parameter values at which it passes the waypoints, (N,)."""

    curve: Trajectory
    knots: Array


def build_path(option: PathOption, points: Array, boundary: str = "natural", knots: Array | None = None) -> Path:
    """Return the path that the option describes.

    Parameters
    ----------
    option : PathOption
    points : (N, D)
    boundary : str
        The cubic spline's boundary where the option names none.
    knots : (N,)
        Parameter values given elsewhere (times); otherwise the option's, otherwise centripetal.

    Raises
    ------
    InvalidRequest
        ``bad_knots``, ``not_increasing``, ``shape_mismatch``, or ``conflict`` where the curve misses a waypoint.
    """
    if knots is None and option.knots is not None:
        knots = increasing(vector(option.knots, "/options/path/knots", len(points)), "/options/path/knots")
    if isinstance(option, PolynomialPath):
        return _polynomial(option, points, knots)
    if knots is None:
        knots = centripetal(points)
    if isinstance(option, LinearPath):
        return Path(linear(knots, points), knots)
    try:
        return Path(cubic_spline(knots, points, option.boundary or boundary), knots)
    except InvalidRequest as error:
        raise _within_path(error) from None


def _within_path(error: InvalidRequest) -> InvalidRequest:
    moved = [(e.field.replace("/options/", "/options/path/"), e.code, e.reason) for e in error.errors]
    return InvalidRequest.of(*moved[0])


def _polynomial(option: PolynomialPath, points: Array, knots: Array | None) -> Path:
    where = "/options/path/polynomial"
    breaks = increasing(vector(option.polynomial.breaks, f"{where}/breaks"), f"{where}/breaks")
    try:
        powers = np.array(option.polynomial.coefficients, dtype=np.float64)
    except ValueError:
        powers = np.zeros(0)
    if powers.ndim != 3 or powers.shape[1:] != (len(breaks) - 1, points.shape[1]) or len(powers) > 64:
        raise InvalidRequest.of(f"{where}/coefficients", "shape_mismatch", "must be [power <= 63][piece][joint]")
    curve = Trajectory.from_powers(breaks, powers)
    if not curve.extrema(1).peak(0).max() <= MAX_VALUE:
        raise InvalidRequest.of(f"{where}/coefficients", "out_of_range", "values on a piece must be at most 1e9")
    if knots is None:
        knots = breaks
    if len(knots) != len(points):
        raise InvalidRequest.of("/options/path/knots", "bad_knots", "needed: the waypoints' parameter values")
    if knots[0] != breaks[0] or knots[-1] != breaks[-1]:
        raise InvalidRequest.of("/options/path/knots", "bad_knots", "must span the polynomial's breaks")
    error = np.abs(curve(knots) - points).max(axis=1)
    if error.max() > 1e-6 * max(1.0, float(np.ptp(points, axis=0).max())):
        i = int(np.argmax(error))
        raise InvalidRequest.of(f"/waypoints/{i}", "conflict", f"the path misses it by {error[i]:g}")
    return Path(curve, knots)


def refuse_position_limits(path: Path, request: PlanRequest) -> None:
    """Raise Infeasible where the path itself leaves the position limits: no timing can cure that."""
    limit = segment_bounds(request.limits, request.segment_limits, 0, request.count - 1, request.dims)
    if not (np.isfinite(limit.lower).any() or np.isfinite(limit.upper).any()):
        return
    curve = path.curve.split(path.knots)
    segment = np.clip(np.searchsorted(path.knots, curve.breaks[:-1], side="right") - 1, 0, request.count - 2)
    found = curve.extrema(1)
    lower, upper = limit.lower[segment], limit.upper[segment]
    over = np.stack([found.high[0] - upper, lower - found.low[0]])
    slack = 1e-9 * max(1.0, float(np.ptp(request.waypoints, axis=0).max()))
    if over.max() <= slack:
        return
    side, piece, joint = (int(i) for i in np.unravel_index(int(np.argmax(over)), over.shape))
    raise Infeasible(
        f"the path itself leaves the position limit of joint {joint} on segment {segment[piece]}; "
        "choose another path or move the waypoints",
        joint=joint,
        quantity="position",
        segment=int(segment[piece]),
        bound=float((upper, lower)[side][piece, joint]),
        needed=float((found.high[0], found.low[0])[side][piece, joint]),
        certified=True,
    )
