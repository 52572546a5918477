"""Path and time law: one way, four ways to run through it.

A path f(s) says where, a law s(t) says when; the trajectory is their composition. By the chain rule

    q = f(s),   q̇ = f'(s) ṡ,   q̈ = f''(s) ṡ² + f'(s) s̈

so the law decides about speed and about half of the acceleration, while the part f'' ṡ² is what the path's curvature
costs at that speed. A law must not fall, and must be as smooth as the motion is to be. If path and law are piecewise
polynomials, so is the composition, of a degree that is the product of theirs: `Trajectory.compose` computes it
exactly.

**The figure.** A spline in the plane, in 2 s, by four laws:

- even: ṡ is constant, the motion starts and ends with a jump of the velocity;
- trapezoid: bounded ṡ and s̈, planned here by `trapezoidal` as a motion of its own, with one joint whose position is
  s;
- cubic, 3u² − 2u³: from rest to rest, the acceleration jumps at both ends;
- quintic, 10u³ − 15u⁴ + 6u⁵: the acceleration, too, starts and ends at zero.

**When to use it.** Whenever geometry and timing come from different places: a path from CAD, a law from a drive.

**When not.** Where limits are per joint: a law chosen by hand wastes time on most of the path and may break a limit
where it bends. `toppra` and `time_optimal_nlp` find the law.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, Trajectory, plan
from planner.curves import cubic_spline, knots, minimum_jerk_motion


def figure() -> Figure:
    """Draw one path, four laws, and the speeds and accelerations that they make."""
    points = [[0, 0], [0.4, 0.6], [1.0, 0.5], [1.2, 0.0]]  # m
    path = cubic_spline(knots(points), points, "natural")  # s in [0, 1]
    end = [0.0, 2.0]
    slow = PlanRequest.of([0, 1], limits={"velocity": 0.8, "acceleration": 1.2}, duration={"min": 2.0})
    laws = {
        "even": Trajectory.from_hermite(end, [[0], [1]]),
        "trapezoid": plan(slow, "trapezoidal").trajectory,
        "cubic": Trajectory.from_hermite(end, [[0], [1]], [[0], [0]]),
        "quintic": minimum_jerk_motion(2.0, [[0], [0], [0]], [[1], [0], [0]]),
    }
    t, ticks = np.linspace(0, 2, 501), np.linspace(0, 2, 21)

    fig, axes = plt.subplot_mosaic([["law", "speed"], ["path", "acceleration"]])
    axes["path"].plot(*path(np.linspace(0, 1, 201)).T, "k", linewidth=0.8)
    for number, (name, law) in enumerate(laws.items()):
        style = ("C4:", "C1--", "C2-.", "C0-")[number]
        motion = path.compose(law)
        axes["law"].plot(t, law(t), style, label=name)
        axes["speed"].plot(t, np.linalg.norm(motion(t, order=1), axis=1), style)
        axes["acceleration"].plot(t, np.linalg.norm(motion(t, order=2), axis=1), style)
        if name in ("even", "quintic"):
            axes["path"].plot(
                *motion(ticks).T, style[:2] + "os"[number == 0], markersize=4, label=f"{name}: each 0.1 s"
            )
    axes["law"].set(xlabel="time (s)", ylabel="law s (-)")
    axes["path"].set(xlabel="x (m)", ylabel="y (m)", aspect="equal", ylim=(-0.1, 0.8))
    axes["speed"].set(xlabel="time (s)", ylabel="speed (m/s)", ylim=(0, None))
    axes["acceleration"].set(xlabel="time (s)", ylabel="acceleration (m/s²)", ylim=(0, None))
    axes["law"].legend()
    axes["path"].legend(loc="lower center")
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
