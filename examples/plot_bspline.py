"""B-spline: local basis functions, by control points or through waypoints.

On knots t₀ ≤ t₁ ≤ … the basis functions of degree p are blended from those of degree p − 1, down to boxes:

    Bᵢᵖ(t) = (t − tᵢ) / (tᵢ₊ₚ − tᵢ) Bᵢᵖ⁻¹(t)  +  (tᵢ₊ₚ₊₁ − t) / (tᵢ₊ₚ₊₁ − tᵢ₊₁) Bᵢ₊₁ᵖ⁻¹(t)

Each is a bump over p + 1 spans and zero elsewhere, none is negative, and on the valid span they sum to one. So in

    s(t) = Σᵢ xᵢ Bᵢᵖ(t)

a control point moves only p + 1 spans of the curve, and each span lies in the hull of p + 1 control points. A knot
that occurs μ times makes the curve of class C^(p − μ) there; p + 1 equal knots at both ends make it start and end at
the outer points. The curve passes given waypoints after solving Σᵢ xᵢ Bᵢᵖ(tₖ) = qₖ, a banded system, for its control
points.

**The figure.** Above, the seven cubic basis functions on clamped knots. Left, the curve they make of seven control
points, and how one moved point (orange) changes it near by only. Right, the curve through the same points.

**When to use it.** By control points for paths that are shaped and reshaped by hand or by an optimiser; through
waypoints for splines of any degree with one description.

**When not.** By control points when waypoints must be met. For exact circles, see `nurbs`.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, plan
from planner.curves import bspline, clamped_knots


def figure() -> Figure:
    """Draw the basis functions, a curve by control points with one moved, and the curve through them."""
    points = np.array([[0, 0], [0.3, 0.8], [0.8, 0.9], [1.1, 0.1], [1.6, 0.2], [1.9, 0.9], [2.4, 0.6]])  # m
    moved = points.copy()
    moved[2] += [0, 0.5]
    t = np.linspace(0, 1, 401)

    fig, axes = plt.subplot_mosaic([["basis", "basis"], ["control", "through"]], height_ratios=(2, 3))
    basis = bspline(np.eye(7), clamped_knots(7, 3))  # one curve a basis function: its control points are unit vectors
    for i, values in enumerate(basis(t).T):
        color, width = ("C1", 2.5) if i == 2 else ("C0", 1.2)
        axes["basis"].plot(t, values, color=color, linewidth=width, label="that of the moved point" if i == 2 else None)
    axes["basis"].plot(t, basis(t).sum(axis=1), "k:", label="their sum")
    axes["basis"].plot(basis.breaks, 0 * basis.breaks, "k|", markersize=10, label="knots")
    axes["basis"].set(xlabel="parameter t (s)", ylabel="basis (-)", ylim=(-0.1, 1.5))
    axes["basis"].legend(loc="upper center", ncols=3)

    for given, style, name in ((moved, "C1--", "one point moved"), (points, "C0-", "curve")):
        curve = plan(PlanRequest.of(given), "bspline", {"interpolate": False}).trajectory
        axes["control"].plot(*curve(t).T, style, label=name)
        axes["control"].plot(*given.T, "o:", color=style[:2], markersize=4, linewidth=0.8)
    axes["control"].set(xlabel="x (m)", ylabel="y (m)", title="by control points")
    through = plan(PlanRequest.of(points, times=np.linspace(0, 1, 7)), "bspline").trajectory
    axes["through"].plot(*through(t).T, label="curve")
    axes["through"].plot(*points.T, "ko", markersize=4, label="waypoints")
    axes["through"].set(xlabel="x (m)", title="through waypoints")
    for name in ("control", "through"):
        axes[name].set(ylim=(-0.3, 1.5))
        axes[name].legend(loc="upper right")
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
