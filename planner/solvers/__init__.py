"""Back ends for the statements of ``problems``: the table, and the rule by which one is picked.

``auto`` picks the first row of the kind, in the order of the table, whose module is installed. What ran is in the
answer's ``solver.name``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

from ..errors import SolverFailed


@dataclass(frozen=True)
class Backend:
    """A solver: name, kind of problem, module needed, and settings for a tolerance and a time limit in s."""

    name: str
    kind: str
    module: str
    settings: Callable[[float, float | None], dict[str, Any]]

    @property
    def available(self) -> bool:
        """Whether the module is installed; asked without importing it."""
        return find_spec(self.module) is not None


def _piqp(tolerance: float, limit: float | None) -> dict[str, Any]:
    return {"eps_abs": tolerance, "eps_rel": tolerance, "max_iter": 500}


def _osqp(tolerance: float, limit: float | None) -> dict[str, Any]:
    settings: dict[str, Any] = {"eps_abs": tolerance, "eps_rel": tolerance, "max_iter": 20_000, "polishing": True}
    return settings if limit is None else {**settings, "time_limit": limit}


def _ipopt(tolerance: float, limit: float | None) -> dict[str, Any]:
    settings: dict[str, Any] = {"tol": tolerance, "max_iter": 1000, "print_level": 0, "sb": "yes"}
    return settings if limit is None else {**settings, "max_wall_time": limit}


BACKENDS: tuple[Backend, ...] = (
    Backend("piqp", "qp", "piqp", _piqp),
    Backend("osqp", "qp", "osqp", _osqp),
    Backend("ipopt", "nlp", "casadi", _ipopt),
)


def select(kind: str, name: str = "auto") -> tuple[Backend, ...]:
    """Return the back ends to try, in order: the named one alone, or for ``auto`` all that are installed.

    Raises
    ------
    SolverFailed
        None of that kind (and name) is installed.
    """
    found = tuple(b for b in BACKENDS if b.kind == kind and b.available and name in ("auto", b.name))
    if not found:
        raise SolverFailed(name, f"no back end for {kind} is installed")
    return found
