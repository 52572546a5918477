"""Rational B-spline (NURBS): weights, and circles that are circles.

Every control point gets a weight wᵢ > 0, and the curve is a quotient of two B-splines:

    s(t) = Σᵢ wᵢ xᵢ Bᵢᵖ(t)  /  Σᵢ wᵢ Bᵢᵖ(t)

It is an ordinary B-spline of the points (wᵢ xᵢ, wᵢ), seen in perspective. No polynomial draws a circle, but a
quotient does: with t the tangent of the half angle, (1 − t²) / (1 + t²) and 2t / (1 + t²) are cosine and sine. A
quarter takes three control points of degree 2, at the corner with weight cos 45° = 1/√2; nine of them close the
circle.

**The figure.** Left, the middle weight of one quarter: below 1 the arc is an ellipse's, at 1/√2 the circle's, at 1 a
parabola's, beyond a hyperbola's: a weight pulls the curve to its point. Right, the full circle, with a dot at even
steps of the clock, and the speed: the way is exact, the speed is not even. `time_scaled` or `toppra` see to that.

**When to use it.** For arcs, circles and other conics from CAD and CNC, exactly.

**When not.** Where a plain spline is good enough: derivatives of quotients are costlier, and their extrema are
bounded tightly instead of solved for. A circle by polynomials of degree 3 in four quarters is off by 3 parts in
10,000 already.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, plan


def figure() -> Figure:
    """Draw arcs of several weights, the full circle, and the speed along it."""
    corner, even = 1 / np.sqrt(2), np.linspace(0, 1, 201)
    fig, axes = plt.subplot_mosaic([["arcs", "circle"], ["arcs", "speed"]], height_ratios=(3, 2))
    arcs, whole, speed = (axes[name] for name in ("arcs", "circle", "speed"))
    quarter = PlanRequest.of([[1, 0], [1, 1], [0, 1]])  # m
    for number, (weight, name) in enumerate(((0.3, "0.3"), (corner, "1/√2: circle"), (1, "1"), (4, "4"))):
        arc = plan(quarter, "nurbs", {"degree": 2, "weights": [1, weight, 1]}).trajectory
        arcs.plot(*arc(even).T, ("C4:", "C0-", "C2--", "C1-.")[number], linewidth=2, label=f"w = {name}")
    arcs.plot(*quarter.waypoints.T, "o:", color="0.4", linewidth=1, label="control points")
    arcs.set(xlabel="x (m)", ylabel="y (m)", title="weight of the corner")

    square = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]]
    knots = [0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1]
    options = {"degree": 2, "knots": knots, "weights": [1, corner] * 4 + [1]}
    circle = plan(PlanRequest.of(square), "nurbs", options).trajectory
    x, v = circle(even), circle(even, order=1)
    radius = np.linalg.norm(x, axis=1)
    whole.plot(*np.transpose(square), "o:", color="0.4", linewidth=1)
    whole.plot(*x.T)
    whole.plot(*circle(np.arange(40) / 40).T, "C1o", markersize=4)
    whole.set(
        xlabel="x (m)",
        ylabel="y (m)",
        title=f"circle, off by less than {10.0 ** np.ceil(np.log10(np.ptp(radius))):.0e} m",
    )
    speed.plot(even, np.linalg.norm(v, axis=1), label="speed")
    speed.axhline(2 * np.pi, color="k", linestyle="--", label="2π: even speed")
    speed.set(xlabel="time (s)", ylabel="speed (m/s)", ylim=(5.4, 7.6))
    arcs.set(aspect="equal", xlim=(-0.1, 1.1), ylim=(-0.1, 1.1))
    whole.set(aspect="equal")
    arcs.legend(loc="lower left")
    speed.legend(loc="upper right", ncols=2)
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
