"""Method ``bezier``."""

from ..curves.bernstein import BezierOptions, from_options
from ..curves.newton import SMOOTH
from ..method import Capabilities, Method, Reference, by_control_points
from ..types import PlanRequest, Solution, Stats


def solve(request: PlanRequest, options: BezierOptions) -> Solution:
    """Return the Bézier curve, or the composite one, of which the waypoints are the control points."""
    return Solution(from_options(options, request.waypoints, request.duration), None, Stats("de_casteljau"))


def capabilities(options: BezierOptions) -> Capabilities:
    """Return what is honoured; one curve is smooth, a composite one as smooth as asked."""
    return by_control_points(SMOOTH if options.degree is None else int(options.joints[1]))


BEZIER = Method(
    id="bezier",
    title="Bézier curve",
    solve=solve,
    options=BezierOptions,
    family="interpolation",
    summary="The curve inside the hull of its control points, which the waypoints are; it passes the outer two.",
    formula="B(s) = sum_i C(n, i) s^i (1 - s)^(n-i) P_i",
    reference=Reference("G. Farin", "Curves and Surfaces for CAGD, chapters 4 and 5", 2002, "Morgan Kaufmann"),
    capabilities=capabilities,
    variants=({"degree": 1}, {"degree": 1, "joints": "C1"}),
)
