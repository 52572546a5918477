"""Free times: when to be where, left to the optimiser.

Waypoints say where, and often nobody knows when. With `free_times` the durations hᵢ of the gaps are found along with
the curve:

    min over h, q:   ∫ ‖q⁽ᵏ⁾‖² dt + ρ Σ hᵢ      within the limits, through the waypoints

ρ, the option `time_weight`, is what a second costs. For given h the best curve is a spline, found in O(N). Its energy E
depends on h, and by the envelope theorem its slope is that of the energy at fixed states x of the waypoints, however
these move with h: dE/dhᵢ = ∂E(h, x)/∂hᵢ. So a search over h alone has exact slopes. Between ends at rest, stretching
all times by s changes E by the factor s¹⁻²ᵏ; at the optimum this leaves

    ρ T = (2k − 1) E,    T proportional to ρ^(−1/(2k))

With limits and no weight, the duration alone is least: a barrier method over durations and states, with the limits at
the exact extrema. Of all curves at the times found, the smoothest is taken.

**The figure.** The same waypoints, three times in the same 4 s, which `duration` fixes. Orange, dashed: even times.
Green, dotted: times by the square root of the distance, the usual rule. Blue: free times, with less J than either. Top
right, the law of the weights: the duration by `time_weight`, with the slope −1/6 (black). Bottom right, the least
duration with a velocity and an acceleration limit: the velocity reaches its bound (black) where it can.

**When to use it.** Where the durations are yours to choose: less jerk in the same time, or less time in the same
limits, than by a rule of thumb.

**When not.** At given times, naturally; for corridors, which need them. The problem is not convex: what is found is a
local optimum, without a bound of how far from the best it is. Along a fixed path `toppra` finds the fastest timing.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, plan

POINTS = [0, 0.2, 1.2, 1.0, 1.1, -0.3, 0]  # rad
FREE = {"free_times": True}
SPEED = {"velocity": 2.0, "acceleration": 12.0}  # rad/s, rad/s²
RULES = (({"spacing": "uniform"}, "C1--", "even"), ({}, "C2:", "by distance"), (FREE, "C0-", "free"))


def figure() -> Figure:
    """Draw one motion by three timings, durations by weight, and the fastest motion within limits."""
    fig, axes = plt.subplot_mosaic([["position", "weight"], ["velocity", "limits"]])
    for options, style, name in RULES:
        request = PlanRequest.of(POINTS, duration={"min": 4, "max": 4})
        answer = plan(request, "minimum_jerk", options)
        motion, cost = answer.trajectory, answer.certificate.cost["squared_jerk"]
        t = np.linspace(0, motion.end, 801)
        axes["position"].plot(t, motion(t), style, label=f"{name}: J = {cost:.0f} rad²/s⁵")
        axes["position"].plot(answer.waypoint_times, POINTS, style[:2] + "o", markersize=4)
        axes["velocity"].plot(t, motion(t, order=1), style)
    weights = 10.0 ** np.arange(-2, 7)
    best = [plan(PlanRequest.of(POINTS), "minimum_jerk", {**FREE, "time_weight": w}).trajectory.end for w in weights]
    axes["weight"].loglog(weights, best, "o", label="free times")
    axes["weight"].loglog(weights, best[0] * (weights / weights[0]) ** (-1 / 6), "k", linewidth=0.8, label="slope −1/6")
    fastest = plan(PlanRequest.of(POINTS, limits=SPEED), "minimum_jerk", FREE).trajectory
    t = np.linspace(0, fastest.end, 801)
    axes["limits"].plot(t, fastest(t, order=1), label=f"least duration: {fastest.end:.3f} s")
    for bound in (-SPEED["velocity"], SPEED["velocity"]):
        axes["limits"].axhline(bound, color="k", linewidth=0.8)
    axes["position"].set(ylabel="position (rad)", ylim=(-0.8, 2.4))
    axes["velocity"].set(xlabel="time (s)", ylabel="velocity (rad/s)")
    axes["weight"].set(xlabel="time_weight (rad²/s⁶)", ylabel="duration (s)")
    axes["limits"].set(xlabel="time (s)", ylabel="velocity (rad/s)", ylim=(-2.8, 3.2))
    for name in ("position", "weight", "limits"):
        axes[name].legend(loc="upper right")
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
