"""Method ``polynomial``."""

from ..curves import chebyshev_nodes, polynomial
from ..curves.barycentric import PolynomialOptions
from ..curves.newton import SMOOTH
from ..errors import InvalidRequest
from ..method import Capabilities, Method, Reference, at_given_times
from ..types import MIN_STEP, PlanRequest, Solution, Stats


def solve(request: PlanRequest, options: PolynomialOptions) -> Solution:
    """Return the one polynomial through all waypoints, at the given times or at Chebyshev nodes."""
    if options.nodes == "given":
        assert request.times is not None
        return Solution(polynomial(request.times, request.waypoints), request.times, Stats("newton_form"))
    if options.interval is None:
        raise InvalidRequest.of("/options/interval", "missing", "chebyshev nodes need the interval [a, b]")
    start, end = options.interval
    if not end - start >= MIN_STEP * request.count**2:
        raise InvalidRequest.of("/options/interval/1", "not_increasing", "must exceed the first entry, by 1e-9 s N²")
    nodes = chebyshev_nodes(request.count, start, end)
    return Solution(polynomial(nodes, request.waypoints, start, end), nodes, Stats("newton_form"))


def capabilities(options: PolynomialOptions) -> Capabilities:
    """Return what is honoured: at Chebyshev nodes the times are the method's own."""
    return at_given_times(SMOOTH) if options.nodes == "given" else Capabilities("chosen", SMOOTH)


POLYNOMIAL = Method(
    id="polynomial",
    title="Interpolating polynomial",
    solve=solve,
    options=PolynomialOptions,
    family="interpolation",
    summary="One polynomial through all waypoints: smooth, but it swings between many evenly spaced ones.",
    formula="p(t) = sum_i w_i x_i / (t - t_i) / sum_i w_i / (t - t_i),  w_i = 1 / prod_{j != i} (t_i - t_j)",
    reference=Reference(
        "J.-P. Berrut and L. N. Trefethen",
        "Barycentric Lagrange interpolation",
        2004,
        "https://doi.org/10.1137/S0036144502417715",
    ),
    capabilities=capabilities,
    variants=({"nodes": "chebyshev", "interval": [0.0, 1.0]},),
)
