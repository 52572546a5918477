"""TOPP-RA: as fast as a fixed path allows, seen in the phase plane.

On a path q(s) only the law s(t) is free. With ṡ the speed along the path,

    q̇ = q'(s) ṡ,   q̈ = q'(s) s̈ + q''(s) ṡ²

so limits on velocity and acceleration become, at each s, limits on ṡ and on pairs (s̈, ṡ²), and the latter are linear
in both. Above some speed no s̈ is left that suits all joints: that is the forbidden region of the phase plane (s, ṡ).
TOPP-RA walks over a grid of stations twice. Backward, it finds the largest ṡ² from which the end can still be
reached,

    xₖ = max { x : some s̈ is allowed and x + 2 Δs s̈ ≤ xₖ₊₁ },   x = ṡ²

forward, it takes the largest s̈ that stays below: two small linear programs a station, and the law is the fastest
there is on the grid. Waywright takes toppra's speeds as exact pieces and lets the certificate check them between the
stations.

**The figure.** Left, the forbidden region (grey), its lower edges from velocity (dotted) and acceleration limits, and
the fastest ṡ(s): it climbs, touches, dips early enough. Right, the accelerations of both joints: at nearly every
instant one of them is at its limit, or a velocity is; the fine teeth are those of the stations.

**When to use it.** For a geometric path that must not change, with velocity and acceleration limits, in milliseconds.

**When not.** With a jerk limit: at each switch the acceleration jumps. `time_optimal_path` is for that.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, Sampling, plan, sample
from planner.curves import cubic_spline, knots

VELOCITY, ACCELERATION = 1.6, 5.0  # rad/s, rad/s², both joints


def allowed(path, s: np.ndarray, speed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where, on the grid of s and speeds, the velocities are allowed, and where some s̈ suits all joints."""
    first, second = path(s, order=1)[:, None, :], path(s, order=2)[:, None, :]
    used = second * speed[None, :, None] ** 2
    ends = np.stack([(-ACCELERATION - used) / first, (ACCELERATION - used) / first])  # of s̈, per joint
    some = ends.min(axis=0).max(axis=-1) <= ends.max(axis=0).min(axis=-1)
    return (np.abs(first * speed[None, :, None]) <= VELOCITY).all(axis=-1), some


def figure() -> Figure:
    """Draw the phase plane with the fastest law, and the accelerations over time."""
    points = [[0, 0], [0.5, 0.6], [1.2, 0.4], [1.6, 1.2], [2.4, 1.0]]  # rad
    request = PlanRequest.of(points, limits={"velocity": VELOCITY, "acceleration": ACCELERATION})
    answer = plan(request, "toppra")
    samples = sample(answer.trajectory, Sampling.of({"count": 1501}))

    path = cubic_spline(knots(points), points, "natural")  # the method's own default, on s in [0, 1]
    s, speed = np.linspace(0, 1, 401), np.linspace(0, 1.2, 301)
    in_velocity, in_acceleration = allowed(path, s, speed)
    at = np.interp(samples.position[:, 0], path(s)[:, 0], s)  # joint 0 only moves forward: its position tells s
    law = samples.velocity[:, 0] / path(at, order=1)[:, 0]

    fig, (left, right) = plt.subplots(1, 2)
    left.contourf(s, speed, (in_velocity & in_acceleration).T, levels=[-0.5, 0.5], colors=["0.85"])
    left.contour(s, speed, in_velocity.T, levels=[0.5], colors="k", linestyles=":")
    left.contour(s, speed, in_acceleration.T, levels=[0.5], colors="C1")
    left.plot([], [], "k:", label="velocity limits")
    left.plot([], [], "C1", label="acceleration limits")
    left.plot(at, law, linewidth=2.5, label="the fastest law")
    left.plot(knots(points), [0] * len(points), "ko", clip_on=False, label="waypoints")
    left.set(xlabel="path parameter s (-)", ylabel="speed ṡ (1/s)", title="forbidden: grey", ylim=(0, 1.2))
    for joint, style in enumerate(("C0-", "C2--")):
        right.plot(samples.time, samples.acceleration[:, joint], style, linewidth=1.1, label=f"joint {joint}")
    for side in (-ACCELERATION, ACCELERATION):
        right.axhline(side, color="k", linewidth=0.8)
    right.set(xlabel="time (s)", ylabel="acceleration (rad/s²)", title=f"{answer.trajectory.duration:.3f} s in all")
    right.set(ylim=(-6.5, 6))
    left.legend(loc="lower center", ncols=2)
    right.legend(loc="lower left", ncols=2)
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
