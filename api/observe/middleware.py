"""What is noted of every request: its metrics, its line in the log, its trace. Outermost, to see all answers."""

import logging
import time
from http import HTTPStatus
from typing import Any

from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ..draft import Draft
from ..engine.engine import Solved
from ..schemas import PlanBody
from ..web import WORK
from . import logs, traces
from .metrics import VERBS, Metrics, method_label

log = logging.getLogger("waywright.api")

#: The status that is noted where the client went away before it got one.
GONE = 499

#: The route of what has none.
NO_ROUTE = "none"


#: Routes that are looked at every few seconds: without a line each, or the log is full of them.
LOOKS = frozenset({"/healthz", "/readyz", "/metrics"})


class Observe:
    """ASGI middleware around everything else.

    Parameters
    ----------
    metrics
        Of the service.
    spans
        Whether FastAPI makes spans, see ``telemetry``.
    """

    def __init__(self, app: ASGIApp, metrics: Metrics, spans: bool = False) -> None:
        self.app = app
        self.metrics = metrics
        self.spans = spans

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass an HTTP request on, and note how it went; anything else untouched."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        began = time.perf_counter()
        metrics = self.metrics
        metrics.in_flight += 1
        state = scope.setdefault("state", {})
        trace = traces.incoming(scope["headers"])
        if self.spans:
            _hide_query(scope)
        status, sent, ended, gone = 0, 0, False, False

        async def receive_noted() -> Message:
            nonlocal gone
            message = await receive()
            if message["type"] == "http.disconnect" and not ended:
                gone = True
            return message

        async def send_noted(message: Message) -> None:
            nonlocal status, sent, ended
            kind = message["type"]
            if kind == "http.response.body":
                sent += len(message.get("body", b""))
                ended = not message.get("more_body", False)
            elif kind == "http.response.start":
                status = message["status"]
                if self.spans:
                    _describe(state)
                if trace is not None:
                    answer = trace.response(_span_id() if self.spans else traces.new_span_id())
                    message["headers"] = [*message.get("headers", ()), (b"traceresponse", answer)]
            await send(message)

        try:
            await self.app(scope, receive_noted, send_noted)
        finally:
            metrics.in_flight -= 1
            gone = gone or not status
            _note(metrics, scope, state, trace, status or GONE, sent, gone, time.perf_counter() - began)


def _note(
    metrics: Metrics,
    scope: Scope,
    state: dict[str, Any],
    trace: traces.Trace | None,
    status: int,
    sent: int,
    gone: bool,
    seconds: float,
) -> None:
    """Count a request and write its line."""
    route = route_of(scope)
    verb = scope["method"] if scope["method"] in VERBS else "other"
    metrics.answered(route, verb, status, seconds)
    solved: Solved | None = state.get("solved")
    problem = state.get("problem")
    code = None if problem is None else problem["type"].rpartition("/")[2]
    if solved is not None:
        metrics.solved(method_of(state), code or "solved", worked(state), solved.queued)
        trail = getattr(solved.outcome, "trace", None)
        if trail is not None:  # a bug of ours, in a solver or here
            log.error("a request failed", extra={"request_id": state.get("request_id"), "trace": trail})
    if code == "rate_limited":
        metrics.shed(code)
    elif code == "overloaded" and problem is not None and "reason" in problem:  # not the answer of /readyz
        metrics.shed(str(problem["reason"]))
    if logs.is_on() and (route not in LOOKS or status == HTTPStatus.INTERNAL_SERVER_ERROR):
        level = "info" if status < 500 else "error" if status == HTTPStatus.INTERNAL_SERVER_ERROR else "warning"
        logs.request_line(level, _line(state, trace, route, verb, status, code, sent, gone, seconds))


def _line(
    state: dict[str, Any],
    trace: traces.Trace | None,
    route: str,
    verb: str,
    status: int,
    code: str | None,
    sent: int,
    gone: bool,
    seconds: float,
) -> logs.Fields:
    """Return what the log says of a request: nothing that a client wrote but its request id."""
    line: logs.Fields = {"request_id": state.get("request_id")}
    trace_id = trace.trace_id if trace is not None else state.get("trace_id")
    if trace_id is not None:
        line["trace_id"] = trace_id
    line |= {"route": route, "verb": verb, "status": status}
    if code is not None:
        line["problem"] = code
    solved: Solved | None = state.get("solved")
    if solved is not None:
        line["method"] = method_of(state)
        line["n"], line["dof"] = size_of(state)
        line["solve_ms"] = round(1e3 * worked(state), 3)
        line["queue_ms"] = round(1e3 * solved.queued, 3)
    line["total_ms"] = round(1e3 * seconds, 3)
    line["bytes"] = sent
    if state.get("key") is not None:  # its name, see ``access``
        line["key"] = state["key"]
    if gone:
        line["gone"] = True
    return line


def route_of(scope: Scope) -> str:
    """Return the template of the route that a request took, ``none`` if it took none."""
    template = getattr(scope.get("route"), "path_format", None)
    if isinstance(template, str):
        return template
    if scope["path"] in WORK:  # turned away before it was routed
        return str(scope["path"])
    if "endpoint" in scope:  # of a plain route, which leaves no other trace; there are few
        fixed = {r.path for r in scope["app"].routes if isinstance(r, Route) and not r.param_convertors}
        return str(scope["path"]) if scope["path"] in fixed else NO_ROUTE
    return NO_ROUTE


def method_of(state: dict[str, Any]) -> str:
    """Return the method that was planned with, or of a failure the one asked for; empty where it is no id of ours."""
    outcome = state["solved"].outcome
    if isinstance(outcome, Draft):
        return method_label(outcome.method)
    kind, body = state.get("asked", ("", None))
    if kind == "retime":
        return "retiming"
    return method_label(body.method or "auto") if isinstance(body, PlanBody) else ""


def size_of(state: dict[str, Any]) -> tuple[int | None, int | None]:
    """Return waypoints and joints of what was planned or asked; None where neither says."""
    outcome = state["solved"].outcome
    if isinstance(outcome, Draft) and outcome.waypoints:
        return outcome.waypoints, outcome.joints
    points = getattr(state.get("asked", ("", None))[1], "waypoints", None)
    return (len(points), len(points[0])) if points else (None, None)


def worked(state: dict[str, Any]) -> float:
    """Return the seconds of work on a request, those in the queue not counted."""
    found = state.get("worked")
    return float(found) if found is not None else sum(getattr(state["solved"].outcome, "seconds", {}).values())


# -- spans: only where ``telemetry`` found the SDK ---------------------------------------------------------------------


def _hide_query(scope: Scope) -> None:
    """Note the trace's id for the log, and take the query's values out of the span that FastAPI began."""
    from opentelemetry.trace import get_current_span

    span = get_current_span()
    scope["state"]["trace_id"] = f"{span.get_span_context().trace_id:032x}"
    if scope.get("query_string"):
        span.set_attribute("url.query", "REDACTED")


def _describe(state: dict[str, Any]) -> None:
    """Say in the span what was solved; it ends with the answer's last byte."""
    from opentelemetry.trace import get_current_span

    attributes: dict[str, Any] = {"waywright.request_id": state.get("request_id", "")}
    if state.get("problem") is not None:
        attributes["waywright.problem"] = state["problem"]["type"].rpartition("/")[2]
    if state.get("solved") is not None:
        n, dof = size_of(state)
        attributes["waywright.method"] = method_of(state)
        attributes |= {} if n is None or dof is None else {"waywright.n": n, "waywright.dof": dof}
        attributes["waywright.queue_seconds"] = state["solved"].queued
        attributes["waywright.solve_seconds"] = worked(state)
    get_current_span().set_attributes(attributes)


def _span_id() -> str:
    from opentelemetry.trace import get_current_span

    return f"{get_current_span().get_span_context().span_id:016x}"
