"""Method ``linear``."""

from ..curves import linear
from ..curves.polyline import LinearOptions
from ..method import Method, Reference, at_given_times
from ..types import PlanRequest, Solution, Stats


def solve(request: PlanRequest, options: LinearOptions) -> Solution:
    """Return the polyline through the waypoints at the given times."""
    assert request.times is not None
    return Solution(linear(request.times, request.waypoints), request.times, Stats("closed_form"))


LINEAR = Method(
    id="linear",
    title="Piecewise linear",
    solve=solve,
    options=LinearOptions,
    family="interpolation",
    summary="Straight lines between the waypoints; the velocity jumps at each of them.",
    formula="q(t) = (1 - u) q_i + u q_{i+1},  u = (t - t_i) / (t_{i+1} - t_i)",
    reference=Reference("K. Hauser", "Robotic Systems, section III", 2022, "https://motion.cs.illinois.edu/"),
    capabilities=lambda options: at_given_times(0),
)
