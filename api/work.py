"""What the service does with a body, without HTTP: the service's solvers and the command line both call this."""

import time
from collections.abc import Callable, Mapping
from typing import Any

from planner import METHODS, InvalidRequest, Plan, PlannerError, Row, Sampling, compare, plan, retime, sample_times

from . import trees
from .draft import WHOLE, Draft, Drawn, refuse_infinite
from .formats import FORMATS
from .media import JSON
from .reading import asked, included, refuse_count, sampling_of, timeout_of, to_request
from .retiming import own_fields, read_motion
from .schemas import CompareBody, MethodChoice, PlanBody, RetimeBody
from .settings import Caps

#: Makes the problem document of a row that refuses.
ProblemOf = Callable[[PlannerError], dict[str, Any]]


def draft_plan(body: PlanBody, caps: Caps, media_type: str = JSON, spent: float = 0.0) -> Draft:
    """Plan, up to the samples, which are drawn as they are written.

    Parameters
    ----------
    spent : float
        Seconds of the request's time limit that have gone by.

    Raises
    ------
    PlannerError
        Whatever the planner refuses with; ``InvalidRequest`` if the format holds samples and none are included.
    """
    started = time.perf_counter()
    include, method = _included(body, media_type), body.method or "auto"
    request, sampling = to_request(body, caps, spent=spent)
    read = time.perf_counter()
    made = plan(request, method, body.options or {})
    given = asked(body) if body.timeout is None else {**asked(body), "timeout": body.timeout}
    return _draft(made, method, sampling, include, given, caps, read - started)


def draft_retiming(body: RetimeBody, caps: Caps, media_type: str = JSON, spent: float = 0.0) -> Draft:
    """Retime, up to the samples.

    Raises
    ------
    PlannerError
        As for a plan.
    """
    started = time.perf_counter()
    include, timeout = _included(body, media_type), timeout_of(body, caps, spent)
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
    return _draft(made, "retiming", sampling, include, given, caps, read - started)


def _included(body: PlanBody | RetimeBody, media_type: str) -> tuple[str, ...]:
    include = included(body)
    if FORMATS[media_type].samples and "samples" not in include:
        raise InvalidRequest.of("/include", "conflict", f"{media_type} holds samples, which are not included")
    return include


def _draft(
    made: Plan,
    method: str,
    sampling: Sampling,
    include: tuple[str, ...],
    given: Mapping[str, Any],
    caps: Caps,
    reading: float,
) -> Draft:
    """Return the draft; ``method`` and ``given`` are what was asked, ``reading`` the seconds before planning."""
    planned = time.perf_counter()
    samples = _drawn(made, sampling, caps.samples) if "samples" in include else None
    digest = trees.digest_of(made, method, sampling, include, given)
    tree = trees.plan_tree(made, samples, "polynomial" in include, digest)
    seconds = {**made.seconds, "encode": time.perf_counter() - planned}
    seconds["validate"] = seconds.get("validate", 0.0) + reading
    n, dims = made.request.waypoints.shape
    draft = Draft(tree, seconds, made.method, n, dims, made.request.joint_names, made.trajectory.start)
    if samples is not None and samples.numbers <= WHOLE < draft.numbers:  # pieces leave before these are drawn
        samples.check()
    return draft


def _drawn(made: Plan, sampling: Sampling, most: int) -> Drawn:
    """Return the samples; those of a large answer are checked here, since their first piece leaves before the last."""
    drawn = Drawn(made.trajectory, sample_times(made.trajectory, sampling, most), made.method)
    if drawn.numbers > WHOLE:
        drawn.check()
    return drawn


def comparison(body: CompareBody, caps: Caps, problem: ProblemOf, spent: float = 0.0) -> dict[str, Any]:
    """Return one row per method, in the given order; a method that refuses is a row with its problem document.

    Raises
    ------
    InvalidRequest, UnknownMethod, TooLarge
        The comparison itself is wrong.
    """
    methods = body.methods if isinstance(body.methods, str) else [_entry(m) for m in body.methods]
    share = len(METHODS) if isinstance(methods, str) else len(methods)
    request, sampling = to_request(body, caps, share, spent)
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
            "peaks": trees.peaks_tree(made.certificate),
            "certificate": trees.certificate_tree(made.certificate),
        }
        if "samples" in include:
            tree["samples"] = _drawn(made, sampling, most)
            if tree["samples"].numbers <= WHOLE:
                tree["samples"].check()
        if "polynomial" in include:
            tree["polynomial"] = trees.polynomial_tree(made.trajectory)
        refuse_infinite(row.method, *tree.get("polynomial", {}).values())
    except PlannerError as error:
        nothing = dict.fromkeys(("duration", "cost", "peaks", "certificate"))
        tree = {"method": row.method, "ok": False, **nothing, "error": problem(error)}
    tree["compute_ms"] = row.compute_ms
    return tree
