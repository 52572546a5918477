"""Many methods on one request; a method that refuses is a row like any other."""

import logging
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .errors import PlannerError, SolverFailed
from .methods import METHODS
from .planning import Plan, pick, plan
from .types import PlanRequest


@dataclass(frozen=True, eq=False)
class Row:
    """What one method made of the request: a plan or the error it refused with, and the milliseconds it took."""

    method: str
    plan: Plan | None
    error: PlannerError | None
    compute_ms: float


def compare(request: PlanRequest, methods: str | Sequence[str | tuple[str, Mapping[str, Any]]] = "all") -> list[Row]:
    """Plan the same request with several methods, in the given order (``all``: the catalogue's).

    Raises
    ------
    UnknownMethod
        One of the methods does not exist. All other errors become rows.
    """
    entries = list(METHODS) if methods == "all" else methods
    asked = [(e, {}) if isinstance(e, str) else e for e in entries]
    for name, _ in asked:
        if name != "auto":
            pick(request, name)
    return [_row(request, name, options) for name, options in asked]


def _row(request: PlanRequest, method: str, options: Mapping[str, Any]) -> Row:
    started = time.perf_counter()
    try:
        made: Plan | None = plan(request, method, options)
        error: PlannerError | None = None
    except PlannerError as refusal:
        made, error = None, refusal
    except Exception:  # a bug in one method must not cost the others' rows
        logging.getLogger(__name__).exception("method %s failed unexpectedly", method)
        made, error = None, SolverFailed(method, "failed unexpectedly; this is a bug, please report it")
    elapsed = 1e3 * (time.perf_counter() - started)
    return Row(made.method if made else method, made, error, elapsed)
