"""Corridors: near the waypoints, inside a tube, below a speed.

Few waypoints are meant to the last digit. A corridor says how far a motion may leave them, and `minimum_jerk` spends
that room on smoothness, at the same given times:

- `waypoint_tolerance` b: a box |q_d(tᵢ) − P_d| ≤ b_d around each interior waypoint P instead of the point;
- `tube` w: at all times between two waypoints P and P + Δ, q lies in a box ± w around some point of their segment;
- `velocity_norm` v: ‖q'‖ ≤ v, a speed along the path rather than a limit for each joint.

The tube asks that some s in [0, 1] has |q_d − P_d − s Δ_d| ≤ w_d for all joints at once. Each joint leaves an interval
of s, and intervals have a point in common if every two of them do (Helly's theorem). So s can be eliminated, exactly:

    min(0, Δ_d) − w_d ≤ q_d − P_d ≤ max(0, Δ_d) + w_d             for every joint
    |Δ_e (q_d − P_d) − Δ_d (q_e − P_e)| ≤ w_d |Δ_e| + w_e |Δ_d|   for every two

These are limits of linear combinations of the joints, kept at all times as those of single joints are. The speed limit
is a second-order cone, put at each place where the exact largest speed of a gap is beyond it.

**The figure.** A pen through six waypoints at the same times: exactly through them (orange, dashed), with boxes and
tube (grey; green, dotted), and with the speed limited as well (blue). Right, the speed with its limit, and the norm of
the jerk. The legend has J: some room around the waypoints lowers it, the limit of the speed raises it. One polynomial a
gap cannot keep that one here, so each gap has two: the answer's warning `sub_segments_used` says so.

**When to use it.** Taught waypoints, blends at corners, paths between obstacles with a known clearance, tools whose
speed is limited.

**When not.** A tube is a box around a line, in the joints' own coordinates: it is no collision check, and says nothing
of the tool's way in space where the joints are angles. Corridors need times: with `free_times` they are refused.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from scipy.spatial import ConvexHull

from planner import PlanRequest, plan

POINTS = np.array([[0, 0], [0.3, 0.4], [0.8, 0.4], [1.0, 0], [0.6, -0.3], [0, 0]])  # m
TIMES = [0, 0.8, 1.6, 2.3, 3.0, 4.0]  # s
ROOM = {"waypoint_tolerance": 0.05, "tube": 0.05}  # m
SPEED = {"velocity_norm": 0.85}  # m/s
MOTIONS = (
    ({}, "C1--", "exact"),
    (ROOM, "C2:", "tolerance and tube"),
    ({**ROOM, "limits": SPEED}, "C0-", "and a speed limit"),
)


def figure() -> Figure:
    """Draw three motions in the plane with the tube, and their speeds and jerks."""
    fig, axes = plt.subplot_mosaic([["path", "speed"], ["path", "jerk"]], width_ratios=(4, 3))
    t = np.linspace(0, TIMES[-1], 1501)
    box = ROOM["tube"] * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for ends in zip(POINTS[:-1], POINTS[1:], strict=True):
        corners = np.concatenate([point + box for point in ends])
        axes["path"].fill(*corners[ConvexHull(corners).vertices].T, color="0.88", zorder=0)
    axes["path"].plot(*POINTS.T, "ks", markersize=4, label="waypoints")
    for room, style, name in MOTIONS:
        answer = plan(PlanRequest.of(POINTS, times=TIMES, **room), "minimum_jerk")
        motion, cost = answer.trajectory, answer.certificate.cost["squared_jerk"]
        axes["path"].plot(*motion(t).T, style, label=f"{name}: J = {cost:.0f} m²/s⁵")
        axes["speed"].plot(t, np.linalg.norm(motion(t, order=1), axis=1), style)
        axes["jerk"].plot(t, np.linalg.norm(motion(t, order=3), axis=1), style)
    axes["speed"].axhline(SPEED["velocity_norm"], color="k", linewidth=0.8)
    axes["path"].set(xlabel="x (m)", ylabel="y (m)", aspect="equal", ylim=(-0.45, 0.9))
    axes["path"].legend(loc="upper center")
    axes["speed"].set(ylabel="speed (m/s)", ylim=(0, None))
    axes["jerk"].set(xlabel="time (s)", ylabel="norm of the jerk (m/s³)", ylim=(0, None))
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
