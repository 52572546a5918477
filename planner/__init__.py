"""Waywright's library: waypoints and limits in, a certified trajectory out.

Names are imported on first use, so that ``import planner`` stays light. No submodule has the name of something exported
here: importing it would put the module in the name's place.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the same names once more, for type checkers; a test holds both equal
    from .cases import CASES as CASES
    from .cases import Case as Case
    from .catalogue import describe_method as describe_method
    from .catalogue import list_methods as list_methods
    from .certification import Recorded as Recorded
    from .certification import certify as certify
    from .comparison import Row as Row
    from .comparison import compare as compare
    from .compat import from_ruckig as from_ruckig
    from .errors import ERRORS as ERRORS
    from .errors import FieldError as FieldError
    from .errors import Infeasible as Infeasible
    from .errors import InvalidRequest as InvalidRequest
    from .errors import NotVerified as NotVerified
    from .errors import PlannerError as PlannerError
    from .errors import SolverFailed as SolverFailed
    from .errors import TimeLimit as TimeLimit
    from .errors import TooLarge as TooLarge
    from .errors import UnknownMethod as UnknownMethod
    from .errors import Unsupported as Unsupported
    from .errors import rebuild as rebuild
    from .limits import Boundary as Boundary
    from .limits import DurationBounds as DurationBounds
    from .limits import Limit as Limit
    from .limits import Limits as Limits
    from .methods import METHODS as METHODS
    from .options import MAX_TIME as MAX_TIME
    from .options import MAX_VALUE as MAX_VALUE
    from .options import Options as Options
    from .options import invalid as invalid
    from .options import pointer as pointer
    from .planning import Plan as Plan
    from .planning import pick as pick
    from .planning import plan as plan
    from .retiming import retime as retime
    from .sampling import Samples as Samples
    from .sampling import sample as sample
    from .sampling import sample_count as sample_count
    from .sampling import sample_times as sample_times
    from .smoothing.stream import Stream as Stream
    from .trajectory import Trajectory as Trajectory
    from .types import Certificate as Certificate
    from .types import Check as Check
    from .types import Note as Note
    from .types import Objective as Objective
    from .types import PlanRequest as PlanRequest
    from .types import Sampling as Sampling
    from .version import __version__ as __version__

_HOME = {
    "cases": ("CASES", "Case"),
    "catalogue": ("describe_method", "list_methods"),
    "certification": ("Recorded", "certify"),
    "comparison": ("Row", "compare"),
    "compat": ("from_ruckig",),
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
    "retiming": ("retime",),
    "sampling": ("Samples", "sample", "sample_count", "sample_times"),
    "smoothing.stream": ("Stream",),
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
