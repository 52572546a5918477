"""Uniform time scaling: one number makes any motion keep its limits.

Run the clock slower by α: q(t / α) goes the same way, and each derivative brings out another factor,

    velocity / α,   acceleration / α²,   jerk / α³

So with the peaks of the motion as it is, the smallest α that keeps all limits of all joints is known at once:

    α = max( v_peak / v_max,  √(a_peak / a_max),  ∛(j_peak / j_max) )

The largest of the three is the binding limit. All others have room to spare.

**The figure.** A cubic spline at times that are too short (orange, dashed) and slowed (blue), with the limits
(black). Bottom right, the α that each limit asks for: the tallest bar is taken, and only that limit is touched in the
other panels.

**When to use it.** To repair a motion whose shape in time shall stay as it is, quickly and for any smooth path; to
learn which limit is worth raising.

**When not.** For speed: one tight spot slows the whole motion. `toppra` and `time_optimal_nlp` slow down only there.
Forces that gravity asks for do not scale with the clock.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, Sampling, plan, sample

LIMITS = {"velocity": 1.8, "acceleration": 6.0, "jerk": 30.0}  # rad/s, rad/s², rad/s³


def figure() -> Figure:
    """Draw a spline before and after scaling, and the factor that each limit asks for."""
    points, times = [0, 0.9, 0.7, 1.6], [0, 0.6, 1.3, 1.9]  # rad, s
    before = plan(PlanRequest.of(points, times=times), "cubic_spline")
    after = plan(PlanRequest.of(points, times=times, limits=LIMITS), "time_scaled")
    factor = after.trajectory.duration / before.trajectory.duration

    fig, axes = plt.subplots(2, 2)
    for answer, style, name in ((before, "C1--", "at the given times"), (after, "C0-", f"slowed by α = {factor:.3f}")):
        samples = sample(answer.trajectory, Sampling.of({"count": 1501}))
        for axis, quantity in zip(axes.flat, LIMITS, strict=False):
            axis.plot(samples.time, getattr(samples, quantity), style, label=name)
    for axis, (quantity, limit), unit in zip(axes.flat, LIMITS.items(), ("/s", "/s²", "/s³"), strict=False):
        for side in (-limit, limit):
            axis.axhline(side, color="k", linewidth=0.8)
        axis.set(xlabel="time (s)", ylabel=f"{quantity} (rad{unit})", ylim=(-2.2 * limit, 2.6 * limit))
    axes[0, 0].legend(loc="upper left", ncols=2)

    peaks = np.array([before.certificate.peaks[quantity][0] for quantity in LIMITS])
    asked = (peaks / list(LIMITS.values())) ** (1 / np.arange(1, 4))  # root of the derivative's order
    axes[1, 1].bar(list(LIMITS), asked, color="C2", label="asked for by this limit")
    axes[1, 1].axhline(factor, color="C0", label="taken")
    axes[1, 1].set(ylabel="factor α (-)", ylim=(0, 2), title=f"{list(LIMITS)[asked.argmax()]} binds")
    axes[1, 1].legend(loc="upper left", ncols=2)
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
