"""Minimum jerk: a quadratic program, free and with limits.

The smoothest motion through waypoints at given times, as that of a human hand, has the least

    J = ∫ ‖q⁽ᵏ⁾(t)‖² dt   subject to   q(tᵢ) = qᵢ and the states at both ends,   k = 3

With k = 2 it is the acceleration that is least, with k = 4 the snap (option `order`). Without limits, q⁽²ᵏ⁾ = 0 between
the waypoints, and all derivatives up to the (2k − 2)-th are continuous: a cubic, quintic or septic spline. For one move
d from rest to rest in T with k = 3 it is q₀ + d (10u³ − 15u⁴ + 6u⁵), u = t / T, with J = 720 d² / T⁵, peak velocity
1.875 d / T and peak acceleration 5.77 d / T².

A polynomial of degree 2k − 1 is fixed by its derivatives 0 to k − 1 at both ends of a gap. Those that are not given are
the unknowns y; the curve is linear in them, and its cost is ½ yᵀHy + gᵀy + c, H banded. Limits are linear, too:

    lower ≤ q, q', q'', q''' ≤ upper   at all times

so the problem stays convex. Wherever an exact extremum of the curve breaks a limit, a row G y ≤ h is added there and
the program is solved again, until none does. The multipliers z ≥ 0 of the last program bound the cost of every curve of
this kind that keeps the limits:

    J ≥ c − ½ (g + Gᵀz)ᵀ H⁻¹ (g + Gᵀz) − hᵀz

The certificate has this bound, and how far J is from it. [minimum_jerk.md](minimum_jerk.md) says how it is solved and
proved, and what becomes of limits that cannot be kept.

**The figure.** There and back through three waypoints. Orange, dashed: without limits. Blue: with limits on position,
velocity and jerk (black lines). The limited motion touches its limits and crosses them nowhere, also not between
samples; where limits bind, the jerk may jump at waypoints. Green, dotted: the least snap within the same limits, with
a jerk that is continuous, and larger. The legend has each motion's integral of the squared jerk: limits, and
smoothness of a higher order, both cost some.

**When to use it.** As the default at given times: it passes the waypoints, moves smoothly, and keeps what you ask.

**When not.** Where the motion shall be as fast as can be: `ruckig`, `toppra`, `time_scaled`. With times too short for
the limits it says so, and what is needed.
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
MOTIONS = ((3, None, "C1--", "free"), (4, LIMITS, "C2:", "limited, least snap"), (3, LIMITS, "C0-", "limited"))


def figure() -> Figure:
    """Draw the free and the limited minimum-jerk motion and the limited one of least snap, with the limits."""
    fig, axes = plt.subplots(2, 2, sharex=True)
    quantities = dict(zip(("position", "velocity", "acceleration", "jerk"), axes.flat, strict=True))
    for k, limits, style, name in MOTIONS:
        request = PlanRequest.of([0, 1, 1.1, 0.2, 0], times=[0, 1, 2, 3, 4], limits=limits)  # rad, s
        answer = plan(request, "minimum_jerk", {"order": k})
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
    quantities["position"].set(ylim=(-0.3, 2.5))
    quantities["position"].plot(request.times, request.waypoints, "ko", label="waypoints")
    quantities["position"].legend(loc="upper right")
    for axis in axes[1]:
        axis.set(xlabel="time (s)")
    fig.align_ylabels()
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
