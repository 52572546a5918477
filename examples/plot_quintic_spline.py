"""Quintic spline: continuous up to the fourth derivative.

Of all curves through the waypoints with given velocity and acceleration at both ends, one has the least

    ∫ ‖q'''(t)‖² dt

Where a waypoint does not hold it, such a curve has q⁽⁶⁾ = 0, so its pieces are quintics; at the inner waypoints all
derivatives up to the fourth are continuous. In numbers: 6 (N − 1) coefficients, less 2 (N − 1) positions and 4 (N −
2) conditions of continuity, leaves four: velocity and acceleration at each end. The system is solved piece by piece,
with velocity and acceleration at the waypoints as unknowns, in O(N).

**The figure.** The same waypoints by the cubic spline (orange) and the quintic one (blue), both from rest to rest.
Positions hardly differ. The cubic starts with a kick, has corners in its acceleration and steps in its jerk, and its
fourth derivative is nothing but spikes, not drawn; the quintic starts with zero acceleration and has a jerk without
steps.

**When to use it.** For smooth commands at given times without limits: feed-forward torques and flexible joints follow
the jerk and the snap, which are continuous here.

**When not.** For noisy or dense waypoints, between which it swings more than the cubic; under limits, where
`minimum_jerk` has the same objective and keeps them; with gaps of very different length.
"""

from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, Sampling, plan, sample


def figure() -> Figure:
    """Draw position, acceleration, jerk and snap of the cubic and the quintic spline."""
    request = PlanRequest.of([0, 1.2, 0.6, 1.8, 1.5], times=[0, 1, 2, 3, 4])  # rad, s
    fig, axes = plt.subplots(2, 2, sharex=True)
    (position, acceleration), (jerk, snap) = axes
    for method, style in (("cubic_spline", "C1--"), ("quintic_spline", "C0-")):
        answer = plan(request, method)
        samples = sample(answer.trajectory, Sampling.of({"count": 2001}))
        name = f"{method}: class C{answer.certificate.continuity}"
        position.plot(samples.time, samples.position, style, label=name)
        acceleration.plot(samples.time, samples.acceleration, style)
        jerk.plot(samples.time, samples.jerk, style)
    snap.plot(samples.time, answer.trajectory(samples.time, order=4), style)
    position.plot(request.times, request.waypoints, "ko", label="waypoints")
    position.set(ylabel="position (rad)", ylim=(-0.1, 2.9))
    position.legend(loc="upper left")
    acceleration.set(ylabel="acceleration (rad/s²)")
    jerk.set(ylabel="jerk (rad/s³)", xlabel="time (s)")
    snap.set(ylabel="snap (rad/s⁴)", xlabel="time (s)")
    fig.align_ylabels()
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
