"""Certificate: what samples do not see.

A trajectory of piecewise polynomials takes its largest velocity at an end of a piece or where the acceleration is
zero,

    q̈(t) = 0,   on each piece a polynomial of low degree

whose roots can be computed. So "keeps its limits" is a statement about all times, not about the instants that someone
looked at. Waywright computes these extrema, of position, velocity, acceleration and jerk, for every piece and joint,
by code that knows neither the method nor the solver, and puts them into the certificate of every answer.

**The figure.** A spline with quick moves, sampled at 10 Hz, as loggers do: all samples (dots) lie within the velocity
limit. The curve between them does not. The certificate finds the peak, its time, joint and size, and says that the
limit does not hold. Below, the acceleration: its zeros are where the velocity has its extrema.

**When to use it.** `certify(trajectory, limits=...)` judges anyone's motion, by its pieces or by samples; from
samples it reports what every smooth curve through them must reach.

**When not.** It says nothing about what a controller makes of the motion, nor about collisions.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, certify, plan

LIMIT = 3.4  # rad/s


def figure() -> Figure:
    """Draw the velocity of a spline with samples and exact extrema, and its acceleration."""
    request = PlanRequest.of([0, 0.1, 0.5, 0.55, 0.2, 0.25], times=[0, 0.18, 0.3, 0.55, 0.67, 0.9])  # rad, s
    motion = plan(request, "cubic_spline").trajectory
    (velocity,) = [c for c in certify(motion, limits={"velocity": LIMIT}).checks if c.quantity == "velocity"]
    t, logged = np.linspace(0, motion.end, 901), np.arange(0, motion.end + 1e-9, 0.1)

    fig, (above, below) = plt.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    above.plot(t, motion(t, order=1), label="velocity")
    above.plot(logged, motion(logged, order=1), "o", color="C1", label="samples at 10 Hz")
    above.plot(velocity.time, velocity.value, "kx", markersize=10, markeredgewidth=2, label="the certificate's peak")
    verdict = "holds" if velocity.holds else f"broken by {100 * (velocity.ratio - 1):.0f} % at {velocity.time:.3f} s"
    for side in (-LIMIT, LIMIT):
        above.axhline(side, color="k", linewidth=0.8)
        above.axhspan(side, 1.6 * side, color="0.92", zorder=0)
    above.set(ylabel="velocity (rad/s)", title=f"limit {LIMIT:g} rad/s: {verdict}", ylim=(-1.5 * LIMIT, 1.5 * LIMIT))
    below.plot(t, motion(t, order=2), color="C2")
    below.axhline(0, color="k", linewidth=0.8)
    below.axvline(velocity.time, color="k", linestyle=":")
    below.set(xlabel="time (s)", ylabel="acceleration (rad/s²)")
    above.legend(loc="lower left", ncols=3)
    fig.align_ylabels()
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
