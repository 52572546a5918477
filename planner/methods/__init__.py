"""The method table, in order of presentation. A method is one file here and one row below."""

from ..method import Method
from .bezier import BEZIER
from .bspline import BSPLINE
from .cubic_hermite import CUBIC_HERMITE
from .cubic_spline import CUBIC_SPLINE
from .hermite import HERMITE
from .linear import LINEAR
from .minimum_jerk import MINIMUM_JERK
from .nurbs import NURBS
from .polynomial import POLYNOMIAL
from .quintic_spline import QUINTIC_SPLINE
from .ruckig import RUCKIG
from .septic_spline import SEPTIC_SPLINE
from .time_optimal_nlp import TIME_OPTIMAL_NLP
from .time_optimal_path import TIME_OPTIMAL_PATH
from .time_optimal_waypoints import TIME_OPTIMAL_WAYPOINTS
from .time_scaled import TIME_SCALED
from .toppra import TOPPRA
from .trapezoidal import TRAPEZOIDAL

METHODS: dict[str, Method] = {
    m.id: m
    for m in (
        LINEAR,
        POLYNOMIAL,
        HERMITE,
        CUBIC_HERMITE,
        CUBIC_SPLINE,
        QUINTIC_SPLINE,
        SEPTIC_SPLINE,
        BEZIER,
        BSPLINE,
        NURBS,
        MINIMUM_JERK,
        TRAPEZOIDAL,
        RUCKIG,
        TIME_SCALED,
        TOPPRA,
        TIME_OPTIMAL_PATH,
        TIME_OPTIMAL_WAYPOINTS,
        TIME_OPTIMAL_NLP,
    )
}
