"""Time-optimal path timing: the fastest law along a fixed path, with jerk limits or without.

The path q(s) is fixed, the law s(t) is free. With a = ṡ² as a function of s, and ' for d/ds,

    q̇ = q' √a,   q̈ = q'' a + q' a'/2,   q⃛ = √a (q''' a + 3/2 q'' a' + q' a''/2),   T = ∫ ds / √a

so limits of velocity and acceleration are linear in a and a', and T is convex in a. Without jerk limits one pass
backward over the stations finds the largest a from which the end can still be reached, one forward takes as much as it
can. With them a is a quadratic spline, and an interior point minimises T; the rows of the jerk, of which √a makes the
only part that is not convex, are taken at tangents that keep it on the safe side. Then the law is looked at between the
stations: the grid is split where time is lost, limits are lowered where they were broken, and at last the exact extrema
of the whole slow it down by the last little. [time_optimal_path.md](time_optimal_path.md) has the details.

**The figure.** Left, the phase plane: forbidden speeds (grey; by velocity up to the dotted edge, by acceleration
beyond the orange one), the fastest law without a jerk limit (dashed) and with one (solid). The dashed law has kinks,
where the acceleration jumps; the solid one rounds them, and pays for it in time. Right, both joints over time, each
quantity divided by its limit (black lines): the solid curves reach the limits one after the other and cross none. The
jerk of the dashed law is not drawn: at each jump of the acceleration it is unbounded.

**When to use it.** For a path that must not change (taught, machined, checked for collisions), as fast as velocity,
acceleration and jerk limits allow, or in a given time; from and to moving ends; with a limit of the speed along it.

**When not.** Where only the waypoints matter: `ruckig` and `minimum_jerk` choose the way as well. Where the time at
each waypoint is given: `time_scaled`, `minimum_jerk`.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, Sampling, plan, sample
from planner.curves import cubic_spline, knots

POINTS = [[0, 0], [0.5, 0.6], [1.2, 0.4], [1.6, 1.2], [2.4, 1.0]]  # rad
LIMITS = {"velocity": 1.6, "acceleration": 5.0, "jerk": 25.0}  # rad/s, rad/s², rad/s³, both joints
UNITS = {"velocity": "1.6 rad/s", "acceleration": "5 rad/s²", "jerk": "25 rad/s³"}


def draw_forbidden(axis, path) -> None:
    """Draw where velocity or acceleration limits leave no path acceleration."""
    s, speed = np.linspace(0, 1, 401), np.linspace(0, 1.2, 301)
    first, second = path(s, order=1)[:, None, :], path(s, order=2)[:, None, :] * speed[None, :, None] ** 2
    fast = np.abs(first * speed[None, :, None]).max(axis=-1) / LIMITS["velocity"]
    ends = np.sort([(-LIMITS["acceleration"] - second) / first, (LIMITS["acceleration"] - second) / first], axis=0)
    short = ends[0].max(axis=-1) - ends[1].min(axis=-1)
    axis.contourf(s, speed, ((fast > 1) | (short > 0)).T, levels=[0.5, 1.5], colors=["0.85"])
    axis.contour(s, speed, fast.T, levels=[1], colors="k", linestyles=":")
    axis.contour(s, speed, short.T, levels=[0], colors="C1")


def figure() -> Figure:
    """Draw the phase plane with both laws, and velocity, acceleration and jerk over time."""
    fig, axes = plt.subplot_mosaic([["plane", q] for q in UNITS], width_ratios=(1, 1))
    path = cubic_spline(knots(POINTS), POINTS, "natural")  # the method's own default, on s in [0, 1]
    draw_forbidden(axes["plane"], path)
    s = np.linspace(0, 1, 401)
    for quantities, style, width in ((("velocity", "acceleration"), "--", 1.0), (tuple(UNITS), "-", 1.5)):
        limits = {q: LIMITS[q] for q in quantities}
        answer = plan(PlanRequest.of(POINTS, limits=limits), "time_optimal_path")
        samples = sample(answer.trajectory, Sampling.of({"count": 1501}))
        at = np.interp(samples.position[:, 0], path(s)[:, 0], s)  # joint 0 only moves forward: its position tells s
        law, name = samples.velocity[:, 0] / path(at, order=1)[:, 0], "with" if "jerk" in limits else "without"
        label = f"{name} a jerk limit: {answer.trajectory.duration:.3f} s"
        axes["plane"].plot(at, law, "C0" + style, linewidth=width + 0.5, label=label)
        for q in quantities:
            for joint, color in enumerate(("C0", "C2")):
                ratio = getattr(samples, q)[:, joint] / LIMITS[q]
                label = f"joint {joint}" if "jerk" in limits else None
                axes[q].plot(samples.time, ratio, color + style, linewidth=width, label=label)
    for q, unit in UNITS.items():
        axes[q].set(ylabel=f"{q}\n/ {unit}", ylim=(-1.25, 1.25))
        axes[q].tick_params(labelbottom=q == "jerk")
        for side in (-1, 1):
            axes[q].axhline(side, color="k", linewidth=0.8)
    axes["plane"].set(xlabel="path parameter s (-)", ylabel="speed ṡ (1/s)", title="forbidden: grey", ylim=(0, 0.75))
    axes["plane"].legend(loc="lower center")
    axes["jerk"].set(xlabel="time (s)")
    axes["velocity"].legend(loc="lower right", ncols=2)
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
