"""The method table, in order of presentation. A method is one file here and one row below."""

from ..method import Method
from .cubic_spline import CUBIC_SPLINE
from .linear import LINEAR
from .minimum_jerk import MINIMUM_JERK
from .ruckig import RUCKIG
from .time_optimal_nlp import TIME_OPTIMAL_NLP
from .time_scaled import TIME_SCALED
from .toppra import TOPPRA
from .trapezoidal import TRAPEZOIDAL

METHODS: dict[str, Method] = {
    m.id: m
    for m in (
        LINEAR,
        CUBIC_SPLINE,
        MINIMUM_JERK,
        TRAPEZOIDAL,
        RUCKIG,
        TIME_SCALED,
        TOPPRA,
        TIME_OPTIMAL_NLP,
    )
}
