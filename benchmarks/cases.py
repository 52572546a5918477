"""The problems: requests in the HTTP contract's shape, from the data that the tests use too."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from planner import CASES, PlanRequest
from planner.limits import Boundary
from planner.types import Demands

DATA = Path(__file__).parent.parent / "tests" / "data"

#: What a group asks, and by what its answers are compared: the sentences are printed above its tables.
GROUPS = {
    "times": "Through waypoints at given times. The smaller the squared jerk, the better; limits, where there are any, "
    "must be kept. `minimum_jerk` and the quintic spline begin and end without acceleration, the septic one without "
    "jerk either, which the cubic ones do not: that costs jerk. The B-spline and the polynomials do not even begin and "
    "end at rest, as the best known does. One polynomial through many waypoints is refused, and then left out.",
    "path": "Along a given path (a cubic spline), at rest at both ends, under velocity and acceleration limits, in one "
    "case also under jerk limits. The shorter, the better.",
    "waypoints": "Through waypoints in this order, at rest at both ends, under velocity, acceleration and jerk limits, "
    "at times and on a way of the method's own choice. The shorter, the better.",
}


@dataclass(frozen=True)
class Problem:
    """A request, the path its answers must follow (if any) and the best value known.

    ``baseline`` is the entry whose time the others' times are divided by; ``reference`` is a duration in s, for given
    times a squared jerk.
    """

    name: str
    group: str
    request: Mapping[str, Any]
    baseline: str
    path: Mapping[str, Any] | None = None
    reference: float | None = None
    quick: bool = False

    @property
    def asked(self) -> PlanRequest:
        """The request as the library reads it."""
        return PlanRequest.of(**self.request)

    @property
    def demands(self) -> Demands:
        """What every answer is held to, whoever made it."""
        asked = self.asked
        rest = Boundary(velocity=0.0 * asked.waypoints[0]) if asked.times is None else Boundary()
        return Demands(
            dims=asked.dims,
            limits=asked.limits,
            waypoints=asked.waypoints,
            times=asked.times,
            start=rest,
            end=rest,
        )


@cache
def _data(file: str) -> dict[str, Any]:
    cases = json.loads((DATA / f"{file}.json").read_text(encoding="utf-8"))["cases"]
    return {c["name"]: c for c in cases}


def _request(case: Mapping[str, Any], *fields: str) -> dict[str, Any]:
    return {k: case["request"][k] for k in ("waypoints", *fields) if k in case["request"]}


def _times(name: str, quick: bool = False) -> Problem:
    case = _data("minimum-jerk")[name]
    request = _request(case, "times", "limits")
    return Problem(name, "times", request, "scipy CubicSpline", reference=case["reference"]["cost"], quick=quick)


def _path(name: str, jerk: bool = False, quick: bool = False) -> Problem:
    case = _data("paths")[name]
    request = _request(case)
    request["limits"] = {k: v for k, v in case["request"]["limits"].items() if jerk or k != "jerk"}
    best = case["reference"]["with_jerk" if jerk else "velocity_acceleration"]["duration_strict"]
    title = f"{name}, with jerk" if jerk else name
    return Problem(title, "path", request, "toppra quick start", case["request"]["options"]["path"], best, quick=quick)


def _waypoints(name: str, quick: bool = False) -> Problem:
    case = _data("waypoints")[name]
    best = case["reference"]["best_known"]
    return Problem(name, "waypoints", _request(case, "limits"), "ruckig by segments", reference=best, quick=quick)


def problems(quick: bool = False) -> list[Problem]:
    """Return the problems, or only those of a smoke run."""
    chosen = [
        Problem("ur5e_times", "times", CASES["ur5e_times"].request, "scipy CubicSpline"),
        _times("U3 100 wp 7d", quick=True),
        _times("C1 10 wp 2d tight"),
        _times("C3 30 wp 3d medium"),
        _path("toppra_straight_line", quick=True),
        _path("rand7_w5_s0"),
        _path("rand7_w10_s1"),
        _path("toppra_plot_kinematics_seed9"),
        _path("rand7_w5_s1", jerk=True),
        Problem("ur5e_jerk", "waypoints", CASES["ur5e_jerk"].request, "ruckig by segments"),
        _waypoints("ruckig_ex08_free"),
        _waypoints("ur6_pick_place"),
        _waypoints("d3_rand_1wp", quick=True),
        _waypoints("d3_rand_5wp"),
    ]
    return [p for p in chosen if p.quick or not quick]
