"""Method ``bspline``."""

import numpy as np

from ..curves import basis
from ..curves.basis import BsplineOptions
from ..method import Capabilities, Method, Reference, at_given_times, by_control_points
from ..types import PlanRequest, Solution, Stats


def solve(request: PlanRequest, options: BsplineOptions) -> Solution:
    """Return the B-spline through the waypoints, or by them as control points."""
    if not options.interpolate:
        return Solution(basis.by_control_points(options, request.waypoints, request.duration), None, Stats("de_boor"))
    assert request.times is not None
    curve = basis.through_waypoints(options, request.times, request.waypoints, options.knots)
    return Solution(curve, request.times, Stats("banded_elimination"))


def capabilities(options: BsplineOptions) -> Capabilities:
    """Return what is honoured; the class is the degree less the largest multiplicity of an interior knot."""
    class_ = options.degree - 1
    if options.knots is not None:
        class_ = basis.smoothness(np.array(options.knots), options.degree)
    return at_given_times(class_) if options.interpolate else by_control_points(class_)


BSPLINE = Method(
    id="bspline",
    title="B-spline",
    solve=solve,
    options=BsplineOptions,
    family="interpolation",
    summary="A spline of any degree on any knots, through the waypoints or with them as control points.",
    formula="s(t) = sum_i x_i B_i^p(t)  on  [t_p, t_N]",
    reference=Reference("C. de Boor", "A Practical Guide to Splines, chapters IX and X", 1978, "Springer"),
    capabilities=capabilities,
    variants=({"degree": 1}, {"degree": 2}, {"degree": 5}, {"interpolate": False}),
)
