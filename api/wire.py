"""What the synchronous and the asynchronous client share: requests to send, answers read, waits. Sends nothing."""

import email.utils
import math
import time
import urllib.parse
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import orjson

from planner import InvalidRequest, PlannerError, Samples, Trajectory, pointer, rebuild

from .result import Result, read_polynomial, read_samples

_HEAD = ("type", "title", "status", "detail", "instance", "request_id")

#: What may be tried again, and the first wait in s where the answer names none.
RETRIED = (429, 503)
FIRST_WAIT = 0.2


@dataclass(frozen=True)
class Call:
    """A request to be sent: verb, path and body."""

    verb: str
    path: str
    body: bytes | None = None

    @property
    def headers(self) -> dict[str, str]:
        """Headers that belong to the body."""
        return {} if self.body is None else {"Content-Type": "application/json"}


def plan_call(waypoints: Any, given: Mapping[str, Any], include: Sequence[str]) -> Call:
    """Return the call that plans."""
    return Call("POST", "/v1/trajectories", _body({"waypoints": waypoints, **given, "include": list(include)}))


def compare_call(waypoints: Any, methods: Any, given: Mapping[str, Any], include: Sequence[str]) -> Call:
    """Return the call that compares; a method is an id, a pair (id, options) or the contract's object."""
    entries = methods if isinstance(methods, str) else [_entry(m) for m in methods]
    body = {"waypoints": waypoints, **given, "methods": entries, "include": list(include)}
    return Call("POST", "/v1/comparisons", _body(body))


def certify_call(trajectory: Any, given: Mapping[str, Any]) -> Call:
    """Return the call that certifies a trajectory, a plan's result, samples or the contract's object."""
    return Call("POST", "/v1/certificates", _body({"trajectory": _trajectory(trajectory), **given}))


def retime_call(trajectory: Any, given: Mapping[str, Any], include: Sequence[str]) -> Call:
    """Return the call that retimes a trajectory, a plan's result, samples or the contract's object."""
    body = {"trajectory": _trajectory(trajectory), **given, "include": list(include)}
    return Call("POST", "/v1/retimings", _body(body))


def methods_call(name: str | None) -> Call:
    """Return the call that lists the methods or describes one."""
    return Call("GET", "/v1/methods" if name is None else f"/v1/methods/{urllib.parse.quote(name, safe='')}")


def _entry(method: Any) -> Any:
    if isinstance(method, (str, Mapping)):
        return method
    name, options = method
    return {"method": name, "options": options}


def _trajectory(value: Any) -> Any:
    if isinstance(value, Result):
        value = value.samples if value.polynomial is None else value.polynomial
    if isinstance(value, Trajectory):
        pieces = {"breaks": value.breaks, "coefficients": value.powers(), "weights": value.weight_powers()}
        return {"polynomial": {k: v for k, v in pieces.items() if v is not None}}
    if isinstance(value, Samples):
        return {"samples": {name: getattr(value, name) for name in ("time", "position", "velocity", "acceleration")}}
    return value


def _body(tree: Mapping[str, Any]) -> bytes:
    return orjson.dumps(_plain({k: v for k, v in tree.items() if v is not None}, ()))


def _plain(value: Any, where: tuple[Any, ...]) -> Any:
    """Return JSON-ready data, NumPy arrays as lists; JSON has no NaN, so it is refused here, where it has a name."""
    if isinstance(value, Mapping):
        return {str(k): _plain(v, (*where, k)) for k, v in value.items()}
    if isinstance(value, (np.ndarray, np.generic)):
        if value.dtype.kind == "f" and not np.isfinite(value).all():
            at = tuple(int(i) for i in np.argwhere(~np.isfinite(np.atleast_1d(value)))[0]) if np.ndim(value) else ()
            raise InvalidRequest.of(pointer(where + at), "not_finite", "must be finite; null stands for unlimited")
        return _plain(value.tolist(), where) if value.dtype.kind == "O" else value.tolist()
    if isinstance(value, float) and not math.isfinite(value):
        raise InvalidRequest.of(pointer(where), "not_finite", "must be finite; null stands for unlimited")
    if isinstance(value, Iterable) and not isinstance(value, (str, bytes)):
        return [_plain(v, (*where, i)) for i, v in enumerate(value)]
    return value


def read_answer(status: int, content: bytes) -> Any:
    """Return the JSON of an answer.

    Raises
    ------
    PlannerError
        The error that the service met, rebuilt from its problem document.
    """
    try:
        tree = orjson.loads(content)
    except orjson.JSONDecodeError:
        raise PlannerError(f"the answer (status {status}) is not JSON") from None
    if status < 400:
        return tree
    raise problem_error(tree if isinstance(tree, dict) else {}, status)


def problem_error(document: Mapping[str, Any], status: int | None = None) -> PlannerError:
    """Return the library's error that a problem document tells of; a plain ``PlannerError`` where it has none."""
    code = str(document.get("type", "")).rpartition("/")[2]
    detail = str(document.get("detail") or document.get("title") or f"the service answered with status {status}")
    data = {k: v for k, v in document.items() if k not in _HEAD}
    try:
        return rebuild(code, detail, data)
    except (TypeError, KeyError, AttributeError):  # fields of a version that is not this one
        return PlannerError(detail)


def read_rows(tree: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the rows of a comparison, samples as arrays and polynomials as trajectories."""
    readers = {"samples": read_samples, "polynomial": read_polynomial}
    return [{k: readers[k](v) if k in readers else v for k, v in row.items()} for row in tree["rows"]]


def wait_before_retry(status: int, headers: Mapping[str, str], attempt: int, remaining: float) -> float | None:
    """Return how long to wait before the next attempt, in s; None if there is to be none.

    Parameters
    ----------
    attempt : int
        How many were made before the one that was answered with ``status``.
    remaining : float
        Seconds left of the caller's patience.
    """
    if status not in RETRIED:
        return None
    wait = _retry_after(headers.get("retry-after"))
    wait = FIRST_WAIT * 2.0 ** min(attempt, 10) if wait is None else max(wait, 0.05)
    return wait if wait < remaining else None


def _retry_after(value: str | None) -> float | None:
    """Return the seconds that a ``Retry-After`` header asks for: a number, or a date."""
    if value is None:
        return None
    try:
        seconds = float(value)
    except ValueError:
        try:
            seconds = email.utils.parsedate_to_datetime(value).timestamp() - time.time()
        except ValueError:
            return None
    return max(seconds, 0.0) if math.isfinite(seconds) else None
