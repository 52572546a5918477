"""Re-evaluation of lower bounds: a number counts only if it follows again from the evidence handed over."""

from .limits import QUANTITIES
from .trajectory import Trajectory
from .types import Bound, Certificate, Minimised, Objective, Optimality

#: What the words of the method table stand for.
_WORDS = {
    "squared_acceleration": Minimised("squared_acceleration", 2),
    "squared_jerk": Minimised("squared_jerk", 3),
    "squared_snap": Minimised("squared_snap", 4),
    "duration": Minimised("duration", 0, 1.0),
}


#: A bound above the value by no more than this, relatively, is one that limits kept to that allow.
BEYOND = 1e-6


def minimised_by(word: str | None) -> Minimised | None:
    """Return what a method minimises that says no more than its row's word; None if it minimises nothing."""
    return None if word is None else _WORDS.get(word)


def objective(
    minimised: Minimised | None, trajectory: Trajectory, certificate: Certificate, bound: Bound | None
) -> Objective | None:
    """Return what was minimised, its value for the trajectory, and the gap to the bound computed from its evidence.

    gap = value / lower_bound - 1, or value - lower_bound where the bound is 0. None where nothing was minimised, or
    the value is unbounded: a jump below the order integrated.
    """
    if minimised is None:
        return None
    value = minimised.time_weight * trajectory.duration
    if minimised.order > 0:
        if not _integrable(certificate, minimised.order):
            return None
        known = certificate.cost.get("squared_jerk") if minimised.order == 3 else None
        value += trajectory.squared_integral(minimised.order) if known is None else known
    kkt = dict(bound.evidence.residuals()) if bound is not None and isinstance(bound.evidence, Optimality) else None
    low = None if bound is None else bound.evidence.lower_bound()
    if bound is None or low is None or not low <= value * (1.0 + BEYOND):  # one above the value is disproved by it
        return Objective(minimised.name, value, None, None, None, kkt)
    low = min(low, value)  # above by no more than what limits are kept to
    gap = value / low - 1.0 if low > 0 else value - low
    return Objective(minimised.name, value, low, gap, bound.scope, kkt)


def _integrable(certificate: Certificate, order: int) -> bool:
    """Return whether the derivative of that order is bounded, as far as the certificate tells."""
    highest = min(order, len(QUANTITIES) - 1)
    bounded = None not in certificate.peaks[QUANTITIES[highest]]
    return bounded and (order == highest or certificate.continuity is None or certificate.continuity >= order - 1)
