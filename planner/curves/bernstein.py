"""Bézier curves: de Casteljau, derivatives, subdivision, elevation, and curves composed of several."""

from math import comb
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from ..errors import InvalidRequest
from ..limits import DurationBounds
from ..options import Options
from ..pieces import divided, to_bernstein, trimmed
from ..trajectory import Trajectory
from .newton import ONE_PIECE, TERMS
from .options import Number, clock, refuse_other_span

Array = NDArray[np.float64]

#: Highest degree of one Bézier curve.
MOST_DEGREE = 200
#: By how much joints may miss each other, relative to the range of the points.
JOINED = 1e-9

Joints = Literal["C0", "C1", "C2"]


class BezierOptions(Options):
    """Options of Bézier curves: the waypoints are control points."""

    degree: int | None = Field(
        default=None,
        ge=1,
        le=MOST_DEGREE,
        description="degree of the segments, which share their end points: N = segments × degree + 1 "
        "(default: one curve of degree N - 1)",
    )
    knots: Annotated[list[Number], Field(min_length=2, fail_fast=True)] | None = Field(
        default=None,
        description="where the segments begin and end, s (default: even, on [0, 1] or [0, duration])",
        json_schema_extra={"unit": "s"},
    )
    joints: Joints = Field(
        default="C0", description="the class that the control points must give at the joints, else they are refused"
    )

    @property
    def moves_by_itself(self) -> bool:
        """Whether the clock is the options'."""
        return self.knots is not None

    def check(self, points: Array) -> None:
        """Raise InvalidRequest where the points do not make whole segments."""
        from_options(self, points, None)

    @property
    def control_points(self) -> bool:
        """Whether the waypoints are control points."""
        return True


def de_casteljau(points: ArrayLike, s: float) -> Array:
    """Return the point of the Bézier curve at s in [0, 1]: Q <- (1 - s) Q[:-1] + s Q[1:] until one is left.

    Parameters
    ----------
    points : (n + 1, D)
    """
    q = np.asarray(points, dtype=np.float64)
    while len(q) > 1:
        q = (1.0 - s) * q[:-1] + s * q[1:]
    return np.asarray(q[0])


def bernstein_basis(degree: int, s: ArrayLike) -> Array:
    """Return the weights C(n, i) s^i (1 - s)^(n - i), shape (…, n + 1): none negative, their sum is 1."""
    at = np.asarray(s, dtype=np.float64)[..., None]
    i = np.arange(degree + 1)
    return np.asarray(np.array([float(comb(degree, k)) for k in i]) * at**i * (1.0 - at) ** (degree - i))


def derivative_points(points: ArrayLike) -> Array:
    """Return the control points of the derivative in s, n (P_{i+1} - P_i); one zero point for a constant."""
    p = np.asarray(points, dtype=np.float64)
    return (len(p) - 1) * np.diff(p, axis=0) if len(p) > 1 else np.zeros_like(p)


def subdivided(points: ArrayLike, s: float) -> tuple[Array, Array]:
    """Return the control points of the parts left and right of s."""
    return divided(np.asarray(points, dtype=np.float64), s)


def elevated(points: ArrayLike) -> Array:
    """Return the control points of the same curve, one degree higher: P'_i = i/(n+1) P_{i-1} + (1 - i/(n+1)) P_i."""
    p = np.asarray(points, dtype=np.float64)
    i = (np.arange(len(p) + 1) / len(p))[:, None]
    padded = np.concatenate([p[:1], p, p[-1:]])
    return np.asarray(i * padded[:-1] + (1.0 - i) * padded[1:])


def control_points(curve: Trajectory) -> Array:
    """Return the Bézier control points of every piece of a trajectory, (n + 1, K, D)."""
    return to_bernstein(curve.coefficients)


def bezier(points: ArrayLike, start: float = 0.0, end: float = 1.0) -> Trajectory:
    r"""Return the Bézier curve B(s) = \sum_i C(n, i) s^i (1 - s)^(n - i) P_i, s = (t - start) / (end - start).

    Above degree 5 it is cut into as many pieces as its degree, which keeps the coefficients well conditioned.

    Parameters
    ----------
    points : (n + 1, D)

    Raises
    ------
    InvalidRequest
        ``bad_degree`` above degree 200.

    References
    ----------
    G. Farin, Curves and Surfaces for CAGD, Morgan Kaufmann, 2002, chapters 4 and 5.
    """
    return composite_bezier(np.asarray(points, dtype=np.float64)[:, None, :], [start, end])


def composite_bezier(segments: ArrayLike, breaks: ArrayLike, joints: Joints = "C0") -> Trajectory:
    """Return Bézier segments one after the other.

    C1 at a joint: n (P_n - P_{n-1})_k / h_k = n (P_1 - P_0)_{k+1} / h_{k+1}; C2: the same for
    n (n - 1) (P_n - 2 P_{n-1} + P_{n-2})_k / h_k² and its counterpart.

    Parameters
    ----------
    segments : (n + 1, K, D)
        Control points: number on the segment, segment, joint.
    breaks : (K + 1,), increasing
    joints : str
        The class asked of the joints.

    Raises
    ------
    InvalidRequest
        ``bad_knots``; ``conflict`` where segments do not meet, or not as smoothly as asked; ``bad_degree``.
    """
    p = np.asarray(segments, dtype=np.float64)
    t = np.asarray(breaks, dtype=np.float64)
    if p.ndim != 3 or len(t) != p.shape[1] + 1 or not (np.diff(t) > 0).all():
        raise InvalidRequest.of("/options/knots", "bad_knots", f"needs {p.shape[1] + 1} increasing knots")
    if len(p) - 1 > MOST_DEGREE:
        reason = f"degree {len(p) - 1} is over {MOST_DEGREE}: use bspline, or segments by the option degree"
        raise InvalidRequest.of("/waypoints", "bad_degree", reason)
    _refuse_joints(p, np.diff(t), int(joints[1]))
    return _expanded(p, t)


def _refuse_joints(p: Array, h: Array, smooth: int) -> None:
    """Raise ``conflict`` at the first joint that is not of class C^smooth."""
    span = max(float(np.ptp(p, axis=(0, 1)).max()), 1e-300)
    left, right = p, p
    for order in range(smooth + 1):
        if order:
            left, right = np.diff(left, axis=0), np.diff(right, axis=0)
        if not len(left):
            break
        scale = h[:, None] ** order
        gap = np.abs(left[-1, :-1] / scale[:-1] - right[0, 1:] / scale[1:])
        allowed = JOINED * span / np.minimum(scale[:-1], scale[1:])
        if (gap > allowed).any():
            k, joint = (int(i) for i in np.argwhere(gap > allowed)[0])
            what = ("the position", "the velocity", "the acceleration")[order]
            reason = f"{what} of joint {joint} jumps between segments {k} and {k + 1}: they are not joined C{smooth}"
            raise InvalidRequest.of("/waypoints", "conflict", reason)


def _expanded(p: Array, t: Array) -> Trajectory:
    """Return the monomial pieces: each segment as a whole, or cut into as many parts as its degree."""
    n = len(p) - 1
    if n <= ONE_PIECE:
        return Trajectory.from_bernstein(t, p)
    a, terms = np.arange(n) / n, min(n, TERMS)
    rows, differences = [], p
    for k in range(
        terms + 1
    ):  # the Taylor coefficients at the left end of each part, C(n, k) / n^k times a Bézier curve
        basis = bernstein_basis(n - k, a)
        rows.append(np.tensordot(basis, differences, axes=1) * comb(n, k) / float(n) ** k)
        differences = np.diff(differences, axis=0)
    coefficients = np.stack(rows[::-1]).transpose(0, 2, 1, 3).reshape(terms + 1, -1, p.shape[2])
    breaks = np.append((t[:-1, None] + np.diff(t)[:, None] * a).reshape(-1), t[-1])
    return Trajectory(breaks, trimmed(coefficients))


def from_options(options: BezierOptions, points: Array, duration: DurationBounds | None) -> Trajectory:
    """Return the curve that the options describe, over its knots or the duration.

    Raises
    ------
    InvalidRequest
        ``bad_degree`` where the points do not make whole segments; as ``composite_bezier``.
    """
    count = len(points)
    degree = count - 1 if options.degree is None else options.degree
    segments, rest = divmod(count - 1, degree)
    if rest or not segments:
        reason = f"segments of degree {degree} need a multiple of {degree} waypoints, plus one; there are {count}"
        raise InvalidRequest.of("/options/degree", "bad_degree", reason)
    even = np.linspace(0.0, clock(duration), segments + 1)
    each = np.arange(segments) * degree + np.arange(degree + 1)[:, None]
    curve = composite_bezier(points[each], even if options.knots is None else options.knots, options.joints)
    refuse_other_span(curve, duration)
    return curve
