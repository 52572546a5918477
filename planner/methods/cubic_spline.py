"""Method ``cubic_spline``."""

from typing import Any

import numpy as np

from ..curves import cubic_spline
from ..curves.cubic import CubicSplineOptions, ends_of
from ..limits import Boundary
from ..method import Capabilities, Method, Reference, at_given_times
from ..types import Note, PlanRequest, Solution, Stats

TAKES = {"clamped": frozenset({"velocity"}), "second_derivative": frozenset({"acceleration"})}


def solve(request: PlanRequest, options: CubicSplineOptions) -> Solution:
    """Return the C2 cubic spline through the waypoints at the given times."""
    assert request.times is not None
    zero = np.zeros(request.dims)
    notes: tuple[Note, ...] = ()
    if options.boundary == "start_conditions":
        message = "start conditions are an initial-value recursion: errors grow by about 3.7 at every waypoint"
        notes = (Note("ill_conditioned", message),)
    curve = cubic_spline(
        request.times,
        request.waypoints,
        options.boundary,
        _value(request.start, ends_of(options.boundary)[0]),
        _value(request.end, ends_of(options.boundary)[1]),
        zero if request.start.acceleration is None else request.start.acceleration,
    )
    return Solution(curve, request.times, Stats("tridiagonal_elimination"), notes=notes)


def _value(state: Boundary, kind: str) -> Any:
    value = state.acceleration if kind == "second_derivative" else state.velocity
    return 0.0 if value is None else value


def capabilities(options: CubicSplineOptions) -> Capabilities:
    """Return what is honoured: each boundary kind takes what it is closed by."""
    start, end = (TAKES.get(kind, frozenset()) for kind in ends_of(options.boundary))
    if options.boundary == "start_conditions":
        start, end = frozenset({"velocity", "acceleration"}), frozenset()
    return at_given_times(2, start, end)


CUBIC_SPLINE = Method(
    id="cubic_spline",
    title="Cubic spline",
    solve=solve,
    options=CubicSplineOptions,
    family="interpolation",
    summary="The twice continuously differentiable cubic spline through the waypoints.",
    formula="h_k s_{k-1} + 2 (h_{k-1} + h_k) s_k + h_{k-1} s_{k+1} = 3 (h_k d_{k-1} + h_{k-1} d_k)",
    reference=Reference("C. de Boor", "A Practical Guide to Splines, chapter IV", 1978, "Springer"),
    capabilities=capabilities,
    variants=tuple(
        {"boundary": b}
        for b in (
            "second_derivative",
            "natural",
            "periodic",
            "not_a_knot",
            "start_conditions",
            ["clamped", "second_derivative"],
            ["clamped", "natural"],
            ["second_derivative", "clamped"],
            ["natural", "clamped"],
        )
    ),
)
