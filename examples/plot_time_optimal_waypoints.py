"""Time-optimal through waypoints: no stop in between, and the path between them left free.

All joints pass each waypoint W_i at one time t_i. What they do in between is free, and so are these times:

    min T   subject to   q(t_i) = W_i,   |q̇| ≤ v,   |q̈| ≤ a,   |q⃛| ≤ j,   lower ≤ q ≤ upper   at all times

Between two waypoints each joint is a cubic spline of K pieces of constant jerk over u = (t − t_i) / h_i. Velocity,
acceleration and jerk at u are linear in its control points, divided by h_i, h_i² and h_i³; a spline lies in the hull of
its control points, so rows for these hold the limits at all times. Unknown are the durations h_i, velocities and
accelerations at the waypoints, and the inner control points. One joint meets the others by the durations alone, one
segment the next by the states at their waypoint: an interior point takes time linear in segments. Then each segment is
timed again by ruckig, in closed form, from state to state. [time_optimal_waypoints.md](time_optimal_waypoints.md) has
the details.

**The figure.** Left, two joints through six waypoints: with a stop at each by `ruckig` (orange, dashed), as fast as
limits allow (blue), and with a fifth more time spent on less jerk (green). None of them keeps to the polyline (grey),
and the fast ones leave it where they turn. Right, the second joint over time, within its limits (black). Without stops
the velocity stays up where the joint goes on in its direction, and most of the time some limit is reached, by one joint
or the other. The position limit (at 1.01 rad) holds between the waypoints as well.

**When to use it.** Where waypoints say where to be and nothing in between matters: pick and place over via points,
feeding, inspection; from and to moving states; as `auto`, whenever velocity, acceleration and jerk are limited.

**When not.** For a path that must be kept (`time_optimal_path`, or the option `straight`); among obstacles, as nothing
but position limits keeps the motion near the polyline; where times are given (`minimum_jerk`).
"""

from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, Sampling, plan, sample

POINTS = [[0.0, 0.0], [0.5, 0.7], [0.9, 1.0], [1.6, 0.6], [2.0, 0.1], [2.8, 0.5]]  # rad
LIMITS = {"velocity": 1.5, "acceleration": 5.0, "jerk": 40.0}  # rad/s, rad/s², rad/s³, both joints
UPPER = 1.01  # rad, of the second joint
UNITS = {"position": "rad", "velocity": "rad/s", "acceleration": "rad/s²", "jerk": "rad/s³"}
MOTIONS = (
    ("ruckig", {}, "C1--", "with stops"),
    ("time_optimal_waypoints", {"smoothness": 0.2}, "C2-", "with 20 % more"),
    ("time_optimal_waypoints", {}, "C0-", "fastest"),
)


def figure() -> Figure:
    """Draw the paths in the plane, and the second joint's motion over time."""
    fig, axes = plt.subplot_mosaic([["plane", q] for q in UNITS], width_ratios=(1, 1))
    points, position = list(zip(*POINTS, strict=True)), {"lower": None, "upper": [None, UPPER]}
    axes["plane"].plot(*points, "0.6", linewidth=1.0)
    for method, options, style, name in MOTIONS:
        limits = LIMITS if method == "ruckig" else {**LIMITS, "position": position}  # ruckig knows none of position
        answer = plan(PlanRequest.of(POINTS, limits=limits), method, options)
        samples = sample(answer.trajectory, Sampling.of({"count": 2001}))
        label = f"{name}: {answer.trajectory.duration:.2f} s"
        axes["plane"].plot(samples.position[:, 0], samples.position[:, 1], style, label=label)
        for quantity in UNITS:
            axes[quantity].plot(samples.time, getattr(samples, quantity)[:, 1], style, linewidth=1.2)
        axes["position"].plot(answer.waypoint_times, points[1], style[:2] + "o", markersize=3)
    axes["plane"].plot(*points, "ko", markersize=4, label="waypoints")
    axes["plane"].set(xlabel="first joint (rad)", ylabel="second joint (rad)", ylim=(-0.35, 1.1))
    axes["plane"].legend(loc="lower left")
    for quantity, unit in UNITS.items():
        axes[quantity].set_ylabel(f"{quantity}\n({unit})")
        axes[quantity].tick_params(labelbottom=quantity == "jerk")
        for side in (-1, 1) if quantity in LIMITS else ():
            axes[quantity].axhline(side * LIMITS[quantity], color="k", linewidth=0.8)
    for name in ("plane", "position"):
        axes[name].axhline(UPPER, color="k", linewidth=0.8)
    axes["jerk"].set_xlabel("time (s)")
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
