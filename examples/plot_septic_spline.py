"""Septic spline: a start without jerk, and what it costs.

The same idea as the quintic spline, one order up: of all curves through the waypoints with given velocity,
acceleration and jerk at both ends, the one with the least

    ∫ ‖q''''(t)‖² dt

Its pieces are of degree 7, its derivatives continuous up to the sixth, and 8 (N − 1) − 2 (N − 1) − 6 (N − 2) = 6
values are left for the ends: three at each.

**The figure.** Three splines from rest to rest through the same waypoints. The acceleration of the cubic starts with
a step, the jerk of the quintic does, the septic's (blue) starts at zero: nothing is felt at the start. That has its
price: the motion starts later, so the rest of it must be faster; bottom right, the largest values over those of the
cubic.

**When to use it.** Where jerk must be continuous from standstill on: cranes, liquids, optics, flexible arms with
feed-forward up to the jerk's rate.

**When not.** By default. Each order more makes the peaks of velocity and acceleration higher, the swing between
uneven waypoints larger and the numbers worse conditioned.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, Sampling, plan, sample


def figure() -> Figure:
    """Draw acceleration, jerk and snap of three splines, and their peaks over the cubic's."""
    request = PlanRequest.of([0, 0.5, 1.4, 1.8], times=[0, 1, 2, 3])  # rad, s
    fig, ((acceleration, jerk), (snap, peaks)) = plt.subplots(2, 2)
    styles = {"cubic_spline": "C1:", "quintic_spline": "C2--", "septic_spline": "C0-"}
    quantities = ["velocity", "acceleration", "jerk"]
    answers = {method: plan(request, method) for method in styles}
    largest = {m: np.array([a.certificate.peaks[q][0] for q in quantities]) for m, a in answers.items()}
    for number, (method, style) in enumerate(styles.items()):
        samples = sample(answers[method].trajectory, Sampling.of({"count": 1001}))
        acceleration.plot(samples.time, samples.acceleration, style, label=method)
        jerk.plot(samples.time, samples.jerk, style)
        if method != "cubic_spline":  # whose jerk is a staircase
            snap.plot(samples.time, answers[method].trajectory(samples.time, order=4), style)
        heights = largest[method] / largest["cubic_spline"]
        peaks.bar(np.arange(3) + 0.27 * (number - 1), heights, 0.25, color=style[:2], label=method)
    acceleration.set(xlabel="time (s)", ylabel="acceleration (rad/s²)")
    jerk.set(xlabel="time (s)", ylabel="jerk (rad/s³)")
    snap.set(xlabel="time (s)", ylabel="snap (rad/s⁴)")
    peaks.set(ylabel="peak / the cubic's (-)", xticks=range(3), xticklabels=quantities)
    acceleration.legend(loc="lower left")
    peaks.legend(loc="upper left")
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
