"""Paths and limits of the data, and stations on them."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from planner import PlanRequest
from planner.paths import Path, PathOptions, build_path
from planner.timing.course import Course
from planner.timing.following import cut_at_corners

from ..cases import DATA
from ..figures import Array


@dataclass(frozen=True)
class Posed:
    """A path of the data with its limits: as a request with its options, and as the courses of its path."""

    name: str
    asked: PlanRequest
    options: Mapping[str, Any]
    path: Path
    courses: list[Course]
    best: Mapping[str, float]

    @classmethod
    def of(cls, name: str, jerk: bool) -> "Posed":
        """Return a case, with or without its jerk limits."""
        case = cases()[name]
        request, options = case["request"], {"path": case["request"]["options"]["path"]}
        limits = {k: v for k, v in request["limits"].items() if jerk or k != "jerk"}
        asked = PlanRequest.of(request["waypoints"], limits=limits)
        path = build_path(PathOptions.model_validate(options).path, asked.waypoints)
        best = case["reference"].get("with_jerk" if jerk else "velocity_acceleration", {})
        return cls(name, asked, options, path, cut_at_corners(path, asked), best)

    @property
    def course(self) -> Course:
        """The only course."""
        (course,) = self.courses
        return course

    @property
    def sides(self) -> list[Array]:
        """Lower and upper limits, (D, 2), of velocity and acceleration."""
        limits = [self.asked.limits.bounds(m, self.asked.dims) for m in (1, 2)]
        return [np.column_stack([x.lower, x.upper]) for x in limits]


@cache
def cases() -> dict[str, Any]:
    """Return the data."""
    return {c["name"]: c for c in json.loads((DATA / "paths.json").read_text(encoding="utf-8"))["cases"]}


def uniform(course: Course, count: int) -> Array:
    """Return about so many stations, evenly spaced between the path's breaks, which are among them."""
    breaks = course.curve.breaks
    width = np.diff(breaks)
    each = np.maximum(np.round((count - 1) * width / width.sum()), 1).astype(int)
    parts = [np.linspace(a, b, m + 1)[1:] for a, b, m in zip(breaks[:-1], breaks[1:], each, strict=True)]
    return np.concatenate([breaks[:1], *parts])
