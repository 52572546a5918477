"""The one trajectory type: a piecewise polynomial of vectors, exact from every method to the answer."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb, factorial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InvalidRequest

Array = NDArray[np.float64]

#: Shortest piece whose derivatives stay in the range of floating point.
SHORTEST = 1e-75
#: A jump counts above this part of the derivative's peak.
JUMP = 1e-6


@dataclass(frozen=True, eq=False)
class Extrema:
    """Exact extrema of a trajectory's pieces; each array has shape (orders, K, D).

    ``low[m, i, d]`` is the smallest value of the m-th derivative of joint d on piece i, taken at time ``at_low``.
    """

    low: Array
    at_low: Array
    high: Array
    at_high: Array

    def peak(self, order: int) -> Array:
        """Return the largest magnitude of each joint, shape (D,)."""
        sides = np.maximum(np.abs(self.low[order]), np.abs(self.high[order]))
        return np.asarray(sides.max(axis=0))


@dataclass(frozen=True, eq=False)
class Trajectory:
    r"""A piecewise polynomial on ``[breaks[0], breaks[-1]]`` with values in R^D.

    On piece i, with the local variable u = (t - breaks[i]) / (breaks[i+1] - breaks[i]) in [0, 1],
    x(t) = \sum_k coefficients[k, i] u^(n-k): highest power first, as in SciPy's PPoly, but scaled to the unit interval.

    Parameters
    ----------
    breaks : array (K + 1,)
        Increasing times in s (for paths: parameter values). A single break pair may be equal: a hold without duration.
    coefficients : array (n + 1, K, D)

    Raises
    ------
    InvalidRequest
        Shapes that do not fit, breaks that do not increase, or numbers that are not finite.
    """

    breaks: Array
    coefficients: Array

    def __post_init__(self) -> None:
        breaks = np.array(self.breaks, dtype=np.float64)
        coefficients = np.array(self.coefficients, dtype=np.float64, order="C")
        if breaks.ndim != 1 or coefficients.ndim != 3 or coefficients.shape[1] != len(breaks) - 1 or len(breaks) < 2:
            raise InvalidRequest.of("", "shape_mismatch", "expected K + 1 breaks and coefficients (n + 1, K, D)")
        if not (np.isfinite(breaks).all() and np.isfinite(coefficients).all()):
            raise InvalidRequest.of("", "not_finite", "a trajectory's breaks and coefficients must be finite")
        still = len(breaks) == 2 and breaks[0] == breaks[1] and len(coefficients) == 1
        if not still and not (np.diff(breaks) > SHORTEST).all():
            raise InvalidRequest.of(
                "", "not_increasing", f"a trajectory's breaks must increase, by {SHORTEST:g} or more"
            )
        for array in (breaks, coefficients):
            array.setflags(write=False)
        object.__setattr__(self, "breaks", breaks)
        object.__setattr__(self, "coefficients", coefficients)

    # -- making ------------------------------------------------------------------------------------------------------

    @classmethod
    def hold(cls, position: ArrayLike, start: float, end: float) -> "Trajectory":
        """Return the trajectory that stays at ``position`` (D,) from ``start`` to ``end`` (which may be equal)."""
        return cls(np.array([start, end]), np.asarray(position, dtype=np.float64)[None, None, :])

    @classmethod
    def from_powers(cls, breaks: ArrayLike, powers: ArrayLike) -> "Trajectory":
        """Return the trajectory with ``powers[k, i, d]`` = coefficient of (t - breaks[i])^k, lowest power first."""
        breaks = np.asarray(breaks, dtype=np.float64)
        powers = np.asarray(powers, dtype=np.float64)
        if powers.ndim != 3 or powers.shape[1] != len(breaks) - 1:
            raise InvalidRequest.of("", "shape_mismatch", "coefficients must be indexed [power][piece][joint]")
        scale = np.diff(breaks) ** np.arange(len(powers))[:, None]
        return cls(breaks, np.asarray(powers * scale[:, :, None], dtype=np.float64)[::-1])

    @classmethod
    def from_hermite(cls, breaks: ArrayLike, *derivatives: ArrayLike) -> "Trajectory":
        """Return the spline with the given values and derivatives at its breaks, each (N, D).

        Position alone gives lines, with velocity cubics, with acceleration too quintics; neighbours share the values,
        so the result is of class C0, C1, C2.
        """
        breaks = np.asarray(breaks, dtype=np.float64)
        h = np.diff(breaks)[:, None]
        at = [np.asarray(x, dtype=np.float64) for x in derivatives]
        q, delta = at[0][:-1], np.diff(at[0], axis=0)
        if len(at) == 1:
            rows = [delta, q]
        elif len(at) == 2:
            v0, v1 = at[1][:-1] * h, at[1][1:] * h
            rows = [v0 + v1 - 2 * delta, 3 * delta - 2 * v0 - v1, v0, q]
        else:
            v0, v1 = at[1][:-1] * h, at[1][1:] * h
            a0, a1 = at[2][:-1] * h * h / 2, at[2][1:] * h * h / 2
            rows = [
                6 * delta - 3 * (v0 + v1) - a0 + a1,
                -15 * delta + 8 * v0 + 7 * v1 + 3 * a0 - 2 * a1,
                10 * delta - 6 * v0 - 4 * v1 - 3 * a0 + a1,
                a0,
                v0,
                q,
            ]
        return cls(breaks, np.stack(rows))

    @classmethod
    def concatenate(cls, parts: Sequence["Trajectory"]) -> "Trajectory":
        """Return the parts one after the other; each starts where, in time, the one before it ends."""
        degree = max(p.degree for p in parts)
        breaks = np.concatenate([parts[0].breaks[:1]] + [p.breaks[1:] for p in parts])
        return cls(breaks, np.concatenate([_raised(p.coefficients, degree) for p in parts], axis=1))

    # -- shape -------------------------------------------------------------------------------------------------------

    @property
    def start(self) -> float:
        """Time of the first break."""
        return float(self.breaks[0])

    @property
    def end(self) -> float:
        """Time of the last break."""
        return float(self.breaks[-1])

    @property
    def duration(self) -> float:
        """Time from the first to the last break."""
        return float(self.breaks[-1] - self.breaks[0])

    @property
    def degree(self) -> int:
        """Degree of the pieces."""
        return len(self.coefficients) - 1

    @property
    def pieces(self) -> int:
        """Number of pieces, K."""
        return len(self.breaks) - 1

    @property
    def dims(self) -> int:
        """Number of joints, D."""
        return int(self.coefficients.shape[2])

    @cached_property
    def _rate(self) -> Array:
        """1 / duration of each piece; 0 for the hold without duration, whose derivatives are zero."""
        h = np.diff(self.breaks)
        return np.divide(1.0, h, out=np.zeros_like(h), where=h > 0)

    def powers(self) -> Array:
        """Return ``[k, i, d]`` = coefficient of (t - breaks[i])^k, lowest power first."""
        scale = self._rate ** np.arange(self.degree + 1)[:, None]
        return np.asarray(self.coefficients[::-1] * scale[:, :, None])

    # -- evaluation --------------------------------------------------------------------------------------------------

    def __call__(self, times: ArrayLike, order: int = 0) -> Array:
        """Return the derivative of the given order at ``times``: (D,) for a scalar, (M, D) for M times.

        At a jump the value from the right is given, at the end the one from the left.

        Raises
        ------
        InvalidRequest
            A time is outside the trajectory (``out_of_range``) or not finite.
        """
        return np.asarray(self.states(times, 1, order)[0])

    def states(self, times: ArrayLike, orders: int = 4, first: int = 0) -> Array:
        """Return the derivatives of order ``first`` … ``first + orders - 1`` at ``times``, shape (orders, …, D).

        Raises
        ------
        InvalidRequest
            As for a call.
        """
        from .kernels.evaluation import evaluate

        t = np.asarray(times, dtype=np.float64)
        if not ((t >= self.start) & (t <= self.end)).all():
            raise InvalidRequest.of("times", "out_of_range", f"times must lie in [{self.start!r}, {self.end!r}]")
        out = np.empty((orders, t.size, self.dims))
        evaluate(self.breaks, self.coefficients, np.ascontiguousarray(t).reshape(-1), first, out)
        return out.reshape(orders, *t.shape, self.dims)

    def derivative(self, order: int = 1) -> "Trajectory":
        """Return the derivative of the given order as a trajectory."""
        scale = (self._rate**order)[:, None]
        return Trajectory(self.breaks, _differentiated(self.coefficients, order) * scale)

    def ends(self, order: int) -> tuple[Array, Array]:
        """Return the derivative at the left and at the right end of every piece, each (K, D)."""
        c = _differentiated(self.coefficients, order)
        scale = (self._rate**order)[:, None]
        return c[-1] * scale, c.sum(axis=0) * scale

    def jumps(self, order: int) -> Array:
        """Return the jumps of a derivative at the interior breaks, shape (K - 1, D)."""
        left, right = self.ends(order)
        return np.asarray(left[1:] - right[:-1])

    def counted_jumps(self, order: int, peak: Array, span: float = 1.0) -> NDArray[np.bool_]:
        """Return which jumps at the interior breaks count as such, shape (K - 1, D).

        Positions: above 1e-6 x ``span``; other derivatives: above 1e-6 of their ``peak`` (D,) and above the rounding
        of values and of the clock.
        """
        if self.pieces == 1:
            return np.zeros((0, self.dims), dtype=bool)
        jumps = np.abs(self.jumps(order))
        if order == 0:
            return np.asarray(jumps > JUMP * span)
        eps, h = np.finfo(float).eps, np.diff(self.breaks)[:, None]
        size = np.abs(self.coefficients[:-1]).max(axis=0, initial=0.0)
        rounding = 64 * eps * size / h**order
        own = np.abs(_differentiated(self.coefficients, order)).sum(axis=0) / h**order
        floor = 1e3 * eps * np.abs(self.coefficients[-1]) / h**order
        noise = (own <= floor).all(axis=0)  # a joint that stands still but for rounding of where it stands
        rounding = np.where(noise, np.maximum(rounding, floor), rounding)
        tick = eps * np.abs(
            self.breaks[1:-1, None]
        )  # what the clock cannot tell moves the break, and scales the pieces
        here, next_ = (np.maximum(*(np.abs(e) for e in (x[1:], y[:-1]))) for x, y in map(self.ends, (order, order + 1)))
        clock = tick * next_ + order * tick / np.minimum(h[1:], h[:-1]) * here
        allowed = np.maximum(rounding[1:], rounding[:-1]) + np.minimum(clock, 1e-2 * peak)
        return np.asarray(jumps > JUMP * peak + allowed)

    def extrema(self, orders: int = 4) -> Extrema:
        """Return the exact extrema of the derivatives of order 0 … orders-1, piece by piece."""
        from .kernels.extrema import extrema

        low, at_low, high, at_high = extrema(self.coefficients, orders)
        scale = (self._rate ** np.arange(orders)[:, None])[:, :, None]
        h, t = np.diff(self.breaks)[:, None], self.breaks[:-1, None]
        return Extrema(low * scale, t + at_low * h, high * scale, t + at_high * h)

    def squared_integral(self, order: int) -> float:
        """Return the integral of the squared Euclidean norm of a derivative, exact but for rounding."""
        if order > self.degree:
            return 0.0
        c = _differentiated(self.coefficients, order)
        power = np.arange(len(c) - 1, -1, -1)
        gram = 1.0 / (power[:, None] + power[None, :] + 1.0)
        pieces = np.einsum("kid,kl,lid->i", c, gram, c)
        return float(np.sum(pieces * self._rate ** (2 * order - 1)))

    # -- changing ----------------------------------------------------------------------------------------------------

    def scaled(self, factor: float) -> "Trajectory":
        """Return the trajectory slowed by ``factor`` about its start: the i-th derivative is divided by factor^i."""
        return Trajectory(self.start + (self.breaks - self.start) * factor, self.coefficients)

    def shifted(self, offset: float) -> "Trajectory":
        """Return the same trajectory ``offset`` seconds later."""
        return Trajectory(self.breaks + offset, self.coefficients)

    def split(self, times: ArrayLike) -> "Trajectory":
        """Return the same trajectory with further breaks at ``times``; those outside or at a break change nothing."""
        extra = np.unique(np.asarray(times, dtype=np.float64))
        extra = extra[(extra > self.start) & (extra < self.end)]
        extra = extra[~np.isin(extra, self.breaks)]
        if not len(extra):
            return self
        breaks = np.sort(np.concatenate([self.breaks, extra]))
        piece = np.searchsorted(self.breaks, breaks[:-1], side="right") - 1
        u0 = (breaks[:-1] - self.breaks[piece]) * self._rate[piece]
        width = np.diff(breaks) * self._rate[piece]
        return Trajectory(breaks, _restricted(self.coefficients[:, piece], u0, width))

    def compose(self, law: "Trajectory") -> "Trajectory":
        """Return self(law(t)): this path run through by a non-decreasing law s(t), exactly.

        Parameters
        ----------
        law : Trajectory with D = 1
            Its values lie in this path's parameter range; its pieces are split where they cross a break of the path.

        Returns
        -------
        Trajectory of degree n_path * n_law, on the merged breaks.
        """
        law = law.split(_crossings(law, self.breaks))
        s_left, s_right = law.ends(0)
        middle = 0.5 * (s_left[:, 0] + s_right[:, 0])
        piece = np.clip(np.searchsorted(self.breaks, middle, side="right") - 1, 0, self.pieces - 1)
        w = law.coefficients[:, :, 0] * self._rate[piece]
        w[-1] = (law.coefficients[-1, :, 0] - self.breaks[piece]) * self._rate[piece]
        result = self.coefficients[:1, piece]
        for k in range(1, self.degree + 1):
            result = _product(result, w)
            result[-1] += self.coefficients[k, piece]
        return Trajectory(law.breaks, result)


def _differentiated(c: Array, order: int) -> Array:
    """Return the u-derivative of coefficients, highest power first; at least one (zero) row."""
    n = len(c) - 1
    if order > n:
        return np.zeros_like(c[:1])
    factors = [factorial(k) // factorial(k - order) for k in range(n, order - 1, -1)]
    return np.asarray(c[: n + 1 - order] * np.array(factors, dtype=np.float64)[:, None, None])


def _raised(c: Array, degree: int) -> Array:
    """Return the coefficients with zero rows in front, up to ``degree``."""
    return np.concatenate([np.zeros((degree + 1 - len(c), *c.shape[1:])), c])


def _restricted(c: Array, u0: Array, width: Array) -> Array:
    """Return the coefficients in x of c(u0 + width x), piece by piece."""
    n = len(c) - 1
    low = c[::-1]
    shifted = np.zeros_like(low)
    for k in range(n + 1):  # Taylor shift: the new coefficient k is sum_m C(m, k) u0^(m-k) c_m
        for m in range(k, n + 1):
            shifted[k] += comb(m, k) * (u0 ** (m - k))[:, None] * low[m]
    return np.asarray((shifted * (width ** np.arange(n + 1)[:, None])[:, :, None])[::-1])


def _product(p: Array, w: Array) -> Array:
    """Return the product of vector polynomials p (a, K, D) and scalar ones w (b, K), highest power first."""
    out = np.zeros((len(p) + len(w) - 1, *p.shape[1:]))
    for k in range(len(w)):
        out[k : k + len(p)] += p * w[k][:, None]
    return out


def _crossings(law: Trajectory, values: Array) -> Array:
    """Return the times at which a non-decreasing scalar law passes the values strictly inside its pieces."""
    left, right = (x[:, 0] for x in law.ends(0))
    slack = 1e-13 * max(float(np.abs(values).max()), 1e-300)
    first = np.searchsorted(values, left + slack, side="right")
    last = np.searchsorted(values, right - slack, side="left")
    count = np.maximum(last - first, 0)
    if not count.any():
        return np.empty(0)
    piece = np.repeat(np.arange(law.pieces), count)
    target = np.concatenate([values[a : a + n] for a, n in zip(first, count, strict=True)])
    c = law.coefficients[:, piece, 0]
    lo, hi = np.zeros(len(piece)), np.ones(len(piece))
    for _ in range(60):  # monotone: plain bisection to the last bit
        u = 0.5 * (lo + hi)
        value = c[0]
        for k in range(1, len(c)):
            value = value * u + c[k]
        below = value < target
        lo, hi = np.where(below, u, lo), np.where(below, hi, u)
    h = np.diff(law.breaks)[piece]
    return np.asarray(law.breaks[piece] + 0.5 * (lo + hi) * h)
