"""Minimum jerk: a quadratic program, free and with limits.

The smoothest motion through waypoints at given times, as that of a human hand, has the least

    J = ∫ ‖q'''(t)‖² dt   subject to   q(tᵢ) = qᵢ and the states at both ends

Without limits, q⁽⁶⁾ = 0 between the waypoints and all derivatives up to the fourth are continuous: a quintic spline.
For one move d from rest to rest in T it is q₀ + d (10u³ − 15u⁴ + 6u⁵), u = t / T, with J = 720 d² / T⁵, peak velocity
1.875 d / T and peak acceleration 5.77 d / T². Limits are linear in q,

    lower ≤ q, q', q'', q''' ≤ upper   at all times

so the problem stays convex. Waywright keeps one quintic between neighbours, with velocities and accelerations at the
waypoints as unknowns: wherever an extremum of the curve breaks a limit, a row is added there and the quadratic
program is solved again, until none does. The multipliers tell how far from the optimum of this kind the answer can
be.

**The figure.** There and back through three waypoints. Dashed: without limits. Solid: with limits on position,
velocity and jerk (black lines). The limited motion touches its limits and crosses them nowhere, also not between
samples. Its J, in the legend, is larger: limits cost smoothness. Where limits bind, the jerk may jump at waypoints.

**When to use it.** As the default at given times: it passes the waypoints, moves smoothly, and keeps what you ask.

**When not.** Where the times are free and the motion shall be fast: `ruckig`, `toppra`, `time_scaled`. With times too
short for the limits it says so, and what is needed.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, Sampling, plan, sample

LIMITS = {
    "position": {"lower": [-0.2], "upper": [1.2]},  # rad
    "velocity": 1.6,  # rad/s
    "jerk": 25.0,  # rad/s³
}


def figure() -> Figure:
    """Draw the free and the limited minimum-jerk motion, with the limits."""
    fig, axes = plt.subplots(2, 2, sharex=True)
    quantities = dict(zip(("position", "velocity", "acceleration", "jerk"), axes.flat, strict=True))
    for limits, style, name in ((None, "C1--", "free"), (LIMITS, "C0-", "limited")):
        request = PlanRequest.of([0, 1, 1.1, 0.2, 0], times=[0, 1, 2, 3, 4], limits=limits)  # rad, s
        answer = plan(request, "minimum_jerk")
        samples = sample(answer.trajectory, Sampling.of({"count": 1501}))
        label = f"{name}: J = {answer.certificate.cost['squared_jerk']:.1f} rad²/s⁵"
        for quantity, axis in quantities.items():
            axis.plot(samples.time, getattr(samples, quantity), style, label=label)
    units = ("rad", "rad/s", "rad/s²", "rad/s³")
    for order, (unit, (quantity, axis)) in enumerate(zip(units, quantities.items(), strict=True)):
        axis.set(ylabel=f"{quantity} ({unit})")
        axis.margins(y=0.12)
        bounds = request.limits.bounds(order, dims=1)  # infinite where there is none
        for bound in [b for side in (bounds.lower, bounds.upper) for b in side if np.isfinite(b)]:
            axis.axhline(bound, color="k", linewidth=0.8)
    quantities["position"].set(ylim=(-0.3, 2.2))
    quantities["position"].plot(request.times, request.waypoints, "ko", label="waypoints")
    quantities["position"].legend(loc="upper right")
    for axis in axes[1]:
        axis.set(xlabel="time (s)")
    fig.align_ylabels()
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
