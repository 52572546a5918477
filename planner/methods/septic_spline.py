"""Method ``septic_spline``."""

from ..curves import septic_spline
from ..curves.higher import SepticSplineOptions
from ..method import Method, Reference, at_given_times
from ..types import PlanRequest, Solution, Stats

ENDS = ("velocity", "acceleration", "jerk")


def solve(request: PlanRequest, options: SepticSplineOptions) -> Solution:
    """Return the C6 septic spline through the waypoints at the given times."""
    assert request.times is not None
    start, end = ([getattr(side, name) for name in ENDS] for side in (request.start, request.end))
    curve = septic_spline(request.times, request.waypoints, start, end)
    return Solution(curve, request.times, Stats("block_elimination"))


SEPTIC_SPLINE = Method(
    id="septic_spline",
    title="Septic spline",
    solve=solve,
    options=SepticSplineOptions,
    family="interpolation",
    summary="The septic spline, continuous to the sixth derivative, with given states at both ends.",
    formula="min ∫ ‖q''''‖² dt  s.t.  q(t_i) = q_i and the end states: q in C6, degree 7 on each piece",
    reference=Reference("C. de Boor", "A Practical Guide to Splines, chapter IX", 1978, "Springer"),
    capabilities=lambda options: at_given_times(6, frozenset(ENDS), frozenset(ENDS)),
)
