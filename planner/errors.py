"""The tree of errors. The library knows no HTTP; the service maps each class to a status in one table.

::

    PlannerError
    ├─ InvalidRequest(errors: field, code, reason)
    ├─ UnknownMethod(name, known)
    ├─ Unsupported(method, what, alternatives)
    ├─ Infeasible(reason, joint, quantity, segment, time, bound, needed, minimum_duration, certified)
    ├─ TooLarge(what, limit, hint)
    ├─ TimeLimit(seconds)
    ├─ SolverFailed(backend, status, residuals)
    └─ NotVerified(report)                                 our bug; the certificate is included

Every error has a stable ``code``, a sentence (``str(error)``) and ``data()``, the JSON-ready fields from which
``rebuild`` makes the same error again on the other side of a wire.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, ClassVar


@dataclass(frozen=True)
class FieldError:
    """What is wrong with one field: its JSON pointer, a stable code and a sentence."""

    field: str
    code: str
    reason: str


class PlannerError(Exception):
    """Base of all errors raised on purpose."""

    code: ClassVar[str]
    title: ClassVar[str]

    def data(self) -> dict[str, Any]:
        """Return the error's JSON-ready fields."""
        return {}


class InvalidRequest(PlannerError):
    """The request contradicts itself or the rules; each finding names its field."""

    code = "invalid_request"
    title = "The request is not valid"
    shown = 20

    def __init__(self, errors: Sequence[FieldError], errors_total: int | None = None) -> None:
        super().__init__(errors, errors_total)
        self.errors = tuple(errors)
        self.errors_total = len(self.errors) if errors_total is None else errors_total

    @classmethod
    def of(cls, field: str, code: str, reason: str) -> "InvalidRequest":
        """Return the error for a single field."""
        return cls([FieldError(field, code, reason)])

    def __str__(self) -> str:
        first = self.errors[0]
        more = f" (and {self.errors_total - 1} more)" if self.errors_total > 1 else ""
        return f"{first.field or 'the request'}: {first.reason}{more}"

    def data(self) -> dict[str, Any]:
        """Return at most ``shown`` findings and how many there were."""
        return {"errors": [asdict(e) for e in self.errors[: self.shown]], "errors_total": self.errors_total}


class UnknownMethod(PlannerError):
    """No method has this id."""

    code = "unknown_method"
    title = "There is no such method"

    def __init__(self, name: str, known: Sequence[str]) -> None:
        super().__init__(name, known)
        self.name = name[:200]
        self.known = tuple(known)

    def __str__(self) -> str:
        return f"there is no method {self.name!r}; known: {', '.join(self.known)}"

    def data(self) -> dict[str, Any]:
        """Return the name asked for and the ids known."""
        return {"name": self.name, "known": list(self.known)}


class Unsupported(PlannerError):
    """The method does not honour something that was asked; the alternatives do."""

    code = "unsupported"
    title = "The method does not honour what was asked"

    def __init__(self, method: str, what: str, alternatives: Sequence[str] = (), reason: str | None = None) -> None:
        super().__init__(method, what, alternatives, reason)
        self.method = method
        self.what = what
        self.alternatives = tuple(alternatives)
        self.reason = reason

    def __str__(self) -> str:
        text = self.reason or f"{self.method} does not honour {self.what}"
        return f"{text}; these do: {', '.join(self.alternatives)}" if self.alternatives else text

    def data(self) -> dict[str, Any]:
        """Return the method, what it does not honour and who does."""
        return {
            "method": self.method,
            "what": self.what,
            "alternatives": list(self.alternatives),
            "reason": self.reason,
        }


class Infeasible(PlannerError):
    """No trajectory of the asked kind keeps what was asked; ``certified`` says that this was proved.

    ``needed`` is the smallest value of the bound that would do, where it is known.
    """

    code = "infeasible"
    title = "Nothing of this kind keeps what was asked"

    def __init__(
        self,
        reason: str,
        *,
        joint: int | None = None,
        quantity: str | None = None,
        segment: int | None = None,
        time: float | None = None,
        bound: float | None = None,
        needed: float | None = None,
        minimum_duration: float | None = None,
        certified: bool = False,
    ) -> None:
        super().__init__(reason)
        self.reason = reason
        self.joint = joint
        self.quantity = quantity
        self.segment = segment
        self.time = time
        self.bound = bound
        self.needed = needed
        self.minimum_duration = minimum_duration
        self.certified = certified

    def __reduce__(self) -> Any:
        data = self.data()
        return (_infeasible, (data.pop("reason"), data))

    def data(self) -> dict[str, Any]:
        """Return where it fails and what would do."""
        return dict(self.__dict__)


def _infeasible(reason: str, data: dict[str, Any]) -> Infeasible:
    return Infeasible(reason, **data)


class TooLarge(PlannerError):
    """The request or its answer is over a cap; decided before anything is allocated."""

    code = "too_large"
    title = "The request or its answer is over a cap"

    def __init__(self, what: str, limit: float, hint: str) -> None:
        super().__init__(what, limit, hint)
        self.what = what
        self.limit = limit
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.what} may be at most {self.limit:,}: {self.hint}"

    def data(self) -> dict[str, Any]:
        """Return what is too large, the cap and what to do."""
        return {"what": self.what, "limit": self.limit, "hint": self.hint}


class TimeLimit(PlannerError):
    """The time that the caller allowed has run out."""

    code = "timeout"
    title = "The time allowed has run out"

    def __init__(self, seconds: float) -> None:
        super().__init__(seconds)
        self.seconds = seconds

    def __str__(self) -> str:
        return f"no answer within the {self.seconds:g} s allowed"

    def data(self) -> dict[str, Any]:
        """Return the time that was allowed."""
        return {"seconds": self.seconds}


class SolverFailed(PlannerError):
    """A back end gave no answer that passes our own residuals."""

    code = "solver_failed"
    title = "The solver found no acceptable answer"

    def __init__(self, backend: str, status: str, residuals: Mapping[str, float] | None = None) -> None:
        super().__init__(backend, status, residuals)
        self.backend = backend
        self.status = status
        self.residuals = dict(residuals or {})

    def __str__(self) -> str:
        return f"{self.backend}: {self.status}"

    def data(self) -> dict[str, Any]:
        """Return the back end, its status and our residuals."""
        return {"backend": self.backend, "status": self.status, "residuals": self.residuals}


class NotVerified(PlannerError):
    """A method's answer did not pass verification and is withheld. This is a bug of ours."""

    code = "not_verified"
    title = "The answer did not pass verification and is withheld"

    def __init__(self, method: str, report: Mapping[str, Any]) -> None:
        super().__init__(method, report)
        self.method = method
        self.report = dict(report)

    def __str__(self) -> str:
        return f"the answer of {self.method} did not pass verification and is withheld; this is a bug, please report it"

    def data(self) -> dict[str, Any]:
        """Return the method and the certificate that does not hold."""
        return {"method": self.method, "report": self.report}


ERRORS: dict[str, type[PlannerError]] = {
    cls.code: cls
    for cls in (
        InvalidRequest,
        UnknownMethod,
        Unsupported,
        Infeasible,
        TooLarge,
        TimeLimit,
        SolverFailed,
        NotVerified,
    )
}


def rebuild(code: str, detail: str, data: Mapping[str, Any]) -> PlannerError:
    """Return the error that ``data()`` came from; a plain ``PlannerError(detail)`` for codes that are not ours."""
    cls = ERRORS.get(code)
    if cls is None:
        return PlannerError(detail)
    if cls is InvalidRequest:
        return InvalidRequest([FieldError(**e) for e in data["errors"]], data.get("errors_total"))
    return cls(**data)
