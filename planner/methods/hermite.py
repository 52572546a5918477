"""Method ``hermite``."""

from ..curves.newton import SMOOTH
from ..curves.osculating import HermiteOptions, from_options
from ..method import Method, Reference, at_given_times
from ..types import Note, PlanRequest, Solution, Stats


def solve(request: PlanRequest, options: HermiteOptions) -> Solution:
    """Return the one polynomial with the given positions and velocities at all waypoints."""
    assert request.times is not None
    notes: tuple[Note, ...] = ()
    if options.velocities is None:
        notes = (Note("velocities_chosen", "no velocities were given: finite differences of the waypoints"),)
    curve = from_options(options, request.times, request.waypoints)
    return Solution(curve, request.times, Stats("newton_form"), notes=notes)


HERMITE = Method(
    id="hermite",
    title="Osculating polynomial",
    solve=solve,
    options=HermiteOptions,
    family="interpolation",
    summary="One polynomial that takes given positions and velocities at all waypoints.",
    formula="p(t) = sum_i x_i [1 - 2 l_i'(t_i) (t - t_i)] l_i(t)² + v_i (t - t_i) l_i(t)²",
    reference=Reference("J. Stoer and R. Bulirsch", "Introduction to Numerical Analysis, 2.1.5", 2002, "Springer"),
    capabilities=lambda options: at_given_times(SMOOTH),
)
