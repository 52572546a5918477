"""Cubic spline: the same waypoints, four ways to close the system.

N − 1 cubics have 4 (N − 1) coefficients. Passing the waypoints takes 2 (N − 1) conditions, continuous velocity and
acceleration at the inner waypoints 2 (N − 2): two are left. With hₖ = tₖ₊₁ − tₖ, the slopes dₖ = (xₖ₊₁ − xₖ) / hₖ and
the unknown velocities sₖ, continuity of the acceleration says

    hₖ sₖ₋₁ + 2 (hₖ₋₁ + hₖ) sₖ + hₖ₋₁ sₖ₊₁ = 3 (hₖ dₖ₋₁ + hₖ₋₁ dₖ)

a tridiagonal system, solved in O(N). The boundary fills its first and last row:

- `clamped`: the end velocities are given, zero for a motion from rest to rest;
- `natural`: the end accelerations are zero, which gives the least ∫ q''² dt of all curves through the waypoints;
- `not_a_knot`: the outer two pieces are one cubic, best for data of unknown ends;
- `periodic`: the end meets the start in position, velocity and acceleration.

**The figure.** Positions differ little, and only near the ends; accelerations, polygons with corners at the
waypoints, tell the variants apart. The integrals in the legend are least for natural, as they must be; a start from
rest (clamped) has to be paid.

**When to use it.** The usual choice for waypoints with times: C², cheap, with little swinging.

**When not.** Where jerk matters (it is a staircase; `quintic_spline`, `minimum_jerk`), where a moved waypoint must
not change the whole curve (`cubic_hermite`), or where limits must hold (`minimum_jerk`, `time_scaled`).
"""

from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, Sampling, plan, sample


def figure() -> Figure:
    """Draw position and acceleration of the cubic spline under four boundary variants."""
    request = PlanRequest.of([0, 1.6, 0.4, 0.8, 0], times=[0, 1, 2, 3, 4])  # rad, s
    fig, (above, below) = plt.subplots(2, 1, sharex=True)
    variants = {"clamped": "-", "natural": "--", "not_a_knot": "-.", "periodic": ":"}
    for boundary, style in variants.items():
        answer = plan(request, "cubic_spline", {"boundary": boundary})
        samples = sample(answer.trajectory, Sampling.of({"count": 401}))
        energy = answer.trajectory.squared_integral(2)
        above.plot(samples.time, samples.position, style, label=boundary)
        below.plot(samples.time, samples.acceleration, style, label=f"{boundary}: ∫ a² dt = {energy:.1f} rad²/s³")
    above.plot(request.times, request.waypoints, "ko", label="waypoints")
    below.plot(request.times, [0] * 5, "k|", markersize=9)
    above.set(ylabel="position (rad)", title="one set of waypoints, four boundary variants")
    below.set(xlabel="time (s)", ylabel="acceleration (rad/s²)", ylim=(-13, 20))
    above.legend(loc="upper right")
    below.legend(loc="upper center", ncols=2)
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
