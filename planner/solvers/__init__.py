"""Back ends for the statements of ``problems``: the table, and the rule by which one is picked.

``auto`` tries the rows of the kind in the order of the table, as far as their modules are installed: the next one where
the one before comes to no end. What ran is in the answer's ``solver.name``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from typing import Any

from ..errors import SolverFailed


@dataclass(frozen=True)
class Backend:
    """A solver.

    Name, kinds of problem (``qp``; ``cone``: with second-order cones; ``nlp``), module needed, settings for a tolerance
    and a time limit in s; ``precision`` is how well it keeps rows that are scaled to one, ``most`` the largest number
    of unknowns that it is meant for.
    """

    name: str
    kinds: tuple[str, ...]
    module: str
    settings: Callable[[float, float | None], dict[str, Any]]
    precision: float = 1e-9
    most: float = float("inf")

    @property
    def available(self) -> bool:
        """Whether the module is installed; asked without importing it."""
        return _installed(self.module)


@cache
def _installed(module: str) -> bool:
    return find_spec(module) is not None


def _own(tolerance: float, limit: float | None) -> dict[str, Any]:
    return {}


def _clarabel(tolerance: float, limit: float | None) -> dict[str, Any]:
    names = ("tol_gap_abs", "tol_gap_rel", "tol_feas")
    settings: dict[str, Any] = {"verbose": False, "max_iter": 200, **dict.fromkeys(names, tolerance)}
    return settings if limit is None else {**settings, "time_limit": limit}


def _piqp(tolerance: float, limit: float | None) -> dict[str, Any]:
    return {"eps_abs": tolerance, "eps_rel": tolerance, "max_iter": 500}


def _daqp(tolerance: float, limit: float | None) -> dict[str, Any]:
    settings: dict[str, Any] = {"primal_tol": tolerance, "dual_tol": tolerance, "iter_limit": 20_000}
    return settings if limit is None else {**settings, "time_limit": limit}


def _osqp(tolerance: float, limit: float | None) -> dict[str, Any]:
    settings: dict[str, Any] = {"eps_abs": tolerance, "eps_rel": tolerance, "max_iter": 20_000, "polishing": True}
    return settings if limit is None else {**settings, "time_limit": limit}


def _ipopt(tolerance: float, limit: float | None) -> dict[str, Any]:
    settings: dict[str, Any] = {"tol": tolerance, "max_iter": 1000, "print_level": 0, "sb": "yes"}
    return settings if limit is None else {**settings, "max_wall_time": limit}


BACKENDS: tuple[Backend, ...] = (
    Backend("interior_point", ("qp",), "numba", _own, precision=1e-10),
    Backend("clarabel", ("qp", "cone"), "clarabel", _clarabel),
    Backend("piqp", ("qp",), "piqp", _piqp),
    Backend("daqp", ("qp",), "daqp", _daqp, most=500),
    Backend("osqp", ("qp",), "osqp", _osqp, precision=1e-7),
    Backend("ipopt", ("nlp",), "casadi", _ipopt),
)


def select(kind: str, name: str = "auto") -> tuple[Backend, ...]:
    """Return the back ends to try, in order: the named one alone, or for ``auto`` all that are installed.

    Raises
    ------
    SolverFailed
        None of that kind (and name) is installed.
    """
    found = tuple(b for b in BACKENDS if kind in b.kinds and b.available and name in ("auto", b.name))
    if not found:
        raise SolverFailed(name, f"no back end for {kind} is installed")
    return found
