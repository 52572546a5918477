"""Interpolating polynomial: Runge's phenomenon, and the nodes that cure it.

Through N points at distinct times goes exactly one polynomial of degree N − 1 or less. Its stable form weighs the
points by their distance in time, without ever solving for powers of t:

    p(t) = Σᵢ wᵢ xᵢ / (t − tᵢ)  /  Σᵢ wᵢ / (t − tᵢ),   wᵢ = 1 / Πⱼ≠ᵢ (tᵢ − tⱼ)

The error at t is f⁽ᴺ⁾(τ) / N! · Πᵢ (t − tᵢ) for some τ: the product is in our hands. With even steps it is huge near
the ends; smallest of all is its peak at the Chebyshev nodes, which are the feet of even steps on a half circle:

    tₖ = (a + b) / 2 + (b − a) / 2 · cos((2k + 1) π / (2N)),   k = 0 … N − 1

**The figure.** Runge's function 1 / (1 + 25 t²) through 13 points: even steps (orange) swing ever wider towards the
ends, Chebyshev nodes (blue) do not. Right, the largest errors: more points make the one worse and the other better.

**When to use it.** For few points (up to some six), or where you may choose the times: a smooth function is then met
to rounding with few numbers.

**When not.** For many waypoints at given times. Waywright refuses nodes whose Lebesgue constant shows that nothing
would be left of the data; use `cubic_spline` there.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, Trajectory, plan
from planner.curves import chebyshev_nodes


def runge(t: np.ndarray) -> np.ndarray:
    """Return Runge's function."""
    return 1 / (1 + 25 * t**2)


def even(count: int) -> Trajectory:
    """Return the polynomial through points at even steps on [-1, 1]."""
    times = np.linspace(-1, 1, count)
    return plan(PlanRequest.of(runge(times), times=times), "polynomial").trajectory


def chebyshev(count: int) -> Trajectory:
    """Return the polynomial through points at the Chebyshev nodes; the method chooses these times itself."""
    request = PlanRequest.of(runge(chebyshev_nodes(count)))
    return plan(request, "polynomial", {"nodes": "chebyshev", "interval": [-1, 1]}).trajectory


def figure() -> Figure:
    """Draw Runge's function through 13 points, and the errors for 3 to 31 points."""
    t = np.linspace(-1, 1, 801)
    fig, (left, right) = plt.subplots(1, 2)
    left.plot(t, runge(t), "k", linewidth=3, alpha=0.3, label="1 / (1 + 25 t²)")
    for curve, nodes, style, name in (
        (chebyshev, chebyshev_nodes(13), "C0o", "Chebyshev nodes"),
        (even, np.linspace(-1, 1, 13), "C1s", "even steps"),
    ):
        left.plot(t, curve(13)(t), style[:2], label=name)
        left.plot(nodes, runge(nodes), style, markersize=4)
        counts = np.arange(3, 32, 2)
        errors = [np.abs(curve(n)(t)[:, 0] - runge(t)).max() for n in counts]
        right.semilogy(counts, errors, style + "-", markersize=4, label=name)
    left.set(xlabel="time (s)", ylabel="position (m)", ylim=(-1.2, 1.4), title="13 points")
    right.set(xlabel="number of points N", ylabel="largest error (m)", title="more points")
    left.legend(loc="lower center")
    right.legend()
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
