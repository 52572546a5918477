"""What the service does with a body, without HTTP: the routes and the command line both call this."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from planner import METHODS, InvalidRequest, Plan, PlannerError, Row, Sampling, compare, plan, retime, sample

from . import encode
from .reading import included, refuse_count, sampling_of, timeout_of, to_request
from .retiming import own_fields, read_motion
from .schemas import CompareBody, MethodChoice, PlanBody, RetimeBody
from .settings import Caps

#: Fields that the digest states in their canonical form instead.
_CANONICAL = {"waypoints", "method", "options", "sampling", "include"}

#: Makes the problem document of a row that refuses.
ProblemOf = Callable[[PlannerError], dict[str, Any]]


@dataclass(frozen=True)
class Answer:
    """An encoded answer, its media type, and the seconds spent on each stretch of the road to it."""

    content: bytes
    media_type: str
    seconds: Mapping[str, float]


def answer_plan(body: PlanBody, caps: Caps, media_type: str = encode.JSON) -> Answer:
    """Plan, sample and encode.

    Raises
    ------
    PlannerError
        Whatever the planner refuses with; ``InvalidRequest`` if the format holds samples and none are included.
    """
    started = time.perf_counter()
    include, method = _included(body, media_type), body.method or "auto"
    request, sampling = to_request(body, caps)
    read = time.perf_counter()
    made = plan(request, method, body.options or {})
    given = body.model_dump(exclude=_CANONICAL, exclude_none=True)
    return _answer(made, method, sampling, include, given, caps, media_type, read - started)


def answer_retiming(body: RetimeBody, caps: Caps, media_type: str = encode.JSON) -> Answer:
    """Retime, sample and encode.

    Raises
    ------
    PlannerError
        As for a plan.
    """
    started = time.perf_counter()
    include, timeout = _included(body, media_type), timeout_of(body, caps)
    motion, names, dims = read_motion(body, caps)
    sampling = sampling_of(body)
    duration = None if body.duration is None else body.duration.model_dump(exclude_none=True)
    if "samples" in include and sampling.dt is None:
        refuse_count(sampling, 1.0, dims, caps.samples)  # any duration: the count does not depend on it
    limits = body.limits.model_dump(exclude_none=True)
    read = time.perf_counter()
    with own_fields(body):
        made = retime(
            motion,
            limits=limits,
            tolerance=body.tolerance,
            duration=duration,
            joint_names=names,
            timeout=timeout,
            bound="bound" in include,
        )
    given = body.model_dump(exclude={"sampling", "include"}, exclude_none=True)
    return _answer(made, "retiming", sampling, include, given, caps, media_type, read - started)


def _included(body: PlanBody | RetimeBody, media_type: str) -> tuple[str, ...]:
    include = included(body)
    if media_type != encode.JSON and "samples" not in include:
        raise InvalidRequest.of("/include", "conflict", f"{media_type} holds samples, which are not included")
    return include


def _answer(
    made: Plan,
    method: str,
    sampling: Sampling,
    include: tuple[str, ...],
    given: Mapping[str, Any],
    caps: Caps,
    media_type: str,
    reading: float,
) -> Answer:
    """Sample and encode; ``method`` and ``given`` are what was asked, ``reading`` the seconds before planning."""
    planned = time.perf_counter()
    samples = sample(made.trajectory, sampling, caps.samples) if "samples" in include else None
    if samples is not None and media_type != encode.JSON:
        encode.refuse_infinite(made.method, *encode.samples_tree(samples).values())
        names = made.request.joint_names
        content = (
            encode.to_csv(samples, names)
            if media_type == encode.CSV
            else encode.to_ros2(samples, names, made.trajectory.start)
        )
    else:
        digest = encode.digest_of(made, method, sampling, include, given)
        content = encode.dumps(encode.plan_tree(made, samples, "polynomial" in include, digest))
    seconds = {**made.seconds, "encode": time.perf_counter() - planned}
    seconds["validate"] = seconds.get("validate", 0.0) + reading
    return Answer(content, media_type, seconds)


def comparison(body: CompareBody, caps: Caps, problem: ProblemOf) -> dict[str, Any]:
    """Return one row per method, in the given order; a method that refuses is a row with its problem document.

    Raises
    ------
    InvalidRequest, UnknownMethod, TooLarge
        The comparison itself is wrong.
    """
    methods = body.methods if isinstance(body.methods, str) else [_entry(m) for m in body.methods]
    share = len(METHODS) if isinstance(methods, str) else len(methods)
    request, sampling = to_request(body, caps, share)
    rows = compare(request, methods)
    include = included(body)
    return {"rows": [_row(row, include, sampling, caps.samples // share, problem) for row in rows]}


def _entry(choice: str | MethodChoice) -> str | tuple[str, Mapping[str, Any]]:
    return choice if isinstance(choice, str) else (choice.method, choice.options or {})


def _row(row: Row, include: tuple[str, ...], sampling: Sampling, most: int, problem: ProblemOf) -> dict[str, Any]:
    try:
        if row.plan is None:
            raise row.error or PlannerError("no answer")
        made = row.plan
        tree: dict[str, Any] = {
            "method": row.method,
            "ok": True,
            "duration": made.trajectory.duration,
            "cost": dict(made.certificate.cost),
            "peaks": encode.peaks_tree(made.certificate),
            "certificate": encode.certificate_tree(made.certificate),
        }
        if "samples" in include:
            tree["samples"] = encode.samples_tree(sample(made.trajectory, sampling, most))
        if "polynomial" in include:
            tree["polynomial"] = encode.polynomial_tree(made.trajectory)
        arrays = [*tree.get("samples", {}).values(), *tree.get("polynomial", {}).values()]
        encode.refuse_infinite(row.method, *arrays)
    except PlannerError as error:
        nothing = dict.fromkeys(("duration", "cost", "peaks", "certificate"))
        tree = {"method": row.method, "ok": False, **nothing, "error": problem(error)}
    tree["compute_ms"] = row.compute_ms
    return tree
