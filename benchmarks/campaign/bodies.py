"""Right requests, random from a seed: what the campaigns send, and what the fuzzer bends."""

import math
import random
from typing import Any

from planner import CASES, METHODS

#: Plans that a solver makes in some hundredths of a second.
SOLVED = ("ur5e_jerk", "ur5e_via_points", "gantry_in_its_frame", "ur5e_times_limits", "pen_path", "ur5e_acceleration")

#: A plan that the event loop makes itself.
QUICK: dict[str, Any] = {
    "waypoints": [[0.0, 0.1, 0.2], [1.0, -0.5, 0.3], [2.0, 0.7, 0.1], [2.5, 0.2, -0.4]],
    "times": [0.0, 1.0, 2.0, 3.0],
    "method": "cubic_spline",
    "sampling": {"count": 20},
}

#: A plan that a solver makes in some twenty milliseconds.
STEADY: dict[str, Any] = {
    "waypoints": [[0.0, 0.0], [1.0, 2.0], [2.0, 1.0], [3.0, 2.0]],
    "limits": {"velocity": 2.0, "acceleration": 5.0, "jerk": 40.0},
    "method": "time_optimal_waypoints",
    "sampling": {"count": 20},
}


def slow(timeout: float) -> dict[str, Any]:
    """Return a plan that takes a solver many seconds, with a time limit."""
    rng = random.Random(7)
    return {
        "waypoints": [[round(rng.uniform(-1, 1), 6) for _ in range(6)] for _ in range(20)],
        "limits": {"velocity": 1.0, "acceleration": 2.0, "jerk": 20.0},
        "method": "time_optimal_nlp",
        "timeout": timeout,
    }


def plan(rng: random.Random) -> dict[str, Any]:
    """Return a plan request that should be answered, with any method; small, so that it is answered soon."""
    if rng.random() < 0.1:
        return dict(CASES[rng.choice(SOLVED)].request)
    n, dims = rng.randint(2, 6), rng.randint(1, 4)
    scale = 10.0 ** rng.uniform(-2, 2)
    body: dict[str, Any] = {"waypoints": [[rng.uniform(-scale, scale) for _ in range(dims)] for _ in range(n)]}
    names = [name for name in METHODS if name != "time_optimal_nlp" or rng.random() < 0.02]
    method = rng.choice([*names, "auto"])
    timing = "given" if method == "auto" else METHODS[method].capabilities(METHODS[method].options()).timing
    honours = set("velocity acceleration jerk".split())
    if method != "auto":
        body["method"] = method
        honours &= METHODS[method].capabilities(METHODS[method].options()).honours
    if timing == "given" or (timing == "either" and rng.random() < 0.5):
        start = rng.uniform(-5, 5)
        body["times"] = [start + i + rng.uniform(0, 0.5) for i in range(n)]
        spread = 20.0
    else:
        spread = 1.0
    if timing != "given" or rng.random() < 0.3:
        body["limits"] = {
            name: scale * spread * factor * rng.uniform(0.5, 2)
            for name, factor in (("velocity", 1), ("acceleration", 5), ("jerk", 50))
            if name in honours
        }
    if rng.random() < 0.6:
        body["sampling"] = rng.choice([{"count": rng.randint(2, 30)}, {"dt": rng.uniform(0.01, 0.5)}])
    if rng.random() < 0.3:
        body["include"] = rng.sample(["samples", "polynomial", "bound"], rng.randint(0, 3))
    if rng.random() < 0.1:
        body["joint_names"] = [f"joint {i}" for i in range(dims)]
    return body


def ruckig(rng: random.Random) -> dict[str, Any]:
    """Return a plan request with the names of ruckig."""
    dims = rng.randint(1, 4)

    def vector(scale: float = 1.0) -> list[float]:
        return [rng.uniform(-scale, scale) for _ in range(dims)]

    body: dict[str, Any] = {
        "degrees_of_freedom": dims,
        "current_position": vector(),
        "target_position": vector(),
        "max_velocity": [rng.uniform(0.5, 2) for _ in range(dims)],
        "max_acceleration": [rng.uniform(1, 4) for _ in range(dims)],
        "max_jerk": [rng.uniform(5, 40) for _ in range(dims)],
    }
    if rng.random() < 0.3:
        body["intermediate_positions"] = [vector() for _ in range(rng.randint(1, 3))]
    return body


def samples(rng: random.Random) -> dict[str, Any]:
    """Return samples of a smooth motion."""
    dims, count = rng.randint(1, 3), rng.randint(4, 30)
    phases = [rng.uniform(0, 6) for _ in range(dims)]
    times = [0.1 * i for i in range(count)]
    return {"time": times, "position": [[math.sin(t + p) for p in phases] for t in times]}


def polynomial(rng: random.Random) -> dict[str, Any]:
    """Return a smooth step as a polynomial."""
    size = rng.uniform(0.1, 3)
    return {"breaks": [0, 1], "coefficients": [[[0]], [[0]], [[0]], [[10 * size]], [[-15 * size]], [[6 * size]]]}


def certify(rng: random.Random) -> dict[str, Any]:
    """Return a certificate request."""
    trajectory = {"samples": samples(rng)} if rng.random() < 0.5 else {"polynomial": polynomial(rng)}
    return {"trajectory": trajectory, "limits": {"velocity": rng.uniform(0.5, 5)}}


def retime(rng: random.Random) -> dict[str, Any]:
    """Return a retiming request."""
    kind = rng.randrange(3)
    if kind == 0:
        trajectory: dict[str, Any] = {"polynomial": polynomial(rng)}
    elif kind == 1:
        trajectory = {"samples": samples(rng)}
    else:
        found = samples(rng)
        stamps = [{"sec": int(t), "nanosec": round((t % 1) * 1e9) % 10**9} for t in found["time"]]
        points = zip(found["position"], stamps, strict=True)
        trajectory = {"points": [{"positions": p, "time_from_start": t} for p, t in points]}
        trajectory["joint_names"] = [f"j{i}" for i in range(len(found["position"][0]))]
    return {"trajectory": trajectory, "limits": {"velocity": 2.0, "acceleration": 5.0}, "sampling": {"count": 20}}


def compare(rng: random.Random) -> dict[str, Any]:
    """Return a comparison of a few quick methods."""
    body = plan(rng)
    body.pop("method", None)
    quick = ["linear", "cubic_spline", "minimum_jerk", "trapezoidal", "ruckig", "quintic_spline", "toppra"]
    return {**body, "methods": rng.sample(quick, rng.randint(1, 3))}


#: By path and query. Other routes that take a body are known from the service's own document, by their example.
MAKERS = {
    "/v1/trajectories": plan,
    "/v1/trajectories?shape=ruckig": ruckig,
    "/v1/certificates": certify,
    "/v1/comparisons": compare,
    "/v1/retimings": retime,
}


class Maker:
    """Makes right requests for every route that the service's document lists."""

    def __init__(self, document: dict[str, Any]) -> None:
        self.gets = [p for p, verbs in document["paths"].items() if "get" in verbs]
        posts = [p for p, verbs in document["paths"].items() if "post" in verbs]
        self._routes = [path for path in MAKERS if path.partition("?")[0] in posts]
        self._examples: dict[str, Any] = {}
        for path in posts:
            content = document["paths"][path]["post"].get("requestBody", {}).get("content", {})
            example = content.get("application/json", {}).get("example")
            if path not in MAKERS and isinstance(example, dict):
                self._examples[path] = example
        self._all = [*self._routes, *(["/v1/trajectories"] * 3), *self._examples]

    def make(self, rng: random.Random) -> tuple[str, dict[str, Any]]:
        """Return a path and a body."""
        path = rng.choice(self._all)
        body = MAKERS[path](rng) if path in MAKERS else dict(self._examples[path])
        return path, body
