"""Sampling, extrema, verdicts and the making of curves, each by itself, beside the same from SciPy."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy.interpolate import PPoly

from planner import Trajectory
from planner.curves import quintic_spline
from planner.kernels.extrema import extrema
from planner.limits import QUANTITIES, Limits
from planner.types import Demands
from planner.verify import verify
from planner.worst import Worst, measures, peaks, worst

from . import curves
from .figures import JOINTS, ROUNDS, Array, Figure, Task, in_turn, power, random_walk, relative


def measure(quick: bool = False, only: str = "") -> list[Figure]:
    """Return a figure a task; ``only`` those with this in their name."""
    figures = []
    for build in groups(quick):
        tasks = [task for task in build() if only in task.name]
        if quick:  # goals are for the full sizes
            tasks = [replace(task, goal=None) for task in tasks]
        figures += in_turn(tasks, 1 if quick else ROUNDS)
    return figures


def groups(quick: bool = False) -> Iterator[Callable[[], list[Task]]]:
    """Yield what makes the tasks that are measured together; not more than one group need be in memory."""
    samples, pieces = (10**4, 10**3) if quick else (10**6, 10**5)
    sizes = (10**3, 10**4) if quick else (10**3, 10**4, 10**5, 10**6)
    yield partial(_sampling, samples)
    yield partial(_sampling_in_disorder, samples)
    yield partial(_sampling_each_piece, pieces)
    yield partial(_extrema, pieces)
    yield partial(_verdict, pieces)
    yield partial(_certificate, 10**3 if quick else 10**4)
    yield from curves.groups(sizes)


def _piecewise(curve: Trajectory) -> PPoly:
    """Return the same curve as SciPy's type."""
    return PPoly(curve.powers()[::-1], curve.breaks)


def _states(name: str, what: str, curve: Trajectory, times: Array, goal: float | None) -> Task:
    spline, out = _piecewise(curve), np.empty((4, len(times), curve.dims))
    return Task(
        name,
        what,
        len(times),
        ours=lambda: curve.states(times, 4, out=out),
        peer="PPoly, 4 calls",
        theirs=lambda: [spline(times, order) for order in range(4)],
        goal=goal,
        difference=relative,
    )


def _sampling(count: int) -> list[Task]:
    curve = quintic_spline(*random_walk(1001))
    times = np.sort(np.random.default_rng(2).uniform(curve.start, curve.end, count))
    what = f"q, v, a, j of {JOINTS} joints at {power(count)} increasing times, {curve.pieces} quintic pieces"
    beside = _states("sampling", what, curve, times, 8.0)
    out = np.empty((4, count, JOINTS))
    fill = Task(
        "sampling, over filling",
        "the same beside writing zeros to the array: at most 1.3 times as long",
        count,
        ours=lambda: curve.states(times, 4, out=out),
        peer="out.fill(0.0)",
        theirs=lambda: out.fill(0.0),
        goal=1 / 1.3,
    )
    return [beside, fill]


def _sampling_in_disorder(count: int) -> list[Task]:
    curve = quintic_spline(*random_walk(1001))
    times = np.random.default_rng(3).uniform(curve.start, curve.end, count)
    return [_states("sampling at random", f"the same at {power(count)} times in no order", curve, times, None)]


def _sampling_each_piece(count: int) -> list[Task]:
    curve = quintic_spline(*random_walk(count + 1))
    times = curve.breaks[:-1] + np.diff(curve.breaks) * np.random.default_rng(4).uniform(0.0, 1.0, count)
    return [
        _states("sampling every piece", f"the same with one time on each of {power(count)} pieces", curve, times, None)
    ]


def _turning_points(spline: PPoly) -> list[tuple[Array, Array, Array]]:
    """Return, for v, a and j: where the derivative vanishes, the values there, and those at the breaks."""
    found = []
    for order in (1, 2, 3):
        curve = spline.derivative(order)
        roots = curve.derivative().roots(discontinuity=False, extrapolate=False)
        found.append((roots, curve(roots), curve(spline.x)))
    return found


def _extrema(count: int) -> list[Task]:
    curve = quintic_spline(*random_walk(count + 1, 1))
    spline = PPoly(curve.powers()[::-1, :, 0], curve.breaks)

    def difference(lowest: Array, highest: Array, theirs: Any) -> float:
        """Compare piece by piece; by continuity it does not matter on which piece a root at a break is counted."""
        each = []
        for order, (roots, values, ends) in enumerate(theirs, start=1):
            piece = np.clip(np.searchsorted(curve.breaks, roots, side="right") - 1, 0, curve.pieces - 1)
            low, high = np.minimum(ends[:-1], ends[1:]), np.maximum(ends[:-1], ends[1:])
            np.minimum.at(low, piece, values)
            np.maximum.at(high, piece, values)
            each.append(relative([np.stack([lowest[order, :, 0], highest[order, :, 0]])], [np.stack([low, high])]))
        return max(each)

    extremes = Task(
        "extrema",
        f"smallest and largest q, v, a, j, and when, of {power(count)} quintic pieces of one joint; "
        "the peer: v, a, j, not sorted",
        count,
        ours=lambda: curve.extrema(4),
        peer="PPoly roots, values",
        theirs=lambda: _turning_points(spline),
        difference=lambda ours, theirs: difference(ours.low, ours.high, theirs),
    )
    scale = (curve.rates ** np.arange(4)[:, None])[:, :, None]
    kernel = replace(
        extremes,
        name="extrema, kernel",
        what="the same without scaling to time",
        ours=lambda: extrema(curve.coefficients, 4),
        goal=9.0,
        difference=lambda ours, theirs: difference(scale * ours[0], scale * ours[2], theirs),
    )
    return [extremes, kernel]


def _verdict(count: int) -> list[Task]:
    curve = quintic_spline(*random_walk(count + 1, 1))
    spline = PPoly(curve.powers()[::-1, :, 0], curve.breaks)
    exact = curve.extrema(4)
    bound = np.quantile(np.maximum(-exact.low, exact.high), 0.99, axis=1)[:, None, :]
    bound[0] = np.inf
    gain, shift = measures(-bound, bound)

    def theirs() -> list[float]:
        found = _turning_points(spline)
        return [max(np.abs(x).max() for x in found[m][1:]) / bound[m + 1, 0, 0] for m in range(3)]

    def difference(ours: Worst, theirs: list[float]) -> float:
        return relative(ours.most[1:, 0], np.array(theirs))

    return [
        Task(
            "verdict",
            f"worst v, a, j of {power(count)} quintic pieces of one joint; one in 100 pieces breaks each limit",
            count,
            ours=lambda: worst(curve, gain, shift),
            peer="PPoly roots, values",
            theirs=theirs,
            goal=100.0,
            difference=difference,
        )
    ]


def _certificate(count: int) -> list[Task]:
    times, points = random_walk(count)
    curve = quintic_spline(times, points)
    highest = peaks(curve, 4)
    bounds = {name: (1.01 * highest[order]).tolist() for order, name in enumerate(QUANTITIES) if order > 0}
    demands = Demands(
        dims=JOINTS,
        limits=Limits.of(bounds, JOINTS),
        waypoints=points,
        times=times,
    )
    what = f"verify: all that is certified of a quintic spline through {power(count)} waypoints"
    return [Task("certificate", what, curve.pieces, ours=lambda: verify(curve, demands))]
