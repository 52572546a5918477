"""Method ``time_scaled``."""

from dataclasses import replace

import numpy as np
from pydantic import Field

from ..errors import InvalidRequest
from ..method import Capabilities, Method, Reference
from ..paths import (
    CubicSplinePath,
    Path,
    PathOptions,
    QuinticSplinePath,
    SepticSplinePath,
    build_path,
    refuse_position_limits,
    smoothness,
)
from ..timing.scaling import slowdown, stretched
from ..timing.stops import segment_bounds_of
from ..trajectory import Trajectory
from ..types import Followed, Note, PlanRequest, Solution, Stats


class TimeScaledOptions(PathOptions):
    """Options of uniform time scaling."""

    allow_faster: bool = Field(default=False, description="with times: also speed up, as far as the limits allow")


def solve(request: PlanRequest, options: TimeScaledOptions) -> Solution:
    """Return the path run through at a uniformly scaled clock: as slow as the limits ask, no slower."""
    if request.times is not None and options.path.control_points:
        raise InvalidRequest.of("/times", "conflict", "the waypoints are control points, which have no times")
    if request.times is not None and options.path.knots is not None:
        raise InvalidRequest.of("/options/path/knots", "conflict", "the times are the path's knots: send one of both")
    path = _path(request, options)
    refuse_position_limits(path, request)
    needed = slowdown(path.curve, request, path.knots)
    span = path.curve.duration
    least = needed.factor
    if request.times is not None and not options.allow_faster:
        least = max(least, 1.0)
    steps = np.diff(path.knots)
    for i, bounds in enumerate(request.segment_durations or ()):
        least = max(least, 0.0 if bounds is None else bounds.min / steps[i])
    duration = stretched(least * span, request.duration)
    if duration == 0.0:
        raise InvalidRequest.of("/limits", "missing", "needed: a velocity, acceleration or jerk limit, or times")
    factor = least if duration == least * span else duration / span
    for i, bounds in enumerate(request.segment_durations or ()):
        stretched(factor * steps[i], bounds, i)
    begin = 0.0 if request.times is None else float(request.times[0])
    trajectory = path.curve.scaled(factor).shifted(begin - path.curve.start)
    knots = begin + (path.knots - path.knots[0]) * factor
    if request.times is not None and factor == 1.0:
        knots = request.times
    trajectory = replace(trajectory, breaks=_exactly(trajectory.breaks, path.curve.breaks, path.knots, knots))
    law = Trajectory.from_hermite([trajectory.start, trajectory.end], [[path.curve.start], [path.curve.end]])
    notes: tuple[Note, ...] = ()
    if needed.binding is not None and factor == least == needed.factor:
        notes = (Note("binding_limit", f"the {needed.binding} limit sets the time scale, {factor:.9g}"),)
    return Solution(
        trajectory, knots if path.passes else None, Stats("closed_form"), Followed(path.curve, law), notes=notes
    )


def _path(request: PlanRequest, options: TimeScaledOptions) -> Path:
    """Return the path; where its knots are ours to choose, a dwell's are spread as its duration bounds ask."""
    times = None if request.times is None else request.times - request.times[0]  # from 0, to lose no digits
    path = build_path(options.path, request.waypoints, "clamped", times)
    still = ~np.diff(request.waypoints, axis=0).any(axis=1)
    if request.times is not None or options.fixes_knots or request.segment_durations is None or not still.any():
        return path
    least, most = segment_bounds_of(request)
    steps = np.diff(path.knots)
    usual = float(steps[~still].mean())
    for _ in range(40):
        scale = float(max(slowdown(path.curve, request, path.knots).factor, (least / steps)[~still].max()))
        if scale <= 0:
            break
        wanted = np.clip(usual, least[still] / scale, most[still] / scale)
        if (np.abs(wanted - steps[still]) <= 1e-13 * steps[still]).all():
            break
        steps[still] = wanted
        path = build_path(options.path, request.waypoints, "clamped", np.concatenate([[0.0], np.cumsum(steps)]))
    return path


def _exactly(breaks: np.ndarray, curve_breaks: np.ndarray, knots: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return the breaks with those at waypoints set to the waypoint times, bit by bit."""
    breaks = breaks.copy()
    at = np.searchsorted(curve_breaks, knots)
    there = curve_breaks[np.minimum(at, len(breaks) - 1)] == knots
    breaks[at[there]] = times[there]
    return breaks


def capabilities(options: TimeScaledOptions) -> Capabilities:
    """Return what is honoured: no scaling bounds what jumps one order below; some paths rest at their ends."""
    path, smooth = options.path, smoothness(options.path)
    derivatives = ("velocity", "acceleration", "jerk")
    honours = {"position", "duration", *(derivatives if smooth is None else derivatives[: smooth + 1])}
    if not path.control_points:
        honours |= {"times", "segment_limits", "segment_durations"}
    rests: tuple[str, ...] = ()
    if isinstance(path, CubicSplinePath) and path.boundary in (None, "clamped"):
        rests = derivatives[:1]
    elif isinstance(path, QuinticSplinePath | SepticSplinePath):
        rests = derivatives[: 2 if isinstance(path, QuinticSplinePath) else 3]
    return Capabilities("either", 0 if smooth is None else smooth, honours=frozenset(honours), rests=frozenset(rests))


TIME_SCALED = Method(
    id="time_scaled",
    title="Uniform time scaling",
    solve=solve,
    options=TimeScaledOptions,
    family="time_optimal",
    summary="A path slowed uniformly until its exact extrema keep the limits.",
    formula="t -> alpha t,  alpha = max(v_pk / v_max, sqrt(a_pk / a_max), cbrt(j_pk / j_max))",
    reference=Reference(
        "J. M. Hollerbach", "Dynamic scaling of manipulator trajectories", 1984, "https://doi.org/10.1115/1.3149652"
    ),
    capabilities=capabilities,
    path="fixed",
    objective="duration",
    variants=(
        {"path": {"kind": "cubic_spline", "boundary": "natural"}},
        {"path": {"kind": "linear"}},
        {"path": {"kind": "cubic_hermite"}},
        {"path": {"kind": "quintic_spline"}},
        {"path": {"kind": "septic_spline"}},
        {"path": {"kind": "polynomial"}},
        {"path": {"kind": "nurbs"}},
    ),
)
