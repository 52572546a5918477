"""Anyone's trajectory, judged: from the body of a certificate request to the answer."""

from typing import Any

import numpy as np

from planner import MAX_VALUE, InvalidRequest, Recorded, Trajectory, certify

from .reading import refuse_above, refuse_oversize
from .schemas import CertifyBody, PolynomialBody, SamplesBody
from .settings import Caps
from .trees import certificate_tree

#: Highest degree of a caller's polynomial: a quintic path under a jerk-limited law has 15, one polynomial through many
#: waypoints more.
MAX_DEGREE = 63

#: Largest rounding of a polynomial's values that is judged, relative to max(1, the range of its values at the breaks).
NOISE = 1e-7

_POLYNOMIAL = "/trajectory/polynomial"
_SAMPLES = "/trajectory/samples"


def certificate(body: CertifyBody, caps: Caps) -> dict[str, Any]:
    """Return ``{"certificate"}``, also where it does not hold.

    Raises
    ------
    InvalidRequest, TooLarge
    """
    if body.waypoints is not None:
        refuse_oversize(body.waypoints, caps)
        if not body.waypoints:
            raise InvalidRequest.of("/waypoints", "too_few_points", "needs at least one waypoint")
    given = body.model_dump(include={"limits", "waypoints", "times", "start", "end"}, exclude_none=True)
    with np.errstate(all="ignore"):  # what overflows is told as unbounded
        found = certify(_trajectory(body, caps), **given)
    return {"certificate": certificate_tree(found)}


def _trajectory(body: CertifyBody, caps: Caps) -> Trajectory | Recorded:
    polynomial, samples = body.trajectory.polynomial, body.trajectory.samples
    if (polynomial is None) == (samples is None):
        raise InvalidRequest.of("/trajectory", "conflict", "needs exactly one of polynomial and samples")
    if samples is not None:
        return recorded(samples, caps)
    assert polynomial is not None
    return polynomial_of(polynomial, caps)


def recorded(samples: SamplesBody, caps: Caps) -> Recorded:
    """Return samples, checked.

    Raises
    ------
    InvalidRequest, TooLarge
    """
    dims = len(samples.position[0]) if samples.position else 0
    if not dims:
        raise InvalidRequest.of(f"{_SAMPLES}/position", "too_few_points", "needs at least one joint")
    refuse_above(dims, caps.joints, "joints")
    refuse_above(len(samples.position) * dims, caps.samples, "samples x joints")
    return Recorded.of(samples.time, samples.position, samples.velocity, samples.acceleration)


def polynomial_of(polynomial: PolynomialBody, caps: Caps) -> Trajectory:
    """Return a piecewise polynomial, checked.

    Raises
    ------
    InvalidRequest, TooLarge
    """
    where = f"{_POLYNOMIAL}/coefficients"
    refuse_above(len(polynomial.coefficients) - 1, MAX_DEGREE, "polynomial degree")
    pieces = len(polynomial.breaks) - 1
    if pieces < 1:
        raise InvalidRequest.of(f"{_POLYNOMIAL}/breaks", "too_few_points", "needs at least two breaks")
    if not polynomial.coefficients:
        raise InvalidRequest.of(where, "too_few_points", "needs at least one power")
    dims = len(polynomial.coefficients[0][0]) if polynomial.coefficients[0] else 0
    refuse_above(dims, caps.joints, "joints")
    refuse_above(pieces * dims, caps.samples, "pieces x joints")
    for k, power in enumerate(polynomial.coefficients):
        if len(power) != pieces:
            raise InvalidRequest.of(f"{where}/{k}", "shape_mismatch", f"needs {pieces} pieces, has {len(power)}")
        for i, piece in enumerate(power):
            if len(piece) != dims or not dims:
                reason = f"has {len(piece)} joints, the first has {dims}" if dims else "needs at least one joint"
                raise InvalidRequest.of(f"{where}/{k}/{i}", "shape_mismatch", reason)
    steps = np.diff(polynomial.breaks)
    still = pieces == 1 and steps[0] == 0 and len(polynomial.coefficients) == 1
    if not still and not (steps > 0).all():
        i = int(np.argmax(steps <= 0)) + 1
        raise InvalidRequest.of(f"{_POLYNOMIAL}/breaks/{i}", "not_increasing", "must be larger than the break before")
    below = polynomial.weights
    if below is not None and [len(row) for row in below] != [pieces] * len(polynomial.coefficients):
        reason = f"needs {len(polynomial.coefficients)} rows of {pieces} entries, as the coefficients"
        raise InvalidRequest.of(f"{_POLYNOMIAL}/weights", "shape_mismatch", reason)
    try:
        trajectory = Trajectory.from_powers(polynomial.breaks, polynomial.coefficients, below)
    except InvalidRequest as error:
        if error.errors[0].code == "bad_weights":
            raise InvalidRequest.of(f"{_POLYNOMIAL}/weights", "bad_weights", error.errors[0].reason) from None
        raise InvalidRequest.of(where, "out_of_range", f"its values must stay within ±{MAX_VALUE:g}") from None
    if not float(trajectory.extrema(1).peak(0).max()) <= MAX_VALUE:
        raise InvalidRequest.of(where, "out_of_range", f"its values must stay within ±{MAX_VALUE:g}")
    _refuse_cancellation(trajectory, where)
    return trajectory


def _refuse_cancellation(trajectory: Trajectory, where: str) -> None:
    """Refuse coefficients that cancel so strongly that the values are rounding: no verdict on them would mean a thing.

    The constant terms are left out: they are values of the trajectory and cancel nothing.
    """
    sums = np.abs(trajectory.coefficients[:-1]).sum(axis=0)
    if trajectory.weights is not None:
        sums = sums / np.minimum(trajectory.weights[-1], trajectory.weights.sum(axis=0))[:, None]
    noise = np.finfo(float).eps * float(sums.max(initial=0.0))
    at_breaks = np.concatenate(trajectory.ends(0))
    allowed = NOISE * max(1.0, float(np.ptp(at_breaks, axis=0).max()))
    if noise > allowed:
        reason = (
            f"they cancel so strongly that the values are known only to {noise:.1g}, {allowed:.1g} is needed: "
            "use shorter pieces or a lower degree"
        )
        raise InvalidRequest.of(where, "out_of_range", reason)
