"""``?shape=ruckig``: a body with the names of ruckig's InputParameter, read as a plan request.

What cannot be honoured is refused by name; errors point to the caller's own field names.
"""

import re
from typing import Annotated, Any, Literal

from pydantic import Field

from planner import FieldError, InvalidRequest

from .reading import parse
from .schemas import Body, Gaps, Included, Matrix, PlanBody, SamplingBody, Seconds, Vector

GapRows = Annotated[list[Gaps], Field(fail_fast=True)]


class RuckigBody(Body):
    """The names of ruckig's InputParameter; null or absent stands for ruckig's default."""

    degrees_of_freedom: Annotated[int, Field(strict=True, ge=1)] | None = Field(None, description="Number of joints")
    current_position: Vector = Field(description="D positions at the start")
    current_velocity: Vector | None = Field(None, description="D velocities at the start, unit/s")
    current_acceleration: Vector | None = Field(None, description="D accelerations at the start, unit/s²")
    target_position: Vector = Field(description="D positions at the end")
    target_velocity: Vector | None = Field(None, description="D velocities at the end, unit/s")
    target_acceleration: Vector | None = Field(None, description="D accelerations at the end, unit/s²")
    intermediate_positions: Matrix | None = Field(None, description="Positions to pass between start and end")
    max_velocity: Gaps | None = Field(None, description="D velocity limits, unit/s; null: unlimited")
    max_acceleration: Gaps | None = Field(None, description="D acceleration limits, unit/s²; null: unlimited")
    max_jerk: Gaps | None = Field(None, description="D jerk limits, unit/s³; null: unlimited")
    min_velocity: Gaps | None = Field(None, description="D lower velocity limits, < 0; default -max_velocity")
    min_acceleration: Gaps | None = Field(None, description="D lower limits, < 0; default -max_acceleration")
    max_position: Gaps | None = Field(None, description="D upper position limits")
    min_position: Gaps | None = Field(None, description="D lower position limits")
    per_section_max_velocity: GapRows | None = Field(None, description="Velocity limits of each section")
    per_section_max_acceleration: GapRows | None = Field(None, description="Acceleration limits of each section")
    per_section_max_jerk: GapRows | None = Field(None, description="Jerk limits of each section")
    per_section_min_velocity: GapRows | None = Field(None, description="Lower velocity limits of each section")
    per_section_min_acceleration: GapRows | None = Field(None, description="Lower acceleration limits of each section")
    per_section_max_position: GapRows | None = Field(None, description="Upper position limits of each section")
    per_section_min_position: GapRows | None = Field(None, description="Lower position limits of each section")
    per_section_minimum_duration: Annotated[list[Seconds | None], Field(fail_fast=True)] | None = Field(
        None, description="Shortest duration of each section, s"
    )
    minimum_duration: Seconds | None = Field(None, description="Shortest duration of the whole, s")
    enabled: list[Literal[True]] | None = Field(None, description="All true: every joint moves")
    control_interface: Literal["position"] | None = Field(None, description="position only")
    synchronization: Literal["time"] | None = Field(None, description="time only: all joints arrive together")
    duration_discretization: Literal["continuous"] | None = Field(None, description="continuous only")
    sampling: SamplingBody | None = Field(None, description="Where to sample the answer; by default 200 samples")
    include: Annotated[list[Included], Field(max_length=16)] | None = Field(None, description="As in a plan request")
    timeout: Seconds | None = Field(None, description="The caller's own limit on the computing time, s")


def to_plan(body: RuckigBody) -> PlanBody:
    """Return the plan request that says the same: method ``auto``, without a jerk limit ``ruckig``.

    There ``auto`` would pick a method on a path, which honours no end states.

    Raises
    ------
    InvalidRequest
    """
    dims = len(body.current_position) if body.degrees_of_freedom is None else body.degrees_of_freedom
    for name in ("current_position", "target_position", "enabled"):
        given = getattr(body, name)
        if given is not None and len(given) != dims:
            raise InvalidRequest.of(f"/{name}", "shape_mismatch", f"needs {dims} entries, has {len(given)}")
    waypoints = [body.current_position, *(body.intermediate_positions or []), body.target_position]
    sections = len(waypoints) - 1
    value = {
        "waypoints": waypoints,
        "method": "auto" if any(bound is not None for bound in body.max_jerk or ()) else "ruckig",
        "limits": _limits(body, "", None),
        "segment_limits": _segments(body, sections),
        "segment_durations": _durations(body, sections),
        "duration": None if body.minimum_duration is None else {"min": body.minimum_duration},
        "start": _state(body.current_velocity, body.current_acceleration),
        "end": _state(body.target_velocity, body.target_acceleration),
        "sampling": body.sampling,
        "include": body.include,
        "timeout": body.timeout,
    }
    return parse(PlanBody, value)


def _state(velocity: list[float] | None, acceleration: list[float] | None) -> dict[str, list[float]] | None:
    """Return a boundary state; zeros are ruckig's defaults and count as not sent."""
    given = {"velocity": velocity, "acceleration": acceleration}
    return {name: values for name, values in given.items() if values is not None and any(values)} or None


def _limits(body: RuckigBody, prefix: str, section: int | None) -> dict[str, Any] | None:
    limits: dict[str, Any] = {}
    for quantity in ("position", "velocity", "acceleration", "jerk"):
        upper, lower = (
            getattr(body, f"{prefix}{side}_{quantity}", None) for side in ("max", "min")
        )  # there is no min_jerk
        if section is not None:
            upper, lower = (None if rows is None else rows[section] for rows in (upper, lower))
        if upper is None and lower is None:
            continue
        if lower is None and quantity != "position":
            limits[quantity] = upper
        else:
            limits[quantity] = {"lower": lower, "upper": upper}
    return limits or None


def _segments(body: RuckigBody, sections: int) -> list[dict[str, Any] | None] | None:
    given = False
    for name in type(body).model_fields:
        rows = getattr(body, name)
        if not name.startswith("per_section_") or name == "per_section_minimum_duration" or rows is None:
            continue
        given = True
        _refuse_count(name, rows, sections)
    return [_limits(body, "per_section_", i) for i in range(sections)] if given else None


def _durations(body: RuckigBody, sections: int) -> list[dict[str, float] | None] | None:
    if body.per_section_minimum_duration is None:
        return None
    _refuse_count("per_section_minimum_duration", body.per_section_minimum_duration, sections)
    return [None if least is None else {"min": least} for least in body.per_section_minimum_duration]


def _refuse_count(name: str, rows: list[Any], sections: int) -> None:
    if len(rows) != sections:
        raise InvalidRequest.of(f"/{name}", "shape_mismatch", f"needs {sections} sections, has {len(rows)}")


#: Our pointers and ruckig's names for them; {0} is the section or waypoint.
_NAMES = (
    (r"/limits/(\w+)/lower", "/min_{0}"),
    (r"/limits/(\w+)/upper", "/max_{0}"),
    (r"/limits/(\w+)", "/max_{0}"),
    (r"/segment_limits/(\d+)/(\w+)/lower", "/per_section_min_{1}/{0}"),
    (r"/segment_limits/(\d+)/(\w+)/upper", "/per_section_max_{1}/{0}"),
    (r"/segment_limits/(\d+)/(\w+)", "/per_section_max_{1}/{0}"),
    (r"/segment_durations/(\d+)/min", "/per_section_minimum_duration/{0}"),
    (r"/segment_durations/(\d+)", "/per_section_minimum_duration/{0}"),
    (r"/duration/min", "/minimum_duration"),
    (r"/duration", "/minimum_duration"),
    (r"/start/(\w+)", "/current_{0}"),
    (r"/end/(\w+)", "/target_{0}"),
)


def own_names(error: InvalidRequest, sections: int) -> InvalidRequest:
    """Return the error with pointers to the fields of the caller's body.

    Parameters
    ----------
    sections : int
        Number of sections of the request that the error came from.
    """
    found = [FieldError(_own(e.field, sections), e.code, e.reason) for e in error.errors]
    return InvalidRequest(found, error.errors_total)


def _own(field: str, sections: int) -> str:
    waypoint = re.match(r"/waypoints/(\d+)", field)
    if waypoint:
        i, rest = int(waypoint[1]), field[waypoint.end() :]
        return (
            f"/current_position{rest}"
            if i == 0
            else f"/target_position{rest}"
            if i == sections
            else f"/intermediate_positions/{i - 1}{rest}"
        )
    for pattern, name in _NAMES:
        found = re.match(pattern, field)
        if found:
            return name.format(*found.groups()) + field[found.end() :]
    return field
