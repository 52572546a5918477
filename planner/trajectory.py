"""The one trajectory type: piecewise polynomial (or rational) vectors, exact from every method to the answer."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import pieces as arithmetic
from .errors import InvalidRequest
from .rational import derivative as rational_derivative
from .rational import enclosures, positive, quotient, squared_integral

Array = NDArray[np.float64]

#: Shortest piece whose derivatives stay in the range of floating point.
SHORTEST = 1e-75


@dataclass(frozen=True, eq=False)
class Extrema:
    """Exact extrema of a trajectory's pieces; each array has shape (orders, K, D).

    ``low[m, i, d]`` is the smallest value of the m-th derivative of joint d on piece i, taken at time ``at_low``.
    Those of rational pieces are bounds that no value passes; over all pieces they are tight to 1e-10.
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
    With ``weights`` the pieces are rational: that sum divided by \sum_k weights[k, i] u^(n-k).

    Parameters
    ----------
    breaks : array (K + 1,)
        Increasing times in s (for paths: parameter values). A single break pair may be equal: a hold without duration.
    coefficients : array (n + 1, K, D)
    weights : array (n + 1, K), optional
        The denominator, > 0 on every piece.

    Raises
    ------
    InvalidRequest
        Shapes that do not fit, breaks that do not increase, numbers that are not finite, or (``bad_weights``) a
        denominator that is not positive everywhere.
    """

    breaks: Array
    coefficients: Array
    weights: Array | None = None

    def __post_init__(self) -> None:
        breaks, coefficients = arithmetic.owned(self.breaks), arithmetic.owned(self.coefficients)
        if breaks.ndim != 1 or coefficients.ndim != 3 or coefficients.shape[1] != len(breaks) - 1 or len(breaks) < 2:
            raise InvalidRequest.of("", "shape_mismatch", "expected K + 1 breaks and coefficients (n + 1, K, D)")
        if not (arithmetic.finite(breaks) and arithmetic.finite(coefficients)):
            raise InvalidRequest.of("", "not_finite", "a trajectory's breaks and coefficients must be finite")
        still = len(breaks) == 2 and breaks[0] == breaks[1] and len(coefficients) == 1
        if not still and not (breaks[1:] - breaks[:-1]).min() > SHORTEST:
            raise InvalidRequest.of(
                "", "not_increasing", f"a trajectory's breaks must increase, by {SHORTEST:g} or more"
            )
        if self.weights is not None:
            weights = arithmetic.owned(self.weights)
            if weights.shape != coefficients.shape[:2]:
                raise InvalidRequest.of("", "shape_mismatch", "expected weights (n + 1, K), as the coefficients")
            if not (np.isfinite(weights).all() and positive(arithmetic.to_bernstein(weights))):
                raise InvalidRequest.of("", "bad_weights", "the denominator must be positive on every piece")
            object.__setattr__(self, "weights", arithmetic.frozen(weights))
        object.__setattr__(self, "breaks", arithmetic.frozen(breaks))
        object.__setattr__(self, "coefficients", arithmetic.frozen(coefficients))

    # -- making ------------------------------------------------------------------------------------------------------

    @classmethod
    def hold(cls, position: ArrayLike, start: float, end: float) -> "Trajectory":
        """Return the trajectory that stays at ``position`` (D,) from ``start`` to ``end`` (which may be equal)."""
        return cls(np.array([start, end]), np.asarray(position, dtype=np.float64)[None, None, :])

    @classmethod
    def from_powers(cls, breaks: ArrayLike, powers: ArrayLike, weights: ArrayLike | None = None) -> "Trajectory":
        """Return the trajectory with ``powers[k, i, d]`` = coefficient of (t - breaks[i])^k, lowest power first.

        ``weights[k, i]`` are those of the denominator, if there is one.
        """
        breaks, powers = np.asarray(breaks, dtype=np.float64), np.asarray(powers, dtype=np.float64)
        if powers.ndim != 3 or powers.shape[1] != len(breaks) - 1:
            raise InvalidRequest.of("", "shape_mismatch", "coefficients must be indexed [power][piece][joint]")
        scale = np.diff(breaks) ** np.arange(len(powers))[:, None]
        scaled = np.asarray(powers * scale[:, :, None], dtype=np.float64)[::-1]
        below = None if weights is None else np.asarray(weights, dtype=np.float64)
        if below is not None and below.shape == scale.shape:  # other shapes are refused with the rest
            below = (below * scale)[::-1]
        return cls(breaks, scaled, below)

    @classmethod
    def from_bernstein(cls, breaks: ArrayLike, points: ArrayLike) -> "Trajectory":
        """Return the trajectory whose pieces have the Bézier control points ``points[k, i, d]``, (n + 1, K, D)."""
        control = np.asarray(points, dtype=np.float64)
        return cls(np.asarray(breaks, dtype=np.float64), arithmetic.from_bernstein(control))

    @classmethod
    def from_hermite(cls, breaks: ArrayLike, *derivatives: ArrayLike) -> "Trajectory":
        """Return the spline with the given values and derivatives at its breaks, each (N, D).

        Position alone gives lines, with velocity cubics, with acceleration quintics, with jerk septics; neighbours
        share the values, so the result is of class C0, C1, C2, C3.
        """
        at = [np.ascontiguousarray(x, dtype=np.float64) for x in derivatives]
        states = np.stack(at[1:]) if len(at) > 1 else np.empty((0, *at[0].shape))
        return cls.from_states(np.asarray(breaks, dtype=np.float64), at[0], states)

    @classmethod
    def from_states(cls, breaks: Array, points: Array, states: Array) -> "Trajectory":
        """Return the same from points (N, D) and the derivatives in one array (k - 1, N, D), C-contiguous."""
        from .kernels.hermite import hermite_pieces

        out = np.empty((2 * len(states) + 2, len(breaks) - 1, points.shape[1]))
        hermite_pieces(breaks[1:] - breaks[:-1], points, states, out)
        return cls(breaks, arithmetic.frozen(out))

    @classmethod
    def concatenate(cls, parts: Sequence["Trajectory"]) -> "Trajectory":
        """Return the parts one after the other; each starts where, in time, the one before it ends."""
        if not parts or len({p.dims for p in parts}) > 1:
            raise InvalidRequest.of("parts", "shape_mismatch", "needs at least one part, all of the same joints")
        gaps = np.array([b.start - a.end for a, b in zip(parts[:-1], parts[1:], strict=True)])
        if (np.abs(gaps) > 1e-12 * max(abs(parts[-1].end), 1.0)).any():
            raise InvalidRequest.of("parts", "not_increasing", "each part must start when the one before it ends")
        degree = max(p.degree for p in parts)
        breaks = np.concatenate([parts[0].breaks[:1]] + [p.breaks[1:] for p in parts])
        whole = np.concatenate([arithmetic.raised(p._homogeneous, degree) for p in parts], axis=1)
        return cls(breaks, whole[..., :-1], None if all(p.weights is None for p in parts) else whole[..., -1])

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
    def rates(self) -> Array:
        """1 / duration of each piece; 0 for the hold without duration, whose derivatives are zero."""
        h = self.breaks[1:] - self.breaks[:-1]
        return np.asarray(1.0 / h) if h[0] > 0 else np.zeros_like(h)

    @cached_property
    def _homogeneous(self) -> Array:
        """Numerator and denominator as one more joint, (n + 1, K, D + 1)."""
        below = self.weights
        if below is None:
            below = np.zeros(self.coefficients.shape[:2])
            below[-1] = 1.0
        return arithmetic.frozen(np.concatenate([self.coefficients, below[:, :, None]], axis=2))

    @cached_property
    def rational(self) -> bool:
        """Whether there is a denominator other than 1."""
        return self.weights is not None and bool((self.weights[:-1] != 0.0).any() or (self.weights[-1] != 1.0).any())

    def powers(self) -> Array:
        """Return ``[k, i, d]`` = coefficient of (t - breaks[i])^k, lowest power first."""
        scale = self.rates ** np.arange(self.degree + 1)[:, None]
        return np.asarray(self.coefficients[::-1] * scale[:, :, None])

    def weight_powers(self) -> Array | None:
        """Return ``[k, i]`` = the denominator's coefficient of (t - breaks[i])^k, or None."""
        scale = self.rates ** np.arange(self.degree + 1)[:, None]
        return None if self.weights is None else np.asarray(self.weights[::-1] * scale)

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

    def states(self, times: ArrayLike, orders: int = 4, first: int = 0, out: Array | None = None) -> Array:
        """Return the derivatives of order ``first`` … ``first + orders - 1`` at ``times``, shape (orders, …, D).

        ``out`` (orders, M, D), C-contiguous, is filled and returned in place of a new array.

        Raises
        ------
        InvalidRequest
            As for a call.
        """
        from .kernels.evaluation import evaluate

        t = np.asarray(times, dtype=np.float64)
        if t.size and not (t.min() >= self.start and t.max() <= self.end):  # also false for NaN
            raise InvalidRequest.of("times", "out_of_range", f"times must lie in [{self.start!r}, {self.end!r}]")
        shape = (orders, t.size, self.dims)
        if out is not None and (out.shape != shape or out.dtype != np.float64 or not out.flags.c_contiguous):
            raise ValueError(f"out must be a C-contiguous array of float64 of shape {shape}")
        if first < 0:
            raise InvalidRequest.of("order", "out_of_range", "must be at least 0")
        flat = np.ascontiguousarray(t).reshape(-1)
        if not self.rational:
            out = np.empty(shape) if out is None else out
            evaluate(self.breaks, self.coefficients, flat, first, out)
            return out.reshape(orders, *t.shape, self.dims)
        both = np.empty((first + orders, t.size, self.dims + 1))
        evaluate(self.breaks, self._homogeneous, flat, 0, both)
        found = quotient(both[..., :-1], both[..., -1])[first:]
        if out is not None:
            out[...] = found
        return found.reshape(orders, *t.shape, self.dims)

    def derivative(self, order: int = 1) -> "Trajectory":
        """Return the derivative of the given order as a trajectory; (A / W)' = (A' W - A W') / W²."""
        if self.weights is None or order == 0:
            scale = (self.rates**order)[:, None]
            return Trajectory(self.breaks, arithmetic.differentiated(self.coefficients, order) * scale, self.weights)
        top, bottom = rational_derivative(self.coefficients, self.weights, order)
        return Trajectory(self.breaks, top * (self.rates**order)[:, None], bottom)

    def ends(self, order: int) -> tuple[Array, Array]:
        """Return the derivative at the left and at the right end of every piece, each (K, D)."""
        left, right = self.all_ends(order, order + 1)[0]
        return left, right

    def all_ends(self, first: int, last: int) -> Array:
        """Return the derivatives of order first … last - 1 at the left and right ends, (last - first, 2, K, D)."""
        from .kernels.motion import end_states

        if not self.rational:
            return np.asarray(end_states(self.coefficients, self.rates, first, last))
        both = end_states(self._homogeneous, np.ones(self.pieces), 0, last)
        scale = self.rates ** np.arange(first, last)[:, None]
        return quotient(both[..., :-1], both[..., -1])[first:] * scale[:, None, :, None]

    def jumps(self, order: int) -> Array:
        """Return the jumps of a derivative at the interior breaks, shape (K - 1, D)."""
        left, right = self.ends(order)
        return np.asarray(left[1:] - right[:-1])

    def extrema(self, orders: int = 4, group: NDArray[np.int64] | None = None) -> Extrema:
        """Return the exact extrema of the derivatives of order 0 … orders-1, piece by piece.

        Those of rational pieces are tight over the pieces that have the same number in ``group`` (K,).
        """
        from .kernels.extrema import extrema

        scale = self.rates ** np.arange(orders)[:, None]
        h, t = np.diff(self.breaks)[:, None], self.breaks[:-1, None]
        if self.rational:
            low, at_low, high, at_high = enclosures(self._homogeneous, scale, group)
        else:
            low, at_low, high, at_high = extrema(self.coefficients, orders)
            low, high = low * scale[:, :, None], high * scale[:, :, None]
        return Extrema(low, t + at_low * h, high, t + at_high * h)

    def squared_integral(self, order: int) -> float:
        """Return the integral of the squared Euclidean norm of a derivative, exact but for rounding.

        For rational pieces: by quadrature, to about 1e-7.
        """
        if self.rational:
            return squared_integral(self._homogeneous, self.rates, order)
        if order > self.degree:
            return 0.0
        from .kernels.motion import squared_integral as integrate

        return float(integrate(self.coefficients, self.rates, order))

    # -- changing ----------------------------------------------------------------------------------------------------

    def scaled(self, factor: float) -> "Trajectory":
        """Return the trajectory slowed by ``factor`` about its start: the i-th derivative is divided by factor^i."""
        return replace(self, breaks=self.start + (self.breaks - self.start) * factor)

    def shifted(self, offset: float) -> "Trajectory":
        """Return the same trajectory ``offset`` seconds later."""
        return replace(self, breaks=self.breaks + offset)

    def reversed(self) -> "Trajectory":
        """Return the trajectory run backwards over the same span: x(start + end - t)."""
        one = np.ones(self.pieces)
        turned = arithmetic.restricted(self._homogeneous, one, -one)[:, ::-1]
        inner = (self.start + self.end - self.breaks)[-2:0:-1]
        return self._like(np.concatenate([[self.start], inner, [self.end]]), turned)

    def mapped(self, matrix: ArrayLike, offset: ArrayLike = 0.0) -> "Trajectory":
        """Return A x(t) + b for a matrix A (E, D) and an offset b (E,)."""
        a, b = np.asarray(matrix, dtype=np.float64), np.asarray(offset, dtype=np.float64)
        if a.ndim != 2 or a.shape[1] != self.dims or b.shape not in ((), (len(a),)):
            raise InvalidRequest.of("matrix", "shape_mismatch", f"needs E rows of {self.dims} entries and E offsets")
        return replace(self, coefficients=self.coefficients @ a.T + self._homogeneous[:, :, -1:] * b)

    def joints(self, chosen: Sequence[int]) -> "Trajectory":
        """Return the trajectory of some of the joints, in the order named."""
        if not chosen or not all(-self.dims <= k < self.dims for k in chosen):
            raise InvalidRequest.of("joints", "out_of_range", f"must name joints from 0 to {self.dims - 1}")
        return replace(self, coefficients=self.coefficients[:, :, list(chosen)])

    def sliced(self, start: float, end: float) -> "Trajectory":
        """Return the part between two times, on the same clock.

        Raises
        ------
        InvalidRequest
            Not ``self.start <= start < end <= self.end``.
        """
        if not self.start <= start < end <= self.end:
            raise InvalidRequest.of("times", "out_of_range", f"must increase within [{self.start!r}, {self.end!r}]")
        cut = self.split([start, end])
        first, last = (int(np.searchsorted(cut.breaks, t)) for t in (start, end))
        return cut.part(first, last)

    def part(self, first: int, last: int) -> "Trajectory":
        """Return the pieces ``first`` … ``last - 1``."""
        weights = None if self.weights is None else self.weights[:, first:last]
        return Trajectory(self.breaks[first : last + 1], self.coefficients[:, first:last], weights)

    def split(self, times: ArrayLike) -> "Trajectory":
        """Return the same trajectory with further breaks at ``times``; those outside or at a break change nothing."""
        extra = np.asarray(times, dtype=np.float64)
        extra = extra[self.breaks[np.minimum(np.searchsorted(self.breaks, extra), self.pieces)] != extra]
        extra = np.unique(extra[(extra > self.start) & (extra < self.end)])
        if not len(extra):
            return self
        return self._like(*arithmetic.cut(self.breaks, self._homogeneous, extra))

    def compose(self, law: "Trajectory") -> "Trajectory":
        """Return self(law(t)): this path run through by a non-decreasing law s(t), exactly.

        Parameters
        ----------
        law : Trajectory with D = 1
            Its values lie in this path's parameter range; its pieces are split where they cross a break of the path.

        Returns
        -------
        Trajectory of degree n_path * n_law, on the merged breaks.

        Raises
        ------
        InvalidRequest
            ``not_increasing`` where the law falls, ``out_of_range`` where it leaves the path, ``shape_mismatch`` for
            a law that is not one polynomial in time.
        """
        if law.dims != 1 or law.rational:
            raise InvalidRequest.of("law", "shape_mismatch", "a time law has one joint and no weights")
        run = law.breaks, law.coefficients[:, :, 0]
        if self.weights is None:
            return Trajectory(*arithmetic.composed(self.breaks, self.coefficients, *run))
        return self._like(*arithmetic.composed(self.breaks, self._homogeneous, *run))

    def _like(self, breaks: Array, whole: Array) -> "Trajectory":
        """Return a trajectory from coefficients, which hold a denominator where this one has one."""
        return Trajectory(breaks, whole[:, :, : self.dims], None if self.weights is None else whole[:, :, self.dims])
