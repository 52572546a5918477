"""Waywright's library: waypoints and limits in, a certified trajectory out.

Names are imported on first use, so that ``import planner`` stays light. No submodule has the name of something exported
here: importing it would put the module in the name's place.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .cases import CASES, Case
    from .catalogue import describe_method, list_methods
    from .certification import Recorded, certify
    from .comparison import Row, compare
    from .errors import (
        ERRORS,
        FieldError,
        Infeasible,
        InvalidRequest,
        NotVerified,
        PlannerError,
        SolverFailed,
        TimeLimit,
        TooLarge,
        UnknownMethod,
        Unsupported,
        rebuild,
    )
    from .limits import Boundary, DurationBounds, Limit, Limits
    from .methods import METHODS
    from .options import MAX_TIME, MAX_VALUE, Options, invalid, pointer
    from .planning import Plan, pick, plan
    from .sampling import Samples, sample, sample_count
    from .trajectory import Trajectory
    from .types import Certificate, Check, Note, Objective, PlanRequest, Sampling
    from .version import __version__

_HOME = {
    "cases": ("CASES", "Case"),
    "catalogue": ("describe_method", "list_methods"),
    "certification": ("Recorded", "certify"),
    "comparison": ("Row", "compare"),
    "errors": (
        "ERRORS",
        "FieldError",
        "Infeasible",
        "InvalidRequest",
        "NotVerified",
        "PlannerError",
        "SolverFailed",
        "TimeLimit",
        "TooLarge",
        "UnknownMethod",
        "Unsupported",
        "rebuild",
    ),
    "limits": ("Boundary", "DurationBounds", "Limit", "Limits"),
    "methods": ("METHODS",),
    "options": ("MAX_TIME", "MAX_VALUE", "Options", "invalid", "pointer"),
    "planning": ("Plan", "pick", "plan"),
    "sampling": ("Samples", "sample", "sample_count"),
    "trajectory": ("Trajectory",),
    "types": ("Certificate", "Check", "Note", "Objective", "PlanRequest", "Sampling"),
    "version": ("__version__",),
}

__all__ = sorted(name for names in _HOME.values() for name in names)


def __getattr__(name: str) -> Any:
    for module, names in _HOME.items():
        if name in names:
            return getattr(import_module(f".{module}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
