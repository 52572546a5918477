"""What every error is over HTTP: one table of codes, and the problem document (RFC 9457) of an error."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import orjson

from planner import ERRORS, PlannerError

#: Largest problem document, in bytes.
LARGEST = 8000

#: Longest string and longest list that are kept, in order of despair.
_FITS = ((1200, 64), (300, 20), (160, 20), (80, 10), (40, 5))


@dataclass(frozen=True)
class Kind:
    """The status of a code, its title, and the explanation at ``/errors/<code>``."""

    status: int
    title: str
    explanation: str


KINDS: dict[str, Kind] = {
    "invalid_request": Kind(
        422,
        "The request is not valid",
        "The body contradicts itself or the rules. `errors` lists at most 20 findings, each with the JSON pointer of "
        "its `field`, a stable `code` and a `reason`; `errors_total` counts them all.",
    ),
    "unknown_method": Kind(
        404, "There is no such method", "No method has the id asked for; `known` lists the ids, `/v1/methods` the rows."
    ),
    "unsupported": Kind(
        422,
        "The method does not honour what was asked",
        "Nothing that is asked is ignored: `what` names what the `method` does not honour, `alternatives` the methods "
        "that honour it.",
    ),
    "infeasible": Kind(
        422,
        "Nothing of this kind keeps what was asked",
        "No trajectory of the method's kind keeps what was asked. `quantity`, `joint`, `segment` and `time` say where "
        "it fails, `needed` the smallest value of the `bound` that would do, `certified` whether this was proved.",
    ),
    "unreachable": Kind(
        422,
        "A target is out of the robot's reach",
        "No joint position puts the tip there; `index`, `distance` and `interval` say which target and how far off.",
    ),
    "singular": Kind(
        422,
        "The motion passes a singularity",
        "The joint rates would be unbounded at `time`; `smallest_singular_value` says how close it gets.",
    ),
    "not_found": Kind(
        404, "There is nothing here", "No resource has this path; `/openapi.json` lists those there are."
    ),
    "method_not_allowed": Kind(
        405, "The resource does not take this verb", "The header `Allow` names the verbs that the path takes."
    ),
    "not_acceptable": Kind(
        406,
        "No format that was asked for is available",
        "The header `Accept` names only formats that this answer does not come in; `available` lists those it does.",
    ),
    "conflict": Kind(409, "The request conflicts with an earlier one", "The same key was used with another body."),
    "too_large": Kind(
        413,
        "The request or its answer is over a cap",
        "`what` is over its `limit`; `/v1/limits` lists all caps. Decided before anything is allocated.",
    ),
    "unsupported_media_type": Kind(
        415,
        "The body has a type that is not read here",
        "Send one of `available` in the header `Content-Type`, without a content encoding.",
    ),
    "too_slow": Kind(
        408,
        "The body did not come in time",
        "The whole body must be there within `seconds` of the request's beginning; the connection is closed.",
    ),
    "unauthorized": Kind(401, "A key is needed", "Send a valid key in the header `X-API-Key`."),
    "rate_limited": Kind(429, "Too many requests", "Wait as long as the header `Retry-After` says, then try again."),
    "overloaded": Kind(
        503, "The service cannot take this now", "Wait as long as the header `Retry-After` says, then try again."
    ),
    "timeout": Kind(
        504,
        "The time allowed has run out",
        "No answer was found within `seconds`; allow more by `timeout`, or ask for less.",
    ),
    "solver_failed": Kind(
        500,
        "The solver found no acceptable answer",
        "The `backend` gave no answer that passes our own check of its residuals.",
    ),
    "not_verified": Kind(
        500,
        "The answer did not pass verification and is withheld",
        "A bug of ours: `report` holds the certificate that does not hold. Please report it.",
    ),
    "internal": Kind(
        500, "Unexpected failure", "A bug of ours. The service's log has the details under the `request_id`."
    ),
}


class Refusal(Exception):
    """An error that only the service has: its code, a sentence, further fields and headers."""

    def __init__(
        self, code: str, detail: str, data: Mapping[str, Any] | None = None, headers: Mapping[str, str] | None = None
    ) -> None:
        super().__init__(code, detail, data, headers)
        self.code = code
        self.detail = detail
        self.data = dict(data or {})
        self.headers = dict(headers or {})


def problem(
    error: PlannerError | Refusal, instance: str | None = None, request_id: str | None = None
) -> dict[str, Any]:
    """Return the problem document of an error, JSON-ready and under 8 kB."""
    detail, data = (error.detail, error.data) if isinstance(error, Refusal) else (str(error), error.data())
    code = error.code if error.code in KINDS else "internal"
    head = {
        "type": f"/errors/{code}",
        "title": KINDS[code].title,
        "status": KINDS[code].status,
        "detail": detail,
        "instance": instance,
        "request_id": request_id,
    }
    document = {**{k: v for k, v in head.items() if v is not None}, **{k: v for k, v in data.items() if k not in head}}
    for longest, most in _FITS:
        clipped: dict[str, Any] = _clipped(document, longest, most, 0)
        if len(orjson.dumps(clipped)) < LARGEST:
            return clipped
    head_only: dict[str, Any] = _clipped(head, *_FITS[-1], 0)
    return head_only


def _clipped(value: Any, longest: int, most: int, depth: int) -> Any:
    """Return JSON-ready data: strings and lists cut, what is not finite null, what has no JSON form as text."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int):
        return int(value) if -(2**53) < value < 2**53 else _text(value, longest)
    if isinstance(value, float):  # NumPy's too
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Mapping) and depth < 8:
        return {
            _text(k, longest): _clipped(v, longest, most, depth + 1)
            for k, v in list(value.items())[: max(most, len(_HEAD))]
        }
    if isinstance(value, (list, tuple)) and depth < 8:
        return [_clipped(v, longest, most, depth + 1) for v in value[:most]]
    if hasattr(value, "tolist"):  # a NumPy scalar or array
        return _clipped(value.tolist(), longest, most, depth + 1)
    return _text(value, longest)


_HEAD = ("type", "title", "status", "detail", "instance", "request_id")


def _text(value: Any, longest: int) -> str:
    text = str(value)
    text = text if len(text) <= longest else text[: longest - 1] + "…"
    return text.encode("utf-8", "replace").decode()


#: Printable characters only: what is echoed in a header must not break it.
REQUEST_ID = re.compile(r"[\x20-\x7e]{1,128}")

assert set(ERRORS) <= set(KINDS)
