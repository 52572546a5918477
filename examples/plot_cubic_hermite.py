"""Cubic Hermite spline: who chooses the slopes decides about overshoot.

A cubic has four coefficients: enough for position and velocity at both ends of a piece. With u in [0, 1] and t = h v,
the velocities in units of the piece's duration h, it is c₀ + c₁ u + c₂ u² + c₃ u³ with

    c₀ = m₀,   c₁ = t₀,   c₂ = −3 m₀ − 2 t₀ + 3 m₁ − t₁,   c₃ = 2 m₀ + t₀ − 2 m₁ + t₁

Neighbours share velocities, so the curve is of class C¹; accelerations jump. Velocities that are not known come from
the slopes dᵢ of the segments by a rule:

- `catmull_rom`: from the waypoint before to the one after, (xᵢ₊₁ − xᵢ₋₁) / (tᵢ₊₁ − tᵢ₋₁);
- `finite_difference`: the mean (dᵢ₋₁ + dᵢ) / 2;
- `monotone`: the mean, but zero where the slopes change sign, and shortened until each piece only rises or only
  falls.

**The figure.** A plateau, a steep rise, a plateau, at uneven times. The first two rules leave the range of the data
(grey); the monotone rule stays inside, and pays with sharper corners in the velocity.

**When to use it.** Where velocities are known (a recorded motion), where a change shall stay local (a waypoint moves
only its neighbourhood), or where overshoot would hit something (`monotone`).

**When not.** Under a jerk limit, as accelerations jump, and where vibration matters.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, Sampling, plan, sample


def figure() -> Figure:
    """Draw position and velocity under the three rules for tangents."""
    request = PlanRequest.of([0, 0, 0.1, 0.9, 1, 1, 0.4], times=[0, 1, 1.5, 1.8, 3, 4, 5])  # rad, s
    fig, (above, below) = plt.subplots(2, 1, sharex=True)
    above.axhspan(0, 1, color="0.92", zorder=0)
    rules = {"catmull_rom": "--", "finite_difference": "-.", "monotone": "-"}
    for color, (rule, style) in zip(("C1", "C2", "C0"), rules.items(), strict=True):
        answer = plan(request, "cubic_hermite", {"tangents": rule})
        samples = sample(answer.trajectory, Sampling.of({"count": 1000}))
        found = answer.trajectory.extrema(1)  # exact, not sampled
        beyond = max(found.high[0].max() - 1, -found.low[0].min(), 0.0)
        above.plot(samples.time, samples.position, style, color=color, label=f"{rule}: {beyond:.3f} rad outside")
        below.plot(samples.time, samples.velocity, style, color=color, label=rule)
    above.plot(request.times, request.waypoints, "ko", label="waypoints")
    above.set(ylabel="position (rad)", title="a step between plateaus")
    below.set(xlabel="time (s)", ylabel="velocity (rad/s)", xticks=np.arange(6))
    above.legend(loc="center left")
    below.legend(loc="upper right")
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
