"""Ruckig: the fastest motion within a jerk limit.

With |j| ≤ J as well, acceleration can no longer jump, so each ramp of the velocity gets rounded at both ends. The
fastest motion from rest to rest has up to seven phases in which the jerk is J, 0 or −J ("double S"). If velocity and
acceleration limit are both reached, a ramp takes A / J + V / A, and

    T = d / V + V / A + A / J

Shorter moves lose phases: first the cruise, then the phases at full acceleration, until jerk alone sets the time, T =
4 ∛(d / (2J)). As J grows, T falls to the trapezoidal profile's. From and to any state there are more cases, with
roots of polynomials up to degree six; the ruckig library (Berscheid and Kröger) knows them all, per joint, and lets
all joints arrive together.

**The figure.** One move with the jerk limit (blue, its seven phases shaded by turns), without (orange, dashed), and
with the jerk limit from a start that is moving backwards (green, dotted). Black: the limits.

**When to use it.** For drives and arms with jerk limits, from stop to stop or from a state in motion; the library
takes microseconds.

**When not.** Where the way between waypoints matters, as each joint goes its own way in its own time; where a motion
through many waypoints must not stop at each (`time_optimal_nlp`, `time_scaled`).
"""

from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, Sampling, plan, sample

LIMITS = {"velocity": 1.0, "acceleration": 2.5, "jerk": 12.0}  # rad/s, rad/s², rad/s³


def figure() -> Figure:
    """Draw a move with and without a jerk limit, and one from a moving start."""
    without = {k: LIMITS[k] for k in ("velocity", "acceleration")}
    moves = (
        (plan(PlanRequest.of([0, 1.2], limits=without), "ruckig"), "C1--", "without jerk limit"),
        (plan(PlanRequest.of([0, 1.2], limits=LIMITS, start={"velocity": [-0.6]}), "ruckig"), "C2:", "moving start"),
        (plan(PlanRequest.of([0, 1.2], limits=LIMITS), "ruckig"), "C0-", "with jerk limit"),
    )
    fig, axes = plt.subplots(2, 2, sharex=True)
    quantities = {"position": "rad", "velocity": "rad/s", "acceleration": "rad/s²", "jerk": "rad/s³"}
    for axis, (quantity, unit) in zip(axes.flat, quantities.items(), strict=True):
        for answer, style, name in moves:
            samples = sample(answer.trajectory, Sampling.of({"count": 1501}))
            if quantity != "jerk" or name != "without jerk limit":  # there it is nothing but spikes
                label = f"{name}: {answer.trajectory.duration:.3f} s"
                axis.plot(samples.time, getattr(samples, quantity), style, label=label)
        for sign in (-1, 1) if quantity in LIMITS else ():
            axis.axhline(sign * LIMITS[quantity], color="k", linewidth=0.8)
        for begin, end in zip(answer.trajectory.breaks[::2], answer.trajectory.breaks[1::2], strict=False):
            axis.axvspan(begin, end, color="0.93", zorder=0)
        axis.set(ylabel=f"{quantity} ({unit})")
        axis.margins(y=0.12)
    axes[0, 0].set(ylim=(-0.3, 2.1))
    axes[0, 0].legend(loc="upper left")
    axes[1, 0].set(xlabel="time (s)")
    axes[1, 1].set(xlabel="time (s)")
    fig.align_ylabels()
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
