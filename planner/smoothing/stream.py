r"""Minimum jerk through waypoints that come one after the other: what is committed stays, and how far off it can be.

The spline through all waypoints so far changes everywhere with every new one, but the change decays geometrically into
the past. A node that is ``window`` behind the newest is given its state for good: the best guess, that of the least
jerk through the waypoints so far with a free end. Neighbouring pieces share these states, so the curve is always of
class C2; nothing that is committed enters the estimates, so errors do not add up.

The difference d of the full spline's states from those committed is found exactly for the last ``window`` of them, with
every append. Older ones are forgotten, with the largest d they had. Since then the full spline can have changed there
only as far as it has changed at the last node f that was committed at that time: by a share of d_f now minus d_f then,
the d measured by the jerk that it takes to make them, \|d\|^2 = d' C^-1 d. With eps the largest of these shares, N the
bound of all d now and n the largest d_f then, N <= forgotten + eps (N + n), which is solved for N.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InvalidRequest
from ..kernels.stream import correct, estimate, influence, measure
from ..pieces import finite
from ..trajectory import Trajectory

Array = NDArray[np.float64]

#: Neighbouring steps of a larger ratio are refused.
UNEVEN = 1e6
#: Rounding errors of both splines, as a share of the largest that a piece's derivatives can be.
ROUNDING = 1e-13


@dataclass(frozen=True, eq=False)
class Stream:
    """A minimum-jerk spline that grows at its end; made by ``begin``, every ``append`` returns a new one.

    It holds at most 2 ``window`` + 1 waypoints, however many there were.

    Attributes
    ----------
    window : int
        How many nodes behind the newest a node is committed.
    count : int
        Number of waypoints so far.
    committed : Trajectory or None
        The pieces committed by the last ``append``; they start where those before ended.
    """

    window: int
    count: int
    committed: Trajectory | None
    _times: Array  # (n,)
    _points: Array  # (n, D)
    _states: Array  # (2, m, D), of the nodes committed, the first of these
    _estimates: Array  # (2, n, D)
    _gains: Array  # (n - 1, 8)
    _spread: Array  # (n, 3)
    _minors: Array  # (5,)
    _most: Array  # (11, D), as by ``measure``: the most there was of some things among the nodes and pieces forgotten
    _share: float  # eps

    @classmethod
    def begin(
        cls,
        time: float,
        point: ArrayLike,
        velocity: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        window: int = 32,
    ) -> "Stream":
        """Return the stream of one waypoint (D,), left with this velocity and acceleration (D,), zero by default.

        Raises
        ------
        InvalidRequest
            ``shape_mismatch``, ``not_finite``, or ``out_of_range`` for a window that is less than 1.
        """
        if window < 1:
            raise InvalidRequest.of("/window", "out_of_range", "must be at least 1")
        x = np.atleast_1d(np.array(point, dtype=np.float64))
        if x.ndim != 1 or not len(x):
            raise InvalidRequest.of("/point", "shape_mismatch", "needs a number for every joint")
        if not (finite(x) and np.isfinite(time)):
            raise InvalidRequest.of("/point", "not_finite", "time and point must be finite")
        state = _state(velocity, acceleration, len(x))
        start = np.array([1.0, 0.0, 0.0, 0.0, 0.0])
        t, gains, spread = np.array([time], dtype=np.float64), np.empty((0, 8)), np.zeros((1, 3))
        return cls(
            window,
            1,
            None,
            t,
            x[None],
            state[:, None],
            state[:, None],
            gains,
            spread,
            start,
            np.zeros((11, len(x))),
            0.0,
        )

    def append(self, times: ArrayLike, points: ArrayLike) -> "Stream":
        """Return the stream with further waypoints: times (M,) and points (M, D), or a time and a point (D,).

        Takes O(window + M) steps.

        Raises
        ------
        InvalidRequest
            ``shape_mismatch``, ``not_finite``, ``not_increasing``, or ``out_of_range`` where neighbouring steps differ
            by a factor of more than 1e6.
        """
        t, x = self._checked(times, points)
        known, minors = len(self._times), self._minors.copy()
        t, x = np.concatenate([self._times, t]), np.concatenate([self._points, x])
        m, gains, spread = np.empty((2, *x.shape)), np.empty((len(t) - 1, 8)), np.empty((len(t), 3))
        m[:, :known], gains[: known - 1], spread[:known] = self._estimates, self._gains, self._spread
        estimate(t, x, known - 1, minors, m, gains, spread)
        done, last = self._states.shape[1], len(t) - 1 - self.window
        states, committed = self._states, None
        if last >= done:
            guess = np.empty_like(m)
            correct(t, x, gains, m, np.zeros((2, x.shape[1])), guess)
            states = np.concatenate([states, guess[:, done : last + 1]], axis=1)
            new = slice(done - 1, last + 1)
            committed = Trajectory.from_states(t[new], x[new], np.ascontiguousarray(states[:, new]))
        count = self.count + len(t) - known
        grown = replace(
            self,
            count=count,
            committed=committed,
            _times=t,
            _points=x,
            _states=states,
            _estimates=m,
            _gains=gains,
            _spread=spread,
            _minors=minors,
        )
        return grown._forgetting(max(last - self.window, 0))

    def tail(self, velocity: ArrayLike | None = None, acceleration: ArrayLike | None = None) -> Trajectory:
        """Return the curve from where all that is committed ends to the newest waypoint.

        It ends with this velocity and acceleration (D,), zero by default; a single waypoint is held.

        Raises
        ------
        InvalidRequest
            ``shape_mismatch`` or ``not_finite``.
        """
        full, done = self._full(velocity, acceleration), self._states.shape[1]
        if self.count == 1:
            return Trajectory.hold(self._points[0], self._times[0], self._times[0])
        full[:, :done] = self._states
        full = np.ascontiguousarray(full[:, done - 1 :])
        return Trajectory.from_states(self._times[done - 1 :], self._points[done - 1 :], full)

    def difference(self, velocity: ArrayLike | None = None, acceleration: ArrayLike | None = None) -> Array:
        """Return a bound on how far the stitched curve is from the spline through all waypoints, (3, D).

        Of position, velocity and acceleration, in the joints' units, at all times; the spline, like the tail, ends
        with the velocity and acceleration given. Rounding errors are included. Infinite if the window is too short.

        Raises
        ------
        InvalidRequest
            As for ``tail``.
        """
        most, full = self._most.copy(), self._full(velocity, acceleration)
        held = len(self._times) - 1
        measure(self._times, self._points, self._estimates, self._states, full, self._spread, held, most)
        moved, size, reach = self._most[:3], most[3:6], self._most[6:9]
        cost, then, share = most[9], self._most[10], self._share
        if not share < 1.0:
            return np.full_like(moved, np.inf)
        later = share * ((cost + share * then) / (1.0 - share) + then)
        return np.asarray(np.maximum(moved + reach * later, most[:3]) + ROUNDING * size)

    def _checked(self, times: ArrayLike, points: ArrayLike) -> tuple[Array, Array]:
        t, x = np.atleast_1d(np.array(times, dtype=np.float64)), np.array(points, dtype=np.float64)
        dims = self._points.shape[1]
        x = x.reshape(1, -1) if np.ndim(times) == 0 else x[:, None] if x.ndim == 1 and dims == 1 else x
        if t.ndim != 1 or not len(t) or x.shape != (len(t), dims):
            reason = f"times {t.shape} and points {x.shape} do not belong together, of {dims} joints"
            raise InvalidRequest.of("/times", "shape_mismatch", reason)
        for name, values in (("/times", t), ("/waypoints", x)):
            if not finite(values):
                raise InvalidRequest.of(name, "not_finite", "must be finite")
        before = self._times[-2:]
        steps = np.diff(np.concatenate([before, t]))
        new = len(before) - 1  # index of the step to the first new time
        if not (steps[new:] > 0).all():
            i = int(np.argmax(steps[new:] <= 0))
            raise InvalidRequest.of(f"/times/{i}", "not_increasing", "must increase, also over the time before")
        ratio = steps[1:] / steps[:-1]
        ratio = np.maximum(ratio, 1.0 / ratio)
        if (ratio > UNEVEN).any():
            i = int(np.argmax(ratio > UNEVEN)) + 1 - new
            reason = f"neighbouring gaps differ by a factor of {ratio.max():.3g}; more than 1e6 cannot be solved safely"
            raise InvalidRequest.of(f"/times/{i}", "out_of_range", reason)
        return t, x

    def _full(self, velocity: ArrayLike | None, acceleration: ArrayLike | None) -> Array:
        """Return the states of the spline through all waypoints, at the nodes held, (2, n, D)."""
        end = _state(velocity, acceleration, self._points.shape[1])
        full = np.empty_like(self._estimates)
        correct(self._times, self._points, self._gains, self._estimates, end - self._estimates[:, -1], full)
        if self.count > 1:
            full[:, -1] = end
        return full

    def _forgetting(self, count: int) -> "Stream":
        """Return the stream that has forgotten its first ``count`` nodes; all their pieces are committed."""
        if not count:
            return self
        last, most = self._states.shape[1] - 1, self._most.copy()
        share, full = np.empty(last + 1), self._full(None, None)
        influence(self._gains, self._spread, last, share)
        measure(self._times, self._points, self._estimates, self._states, full, self._spread, count, most)
        return replace(
            self,
            _times=self._times[count:].copy(),
            _points=self._points[count:].copy(),
            _states=self._states[:, count:].copy(),
            _estimates=self._estimates[:, count:].copy(),
            _gains=self._gains[count:].copy(),
            _spread=self._spread[count:].copy(),
            _most=most,
            _share=max(self._share, float(share[: count + 1].max()) * (1.0 + 1e-9)),
        )


def _state(velocity: ArrayLike | None, acceleration: ArrayLike | None, dims: int) -> Array:
    """Return velocity and acceleration as (2, D), zero where not given."""
    state = np.zeros((2, dims))
    for row, (field, given) in enumerate((("/velocity", velocity), ("/acceleration", acceleration))):
        if given is not None:
            value = np.atleast_1d(np.asarray(given, dtype=np.float64))
            if value.shape != (dims,):
                raise InvalidRequest.of(field, "shape_mismatch", f"needs {dims} numbers, has shape {value.shape}")
            if not finite(value):
                raise InvalidRequest.of(field, "not_finite", "must be finite")
            state[row] = value
    return state
