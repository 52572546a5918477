"""The option ``path`` of every fixed-path method: which curve through the waypoints is followed."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Discriminator, Field, Tag

from . import curves
from .curves import basis, bernstein, local_hermite, nurbs_curve, osculating
from .curves.basis import BsplineOptions
from .curves.bernstein import BezierOptions
from .curves.cubic import BoundaryOption
from .curves.local_hermite import CubicHermiteOptions
from .curves.newton import SMOOTH
from .curves.nurbs_curve import NurbsOptions
from .curves.options import Number, Spaced
from .curves.osculating import HermiteOptions
from .errors import FieldError, Infeasible, InvalidRequest
from .limits import DurationBounds, segment_bounds
from .options import MAX_VALUE, Options
from .reading import increasing, matrix, vector
from .trajectory import Trajectory
from .types import PlanRequest

Array = NDArray[np.float64]

Coefficient = Annotated[float, Field(ge=-1e100, le=1e100, allow_inf_nan=False)]
Knots = Annotated[list[Number], Field(min_length=2, fail_fast=True)]

#: Without a spacing, or with the default.
UNSPACED = (None, "centripetal")

KNOTS = "parameter values of the waypoints, increasing (default: as spacing says)"


class Polynomial(Options):
    """A piecewise polynomial: ``coefficients[k][i][d]`` is that of (s - breaks[i])^k."""

    breaks: Knots = Field(description="K + 1 increasing parameter values")
    coefficients: list[list[list[Coefficient]]] = Field(description="[power, lowest first][piece][joint]")
    weights: list[list[Coefficient]] | None = Field(
        default=None, description="[power][piece] of the denominator, for a rational curve"
    )


class LinearPath(Spaced):
    """The polyline through the waypoints."""

    kind: Literal["linear"]
    knots: Knots | None = Field(default=None, description=KNOTS)


class PolynomialPath(Spaced):
    """The one polynomial through the waypoints."""

    kind: Literal["polynomial"]
    knots: Knots | None = Field(default=None, description=KNOTS)


class HermitePath(HermiteOptions):
    """The one polynomial with given derivatives (with respect to the parameter) at the waypoints."""

    kind: Literal["hermite"]
    knots: Knots | None = Field(default=None, description=KNOTS)


class CubicHermitePath(CubicHermiteOptions):
    """The C1 cubic spline; tangents that are sent are derivatives with respect to the parameter."""

    kind: Literal["cubic_hermite"]
    knots: Knots | None = Field(default=None, description=KNOTS)


class CubicSplinePath(Spaced):
    """The C2 cubic spline through the waypoints; end values that a boundary takes are zero."""

    kind: Literal["cubic_spline"] = "cubic_spline"
    boundary: BoundaryOption | None = Field(
        default=None, description="as of the method cubic_spline (default: natural; for time_scaled clamped)"
    )
    knots: Knots | None = Field(default=None, description=KNOTS)


class QuinticSplinePath(Spaced):
    """The C4 quintic spline; first and second derivative are zero at its ends."""

    kind: Literal["quintic_spline"]
    knots: Knots | None = Field(default=None, description=KNOTS)


class SepticSplinePath(Spaced):
    """The C6 septic spline; first to third derivative are zero at its ends."""

    kind: Literal["septic_spline"]
    knots: Knots | None = Field(default=None, description=KNOTS)


class BezierPath(BezierOptions):
    """The Bézier curve by the waypoints as control points."""

    kind: Literal["bezier"]


class BsplinePath(BsplineOptions):
    """The B-spline through the waypoints (``knots``: their parameter values) or by them as control points."""

    kind: Literal["bspline"]


class NurbsPath(NurbsOptions):
    """The rational B-spline by the waypoints as control points."""

    kind: Literal["nurbs"]


class GivenPath(Options):
    """A piecewise polynomial over the path parameter; the waypoints lie on it at its breaks, or at ``knots``."""

    model_config = ConfigDict(title="GivenPath")

    polynomial: Polynomial
    knots: Knots | None = Field(default=None, description="parameter values of the waypoints (default: the breaks)")


_KINDS = {
    "LinearPath": "linear",
    "PolynomialPath": "polynomial",
    "HermitePath": "hermite",
    "CubicHermitePath": "cubic_hermite",
    "QuinticSplinePath": "quintic_spline",
    "SepticSplinePath": "septic_spline",
    "BezierPath": "bezier",
    "BsplinePath": "bspline",
    "NurbsPath": "nurbs",
    "GivenPath": "given",
}


def _kind(value: Any) -> str:
    if isinstance(value, Options):
        return "#" + _KINDS.get(type(value).__name__, "cubic_spline")
    if isinstance(value, dict) and value.get("polynomial") is not None and "kind" not in value:
        return "#given"
    kind = value.get("kind") if isinstance(value, dict) else None
    return f"#{kind}" if isinstance(kind, str) and kind in _KINDS.values() and kind != "given" else "#cubic_spline"


PathOption = Annotated[
    Annotated[LinearPath, Tag("#linear")]
    | Annotated[PolynomialPath, Tag("#polynomial")]
    | Annotated[HermitePath, Tag("#hermite")]
    | Annotated[CubicHermitePath, Tag("#cubic_hermite")]
    | Annotated[CubicSplinePath, Tag("#cubic_spline")]
    | Annotated[QuinticSplinePath, Tag("#quintic_spline")]
    | Annotated[SepticSplinePath, Tag("#septic_spline")]
    | Annotated[BezierPath, Tag("#bezier")]
    | Annotated[BsplinePath, Tag("#bspline")]
    | Annotated[NurbsPath, Tag("#nurbs")]
    | Annotated[GivenPath, Tag("#given")],
    Discriminator(_kind),
]


class PathOptions(Options):
    """Base of the options of methods that follow a fixed path."""

    path: PathOption = Field(
        default=CubicSplinePath(), description="the curve that is followed exactly", validate_default=False
    )

    @property
    def fixes_knots(self) -> bool:
        """Whether every waypoint has a parameter value, or something else, of its own."""
        return self.path.knots is not None or self.path.fixes_knots or self.moves_by_itself

    @property
    def moves_by_itself(self) -> bool:
        """Whether the path is a curve of its own."""
        return isinstance(self.path, GivenPath) or self.path.moves_by_itself

    def check(self, points: Array) -> None:
        """Raise InvalidRequest where the path's options do not fit the waypoints."""
        build_path(self.path, points)

    @property
    def control_points(self) -> bool:
        """Whether the waypoints are control points."""
        return self.path.control_points


@dataclass(frozen=True, eq=False)
class Path:
    """A curve over a parameter, and the parameter values at which it passes the waypoints, (N,).

    With ``passes`` false the waypoints are control points, and ``knots`` are the curve's two ends.
    """

    curve: Trajectory
    knots: Array
    passes: bool = True


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
    if option.control_points:
        curve = _moved_errors(lambda: _BY_CONTROL_POINTS[type(option)](option, points, None))
        return Path(curve, np.array([curve.start, curve.end]), passes=False)
    if (knots if knots is not None else option.knots) is not None and getattr(option, "spacing", None) not in UNSPACED:
        raise InvalidRequest.of("/options/path/spacing", "conflict", "knots are given: nothing is left to spread")
    if knots is None and option.knots is not None:
        knots = increasing(vector(option.knots, "/options/path/knots", len(points)), "/options/path/knots")
    if isinstance(option, GivenPath):
        return _given(option, points, knots)
    assert isinstance(option, Spaced)
    at = curves.knots(points, option.spacing) if knots is None else knots
    if isinstance(option, CubicSplinePath):
        return Path(_moved_errors(lambda: curves.cubic_spline(at, points, option.boundary or boundary)), at)
    return Path(_moved_errors(lambda: _THROUGH[type(option)](option, at, points)).split(at), at)


#: The curves through waypoints: of the option, the parameter values and the points.
_THROUGH: dict[type[Options], Callable[[Any, Array, Array], Trajectory]] = {
    LinearPath: lambda option, knots, points: curves.linear(knots, points),
    PolynomialPath: lambda option, knots, points: curves.polynomial(knots, points),
    HermitePath: osculating.from_options,
    CubicHermitePath: local_hermite.from_options,
    QuinticSplinePath: lambda option, knots, points: curves.quintic_spline(knots, points),
    SepticSplinePath: lambda option, knots, points: curves.septic_spline(knots, points),
    BsplinePath: lambda option, knots, points: basis.through_waypoints(option, knots, points, None),
}

#: The curves by control points: of the option, the points and the span asked.
_BY_CONTROL_POINTS: dict[type[Options], Callable[[Any, Array, DurationBounds | None], Trajectory]] = {
    BezierPath: bernstein.from_options,
    BsplinePath: basis.by_control_points,
    NurbsPath: nurbs_curve.from_options,
}


def smoothness(option: PathOption) -> int | None:
    """Return the class that a path of this kind is certain to have; None where its numbers must tell."""
    if isinstance(option, BsplinePath | NurbsPath):
        return max(option.degree - 1, 0) if option.knots is None or not option.control_points else None
    if isinstance(option, BezierPath):
        return SMOOTH if option.degree is None else None
    return {
        LinearPath: 0,
        PolynomialPath: SMOOTH,
        HermitePath: SMOOTH,
        CubicHermitePath: 1,
        CubicSplinePath: 2,
        QuinticSplinePath: 4,
        SepticSplinePath: 6,
    }.get(type(option))


def _moved_errors(build: Callable[[], Trajectory]) -> Trajectory:
    """Return the curve; errors about a method's options are told as being about the path's."""
    try:
        return build()
    except InvalidRequest as error:
        moved = [FieldError(e.field.replace("/options/", "/options/path/"), e.code, e.reason) for e in error.errors]
        raise InvalidRequest(moved) from None


def _given(option: GivenPath, points: Array, knots: Array | None) -> Path:
    where = "/options/path/polynomial"
    breaks = increasing(vector(option.polynomial.breaks, f"{where}/breaks"), f"{where}/breaks")
    try:
        powers = np.array(option.polynomial.coefficients, dtype=np.float64)
    except ValueError:
        powers = np.zeros(0)
    if powers.ndim != 3 or powers.shape[1:] != (len(breaks) - 1, points.shape[1]) or len(powers) > 64:
        raise InvalidRequest.of(f"{where}/coefficients", "shape_mismatch", "must be [power <= 63][piece][joint]")
    weights = None
    if option.polynomial.weights is not None:
        weights = matrix(option.polynomial.weights, f"{where}/weights", len(breaks) - 1, 1e100)
        if len(weights) != len(powers):
            raise InvalidRequest.of(f"{where}/weights", "shape_mismatch", "must be [power][piece], as the coefficients")
    try:
        curve = Trajectory.from_powers(breaks, powers, weights)
    except InvalidRequest as error:
        if error.errors[0].code != "bad_weights":
            raise
        raise InvalidRequest.of(f"{where}/weights", "bad_weights", error.errors[0].reason) from None
    if not curve.extrema(1).peak(0).max() <= MAX_VALUE:
        raise InvalidRequest.of(f"{where}/coefficients", "out_of_range", "values on a piece must be at most 1e9")
    if knots is None:
        knots = breaks
    if len(knots) != len(points):
        raise InvalidRequest.of("/options/path/knots", "bad_knots", "needed: the waypoints' parameter values")
    if knots[0] != breaks[0] or knots[-1] != breaks[-1]:
        raise InvalidRequest.of("/options/path/knots", "bad_knots", "must span the polynomial's breaks")
    miss = np.abs(curve(knots) - points).max(axis=1)
    if miss.max() > 1e-6 * max(1.0, float(np.ptp(points, axis=0).max())):
        i = int(np.argmax(miss))
        raise InvalidRequest.of(f"/waypoints/{i}", "conflict", f"the path misses it by {miss[i]:g}")
    return Path(curve.split(knots), knots)


def refuse_position_limits(path: Path, request: PlanRequest) -> None:
    """Raise Infeasible where the path itself leaves the position limits: no timing can cure that."""
    limit = segment_bounds(request.limits, request.segment_limits, 0, request.count - 1, request.dims)
    if not (np.isfinite(limit.lower).any() or np.isfinite(limit.upper).any()):
        return
    curve = path.curve.split(path.knots)
    segment = np.clip(np.searchsorted(path.knots, curve.breaks[:-1], side="right") - 1, 0, request.count - 2)
    found = curve.extrema(1, segment)
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
