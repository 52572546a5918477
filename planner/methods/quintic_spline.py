"""Method ``quintic_spline``."""

from ..curves import quintic_spline
from ..curves.higher import QuinticSplineOptions
from ..method import Method, Reference, at_given_times
from ..types import PlanRequest, Solution, Stats

ENDS = ("velocity", "acceleration")


def solve(request: PlanRequest, options: QuinticSplineOptions) -> Solution:
    """Return the C4 quintic spline through the waypoints at the given times."""
    assert request.times is not None
    start, end = ([getattr(side, name) for name in ENDS] for side in (request.start, request.end))
    curve = quintic_spline(request.times, request.waypoints, start, end)
    return Solution(curve, request.times, Stats("block_elimination"))


QUINTIC_SPLINE = Method(
    id="quintic_spline",
    title="Quintic spline",
    solve=solve,
    options=QuinticSplineOptions,
    family="interpolation",
    summary="The quintic spline, continuous to the fourth derivative, with given states at both ends.",
    formula="min ∫ ‖q'''‖² dt  s.t.  q(t_i) = q_i and the end states: q in C4, degree 5 on each piece",
    reference=Reference("C. de Boor", "A Practical Guide to Splines, chapter IX", 1978, "Springer"),
    capabilities=lambda options: at_given_times(4, frozenset(ENDS), frozenset(ENDS)),
)
