"""Requests from the data, long ones, random ones; and the program behind a request."""

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from planner import PlanRequest, plan
from planner.waypoints.first_guess import spline_durations, spline_start
from planner.waypoints.transcription import transcribe
from problems.waypoint_timing import Spline, WaypointTiming

from ..cases import DATA
from ..figures import Array

METHOD = "time_optimal_waypoints"
#: What requests of the data have that is not asked of all.
EXTRAS = ("start", "end", "segment_durations")
#: Pieces a segment of the program behind the effort ``default``.
PIECES = 12


@cache
def cases() -> dict[str, Any]:
    """Return the data."""
    return {c["name"]: c for c in json.loads((DATA / "waypoints.json").read_text(encoding="utf-8"))["cases"]}


def request_of(name: str) -> PlanRequest:
    """Return the request of a case."""
    return _read({k: v for k, v in cases()[name]["request"].items() if k not in ("method", "options")})


def plain(name: str) -> PlanRequest:
    """Return the request from rest to rest, without limits of positions and durations, no waypoint twice in a row."""
    asked = _read({k: v for k, v in cases()[name]["request"].items() if k in ("waypoints", "limits")})
    moves = np.append(True, (np.diff(asked.waypoints, axis=0) != 0).any(axis=1))
    return replace(asked, waypoints=asked.waypoints[moves], limits=replace(asked.limits, position=None))


def stop_times(asked: PlanRequest) -> Array:
    """Return when the plan that stops at all waypoints passes them, (N,)."""
    times = plan(replace(asked, limits=replace(asked.limits, position=None)), "ruckig").waypoint_times
    assert times is not None
    return times


def program(asked: PlanRequest, pieces: int = PIECES) -> tuple[WaypointTiming, Spline]:
    """Return the program behind a request, and where to begin."""
    stops = np.diff(stop_times(asked))
    stops = np.maximum(stops, 1e-9 * stops.max())
    case = transcribe(asked, stops)
    durations = spline_durations(case.with_pieces(4, stops), stops)
    problem = case.with_pieces(pieces, durations)
    return problem, spline_start(problem, durations)


def long_request(count: int) -> PlanRequest:
    """Return six joints, limits like a UR's, and so many random waypoints: the first of always the same."""
    points = np.random.default_rng(6).uniform(-1.5, 1.5, (count, 6))
    limits = {"velocity": 3.14, "acceleration": [8.0, 8.0, 10.0, 10.0, 12.0, 12.0], "jerk": [80.0] * 3 + [100.0] * 3}
    return _read({"waypoints": points, "limits": {k: (np.ones(6) * v).tolist() for k, v in limits.items()}})


def random_request(seed: int, moving: bool) -> PlanRequest:
    """Return 1 to 7 joints of scales one and a half decades apart, 2 to 9 waypoints, 30 % with one-sided limits.

    Parameters
    ----------
    moving : bool
        Whether velocity and acceleration are asked at both ends: at random, as far as limits let them be.
    """
    random = np.random.default_rng(seed)
    dims, count = int(random.integers(1, 8)), int(random.integers(2, 10))
    scale = 10 ** random.uniform(-0.75, 0.75, dims)
    points = random.uniform(-1.0, 1.0, (count, dims)) * scale
    if random.random() < 0.15:
        points = np.cumsum(np.abs(points), axis=0)
    v = scale * 10 ** random.uniform(-0.3, 0.3, dims)
    a = v * 10 ** random.uniform(0.0, 0.8, dims)
    j = a * 10 ** random.uniform(0.2, 1.3, dims)
    low_v, low_a = -v, -a
    if random.random() < 0.3:
        low_v, low_a = -v * random.uniform(0.4, 1.0, dims), -a * random.uniform(0.4, 1.0, dims)
    limits = {"velocity": _sides(low_v, v), "acceleration": _sides(low_a, a), "jerk": j.tolist()}
    ends = {}
    for end in ("start", "end") if moving else ():
        velocity = random.uniform(0.8 * low_v, 0.8 * v)
        most = 0.95 * np.sqrt(2.0 * j * np.minimum(v - velocity, velocity - low_v))
        acceleration = np.clip(random.uniform(0.8 * low_a, 0.8 * a), -most, most)
        ends[end] = {"velocity": velocity.tolist(), "acceleration": acceleration.tolist()}
    return _read({"waypoints": points, "limits": limits, **ends})


def _sides(lower: Array, upper: Array) -> dict[str, list[float]]:
    return {"lower": lower.tolist(), "upper": upper.tolist()}


def _read(request: Mapping[str, Any]) -> PlanRequest:
    given = dict(request)
    return PlanRequest.of(given.pop("waypoints"), **given)
