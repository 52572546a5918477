"""The OpenAPI 3.1 document: one table of operations, and the models of bodies and answers as components."""

from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from planner import CASES

from . import answers as a
from .errors import KINDS
from .formats import FORMATS, offered
from .media import JSON, MARKDOWN, PROBLEM, PROMETHEUS
from .reading import READ
from .ruckig_shape import RuckigBody
from .schemas import CertifyBody, CompareBody, PlanBody, RetimeBody

_POST_ERRORS = (
    "invalid_request",
    "unknown_method",
    "unsupported",
    "infeasible",
    "not_acceptable",
    "too_large",
    "too_slow",
    "unsupported_media_type",
    "overloaded",
    "timeout",
    "solver_failed",
    "not_verified",
)


@dataclass(frozen=True)
class Operation:
    """What the document says about one operation besides its docstring."""

    tag: str
    reply: type[BaseModel]
    many: bool = False
    body: tuple[type[BaseModel], ...] = ()
    formats: tuple[str, ...] = offered(whole=False)
    errors: tuple[str, ...] = ("invalid_request", "not_acceptable")
    parameters: tuple[dict[str, Any], ...] = ()
    example: Any = None
    guard: str = "key"  # what it needs where the service has keys and rates, a name of _GUARDS


def _parameter(name: str, where: str, description: str, **schema: Any) -> dict[str, Any]:
    return {
        "name": name,
        "in": where,
        "required": where == "path",
        "description": description,
        "schema": {"type": "string", **schema},
    }


_EXAMPLE = {**CASES["contract_example"].request, "method": "auto", "options": {}}
_POLYNOMIAL = {"breaks": [0, 1], "coefficients": [[[0]], [[0]], [[3]], [[-2]]]}

OPERATIONS: dict[str, Operation] = {
    "plan": Operation(
        "planning",
        a.PlanReply,
        body=(PlanBody, RuckigBody),
        formats=offered(),
        errors=_POST_ERRORS,
        parameters=(_parameter("shape", "query", "ruckig: the body has the names of InputParameter", enum=["ruckig"]),),
        example=_EXAMPLE,
    ),
    "compare": Operation(
        "planning",
        a.ComparisonReply,
        body=(CompareBody,),
        errors=_POST_ERRORS,
        example={**CASES["two_joint_times"].request, "methods": ["linear", {"method": "minimum_jerk", "options": {}}]},
    ),
    "certify": Operation(
        "planning",
        a.CertifyReply,
        body=(CertifyBody,),
        errors=_POST_ERRORS,
        example={"trajectory": {"polynomial": _POLYNOMIAL}, "limits": {"velocity": 2}},
    ),
    "retime": Operation(
        "planning",
        a.PlanReply,
        body=(RetimeBody,),
        formats=offered(),
        errors=_POST_ERRORS,
        example={
            "trajectory": {"samples": {"time": [0, 1, 2], "position": [[0, 0], [1, 2], [2, 3]]}},
            "limits": {"velocity": 2, "acceleration": 5},
        },
    ),
    "methods": Operation("discovery", a.MethodReply, many=True),
    "method": Operation(
        "discovery",
        a.MethodReply,
        errors=("invalid_request", "unknown_method", "not_acceptable"),
        parameters=(_parameter("id", "path", "The method's id"),),
    ),
    "cases": Operation("discovery", a.CaseReply, many=True),
    "limits": Operation("discovery", a.LimitsReply),
    "version": Operation("discovery", a.VersionReply),
    "healthz": Operation("health", a.StatusReply, formats=(JSON,), errors=("invalid_request",), guard="none"),
    "readyz": Operation(
        "health", a.StatusReply, formats=(JSON,), errors=("invalid_request", "overloaded"), guard="none"
    ),
    "metrics": Operation("health", a.MetricsReply, formats=(PROMETHEUS,), errors=("invalid_request",)),
    "explain": Operation(
        "discovery",
        a.ExplanationReply,
        formats=(*offered(whole=False), MARKDOWN),
        errors=("invalid_request", "not_found", "not_acceptable"),
        parameters=(_parameter("code", "path", "The last part of a problem's type", enum=list(KINDS)),),
        guard="rate",
    ),
}

#: Echoed on every answer.
_ID_HEADER = {"X-Request-ID": {"description": "The id sent, or one made", "schema": {"type": "string"}}}

#: What goes before an operation: which errors it adds where the service has keys and rates.
_GUARDS = {"key": ("unauthorized", "rate_limited"), "rate": ("rate_limited",), "none": ()}

_RETRY = {"Retry-After": {"description": "Seconds to wait", "schema": {"type": "integer", "minimum": 0}}}

#: Further headers of errors.
_HEADERS: dict[int, dict[str, Any]] = {
    401: {"WWW-Authenticate": {"description": "That a key is needed", "schema": {"type": "string"}}},
    429: _RETRY
    | {
        "RateLimit-Policy": {"description": "What is admitted: q requests in w seconds", "schema": {"type": "string"}},
        "RateLimit": {"description": "What is left: r requests for t seconds", "schema": {"type": "string"}},
    },
    503: _RETRY,
}


def operation(name: str) -> dict[str, Any]:
    """Return the arguments of the route's decorator."""
    op = OPERATIONS[name]
    extra: dict[str, Any] = {"parameters": [*op.parameters, _parameter("X-Request-ID", "header", "Echoed")]}
    if op.body:
        refs = [{"$ref": _ref(model)} for model in op.body]
        schema = refs[0] if len(refs) == 1 else {"anyOf": refs}
        content = {media_type: {"schema": schema} for media_type in READ}
        content[JSON]["example"] = op.example
        extra["requestBody"] = {"required": True, "content": content}
    return {
        "operation_id": name,
        "tags": [op.tag],
        "response_model": None,
        "responses": _responses(op),
        "openapi_extra": extra,
    }


def _ref(model: type[BaseModel]) -> str:
    return f"#/components/schemas/{model.__name__}"


def _responses(op: Operation) -> dict[int | str, dict[str, Any]]:
    one: dict[str, Any] = {"$ref": _ref(op.reply)}
    first = op.formats[0]
    content: dict[str, Any] = {first: {"schema": {"type": "array", "items": one} if op.many else one}}
    for media_type in op.formats:
        if media_type != first:
            text = FORMATS[media_type].says if media_type in FORMATS else "The same as text"
            kind = "object" if media_type.endswith("+json") else "string"
            content[media_type] = {"schema": {"type": kind, "description": text}}
    headers: dict[str, Any] = dict(_ID_HEADER)
    if op.body:
        timing = "Times of validate, queue, pose, solve, verify and encode, ms"
        headers["Server-Timing"] = {"description": timing, "schema": {"type": "string"}}
    responses: dict[int | str, dict[str, Any]] = {
        200: {"description": (op.reply.__doc__ or "").splitlines()[0], "content": content, "headers": headers}
    }
    codes = [*op.errors, *_GUARDS[op.guard], "internal"]
    for status in sorted({KINDS[code].status for code in codes}):
        titles = [f"`{code}`: {KINDS[code].title}" for code in codes if KINDS[code].status == status]
        problem = {PROBLEM: {"schema": {"$ref": _ref(a.Problem)}}}
        responses[status] = {
            "description": "; ".join(titles),
            "content": problem,
            "headers": {**_ID_HEADER, **_HEADERS.get(status, {})},
        }
    return responses


def components() -> dict[str, Any]:
    """Return the schemas of all bodies and answers, by name."""
    bodies = {model for op in OPERATIONS.values() for model in op.body}
    replies = {op.reply for op in OPERATIONS.values()} | {a.Problem}
    inputs = [(model, "validation") for model in sorted(bodies | replies, key=lambda m: m.__name__)]
    _, document = models_json_schema(inputs, ref_template="#/components/schemas/{model}")  # type: ignore[arg-type]
    schemas: dict[str, Any] = document["$defs"]
    return schemas


def secured(document: dict[str, Any]) -> None:
    """Write into a document that the operations need a key."""
    scheme = {"type": "apiKey", "in": "header", "name": "X-API-Key", "description": "A key that the operator gave out"}
    document["components"]["securitySchemes"] = {"key": scheme}
    for operations in document["paths"].values():
        for op in operations.values():
            if OPERATIONS[op["operationId"]].guard == "key":
                op["security"] = [{"key": []}]
