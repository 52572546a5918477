"""Method ``time_optimal_path``."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ..curves.rounded import rounded_polyline
from ..deadline import Deadline
from ..errors import Infeasible, InvalidRequest, SolverFailed, Unsupported
from ..limits import Boundary
from ..method import Capabilities, Method, Reference
from ..options import MAX_VALUE
from ..paths import LinearPath, Path, PathOptions, build_path
from ..timing.ends import path_state
from ..timing.fastest import Answer, fastest, lasting
from ..timing.following import Timed, cut_at_corners, follow
from ..timing.path_bounds import duration_bound
from ..timing.scaling import stretched
from ..types import PlanRequest, Solution

Array = NDArray[np.float64]


class TimeOptimalPathOptions(PathOptions):
    """Options of the time-optimal law on a path."""

    stations: int | None = Field(
        default=None,
        ge=10,
        le=20_000,
        description="fixed number of stations (default: as many as an estimated loss of 0.1 % needs, 10,000 with jerk)",
    )
    corner_tolerance: float | None = Field(
        default=None,
        gt=0,
        le=MAX_VALUE,
        description="linear path only: corners are rounded, nowhere further from the polyline than this in any joint "
        "(default: the motion stops at corners)",
        json_schema_extra={"unit": "unit"},
    )

    @property
    def rounding(self) -> float | None:
        """The corner tolerance."""
        return self.corner_tolerance

    def check(self, points: Array) -> None:
        """Raise InvalidRequest where the path's options do not fit the waypoints, or its corners cannot be rounded."""
        super().check(points)
        self.refuse_rounding()

    def refuse_rounding(self) -> None:
        """Raise InvalidRequest where corners are to be rounded that no polyline has."""
        if self.corner_tolerance is None or isinstance(self.path, LinearPath) and self.path.knots is None:
            return
        reason = "rounds the corners of a linear path without knots"
        raise InvalidRequest.of("/options/corner_tolerance", "conflict", reason)


def solve(request: PlanRequest, options: TimeOptimalPathOptions) -> Solution:
    """Return the path run through as fast as the limits allow, or as the duration asks."""
    try:
        return _solve(request, options)
    except SolverFailed as error:
        reason = f"no law was found that is one: {error}"
        moving = [f"boundary_{n}" for side in (request.start, request.end) for n in side.given() if _moves(side, n)]
        if moving:
            raise Unsupported("time_optimal_path", ", ".join(dict.fromkeys(moving)), (), reason) from None
        raise Unsupported("time_optimal_path", "path", ["time_optimal_nlp", "trapezoidal"], reason) from None


def _solve(request: PlanRequest, options: TimeOptimalPathOptions) -> Solution:
    deadline = Deadline(request.timeout)
    path = build_path(options.path, request.waypoints)
    options.refuse_rounding()
    if options.corner_tolerance is not None:
        path = Path(*rounded_polyline(request.waypoints, options.corner_tolerance))
        path = replace(path, curve=path.curve.split(path.knots))
    start, end = (path_state(path.curve, getattr(request, side), side) for side in ("start", "end"))
    courses = cut_at_corners(path, request, start, end)
    answers = fastest(courses, options.stations, deadline)
    solver = "interior_point" if any(c.jerk for c in courses) else "backward_and_forward_pass"
    answer = follow(path, replace(request, duration=None), courses, _laws(answers), solver)
    wanted = stretched(answer.trajectory.duration, request.duration)
    moving = [a for a in answers if a is not None]
    least = 0.0 if request.duration is None else request.duration.min
    grids = [a.grid for a in moving]
    bound = duration_bound([a.course for a in moving], grids, least, request.bound, deadline)
    if wanted > answer.trajectory.duration:
        try:
            gentle = _laws(lasting(courses, options.stations, wanted, deadline))
            answer = follow(path, request, courses, gentle, "interior_point")
        except (SolverFailed, Infeasible) as error:
            if any(not c.rests for c in courses):
                reason = f"from or to a moving end the duration is not met: {error}"
                raise Unsupported("time_optimal_path", "duration", reason=reason) from None
            answer = follow(path, request, courses, _laws(answers), solver)  # the fastest, slowed
    if options.corner_tolerance is not None:  # what is told is how far the polyline is left
        answer = replace(answer, path=None)
    return replace(answer, bound=bound)


def _moves(state: Boundary, name: str) -> bool:
    return bool(np.nan_to_num(getattr(state, name)).any())


def _laws(answers: list[Answer | None]) -> list[Timed | None]:
    return [None if a is None else a.timed for a in answers]


TIME_OPTIMAL_PATH = Method(
    id="time_optimal_path",
    title="Time-optimal path timing",
    solve=solve,
    options=TimeOptimalPathOptions,
    family="time_optimal",
    summary="The fastest law along a fixed path under velocity, acceleration and jerk limits, kept at all times.",
    formula="min ∫ ds/ṡ  s.t.  |q' ṡ| <= v,  |q'' ṡ² + q' s̈| <= a,  |q''' ṡ³ + 3 q'' ṡ s̈ + q' s⃛| <= j",
    reference=Reference(
        "D. Verscheure, B. Demeulenaere, J. Swevers, J. De Schutter and M. Diehl",
        "Time-optimal path tracking for robots: a convex optimization approach",
        2009,
        "https://doi.org/10.1109/TAC.2009.2028959",
    ),
    capabilities=lambda options: Capabilities(
        "chosen",
        1,
        requires=frozenset({"acceleration"}),
        honours=frozenset(
            {"position", "velocity", "acceleration", "jerk", "velocity_norm", "segment_limits", "duration"}
        ),
        start=frozenset({"velocity", "acceleration"}),
        end=frozenset({"velocity", "acceleration"}),
        with_jerk=frozenset({"acceleration"}),
    ),
    path="fixed",
    objective="duration",
)
