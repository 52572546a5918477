"""From bytes to a checked body, and from a body to the planner's request. Knows no HTTP."""

from dataclasses import fields
from typing import Any, TypeVar

import jiter
from pydantic import BaseModel, ValidationError

from planner import (
    FieldError,
    InvalidRequest,
    PlanRequest,
    Sampling,
    TooLarge,
    invalid,
    pointer,
    sample_count,
)
from planner.sampling import refuse_too_many

from .media import JSON, MSGPACK
from .packed import unpack
from .schemas import CompareBody, MotionBody, RetimeBody
from .settings import Caps

#: Media types of a body.
READ = (JSON, MSGPACK)

#: Time limit, s, of what comes to be solved when its time has run out.
SHORTEST = 1e-6

Model = TypeVar("Model", bound=BaseModel)

#: What a request to the planner has of a body's fields, but for those that are read on their own.
_ASKED = tuple(f.name for f in fields(PlanRequest) if f.name not in ("waypoints", "timeout", "bound"))


def decode(raw: bytes, coding: str = JSON) -> Any:
    """Return the value of a body; ``NaN`` and numbers beyond floats come through, so that their field can be named.

    Raises
    ------
    InvalidRequest
        ``not_json``: not what its coding says, not UTF-8, nested too deeply, or with a key twice in an object.
    """
    if coding == MSGPACK:
        return unpack(raw)
    try:
        return jiter.from_json(raw, allow_inf_nan=True, catch_duplicate_keys=True)
    except ValueError as error:
        raise InvalidRequest.of("", "not_json", f"the body is not JSON: {error}"[:300]) from None


def parse(model: type[Model], value: Any) -> Model:
    """Return the value as a body.

    Raises
    ------
    InvalidRequest
        With pointers to what is missing, unknown, of the wrong type or out of range.
    """
    if isinstance(value, dict):
        known = model.model_fields
        unknown = [k for k in value if k not in known]
        if len(unknown) > InvalidRequest.shown:  # thousands of them must cost nothing
            shown = unknown[: InvalidRequest.shown]
            raise InvalidRequest(
                [FieldError(pointer((k[:60],)), "unknown_field", "there is no such field") for k in shown], len(unknown)
            )
    try:
        return model.model_validate(value)
    except ValidationError as error:
        raise invalid(error) from None


def refuse_oversize(waypoints: list[list[float]], caps: Caps) -> None:
    """Refuse more waypoints or joints than the caps allow, before anything is built from them."""
    refuse_above(len(waypoints), caps.waypoints, "waypoints")
    refuse_above(len(waypoints[0]) if waypoints else 0, caps.joints, "joints")


def refuse_above(count: int, most: int, what: str) -> None:
    """Raise TooLarge if there are more than ``most``."""
    if count > most:
        raise TooLarge(what, most, f"{count:,} were sent; the library itself has no such cap")


def included(body: MotionBody | RetimeBody) -> tuple[str, ...]:
    """Return what the answer is to hold, in one order: by default the samples, in a comparison nothing."""
    default = () if isinstance(body, CompareBody) else ("samples",)
    asked = default if body.include is None else body.include
    return tuple(name for name in ("samples", "polynomial", "bound") if name in asked)


def asked(body: MotionBody) -> dict[str, Any]:
    """Return what a body asks of the trajectory besides waypoints and time to compute it, models as dicts.

    What pydantic's ``model_dump`` would return, without its copies of all lists.
    """
    found = {name: getattr(body, name) for name in _ASKED}
    return {name: _dumped(value) for name, value in found.items() if value is not None}


def _dumped(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return value.model_dump(exclude_none=True)
    if type(value) is list and any(isinstance(entry, BaseModel) for entry in value):
        return [_dumped(entry) for entry in value]
    return value


def to_request(body: MotionBody, caps: Caps, share: int = 1, spent: float = 0.0) -> tuple[PlanRequest, Sampling]:
    """Return the planner's request and where to sample.

    Parameters
    ----------
    share : int
        How many answers share the cap on samples.
    spent : float
        Seconds of the time limit that have gone by.

    Raises
    ------
    InvalidRequest, TooLarge
    """
    refuse_oversize(body.waypoints, caps)
    timeout = timeout_of(body, caps, spent)
    include = included(body)
    request = PlanRequest.of(body.waypoints, **asked(body), timeout=timeout, bound="bound" in include)
    sampling = sampling_of(body)
    if "samples" in include:
        _refuse_samples(request, sampling, caps.samples // share)
    return request, sampling


def timeout_of(body: MotionBody | RetimeBody, caps: Caps, spent: float = 0.0) -> float:
    """Return the seconds that are left for the answer.

    Raises
    ------
    InvalidRequest
        Nothing, or more than the cap, was asked for.
    """
    if body.timeout is not None and not 0 < body.timeout <= caps.timeout:
        raise InvalidRequest.of("/timeout", "out_of_range", f"must be > 0 and at most {caps.timeout:g} s")
    whole = caps.timeout if body.timeout is None else body.timeout
    return max(whole - spent, SHORTEST)


def sampling_of(body: MotionBody | RetimeBody) -> Sampling:
    """Return where the answer is to be sampled."""
    return Sampling.of(None if body.sampling is None else body.sampling.model_dump(exclude_none=True))


def _refuse_samples(request: PlanRequest, sampling: Sampling, most: int) -> None:
    """Refuse more samples than the cap before solving, as far as the duration is known by then."""
    least = 0.0 if request.duration is None else request.duration.min
    if request.times is not None:
        least = float(request.times[-1] - request.times[0])
    else:
        least = max(least, sum(b.min for b in request.segment_durations or () if b is not None))
    if least == 0.0 and (request.waypoints != request.waypoints[0]).any():
        if sampling.dt is not None:
            return
        least = 1.0  # any: the count does not depend on it
    refuse_count(sampling, least, request.dims, most)


def refuse_count(sampling: Sampling, least: float, dims: int, most: int) -> None:
    """Refuse more samples of a trajectory that takes at least ``least`` seconds than the cap allows."""
    refuse_too_many(sample_count(sampling, least), dims, most, sampling, least)
