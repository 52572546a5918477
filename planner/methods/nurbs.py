"""Method ``nurbs``."""

import numpy as np

from ..curves.basis import smoothness
from ..curves.nurbs_curve import NurbsOptions, from_options
from ..method import Capabilities, Method, Reference, by_control_points
from ..types import PlanRequest, Solution, Stats


def solve(request: PlanRequest, options: NurbsOptions) -> Solution:
    """Return the rational B-spline of which the waypoints are the control points."""
    return Solution(from_options(options, request.waypoints, request.duration), None, Stats("de_boor"))


def capabilities(options: NurbsOptions) -> Capabilities:
    """Return what is honoured; the class is the degree less the largest multiplicity of an interior knot."""
    if options.knots is None:
        return by_control_points(options.degree - 1)
    return by_control_points(smoothness(np.array(options.knots), options.degree))


NURBS = Method(
    id="nurbs",
    title="Rational B-spline (NURBS)",
    solve=solve,
    options=NurbsOptions,
    family="interpolation",
    summary="Weighted control points: circles and other conics exactly; the answer's pieces have a denominator.",
    formula="s(t) = sum_i w_i x_i B_i^p(t) / sum_i w_i B_i^p(t)",
    reference=Reference("L. Piegl and W. Tiller", "The NURBS Book, chapter 4", 1997, "Springer"),
    capabilities=capabilities,
    variants=({"degree": 2},),
)
