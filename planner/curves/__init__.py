"""Interpolation as functions: points and times (or knots) in, a trajectory out.

Modules are named after the mathematics, functions after the curves: none has the other's name.
"""

from .barycentric import (
    barycentric,
    barycentric_weights,
    chebyshev_nodes,
    lagrange_basis,
    lebesgue_constant,
    polynomial,
)
from .basis import basis_values, bspline, clamped_knots, de_boor, inserted, interpolating_points, interpolation_knots
from .bernstein import (
    bernstein_basis,
    bezier,
    composite_bezier,
    control_points,
    de_casteljau,
    derivative_points,
    elevated,
    subdivided,
)
from .cubic import cubic_spline, move
from .higher import quintic_pieces, quintic_spline, septic_spline
from .local_hermite import cubic_hermite, tangents
from .motion import minimum_jerk_motion, shortest_duration
from .nurbs_curve import nurbs
from .osculating import hermite
from .polyline import linear
from .spacing import knots, shortest_turns
from .textbook import cubic_system, freedoms, vandermonde

__all__ = [
    "barycentric",
    "barycentric_weights",
    "basis_values",
    "bernstein_basis",
    "bezier",
    "bspline",
    "chebyshev_nodes",
    "clamped_knots",
    "composite_bezier",
    "control_points",
    "cubic_hermite",
    "cubic_spline",
    "cubic_system",
    "de_boor",
    "de_casteljau",
    "derivative_points",
    "elevated",
    "freedoms",
    "hermite",
    "inserted",
    "interpolating_points",
    "interpolation_knots",
    "knots",
    "lagrange_basis",
    "lebesgue_constant",
    "linear",
    "minimum_jerk_motion",
    "move",
    "nurbs",
    "polynomial",
    "quintic_pieces",
    "quintic_spline",
    "septic_spline",
    "shortest_duration",
    "shortest_turns",
    "subdivided",
    "tangents",
    "vandermonde",
]
