"""Requests in ruckig's words: the names of its ``InputParameter``, read as a plan request. ruckig is not imported.

What cannot be honoured is refused by name; errors point to the caller's own field names.
"""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import reading
from .errors import FieldError, InvalidRequest
from .limits import QUANTITIES
from .options import MAX_TIME, MAX_VALUE
from .types import PlanRequest

Array = NDArray[np.float64]

#: The attributes of ruckig's InputParameter, all of them. What is not read below is refused unless at its default.
NAMES = (
    "degrees_of_freedom",
    "current_position",
    "current_velocity",
    "current_acceleration",
    "target_position",
    "target_velocity",
    "target_acceleration",
    "intermediate_positions",
    "max_velocity",
    "max_acceleration",
    "max_jerk",
    "min_velocity",
    "min_acceleration",
    "max_position",
    "min_position",
    "per_section_max_velocity",
    "per_section_max_acceleration",
    "per_section_max_jerk",
    "per_section_min_velocity",
    "per_section_min_acceleration",
    "per_section_max_position",
    "per_section_min_position",
    "per_section_minimum_duration",
    "minimum_duration",
    "interrupt_calculation_duration",
    "enabled",
    "control_interface",
    "synchronization",
    "duration_discretization",
    "per_dof_control_interface",
    "per_dof_synchronization",
)

#: The only value that is honoured of what ruckig offers a choice of, and why.
_ONLY = {
    "control_interface": ("position", "velocity control has no target position"),
    "synchronization": ("time", "all joints arrive together"),
    "duration_discretization": ("continuous", "durations are not rounded to a control cycle"),
}

#: Why no timeout stands in for ruckig's soft interruption: the one answers with the best so far, the other not at all.
_INTERRUPT = "a calculation cannot be interrupted and still answer; timeout (s) ends it with an error"


def from_ruckig(given: Any) -> PlanRequest:
    """Return the plan request that says what ruckig's input says.

    Limits per section take the place of the general ones in their section, as in ruckig. What ruckig does without is
    None here too: infinite limits, zero velocities and accelerations at the ends.

    Parameters
    ----------
    given : ruckig.InputParameter or mapping
        Or anything with the same attributes. A mapping may leave out all but ``current_position`` and
        ``target_position``, and may also hold ``timeout`` (s). None stands for ruckig's default; in a row of a limit
        per section, it stands for the general limit.

    Raises
    ------
    InvalidRequest
        With the caller's own names as pointers. ``out_of_range``: asked is what is not honoured (another control
        interface or synchronization than position and time, discrete durations, a disabled joint, an
        interruption). ``unknown_field``: a name that ruckig does not have, or an attribute newer than this list that
        is set. Else as for ``PlanRequest.of``.
    """
    fields = plan_fields(given if isinstance(given, Mapping) else _attributes(given))
    waypoints = fields.pop("waypoints")
    try:
        return PlanRequest.of(waypoints, **fields)
    except InvalidRequest as error:
        raise own_names(error, len(waypoints) - 1) from None


def plan_fields(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a plan request, JSON-ready and without what was not asked, from ruckig's names.

    Raises
    ------
    InvalidRequest
        See ``from_ruckig``.
    """
    reading.fields(given, "", (*NAMES, "timeout"))
    given = {name: value for name, value in given.items() if value is not None}
    dims, findings = _dims(given), reading.Findings()
    waypoints = _waypoints(given, dims)
    sections = len(waypoints) - 1
    for name in ("enabled", *_ONLY, "per_dof_control_interface", "per_dof_synchronization"):
        findings.take(_refuse_other, given, name, dims)
    if "interrupt_calculation_duration" in given:
        findings.errors.append(FieldError("/interrupt_calculation_duration", "out_of_range", _INTERRUPT))
    limits: dict[str, Any] = {}
    rows: list[dict[str, Any]] = [{} for _ in range(sections)]
    for quantity in QUANTITIES:
        findings.take(_limit, given, quantity, dims, limits, rows)
    found = {
        "waypoints": waypoints,
        "limits": limits or None,
        "segment_limits": [row or None for row in rows] if any(rows) else None,
        "segment_durations": findings.take(_section_durations, given, sections),
        "duration": findings.take(_duration, given.get("minimum_duration"), "/minimum_duration"),
        "start": _state(given, "current", dims, findings),
        "end": _state(given, "target", dims, findings),
        "timeout": given.get("timeout"),
    }
    findings.close()
    return {name: value for name, value in found.items() if value is not None}


def _attributes(given: Any) -> dict[str, Any]:
    if not hasattr(given, "current_position"):
        raise InvalidRequest.of("", "wrong_type", "needs ruckig's InputParameter, or a mapping with its names")
    public = {name: getattr(given, name) for name in dir(given) if not name.startswith("_")}
    # what a later ruckig adds is refused where it is set, and never ignored
    return {name: v for name, v in public.items() if name in NAMES or not (v is None or callable(v))}


def _list(value: Any, field: str, count: int | None = None, what: str = "entries") -> list[Any]:
    value = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(value, (list, tuple)):
        raise InvalidRequest.of(field, "wrong_type", "must be a list")
    if count is not None and len(value) != count:
        raise InvalidRequest.of(field, "shape_mismatch", f"needs {count} {what}, has {len(value)}")
    return list(value)


def _dims(given: Mapping[str, Any]) -> int:
    lacking = [name for name in ("current_position", "target_position") if name not in given]
    if lacking:
        raise InvalidRequest([FieldError(f"/{name}", "missing", "must be given") for name in lacking])
    dims = len(_list(given["current_position"], "/current_position"))
    if "degrees_of_freedom" in given:
        number = reading.number(given["degrees_of_freedom"], "/degrees_of_freedom")
        if number < 1 or number != int(number):
            raise InvalidRequest.of("/degrees_of_freedom", "out_of_range", "must be a whole number of at least 1")
        dims = int(number)
    if dims == 0:
        raise InvalidRequest.of("/current_position", "too_few_points", "needs at least one joint")
    return dims


def _waypoints(given: Mapping[str, Any], dims: int) -> list[list[float]]:
    findings = reading.Findings()
    first, last = (
        findings.take(_vector, given[name], f"/{name}", dims) for name in ("current_position", "target_position")
    )
    between = findings.take(_rows, given.get("intermediate_positions", ()), "/intermediate_positions", dims)
    findings.close()
    return [first or [], *(between or ()), last or []]


def _rows(value: Any, field: str, dims: int) -> list[list[float]]:
    rows = [_list(row, f"{field}/{i}", dims) for i, row in enumerate(_list(value, field))]
    found: list[list[float]] = reading.matrix(rows, field).tolist() if rows else []
    return found


def _vector(value: Any, field: str, dims: int) -> list[float]:
    found: list[float] = reading.vector(_list(value, field), field, dims).tolist()
    return found


def _refuse_other(given: Mapping[str, Any], name: str, dims: int) -> None:
    """Raise where anything but the honoured value is asked; ruckig's enumerations count by their members' names."""
    if name not in given:
        return
    if name in _ONLY:
        words, asked = [given[name]], [f"/{name}"]
    else:
        words = _list(given[name], f"/{name}", dims)
        asked = [f"/{name}/{i}" for i in range(dims)]
    for word, field in zip(words, asked, strict=True):
        if name == "enabled":
            if not isinstance(word, (bool, np.bool_)):
                raise InvalidRequest.of(field, "wrong_type", "must be true or false")
            if not word:
                raise InvalidRequest.of(field, "out_of_range", "every joint is planned: leave the joint out")
            continue
        only, reason = _ONLY[name.removeprefix("per_dof_")]
        if str(getattr(word, "name", word)).lower() != only:
            raise InvalidRequest.of(field, "out_of_range", f"{only} only: {reason}")


def _state(given: Mapping[str, Any], end: str, dims: int, findings: reading.Findings) -> dict[str, list[float]] | None:
    """Return the state at an end; zeros are ruckig's defaults and count as not sent."""
    state = {}
    for name in ("velocity", "acceleration"):
        if f"{end}_{name}" in given:
            state[name] = findings.take(_vector, given[f"{end}_{name}"], f"/{end}_{name}", dims)
    return {name: values for name, values in state.items() if values is not None and any(values)} or None


def _duration(value: Any, field: str) -> dict[str, float] | None:
    return None if value is None else {"min": reading.number(value, field, 0.0, MAX_TIME)}


def _section_durations(given: Mapping[str, Any], sections: int) -> list[dict[str, float] | None] | None:
    name = "per_section_minimum_duration"
    if name not in given:
        return None
    rows = _list(given[name], f"/{name}", sections, "sections")
    return [_duration(value, f"/{name}/{i}") for i, value in enumerate(rows)]


def _limit(
    given: Mapping[str, Any], quantity: str, dims: int, limits: dict[str, Any], rows: list[dict[str, Any]]
) -> None:
    """Enter the limits of a quantity: the loosest of all sections, and those of the sections that differ from it."""
    low, high = _sides(given, quantity, len(rows), dims)
    whole = low.min(axis=0), high.max(axis=0)
    if np.isfinite(whole).any():
        limits[quantity] = _value(*whole, quantity)
    for i in np.flatnonzero((low != whole[0]).any(axis=1) | (high != whole[1]).any(axis=1)):
        rows[i][quantity] = _value(low[i], high[i], quantity)


def _value(low: Array, high: Array, quantity: str) -> Any:
    """Return a limit of a plan request: one value for both directions where that is the same."""
    lower, upper = ([x if np.isfinite(x) else None for x in side.tolist()] for side in (low, high))
    same = quantity != "position" and (low == -high).all()
    return upper if same else {"lower": lower, "upper": upper}


def _sides(given: Mapping[str, Any], quantity: str, sections: int, dims: int) -> tuple[Array, Array]:
    """Return the bounds that hold in every section, (sections, D) each, infinite where there are none."""
    upper, own_upper, lower, own_lower = (
        _read(given, f"{prefix}{side}_{quantity}", count, dims)
        for side in ("max", "min")
        for prefix, count in (("", None), ("per_section_", sections))
    )
    position = quantity == "position"
    high = np.tile(np.full(dims, np.inf) if upper is None else np.where(np.isnan(upper), np.inf, upper), (sections, 1))
    if own_upper is not None:
        high = np.where(np.isnan(own_upper), high, own_upper)
    if lower is not None:
        low = np.tile(np.where(np.isnan(lower), -np.inf, lower), (sections, 1))
        if own_upper is not None and not position:  # a section's one limit bounds both directions
            low = np.where(np.isnan(own_upper), low, np.maximum(low, -high))
    else:
        low = np.full(high.shape, -np.inf) if position else -high
    if own_lower is not None:
        low = np.where(np.isnan(own_lower), low, own_lower)
    if position:
        _refuse_empty(given, low >= high)
    else:  # the limits of sections were judged when they were read
        for bad, field in ((high <= 0, f"/max_{quantity}"), (low >= 0, f"/min_{quantity}")):
            if bad.any():
                raise InvalidRequest.of(field, "bad_limits", f"joint {np.argwhere(bad)[0, 1]}: must not be 0")
    return low, high


def _refuse_empty(given: Mapping[str, Any], empty: NDArray[np.bool_]) -> None:
    for section, joint in np.argwhere(empty)[:1]:
        own = next((n for n in ("per_section_max_position", "per_section_min_position") if n in given), None)
        field = "/max_position" if own is None else f"/{own}/{section}"
        raise InvalidRequest.of(field, "bad_limits", f"joint {joint}: min_position < max_position must hold")


def _read(given: Mapping[str, Any], name: str, sections: int | None, dims: int) -> Array | None:
    """Return the bounds of one name, (D,) or (sections, D), NaN where None was sent."""
    if name not in given:
        return None
    if sections is None:
        return _bounds(given[name], f"/{name}", name, dims)
    rows = _list(given[name], f"/{name}", sections, "sections")
    rows = [_list(row, f"/{name}/{i}", dims) for i, row in enumerate(rows)]
    side = -1.0 if "min_" in name else 1.0
    if all(isinstance(x, float) and 0 < x * side <= MAX_VALUE for row in rows for x in row):
        return np.array(rows)  # the usual case, without the look at each that names a field
    return np.array([_bounds(row, f"/{name}/{i}", name, dims) for i, row in enumerate(rows)])


def _bounds(value: Any, field: str, name: str, dims: int) -> Array:
    entries, side = _list(value, field, dims), -1.0 if "min_" in name else 1.0
    read = np.array([_bound(entry, f"{field}/{i}", side) for i, entry in enumerate(entries)], dtype=np.float64)
    wrong = read * side < 0
    if name.startswith(
        "per_section_"
    ):  # general limits may be 0, as ruckig's are at first, where no section needs them
        wrong |= read == 0
    if wrong.any() and not name.endswith("position"):
        raise InvalidRequest.of(field, "bad_limits", f"joint {np.argmax(wrong)}: must be {'<' if side < 0 else '>'} 0")
    return read


def _bound(entry: Any, field: str, side: float) -> float:
    if entry is None:
        return np.nan
    if isinstance(entry, float) and entry == side * np.inf:
        return entry
    return reading.number(entry, field)


#: Our pointers and ruckig's names for them; {0} is the quantity or section.
_RENAMED = (
    (r"/limits/(\w+)/lower", "/min_{0}"),
    (r"/limits/(\w+)/upper", "/max_{0}"),
    (r"/limits/(\w+)", "/max_{0}"),
    (r"/segment_limits/(\d+)/(\w+)/lower", "/per_section_min_{1}/{0}"),
    (r"/segment_limits/(\d+)/(\w+)/upper", "/per_section_max_{1}/{0}"),
    (r"/segment_limits/(\d+)/(\w+)", "/per_section_max_{1}/{0}"),
    (r"/segment_durations/(\d+)/min", "/per_section_minimum_duration/{0}"),
    (r"/segment_durations/(\d+)", "/per_section_minimum_duration/{0}"),
    (r"/segment_durations", "/per_section_minimum_duration"),
    (r"/duration/min", "/minimum_duration"),
    (r"/duration", "/minimum_duration"),
    (r"/start/(\w+)", "/current_{0}"),
    (r"/end/(\w+)", "/target_{0}"),
)


def own_names(error: InvalidRequest, sections: int) -> InvalidRequest:
    """Return the error with pointers to ruckig's names.

    Parameters
    ----------
    sections : int
        Number of sections of the request that the error came from.
    """
    found = [FieldError(_renamed(e.field, sections), e.code, e.reason) for e in error.errors]
    return InvalidRequest(found, error.errors_total)


def _renamed(field: str, sections: int) -> str:
    waypoint = re.match(r"/waypoints/(\d+)", field)
    if waypoint:
        i, rest = int(waypoint[1]), field[waypoint.end() :]
        ends = {0: "/current_position", sections: "/target_position"}
        return ends.get(i, f"/intermediate_positions/{i - 1}") + rest
    for pattern, name in _RENAMED:
        found = re.match(pattern, field)
        if found:
            return name.format(*found.groups()) + field[found.end() :]
    return field
