"""Free times: least squared jerk plus weight times duration, beside IPOPT (through CasADi) and spline-trajectory."""

from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np

from planner.curves import quintic_spline
from planner.smoothing.free_times import FreeTimes, optimal_times
from problems.free_times import FreeDurations

from ..figures import Array
from .limited_problems import walk
from .rounds import MINCO as splines
from .rounds import Standing, in_turn, over

PART = "free times"
OURS, IPOPT, MINCO = "optimal_times", "IPOPT", "spline-trajectory optimize()"
DIMS, WEIGHT = 3, 100.0
GOAL, SAME = 50.0, 1e-8  # IPOPT's time over ours; the relative difference of the costs
TOLD = {
    OURS: "without the request's check and the certificate",
    IPOPT: "its solve alone, of the same statement in durations and node states",
    MINCO: "L-BFGS-B of SciPy, which calls it back from Python; one sample a gap",
}


def measure(quick: bool = False) -> list[Standing]:
    """Return the standings."""
    found = []
    for count in (10,) if quick else (10, 50, 200):
        calls = _calls(walk(count, DIMS)[1])
        costs = {name: cost(run()) for name, (run, cost) in calls.items()}
        seconds = in_turn({name: run for name, (run, _) in calls.items()}, 1 if quick else 5, budget=3.0)
        for name, own in seconds.items():
            goal = GOAL if name == IPOPT and count == 50 and not quick else None
            beyond = costs[name] / costs[OURS] - 1.0
            told = TOLD[name] + ("; **not the same cost**" if abs(beyond) > SAME and name != MINCO else "")
            entry = (PART, f"weight {WEIGHT:g}", DIMS, count, name, 1e3 * median(own), over(own, seconds[OURS]), goal)
            found.append(Standing(*entry, beyond=beyond, told=told, rounds=len(own)))
    return found


def _calls(points: Array) -> dict[str, tuple[Callable[[], Any], Callable[[Any], float]]]:
    """Return for every entry the call that is timed, and what reads the cost of its answer."""
    still = np.zeros((2, DIMS))
    h, states = _guess(points)
    ends = np.zeros((2, *still.shape))
    problem = FreeDurations(points, 3, ends, np.append(np.ones(DIMS), WEIGHT)).to_casadi(h, states, np.zeros(0))
    solver, start = _ipopt(problem), {k: problem[k] for k in ("x0", "lbx", "ubx", "lbg", "ubg")}

    def ours() -> FreeTimes:
        return optimal_times(points, 3, still, still, WEIGHT)

    calls: dict[str, tuple[Callable[[], Any], Callable[[Any], float]]] = {
        OURS: (ours, lambda answer: float(answer.cost)),
        IPOPT: (lambda: solver(**start), lambda answer: float(answer["f"])),
    }
    if splines is not None:
        calls[MINCO] = (_minco(splines, points, h), lambda answer: float(answer.fun))
    return calls


def _guess(points: Array) -> tuple[Array, Array]:
    """Return the peers' start: durations by the steps, as a whole the best, and the best node states (2, N, D)."""
    h = np.sqrt(np.linalg.norm(np.diff(points, axis=0), axis=1))
    energy = quintic_spline(_clock(h), points).squared_integral(3)
    h = h * (5.0 * energy / (WEIGHT * h.sum())) ** (1.0 / 6.0)
    curve = quintic_spline(_clock(h), points)
    return h, np.stack([curve(curve.breaks, order) for order in (1, 2)])


def _clock(h: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(h)])


def _ipopt(problem: dict[str, Any]) -> Any:
    import casadi

    quiet = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False}
    return casadi.nlpsol("solver", "ipopt", {k: problem[k] for k in ("x", "f", "g")}, quiet)


def _minco(splines: Any, points: Array, h: Array) -> Callable[[], Any]:
    mask = splines.OptimizationMask()
    mask.waypoints, mask.time = [0] * len(points), [1] * len(h)
    fewest = {"integral_num_steps": 1}  # of callbacks; none are wanted

    def run() -> Any:
        optimizer = splines.QuinticOptimizer3D()
        optimizer.set_config(rho_energy=1.0, **fewest)
        context = optimizer.prepare_context(
            time_segments=h.tolist(), waypoints=points, bc=splines.BoundaryConditions3D(), mask=mask
        )
        return splines.optimize(optimizer, context, time_cost=_duration, max_iter=1000)

    return run


def _duration(times: Array) -> tuple[float, Array]:
    return WEIGHT * float(np.sum(times)), np.full(len(times), WEIGHT)
