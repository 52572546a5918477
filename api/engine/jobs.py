"""What is solved: a request's bytes in, a draft or a problem document out. Runs in the service or in a solver."""

import logging
import math
import re
import signal
import struct
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from pydantic import BaseModel

from planner import InvalidRequest, PlannerError, TimeLimit, TooLarge

from ..draft import Draft
from ..errors import Refusal, problem
from ..judging import certificate
from ..media import JSON
from ..reading import decode, parse, refuse_above
from ..ruckig_shape import RuckigBody, own_names, to_plan
from ..schemas import CertifyBody, CompareBody, PlanBody, RetimeBody
from ..settings import Caps
from ..work import comparison, draft_plan, draft_retiming
from . import lanes

log = logging.getLogger("waywright.api")

#: Seconds beyond a job's time limit after which its process ends itself; after twice as many it is killed.
GRACE = 0.05

#: The signal by which it then ends itself, even in native code; 0 where there is none.
ALARM = int(getattr(signal, "SIGALRM", 0))


@dataclass(frozen=True)
class Job:
    """A request to be solved.

    Parameters
    ----------
    kind
        A key of ``KINDS``.
    raw, coding
        The body and its media type: bytes are all that a solver is sent.
    media_type
        The format of the answer.
    instance, request_id
        For the problem documents inside an answer.
    spent
        Seconds of its time limit that have gone by.
    """

    kind: str
    raw: bytes
    coding: str = JSON
    media_type: str = JSON
    caps: Caps = field(default_factory=Caps)
    instance: str | None = None
    request_id: str | None = None
    spent: float = 0.0


@dataclass(frozen=True)
class Failed:
    """A problem document, and for the log what a bug of ours left behind."""

    document: dict[str, Any]
    trace: str | None = None


Outcome = Draft | Failed


@dataclass(frozen=True)
class Kind:
    """A kind of job: its body and the work."""

    body: type[BaseModel]
    run: Callable[[Any, Job], Draft]


def _plan(body: PlanBody, job: Job) -> Draft:
    return draft_plan(body, job.caps, job.media_type, job.spent)


def _plan_ruckig(body: RuckigBody, job: Job) -> Draft:
    sections = len(body.intermediate_positions or ()) + 1
    try:
        return draft_plan(to_plan(body), job.caps, job.media_type, job.spent)
    except InvalidRequest as error:
        raise own_names(error, sections) from None


def _retime(body: RetimeBody, job: Job) -> Draft:
    return draft_retiming(body, job.caps, job.media_type, job.spent)


def _compare(body: CompareBody, job: Job) -> Draft:
    row_problem = partial(problem, instance=job.instance, request_id=job.request_id)
    return Draft(comparison(body, job.caps, row_problem, job.spent))


def _certify(body: CertifyBody, job: Job) -> Draft:
    return Draft(certificate(body, job.caps))


KINDS = {
    "plan": Kind(PlanBody, _plan),
    "plan_ruckig": Kind(RuckigBody, _plan_ruckig),
    "compare": Kind(CompareBody, _compare),
    "certify": Kind(CertifyBody, _certify),
    "retime": Kind(RetimeBody, _retime),
}


#: Kinds whose size is that of their waypoints, and lists and objects of a waypoint: its row, states, limits.
_BY_WAYPOINTS = ("plan", "compare")
PARTS = 32

#: Entries too many that cost nothing to read; what is wrong is then told with the rest.
FEW = 100


def load(job: Job) -> Any:
    """Return the value of a body; what is far too large is refused before it is read entry by entry.

    Raises
    ------
    InvalidRequest, TooLarge
    """
    if job.kind not in _BY_WAYPOINTS:
        return decode(job.raw, job.coding)
    if lanes.parts(job.raw, job.coding) > PARTS * job.caps.waypoints:
        raise TooLarge("waypoints", job.caps.waypoints, f"no more than {PARTS} lists and objects a waypoint are needed")
    value = decode(job.raw, job.coding)
    waypoints = value.get("waypoints") if isinstance(value, dict) else None
    if isinstance(waypoints, list):
        refuse_above(len(waypoints), job.caps.waypoints, "waypoints")
        dims = len(waypoints[0]) if waypoints and isinstance(waypoints[0], list) else 0
        for name in _SIDE_LISTS:
            most = max(dims if name == "joint_names" else len(waypoints), 1)
            if isinstance(value.get(name), list) and len(value[name]) > most + FEW:
                reason = f"needs at most {most} entries, has {len(value[name])}"
                raise InvalidRequest.of(f"/{name}", "shape_mismatch", reason)
    return value


#: Lists of a plan that have an entry, or nearly, for every waypoint or joint.
_SIDE_LISTS = ("times", "segment_limits", "segment_durations", "waypoint_states", "joint_names")


def read(job: Job, value: Any = None) -> BaseModel:
    """Return the checked body, of its value if that was loaded.

    Raises
    ------
    InvalidRequest, TooLarge
    """
    return parse(KINDS[job.kind].body, load(job) if value is None else value)


def limit_of(body: BaseModel | None, caps: Caps) -> float:
    """Return a job's time limit, s: the client's own, or the cap."""
    asked = getattr(body, "timeout", None)
    return caps.timeout if asked is None else min(float(asked), caps.timeout)


def run(job: Job, body: BaseModel) -> Outcome:
    """Do the work; whatever goes wrong becomes a problem document."""
    try:
        return KINDS[job.kind].run(body, job)
    except TimeLimit as error:  # its seconds are what was left when the work began
        return failed(TimeLimit(limit_of(body, job.caps)) if job.spent else error, job)
    except PlannerError as error:
        return failed(error, job)
    except Exception:
        return failed(Refusal("internal", UNEXPECTED), job, traceback.format_exc())


UNEXPECTED = "something failed that should not have; the log has the details"


def failed(error: PlannerError | Refusal, job: Job, trace: str | None = None) -> Failed:
    """Return the failure that an error makes of a job."""
    return Failed(problem(error, job.instance, job.request_id), trace)


def solve(job: Job) -> Outcome:
    """Read and run a job in a solver's process, which ends if the job's time limit passes: even in native code.

    The service watches too, but a large body's own limit is known here only.
    """
    began = time.perf_counter()
    alarmed = ALARM and threading.current_thread() is threading.main_thread()
    try:
        value = load(job)
        if alarmed:
            spent = job.spent + time.perf_counter() - began
            signal.setitimer(signal.ITIMER_REAL, max(_asked_limit(value, job.caps) - spent, 0.0) + GRACE)
        body = read(job, value)
        reading = time.perf_counter() - began
        outcome = run(replace(job, spent=job.spent + reading), body)
        if isinstance(outcome, Draft):
            seconds = {**outcome.seconds, "validate": outcome.seconds.get("validate", 0.0) + reading}
            return replace(outcome, seconds=seconds)
        return outcome
    except PlannerError as error:
        return failed(error, job)
    except Exception:
        return failed(Refusal("internal", UNEXPECTED), job, traceback.format_exc())
    finally:
        if alarmed:
            signal.setitimer(signal.ITIMER_REAL, 0.0)


def _asked_limit(value: Any, caps: Caps) -> float:
    """Return the time limit, s, that a value has that was not checked yet."""
    asked = value.get("timeout") if isinstance(value, dict) else None
    return float(asked) if isinstance(asked, (int, float)) and 0 < asked <= caps.timeout else caps.timeout


_LIMIT = re.compile(rb'"timeout"\s*:\s*([0-9.eE+-]+)')
_PACKED_LIMIT = re.compile(rb"\xa7timeout(?:\xcb(.{8})|([\x00-\x7f]))", re.DOTALL)


def glimpsed_limit(job: Job) -> float:
    """Return the time limit, s, of a body that nobody here has read: what stands after its name, or the cap."""
    asked = math.nan
    if job.coding == JSON:
        found = _LIMIT.findall(job.raw)
        with suppress(ValueError):
            asked = float(found[-1]) if found else math.nan
    else:
        packed = _PACKED_LIMIT.findall(job.raw)
        if packed:
            asked = struct.unpack(">d", packed[-1][0])[0] if packed[-1][0] else float(packed[-1][1][0])
    return asked if 0 < asked <= job.caps.timeout else job.caps.timeout
