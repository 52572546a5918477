"""Trapezoidal velocity: as hard as allowed, from stop to stop.

The fastest move of a distance d from rest to rest with |v| ≤ V and |a| ≤ A is all or nothing: full acceleration,
cruise, full deceleration. Each ramp takes V / A and covers V² / (2A), so

    T = d / V + V / A          if d ≥ V² / A: the velocity is a trapezoid
    T = 2 √(d / A)             else: V is not reached, the velocity is a triangle with the peak √(d A)

With several joints on one straight line, each joint's limits become limits of the path's own speed, V = minⱼ Vⱼ /
|dⱼ| and A = minⱼ Aⱼ / |dⱼ|: one joint sets the pace, the others follow in step. Acceleration and deceleration may
differ.

**The figure.** Three segments of two joints, with a stop at each waypoint (dotted). On the first and the last, a long
move reaches its velocity limit: a trapezoid; the short one between is a triangle. At each instant some joint is on
one of its limits (in the panels, values over limits): that is what fastest means here. The acceleration jumps: no
jerk limit.

**When to use it.** For point-to-point moves on straight lines by drives that know velocity and acceleration limits;
as a fast answer in closed form, optimal for stops at all waypoints.

**When not.** Where the jumps excite vibration (`ruckig`), or where the way need not be straight and the stops cost
too much time (`toppra` on a curve).
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, Sampling, plan, sample

VELOCITY, ACCELERATION = np.array([1.0, 0.8]), np.array([4.0, 2.0])  # rad/s, rad/s², per joint


def figure() -> Figure:
    """Draw positions, and velocities and accelerations over their limits."""
    limits = {"velocity": VELOCITY, "acceleration": ACCELERATION}
    answer = plan(PlanRequest.of([[0, 0], [1.0, 0.4], [1.1, 0.6], [0.4, 1.6]], limits=limits), "trapezoidal")  # rad
    samples = sample(answer.trajectory, Sampling.of({"count": 2001}))

    fig, axes = plt.subplots(3, 1, sharex=True)
    for joint, style in enumerate(("C0-", "C1--")):
        axes[0].plot(samples.time, samples.position[:, joint], style, label=f"joint {joint}")
        axes[1].plot(samples.time, samples.velocity[:, joint] / VELOCITY[joint], style)
        axes[2].plot(samples.time, samples.acceleration[:, joint] / ACCELERATION[joint], style)
    for axis in axes:
        for time in answer.waypoint_times:
            axis.axvline(time, color="k", linestyle=":", linewidth=1)
    for axis in axes[1:]:
        for side in (-1, 1):
            axis.axhline(side, color="k", linewidth=0.8)
    axes[0].set(ylabel="position (rad)", title=f"three segments, three stops: {answer.trajectory.duration:.3f} s")
    axes[1].set(ylabel="velocity /\nits limit (-)", ylim=(-1.2, 1.2))
    axes[2].set(ylabel="acceleration /\nits limit (-)", ylim=(-1.2, 1.2), xlabel="time (s)")
    axes[0].legend(loc="upper left")
    fig.align_ylabels()
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
