"""The answers as pydantic models: for the OpenAPI document and the tests; answers are never encoded through them."""

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, RootModel

Rows = list[list[float]]


class Reply(BaseModel):
    """Base of all answers."""

    model_config = ConfigDict(extra="forbid")


class SamplesReply(Reply):
    """Samples, a row each."""

    time: list[float] = Field(description="M times, s")
    position: Rows = Field(description="M×D positions")
    velocity: Rows = Field(description="M×D velocities, unit/s")
    acceleration: Rows = Field(description="M×D accelerations, unit/s²")
    jerk: Rows = Field(description="M×D jerks, unit/s³")


class PolynomialReply(Reply):
    """The trajectory itself: a piecewise polynomial."""

    breaks: list[float] = Field(description="K+1 times, s")
    coefficients: list[Rows] = Field(description="[power][piece][joint], lowest power first, of (t - breaks[piece])")
    weights: Rows | None = Field(None, description="[power][piece] of the denominator, for rational methods")


class CheckReply(Reply):
    """The worst joint, segment and time of one quantity, at the exact extrema; null stands for unbounded."""

    quantity: str = Field(description="What is checked, say velocity, duration or tube")
    joint: int | None = Field(description="The worst joint, from 0")
    segment: int | None = Field(description="The segment it is on, from 0")
    time: float | None = Field(description="When, s")
    value: float | None = Field(description="The value there, signed; for tube and waypoint_tolerance a width >= 0")
    bound: float | None = Field(description="The side of the limit that is nearest or broken")
    ratio: float | None = Field(description="value / bound; for positions |value - middle| / half-width; null without")
    holds: bool = Field(description="Whether the limit is kept, to 1e-6 relative")


class ObjectiveReply(Reply):
    """What the method minimises."""

    name: str = Field(description="Its name")
    value: float = Field(description="Its value for this trajectory")
    lower_bound: float | None = Field(description="No answer within bound_scope can fall below; null: not computed")
    gap: float | None = Field(description="value / lower_bound - 1, or value where the bound is 0")
    bound_scope: str | None = Field(description="all, method or on_grid: the answers for which the bound holds")
    kkt: dict[str, float | None] | None = Field(
        description="Residuals primal, dual and complementarity of the optimality conditions; null: not computed"
    )


class CertificateReply(Reply):
    """What verification found, by code that knows neither the method nor its solver."""

    holds: bool = Field(description="Whether every check holds")
    basis: Literal["exact", "enclosure", "finite_differences"] = Field(description="How values were found")
    checks: list[CheckReply] = Field(description="One row per limited quantity")
    waypoint_error: float | None = Field(description="Largest miss of a waypoint beyond its tolerance, relative")
    boundary_error: float | None = Field(description="Largest miss of a state asked at an end or waypoint, relative")
    continuity: int | None = Field(description="Class C^k; null for one piece")
    path_deviation: float | None = Field(
        description="Largest distance from the path followed, or from the polyline: with a tube, and with a free path "
        "through waypoints (time_optimal_waypoints); of a retiming with a tolerance: of a sample from the path, in any "
        "joint"
    )
    cost: dict[str, float | None] = Field(description="squared_jerk and path_length")
    objective: ObjectiveReply | None = Field(description="null for methods that minimise nothing")


class SolverReply(Reply):
    """What computed the answer."""

    name: str = Field(description="The back end")
    status: str = Field(description="Its own word for how it went")
    iterations: int = Field(description="Iterations taken")


class WarningReply(Reply):
    """Something assumed or repaired on the way."""

    code: str = Field(description="A stable code")
    message: str = Field(description="A sentence")


class PlanReply(Reply):
    """A certified trajectory."""

    method: str = Field(description="The method that made it")
    picked_because: str | None = Field(None, description="Why auto picked the method; only with auto")
    duration: float = Field(description="Duration, s")
    waypoint_times: list[float] | None = Field(description="N times, s; null where waypoints are control points")
    samples: SamplesReply | None = Field(None, description="Where samples are included")
    polynomial: PolynomialReply | None = Field(None, description="Where the polynomial is included")
    certificate: CertificateReply = Field(description="What the trajectory was found to keep")
    solver: SolverReply = Field(description="What computed it")
    warnings: list[WarningReply] = Field(description="What was assumed or repaired")
    digest: str = Field(description="SHA-256 of the canonical request and the version")


class FindingReply(Reply):
    """What is wrong with one field."""

    field: str = Field(description="JSON pointer")
    code: str = Field(description="A stable code")
    reason: str = Field(description="A sentence")


class Problem(BaseModel):
    """A problem document (RFC 9457); further fields depend on the type, see /errors/{code}."""

    model_config = ConfigDict(extra="allow")

    type: str = Field(description="/errors/ and a stable code, which explains itself there")
    title: str = Field(description="What kind of problem this is")
    status: int = Field(description="The HTTP status")
    detail: str = Field(description="What happened this time")
    instance: str | None = Field(None, description="The path that was asked")
    request_id: str | None = Field(None, description="The id in the header X-Request-ID")
    errors: list[FindingReply] | None = Field(None, description="With invalid_request: at most 20 findings")
    errors_total: int | None = Field(None, description="With invalid_request: how many findings there were")


class RowReply(Reply):
    """What one method made of the request."""

    method: str = Field(description="Its id")
    ok: bool = Field(description="Whether it answered")
    duration: float | None = Field(description="Duration, s")
    cost: dict[str, float | None] | None = Field(description="squared_jerk and path_length")
    peaks: dict[str, list[float | None]] | None = Field(description="Largest magnitudes per joint; null: unbounded")
    certificate: CertificateReply | None = Field(description="What its trajectory was found to keep")
    samples: SamplesReply | None = Field(None, description="Where samples are included")
    polynomial: PolynomialReply | None = Field(None, description="Where the polynomial is included")
    error: Problem | None = Field(None, description="Why it refused")
    compute_ms: float = Field(description="Time taken, ms; the one figure that differs from run to run")


class ComparisonReply(Reply):
    """One row per method, in the order asked."""

    rows: list[RowReply] = Field(description="The rows")


class CertifyReply(Reply):
    """What was found about the trajectory that was sent."""

    certificate: CertificateReply = Field(description="holds is false where anything is broken")


class MethodReply(Reply):
    """A row of the catalogue."""

    id: str = Field(description="The id to ask for")
    title: str = Field(description="Its name")
    family: Literal["interpolation", "smoothing", "time_optimal"] = Field(description="The kind of method")
    summary: str = Field(description="What it does")
    formula: str = Field(description="The formula, in LaTeX or plain text")
    reference: dict[str, Any] = Field(description="authors, title, year, where")
    timing: Literal["given", "chosen", "either", "parameter"] = Field(description="Who chooses the waypoints' times")
    requires: list[str] = Field(description="What must be sent")
    honours: list[str] = Field(description="What may be sent")
    continuity: int = Field(description="Class C^k guaranteed; -1: none")
    variants: list[dict[str, Any]] = Field(description="What differs with other options")
    path: Literal["free", "fixed", "approximate"] = Field(description="Whether the geometric path is given")
    objective: str | None = Field(description="What it minimises")
    options: dict[str, Any] = Field(description="JSON schema of its options")


class CaseReply(Reply):
    """A named request."""

    name: str = Field(description="Its name")
    title: str = Field(description="What it is")
    request: dict[str, Any] = Field(description="A body for /v1/trajectories")


class LimitsReply(Reply):
    """The caps on a request."""

    body_bytes: int = Field(description="Bytes of a body")
    waypoints: int = Field(description="Waypoints, N")
    joints: int = Field(description="Joints, D")
    samples: int = Field(description="Samples × D")
    timeout: float = Field(description="Computing time, s")


class VersionReply(Reply):
    """Versions."""

    version: str = Field(description="Of the service")
    python: str = Field(description="Of Python")
    libraries: dict[str, str] = Field(description="Of the libraries that answers depend on")


class StatusReply(Reply):
    """How the service is."""

    status: Literal["ok", "ready"] = Field(description="ok or ready")


class MetricsReply(RootModel[str]):
    """Prometheus' text format, version 0.0.4."""


class ExplanationReply(Reply):
    """What an error code means."""

    code: str = Field(description="The code")
    title: str = Field(description="In short")
    status: int = Field(description="The HTTP status it comes with")
    explanation: str = Field(description="What to make of it")
