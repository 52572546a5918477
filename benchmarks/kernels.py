"""Sampling, extrema, verdicts and the making of curves, each by itself, beside the same from SciPy."""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BarycentricInterpolator, CubicSpline, PPoly, make_interp_spline

from planner import Trajectory
from planner.curves import (
    bspline,
    chebyshev_nodes,
    cubic_spline,
    interpolating_points,
    interpolation_knots,
    polynomial,
    quintic_spline,
    septic_spline,
)
from planner.kernels.extrema import extrema
from planner.limits import QUANTITIES, Limits
from planner.types import Demands
from planner.verify import verify
from planner.worst import Worst, measures, peaks, worst

Array = NDArray[np.float64]

JOINTS = 7
ROUNDS, FEWEST = 9, 3
SHORTEST = 5e-3  # s; shorter calls are repeated within a round until this much time has passed
BUDGET = 6.0  # s for the rounds of one group; it is kept to unless fewer than FEWEST were run


@dataclass(frozen=True)
class Figure:
    """What was measured: medians of the process time, and of the ratios of the same rounds.

    ``ratio`` is the peer's time over ours, ``goal`` the least it should be. ``growth`` is our time an item over that
    of the smallest size. ``difference`` is the largest between the results, relative to their size; results that do
    not agree are not timed.
    """

    name: str
    what: str
    peer: str
    items: int
    difference: float | None
    agrees: bool
    goal: float | None
    ours_ms: float | None = None
    peer_ms: float | None = None
    ratio: float | None = None
    growth: float | None = None
    rounds: int = 0

    @property
    def each_ns(self) -> float | None:
        """Our time an item."""
        return None if self.ours_ms is None else 1e6 * self.ours_ms / self.items

    @property
    def met(self) -> bool | None:
        """Whether the goal is reached; None without a goal."""
        return None if self.goal is None else self.ratio is not None and self.ratio >= self.goal


@dataclass(frozen=True)
class Task:
    """One call of ours and, unless it stands alone, one of the peer's; ``difference`` compares what they return."""

    name: str
    what: str
    items: int
    ours: Callable[[], Any]
    peer: str = ""
    theirs: Callable[[], Any] | None = None
    goal: float | None = None
    difference: Callable[[Any, Any], float] | None = None
    tolerance: float = 1e-9


@dataclass
class _Call:
    """A call on its way through the rounds."""

    run: Callable[[], Any]
    seconds: list[float] = field(default_factory=list)

    def once(self) -> None:
        """Run one round."""
        began, passed, repeats = time.process_time(), 0.0, 0
        while passed < SHORTEST:
            self.run()
            repeats += 1
            passed = time.process_time() - began
        self.seconds.append(passed / repeats)


def measure(quick: bool = False, only: str = "") -> list[Figure]:
    """Return a figure a task; ``only`` those with this in their name."""
    figures = []
    for build in groups(quick):
        tasks = [task for task in build() if only in task.name]
        if quick:  # goals are for the full sizes
            tasks = [replace(task, goal=None) for task in tasks]
        figures += _measure(tasks, 1 if quick else ROUNDS)
    return figures


def _measure(tasks: list[Task], rounds: int) -> list[Figure]:
    """Measure one group: all its calls in turn, round after round."""
    checked = [_check(task) for task in tasks]
    calls = [
        (_Call(task.ours), None if task.theirs is None else _Call(task.theirs)) if agrees else None
        for task, (_, agrees) in zip(tasks, checked, strict=True)
    ]
    flat = [call for pair in calls if pair for call in pair if call]
    began = time.perf_counter()
    for done in range(rounds):
        if done >= FEWEST and time.perf_counter() - began > BUDGET:
            break
        for call in flat:
            call.once()
    first = calls[0][0] if calls and calls[0] else None
    figures = []
    for task, (difference, agrees), pair in zip(tasks, checked, calls, strict=True):
        figure = (task.name, task.what, task.peer, task.items, difference, agrees, task.goal)
        if pair is None:
            figures.append(Figure(*figure))
            continue
        ours, theirs = pair
        ratio = growth = None
        if theirs is not None:
            ratio = median(b / a for a, b in zip(ours.seconds, theirs.seconds, strict=True))
        if first is not None and task.items > tasks[0].items:
            share = tasks[0].items / task.items
            growth = median(share * a / b for a, b in zip(ours.seconds, first.seconds, strict=True))
        peer_ms = None if theirs is None else 1e3 * median(theirs.seconds)
        figures.append(Figure(*figure, 1e3 * median(ours.seconds), peer_ms, ratio, growth, len(ours.seconds)))
    return figures


def _check(task: Task) -> tuple[float | None, bool]:
    """Run both once, so that kernels are compiled; return by how much they differ, and whether that is rounding."""
    ours, theirs = task.ours(), None if task.theirs is None else task.theirs()
    if task.difference is None:
        return None, True
    difference = task.difference(ours, theirs)
    return difference, difference <= task.tolerance


# -- what is measured ------------------------------------------------------------------------------------------------


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
    for curve in (_cubic, _quintic, _septic):
        yield partial(_growing, curve, sizes)
    yield partial(_growing, _bspline, sizes[:3])
    yield _polynomial


def _power(count: int) -> str:
    """Return a power of ten as one."""
    return f"10^{round(math.log10(count))}"


def _waypoints(count: int, dims: int = JOINTS, seed: int = 1) -> tuple[Array, Array]:
    """Return uneven times (N,) and a random walk (N, D)."""
    random = np.random.default_rng(seed)
    times = np.concatenate([[0.0], np.cumsum(random.uniform(0.5, 1.5, count - 1))])
    return times, np.cumsum(random.normal(size=(count, dims)), axis=0)


def _piecewise(curve: Trajectory) -> PPoly:
    """Return the same curve as SciPy's type."""
    return PPoly(curve.powers()[::-1], curve.breaks)


def _relative(ours: Any, theirs: Any) -> float:
    """Return the largest difference of each entry, over the largest magnitude in it: the worst of them."""
    return max(
        float(np.abs(a - b).max() / max(float(np.abs(b).max()), 1e-300)) for a, b in zip(ours, theirs, strict=True)
    )


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
        difference=_relative,
    )


def _sampling(count: int) -> list[Task]:
    curve = quintic_spline(*_waypoints(1001))
    times = np.sort(np.random.default_rng(2).uniform(curve.start, curve.end, count))
    what = f"q, v, a, j of {JOINTS} joints at {_power(count)} increasing times, {curve.pieces} quintic pieces"
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
    curve = quintic_spline(*_waypoints(1001))
    times = np.random.default_rng(3).uniform(curve.start, curve.end, count)
    return [_states("sampling at random", f"the same at {_power(count)} times in no order", curve, times, None)]


def _sampling_each_piece(count: int) -> list[Task]:
    curve = quintic_spline(*_waypoints(count + 1))
    times = curve.breaks[:-1] + np.diff(curve.breaks) * np.random.default_rng(4).uniform(0.0, 1.0, count)
    return [
        _states("sampling every piece", f"the same with one time on each of {_power(count)} pieces", curve, times, None)
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
    curve = quintic_spline(*_waypoints(count + 1, 1))
    spline = PPoly(curve.powers()[::-1, :, 0], curve.breaks)

    def difference(lowest: Array, highest: Array, theirs: Any) -> float:
        """Compare piece by piece; by continuity it does not matter on which piece a root at a break is counted."""
        each = []
        for order, (roots, values, ends) in enumerate(theirs, start=1):
            piece = np.clip(np.searchsorted(curve.breaks, roots, side="right") - 1, 0, curve.pieces - 1)
            low, high = np.minimum(ends[:-1], ends[1:]), np.maximum(ends[:-1], ends[1:])
            np.minimum.at(low, piece, values)
            np.maximum.at(high, piece, values)
            each.append(_relative([np.stack([lowest[order, :, 0], highest[order, :, 0]])], [np.stack([low, high])]))
        return max(each)

    extremes = Task(
        "extrema",
        f"smallest and largest q, v, a, j, and when, of {_power(count)} quintic pieces of one joint; "
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
    curve = quintic_spline(*_waypoints(count + 1, 1))
    spline = PPoly(curve.powers()[::-1, :, 0], curve.breaks)
    exact = curve.extrema(4)
    bound = np.quantile(np.maximum(-exact.low, exact.high), 0.99, axis=1)[:, None, :]
    bound[0] = np.inf
    gain, shift = measures(-bound, bound)

    def theirs() -> list[float]:
        found = _turning_points(spline)
        return [max(np.abs(x).max() for x in found[m][1:]) / bound[m + 1, 0, 0] for m in range(3)]

    def difference(ours: Worst, theirs: list[float]) -> float:
        return _relative(ours.most[1:, 0], np.array(theirs))

    return [
        Task(
            "verdict",
            f"worst v, a, j of {_power(count)} quintic pieces of one joint; one in 100 pieces breaks each limit",
            count,
            ours=lambda: worst(curve, gain, shift),
            peer="PPoly roots, values",
            theirs=theirs,
            goal=100.0,
            difference=difference,
        )
    ]


def _certificate(count: int) -> list[Task]:
    times, points = _waypoints(count)
    curve = quintic_spline(times, points)
    highest = peaks(curve, 4)
    bounds = {name: (1.01 * highest[order]).tolist() for order, name in enumerate(QUANTITIES) if order > 0}
    demands = Demands(
        dims=JOINTS,
        limits=Limits.of(bounds, JOINTS),
        waypoints=points,
        times=times,
    )
    what = f"verify: all that is certified of a quintic spline through {_power(count)} waypoints"
    return [Task("certificate", what, curve.pieces, ours=lambda: verify(curve, demands))]


def _growing(make: Callable[[int], Task], sizes: tuple[int, ...]) -> list[Task]:
    return [make(count) for count in sizes]


def _curve(
    name: str,
    what: str,
    points: tuple[Array, Array],
    ours: Callable[[], Trajectory],
    peer: str,
    theirs: Callable[[], Any],
    goal: float | None = 1.0,
) -> Task:
    """Return the task of making a curve; curves are compared by q, v and a at some times."""
    count = len(points[0])
    times = np.random.default_rng(5).uniform(points[0][0], points[0][-1], 1000)

    def difference(mine: Trajectory, other: Any) -> float:
        return _relative(mine.states(times, 3), [other(times, order) for order in range(3)])

    return Task(f"{name}, N = {_power(count)}", what, count, ours, peer, theirs, goal, difference, tolerance=1e-8)


def _cubic(count: int) -> Task:
    t, x = _waypoints(count)
    return _curve(
        "cubic_spline",
        "at rest at the ends",
        (t, x),
        lambda: cubic_spline(t, x),
        "CubicSpline",
        lambda: CubicSpline(t, x, bc_type="clamped"),
    )


def _still(orders: int) -> Any:
    """Return SciPy's boundary condition of vanishing derivatives at both ends."""
    end = [(order, np.zeros(JOINTS)) for order in range(1, orders + 1)]
    return end, end


def _quintic(count: int) -> Task:
    t, x = _waypoints(count)
    return _curve(
        "quintic_spline",
        "zero v and a at the ends",
        (t, x),
        lambda: quintic_spline(t, x),
        "make_interp_spline(k=5)",
        lambda: make_interp_spline(t, x, k=5, bc_type=_still(2)),
    )


def _septic(count: int) -> Task:
    t, x = _waypoints(count)
    return _curve(
        "septic_spline",
        "zero v, a and j at the ends",
        (t, x),
        lambda: septic_spline(t, x),
        "make_interp_spline(k=7)",
        lambda: make_interp_spline(t, x, k=7, bc_type=_still(3)),
    )


def _bspline(count: int) -> Task:
    t, x = _waypoints(count)

    def ours() -> Trajectory:
        knots = interpolation_knots(t, 3)
        return bspline(interpolating_points(t, x, knots, 3), knots, 3)

    return _curve(
        "bspline",
        "through the points, degree 3",
        (t, x),
        ours,
        "make_interp_spline(k=3)",
        lambda: make_interp_spline(t, x, k=3),
        goal=None,
    )


def _polynomial() -> list[Task]:
    nodes = chebyshev_nodes(50, 0.0, 1.0)
    points = np.random.default_rng(6).normal(size=(len(nodes), JOINTS))
    times = np.random.default_rng(7).uniform(0.0, 1.0, 1000)
    return [
        Task(
            "polynomial",
            f"through {len(nodes)} Chebyshev nodes, and its values at {len(times)} times",
            len(nodes),
            ours=lambda: polynomial(nodes, points, 0.0, 1.0)(times),
            peer="BarycentricInterpolator",
            theirs=lambda: BarycentricInterpolator(nodes, points)(times),
            difference=lambda mine, other: _relative([mine], [other]),
        )
    ]
