"""Piecewise linear: the shortest way, with a jolt at every waypoint.

Between two neighbours the curve is their weighted mean, with weights that sum to one:

    q(t) = (1 − u) qᵢ + u qᵢ₊₁,   u = (t − tᵢ) / (tᵢ₊₁ − tᵢ)

Its velocity (qᵢ₊₁ − qᵢ) / (tᵢ₊₁ − tᵢ) is constant on a segment and jumps at the waypoints: the curve is of class C⁰,
and its acceleration is unbounded there, which no motor follows.

**The figure.** Left, the way in the plane, with a dot every 0.1 s: where times are given, the speed is whatever
distance and time make of it. Right, positions and velocities. The certificate names the class that it found (0) and
gives no peak for the acceleration, as there is none.

**When to use it.** As a path that something else times: `trapezoidal` stops at each corner, `time_scaled` bounds the
velocity. Also for data that are dense already, and where not a bit of overshoot is allowed.

**When not.** As a command to a robot, unless waypoints are closer than its controller's own period.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, plan


def figure() -> Figure:
    """Draw the polyline, and its positions and velocities over time."""
    request = PlanRequest.of([[0, 0], [0.4, 1.2], [1.0, 0.4], [1.2, 1.4]], times=[0, 0.5, 1.5, 2])  # m, s
    answer = plan(request, "linear")
    motion = answer.trajectory

    fig, axes = plt.subplot_mosaic([["path", "position"], ["path", "velocity"]])
    axes["path"].plot(*motion(motion.breaks).T, label="path")
    axes["path"].plot(*motion(np.arange(0, 2.01, 0.1)).T, ".", color="C1", label="every 0.1 s")
    axes["path"].plot(*request.waypoints.T, "ko", markerfacecolor="none", markersize=9, label="waypoints")
    axes["path"].set(xlabel="x (m)", ylabel="y (m)", aspect="equal", title="the way")
    for joint, name in enumerate("xy"):
        axes["position"].plot(motion.breaks, motion(motion.breaks)[:, joint], "o-", markersize=4, label=name)
        velocity = motion.derivative().coefficients[0, :, joint]
        axes["velocity"].stairs(velocity, motion.breaks, baseline=None, linewidth=1.5, label=name)
    axes["position"].set(ylabel="position (m)", title=f"positions: of class C{answer.certificate.continuity}")
    axes["velocity"].set(xlabel="time (s)", ylabel="velocity (m/s)", title="velocities: they jump")
    for axis in axes.values():
        axis.legend()
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
