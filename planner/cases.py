"""Named requests, shared by tests, benchmarks, the service's presets and the docs."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

#: Public joint limits of a UR5e: velocity in rad/s, acceleration in rad/s², jerk in rad/s³, the same for all joints.
UR5E = {"velocity": 3.14, "acceleration": 10.0, "jerk": 100.0}

PICK_AND_PLACE = [
    [0.0, -1.57, 1.57, -1.57, -1.57, 0.0],
    [0.55, -1.25, 1.72, -2.04, -1.57, 0.55],
    [0.72, -1.02, 1.85, -2.40, -1.57, 0.72],
    [0.72, -1.22, 1.60, -1.95, -1.57, 0.72],
    [-0.10, -1.45, 1.30, -1.42, -1.57, 0.20],
    [-0.95, -1.22, 1.60, -1.95, -1.57, -0.40],
    [-0.95, -0.98, 1.88, -2.47, -1.57, -0.95],
    [0.0, -1.57, 1.57, -1.57, -1.57, 0.0],
]


@dataclass(frozen=True)
class Case:
    """A request in the HTTP contract's shape, under a name."""

    name: str
    title: str
    request: Mapping[str, Any]


CASES: dict[str, Case] = {
    c.name: c
    for c in (
        Case(
            "contract_example",
            "Two joints, three waypoints at given times, limits that do not bind",
            {
                "waypoints": [[0, 0], [1, 2], [2, 3]],
                "times": [0, 1, 2],
                "limits": {"velocity": 3.5, "acceleration": [8, None], "jerk": 60},
                "sampling": {"dt": 0.01},
                "include": ["samples", "polynomial"],
            },
        ),
        Case(
            "two_joint_times",
            "Two joints, three waypoints at given times, no limits",
            {"waypoints": [[0, 0], [1, 2], [2, 3]], "times": [0, 1, 2]},
        ),
        Case(
            "ur5e_times",
            "UR5e pick and place at given times, no limits",
            {"waypoints": PICK_AND_PLACE, "times": [0.0, 0.6, 1.1, 1.5, 2.3, 3.1, 3.6, 4.6]},
        ),
        Case(
            "ur5e_quintic",
            "UR5e pick and place at given times by the quintic spline, continuous to the fourth derivative",
            {
                "waypoints": PICK_AND_PLACE,
                "times": [0.0, 0.6, 1.1, 1.5, 2.3, 3.1, 3.6, 4.6],
                "method": "quintic_spline",
            },
        ),
        Case(
            "circle",
            "A circle as a rational curve by its control points, exactly, under velocity and acceleration limits",
            {
                "waypoints": [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]],
                "method": "toppra",
                "options": {
                    "path": {
                        "kind": "nurbs",
                        "degree": 2,
                        "knots": [0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1],
                        "weights": [1, 0.5**0.5, 1, 0.5**0.5, 1, 0.5**0.5, 1, 0.5**0.5, 1],
                    }
                },
                "limits": {"velocity": 1.0, "acceleration": 4.0},
            },
        ),
        Case(
            "ur5e_acceleration",
            "UR5e pick and place under velocity and acceleration limits",
            {
                "waypoints": PICK_AND_PLACE,
                "limits": {"velocity": UR5E["velocity"], "acceleration": UR5E["acceleration"]},
            },
        ),
        Case(
            "pen_path",
            "A pen along a fixed curve in the plane, as fast as its acceleration and its speed along the curve may be",
            {
                "waypoints": [[0, 0], [0.3, 0.4], [0.8, 0.4], [1.0, 0], [0.6, -0.3], [0, 0]],
                "limits": {"velocity_norm": 1.0, "acceleration": 4.0},
                "segment_limits": [None, {"velocity_norm": 0.5}, None, None, None],
                "method": "time_optimal_path",
            },
        ),
        Case(
            "ur5e_path_jerk",
            "UR5e pick and place along the cubic spline, as fast as velocity, acceleration and jerk limits allow",
            {"waypoints": PICK_AND_PLACE, "limits": UR5E, "method": "time_optimal_path"},
        ),
        Case(
            "ur5e_jerk",
            "UR5e pick and place under velocity, acceleration and jerk limits",
            {"waypoints": PICK_AND_PLACE, "limits": UR5E},
        ),
        Case(
            "ur5e_via_points",
            "UR5e pick and place through its waypoints without a stop but at the two parts, as fast as limits allow",
            {
                "waypoints": PICK_AND_PLACE,
                "limits": UR5E,
                "waypoint_states": [
                    None,
                    None,
                    {"velocity": [0.0] * 6},
                    None,
                    None,
                    None,
                    {"velocity": [0.0] * 6},
                    None,
                ],
                "method": "time_optimal_waypoints",
            },
        ),
        Case(
            "gantry_in_its_frame",
            "A gantry through waypoints within the range of its axes, with more time for one of the ways",
            {
                "waypoints": [[0.02, 0.02], [0.5, 0.38], [0.98, 0.2], [0.6, 0.02], [0.1, 0.3], [0.02, 0.02]],
                "limits": {
                    "position": {"lower": -0.2, "upper": [1.2, 0.6]},
                    "velocity": 1.0,
                    "acceleration": 4.0,
                    "jerk": 40.0,
                },
                "segment_durations": [None, None, {"min": 1.2}, None, None],
                "method": "time_optimal_waypoints",
            },
        ),
        Case(
            "ur5e_times_limits",
            "UR5e pick and place at given times that are short for its limits: acceleration and jerk reach them",
            {
                "waypoints": PICK_AND_PLACE,
                "times": [0.0, 0.45, 0.825, 1.125, 1.725, 2.325, 2.7, 3.45],
                "limits": UR5E,
            },
        ),
        Case(
            "ur5e_corridor",
            "UR5e pick and place at given times, near the waypoints and inside a tube between them",
            {
                "waypoints": PICK_AND_PLACE,
                "times": [0.0, 0.6, 1.1, 1.5, 2.3, 3.1, 3.6, 4.6],
                "limits": {"velocity": UR5E["velocity"], "acceleration": UR5E["acceleration"]},
                "waypoint_tolerance": 0.02,
                "tube": 0.05,
            },
        ),
        Case(
            "pen_speed",
            "A pen in the plane at given times, its speed along the path limited",
            {
                "waypoints": [[0, 0], [0.3, 0.4], [0.8, 0.4], [1.0, 0], [0.6, -0.3], [0, 0]],
                "times": [0, 0.8, 1.6, 2.3, 3.0, 4.0],
                "limits": {"velocity_norm": 1.0},
            },
        ),
        Case(
            "ur5e_free_times",
            "UR5e pick and place in the least time, the times at the waypoints free, slow near the two parts",
            {
                "waypoints": PICK_AND_PLACE,
                "limits": UR5E,
                "segment_limits": [
                    None,
                    {"velocity": 0.5},
                    {"velocity": 0.5},
                    None,
                    None,
                    {"velocity": 0.5},
                    {"velocity": 1.5},
                ],
                "method": "minimum_jerk",
                "options": {"free_times": True},
            },
        ),
    )
}
