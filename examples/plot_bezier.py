"""Bézier curve: a curve drawn by its control points.

Take n + 1 control points and divide every side of their polygon in the ratio s : 1 − s; do the same with the polygon
that results, until one point is left. That is de Casteljau's construction, and its point is

    B(s) = Σᵢ C(n, i) sⁱ (1 − s)ⁿ⁻ⁱ Pᵢ

The weights are never negative and sum to one: every point is a mean of the control points and lies in their convex
hull. The curve starts at P₀ towards P₁, B'(0) = n (P₁ − P₀), and ends likewise. Segments that share an end point make
longer curves; with durations h on both sides of a joint, they are of class C¹ there if

    (Pₙ − Pₙ₋₁) / h   before the joint  =  (P₁ − P₀) / h   after it

**The figure.** Left, the construction at s = 0.4: the last division gives the point and its tangent. Right, two cubic
segments: with the handle of the second in line with and as long as that of the first (blue) the motion runs through
the joint; turned away (orange) it has a corner there, and `"joints": "C1"` would refuse it.

**When to use it.** For hand-made paths, for guarantees from the hull (no point leaves it, so it is enough to check
the control points against a box), and for blends.

**When not.** To pass given waypoints: the curve only passes the outer control points. Many points on one curve barely
pull it any more; take segments, or a `bspline`.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from scipy.spatial import ConvexHull

from planner import PlanRequest, plan


def figure() -> Figure:
    """Draw de Casteljau's construction in the hull, and two segments with and without a C1 joint."""
    points, s = np.array([[0, 0], [0.1, 0.9], [1.0, 1.1], [1.2, 0.1]]), 0.4  # m
    curve = plan(PlanRequest.of(points), "bezier").trajectory
    at = np.linspace(0, 1, 201)

    fig, (left, right) = plt.subplots(1, 2)
    left.fill(*points[ConvexHull(points).vertices].T, color="0.93", label="hull")
    level, colors = points, iter(["0.3", "C2", "C4", "C1"])
    while len(level):
        color = next(colors)
        name = {4: "control polygon", 3: "divided once", 2: "twice", 1: f"B({s})"}[len(level)]
        left.plot(*level.T, "o-", color=color, markersize=5, linewidth=1.2, zorder=5 - len(level), label=name)
        level = (1 - s) * level[:-1] + s * level[1:]
    left.plot(*curve(at).T, linewidth=2.5, zorder=1.5, label="curve")
    left.set(xlabel="x (m)", ylabel="y (m)", title="de Casteljau's construction")

    first = [[0, 0], [0, 0.6], [0.3, 0.9], [0.6, 0.9]]
    for handle, joints, style in (([0.9, 0.4], "C0", "C1--"), ([0.9, 0.9], "C1", "C0-")):
        request = PlanRequest.of([*first, handle, [1.2, 0.5], [1.2, 0]])
        answer = plan(request, "bezier", {"degree": 3, "joints": joints})
        right.plot(*answer.trajectory(at).T, style, linewidth=2.5, label=f"class C{answer.certificate.continuity}")
        right.plot(*request.waypoints.T, "o:", color=style[:2], markersize=4, linewidth=1)
    right.plot(0.6, 0.9, "ks", label="joint")
    right.set(xlabel="x (m)", title="two cubic segments")
    for axis in (left, right):
        axis.set(aspect="equal", xlim=(-0.1, 1.3), ylim=(-0.45, 1.2))
        axis.legend(loc="lower center", ncols=3)
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
