"""Time-optimal NLP: the same path with a jerk limit.

As for `toppra` the path q(s) is fixed and the law s(t) is sought. The jerk brings in a third derivative,

    q⃛ = q' s⃛ + 3 q'' ṡ s̈ + q''' ṡ³

and with it the problem is no longer convex: no walk from station to station finds the best law. Instead all stations
are put into one nonlinear program, with speed, acceleration and jerk of the law as unknowns,

    min Σ Δtₖ   subject to   |q̇| ≤ v,  |q̈| ≤ a,  |q⃛| ≤ j at the stations

CasADi gives exact derivatives and IPOPT solves it. Then the grid is refined where limits are broken between stations,
and the last per mille is slowed away, so that the certificate holds at all times.

**The figure.** Left, `toppra` under velocity and acceleration limits: accelerations jump from limit to limit, so the
jerk is unbounded (drawn is what lies between the jumps). Right, the same path with a jerk limit too: ramps instead of
jumps, and a little more time. Where a velocity limit holds the speed, the jerk chatters within its limit: nothing in
the objective is against it. Solid and dashed are the two joints, black lines the limits.

**When to use it.** Where the path must stay, jerk is limited, and some tenths of a second to compute are no matter;
as the reference that faster methods are measured by.

**When not.** In a loop. Without a jerk limit `toppra` is as good and far faster. The optimum found is a local one.
"""

from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, Sampling, plan, sample

LIMITS = {"velocity": 1.6, "acceleration": 5.0, "jerk": 60.0}  # rad/s, rad/s², rad/s³, both joints


def figure() -> Figure:
    """Draw velocity, acceleration and jerk without and with a jerk limit."""
    points = [[0, 0], [0.5, 0.6], [1.2, 0.4], [1.6, 1.2], [2.4, 1.0]]  # rad
    fig, axes = plt.subplots(3, 2, sharex=True, sharey="row")
    for column, (method, kept) in enumerate(
        (("toppra", ["velocity", "acceleration"]), ("time_optimal_nlp", ["velocity", "acceleration", "jerk"]))
    ):
        request = PlanRequest.of(points, limits={k: LIMITS[k] for k in kept})
        answer = plan(request, method)
        samples = sample(answer.trajectory, Sampling.of({"count": 2001}))
        axes[0, column].set_title(f"{method}: {answer.trajectory.duration:.3f} s")
        axes[2, column].set_xlabel("time (s)")
        for axis, (quantity, limit) in zip(axes[:, column], LIMITS.items(), strict=True):
            for joint, style in enumerate(("C0-", "C1--")):
                axis.plot(
                    samples.time, getattr(samples, quantity)[:, joint], style, linewidth=1, label=f"joint {joint}"
                )
            for side in (-limit, limit) if quantity in kept else ():
                axis.axhline(side, color="k", linewidth=0.8)
            axis.set_ylim(-1.4 * limit, 1.4 * limit)
    for axis, quantity, unit in zip(axes[:, 0], LIMITS, ("rad/s", "rad/s²", "rad/s³"), strict=True):
        axis.set_ylabel(f"{quantity} ({unit})")
    axes[0, 1].legend(loc="lower right", ncols=2)
    fig.align_ylabels()
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
