"""Method ``cubic_hermite``."""

from ..curves.local_hermite import CubicHermiteOptions, from_options
from ..method import Method, Reference, at_given_times
from ..types import PlanRequest, Solution, Stats


def solve(request: PlanRequest, options: CubicHermiteOptions) -> Solution:
    """Return the C1 cubic spline with given velocities at the waypoints, or those of a rule."""
    assert request.times is not None
    return Solution(from_options(options, request.times, request.waypoints), request.times, Stats("closed_form"))


CUBIC_HERMITE = Method(
    id="cubic_hermite",
    title="Cubic Hermite spline",
    solve=solve,
    options=CubicHermiteOptions,
    family="interpolation",
    summary="Cubic pieces with given velocities at the waypoints: local, a waypoint moves only its neighbourhood.",
    formula="c0 = m0, c1 = t0, c2 = -3 m0 - 2 t0 + 3 m1 - t1, c3 = 2 m0 + t0 - 2 m1 + t1,  t = h v",
    reference=Reference(
        "F. N. Fritsch and R. E. Carlson",
        "Monotone piecewise cubic interpolation",
        1980,
        "https://doi.org/10.1137/0717021",
    ),
    capabilities=lambda options: at_given_times(1),
)
