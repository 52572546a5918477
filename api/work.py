"""What the service does with a body, without HTTP: the routes and the command line both call this."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from planner import METHODS, InvalidRequest, PlannerError, Row, Sampling, compare, plan, sample

from . import encode
from .reading import included, to_request
from .schemas import CompareBody, MethodChoice, PlanBody
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
    include, method = included(body), body.method or "auto"
    if media_type != encode.JSON and "samples" not in include:
        raise InvalidRequest.of("/include", "conflict", f"{media_type} holds samples, which are not included")
    request, sampling = to_request(body, caps)
    read = time.perf_counter()
    made = plan(request, method, body.options or {})
    planned = time.perf_counter()
    samples = sample(made.trajectory, sampling, caps.samples) if "samples" in include else None
    if samples is not None and media_type != encode.JSON:
        encode.refuse_infinite(made.method, *encode.samples_tree(samples).values())
        content = (
            encode.to_csv(samples, request.joint_names)
            if media_type == encode.CSV
            else encode.to_ros2(samples, request.joint_names, made.trajectory.start)
        )
    else:
        given = body.model_dump(exclude=_CANONICAL, exclude_none=True)
        digest = encode.digest_of(made, method, sampling, include, given)
        content = encode.dumps(encode.plan_tree(made, samples, "polynomial" in include, digest))
    done = time.perf_counter()
    seconds = {**made.seconds, "encode": done - planned}
    seconds["validate"] = seconds.get("validate", 0.0) + read - started
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
