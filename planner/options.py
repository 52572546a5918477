"""The base of every method's options, and the words in which methods say what they honour."""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, ValidationError

from .errors import FieldError, InvalidRequest

#: What a request may ask for, in the order in which it is told. A method names the subset that it honours.
CAPABILITIES = (
    "times",
    "position",
    "velocity",
    "acceleration",
    "jerk",
    "torque",
    "velocity_norm",
    "tip_speed",
    "tip_acceleration",
    "segment_limits",
    "segment_durations",
    "duration",
    "boundary_velocity",
    "boundary_acceleration",
    "boundary_jerk",
    "waypoint_states",
    "waypoint_tolerance",
    "tube",
    "robot",
)

#: Largest magnitude of a number in a request, and of a time in it.
MAX_VALUE = 1e9
MAX_TIME = 1e11

_CODES = {
    "missing": "missing",
    "extra_forbidden": "unknown_field",
    "finite_number": "not_finite",
    "greater_than": "out_of_range",
    "greater_than_equal": "out_of_range",
    "less_than": "out_of_range",
    "less_than_equal": "out_of_range",
    "too_long": "out_of_range",
    "too_short": "out_of_range",
    "literal_error": "out_of_range",
    "string_too_long": "out_of_range",
    "string_too_short": "out_of_range",
    "string_pattern_mismatch": "out_of_range",
}


class Conflict(ValueError):
    """Raised by an option's validator: it contradicts another option."""

    code = "conflict"


class Options(BaseModel):
    """Options of a method: frozen, strict, and with no field that is not declared."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, arbitrary_types_allowed=True)

    @property
    def fixes_knots(self) -> bool:
        """Whether the options give a parameter value to every waypoint, so that none may be merged."""
        return False

    @property
    def moves_by_itself(self) -> bool:
        """Whether the options hold a curve, which may move where all waypoints are equal."""
        return False

    @property
    def rounding(self) -> float | None:
        """By how much the path between waypoints may leave their polyline to round its corners; None: not at all."""
        return None

    @property
    def closed(self) -> bool:
        """Whether the derivatives at the end are those at the start, up to the class the method guarantees."""
        return False

    def check(self, points: NDArray[np.float64]) -> None:
        """Raise InvalidRequest where the options do not fit the waypoints (N, D), which are all equal.

        Nothing then moves and the method is not asked; elsewhere it finds out by itself.
        """

    @property
    def control_points(self) -> bool:
        """Whether the waypoints are control points, which the curve need not pass."""
        return False


def pointer(parts: tuple[Any, ...]) -> str:
    """Return the JSON pointer (RFC 6901) of a location; parts that are union tags (``#…``) are not part of it."""
    return "".join(_token(p) for p in parts if not (isinstance(p, str) and p.startswith("#")))[:300]


def _token(part: Any) -> str:
    return "/" + str(part).replace("~", "~0").replace("/", "~1")


def invalid(error: ValidationError, prefix: tuple[str, ...] = ()) -> InvalidRequest:
    """Return pydantic's findings as ours: a pointer, one of our codes and the reason, without the input."""
    found = []
    details = error.errors(include_url=False, include_input=False, include_context=True)
    for detail in details[: InvalidRequest.shown]:
        kind, where = detail["type"], detail["loc"]
        if kind == "extra_forbidden":  # the name is the user's own, even where it looks like a tag
            field = pointer(prefix + where[:-1]) + _token(where[-1])
        else:
            field = pointer(prefix + where)
        code = _CODES.get(kind, "wrong_type")
        if kind == "value_error":
            code = getattr(detail.get("ctx", {}).get("error"), "code", "out_of_range")
        found.append(FieldError(field[:300], code, detail["msg"].removeprefix("Value error, ")))
    return InvalidRequest(found, len(details))


def read_options(model: type[Options], given: Options | dict[str, Any] | None) -> Options:
    """Return the options as ``model``, defaults filled in.

    Raises
    ------
    InvalidRequest
        An option is unknown, of the wrong type or out of range; the pointer starts with ``/options``.
    """
    if isinstance(given, model):
        return given
    if isinstance(given, Options):
        return _wrong(model, given)
    if not given:
        return _defaults(model)
    try:
        return model.model_validate(_lists(given))
    except ValidationError as error:
        raise invalid(error, ("options",)) from None


@cache
def _defaults(model: type[Options]) -> Options:
    return model()


def _lists(value: Any) -> Any:
    """Return the tree with lists for arrays."""
    if isinstance(value, dict):
        return {k: _lists(v) for k, v in value.items()}
    return value.tolist() if isinstance(value, np.ndarray) else value


def _wrong(model: type[Options], given: Options) -> Options:
    raise InvalidRequest.of("/options", "wrong_type", f"expected {model.__name__}, got {type(given).__name__}")
