"""Re-evaluation of lower bounds: a number counts only if it follows again from the evidence handed over."""

import math

from .types import Bound, Certificate, Objective


def objective(name: str | None, certificate: Certificate, duration: float, bound: Bound | None) -> Objective | None:
    """Return what was minimised, its verified value, and the gap to the lower bound computed from its evidence.

    gap = value / lower_bound - 1, or value - lower_bound where the bound is 0.
    """
    value = None if name is None else duration if name == "duration" else certificate.cost.get(name)
    if name is None or value is None:
        return None
    low = None if bound is None else bound.evidence.lower_bound()
    if bound is None or low is None or not math.isfinite(low):
        return Objective(name, value, None, None, None)
    if abs(value - low) <= 1e-12 * abs(value):  # equal but for rounding
        low = min(low, value)
    gap = value / low - 1.0 if low > 0 else value - low
    return Objective(name, value, low, gap, bound.scope)
