"""No limits, zero velocity and acceleration at the ends: the quintic spline, by everyone who can make it."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import qpsolvers
from scipy.interpolate import make_interp_spline
from scipy.sparse import csc_matrix, diags_array, identity, kron, vstack

from planner import Trajectory
from planner.curves import quintic_spline
from planner.curves.higher import quintic_pieces
from problems.minimum_derivative import MinimumDerivative

from ..figures import Array, power, random_walk, relative
from .rounds import MINCO as splines
from .rounds import Standing, in_turn, over

PART = "without limits"
OURS, INTO, FILL = "quintic_spline", "quintic_pieces(out=)", "out.fill(0.0)"
MINCO, SCIPY = "spline-trajectory", "make_interp_spline(k=5)"
#: General solvers, on the node states alone, which leaves no constraint; and on coefficients, as it is mostly posed.
PIQP, OSQP, USUAL = "PIQP, node states", "OSQP, node states", "PIQP, coefficients"
GOALS = {MINCO: 1.5, SCIPY: 2.5, PIQP: 1000.0, OSQP: 1000.0, USUAL: 1000.0}
#: The most that these may be: time a waypoint at the most waypoints over that at the fewest; over filling; memory.
GROWTH, FILLING, MEMORY = 2.0, 1.7, 3.0
MOST_JOINTS = 6  # of spline-trajectory
PROGRAMS = 10**3  # waypoints that general solvers are given
PATIENCE = 5.0  # s for one joint, where a solver knows a time limit
AGREE = 1e-6


def measure(quick: bool = False) -> list[Standing]:
    """Return the standings."""
    sizes = (10**3, 10**4) if quick else (10**3, 10**4, 10**5, 10**6)
    found = []
    for dims in (3, 7) if quick else (3, 6, 7):
        found += _joints(dims, sizes, 1 if quick else 5, quick)
    return found


def _joints(dims: int, sizes: tuple[int, ...], rounds: int, quick: bool) -> list[Standing]:
    calls: dict[tuple[int, str], Callable[[], Any]] = {}
    differences: dict[tuple[int, str], float | None] = {}
    for count in sizes:
        times, points = random_walk(count, dims)
        at = np.sort(np.random.default_rng(5).uniform(times[0], times[-1], 1000))
        reference = quintic_spline(times, points).states(at, 3)
        for name, run, read in _entries(times, points, at):
            states = read(run())
            differences[count, name] = None if states is None else relative(states, reference)
            calls[count, name] = run
    seconds = in_turn(calls, rounds, budget=15.0)
    found = []
    for (count, name), own in seconds.items():
        ours = seconds[count, OURS]
        goal = None if quick else GOALS.get(name)
        difference = differences[count, name]
        told = "not the same curve" if difference is not None and not difference <= AGREE else ""
        entry = (PART, f"N = {power(count)}", dims, count, name, 1e3 * median(own), over(own, ours), goal)
        found.append(Standing(*entry, difference=difference, told=told, rounds=len(own)))
    first, last = sizes[0], sizes[-1]
    figures = [
        (
            f"time a waypoint at {power(last)} over {power(first)}, {name}",
            over(seconds[last, name], seconds[first, name]) * first / last,
            GROWTH if name == INTO else None,
        )
        for name in (OURS, INTO)
    ]
    figures += [(f"{name} over {FILL}", over(seconds[last, name], seconds[last, FILL]), FILLING) for name in (INTO,)]
    figures += [("peak memory over that of the result", memory(last, dims), MEMORY)]
    for name, value, goal in figures:
        told = "" if value is not None else "not told by this system"
        kept = None if quick else goal
        found.append(Standing(PART, f"N = {power(last)}", dims, last, name, None, value, kept, True, told=told))
    return found


def _entries(times: Array, points: Array, at: Array) -> Iterator[tuple[str, Callable[[], Any], Callable[[Any], Any]]]:
    """Yield name, call, and what makes q, v, a at some times (3, …) of what the call returns (None: not compared)."""
    count, dims = points.shape
    out = np.empty((6, count - 1, dims))
    still = [(order, np.zeros(dims)) for order in (1, 2)]
    yield OURS, lambda: quintic_spline(times, points), lambda curve: curve.states(at, 3)
    yield INTO, lambda: quintic_pieces(times, points, out=out), lambda _: None
    yield FILL, lambda: out.fill(0.0), lambda _: None
    if splines is not None and dims <= MOST_JOINTS:
        kind = getattr(splines, f"QuinticSpline{dims}D")
        orders = [getattr(splines.Deriv, name) for name in ("Pos", "Vel", "Acc")]
        listed = times.tolist()  # not counted: it wants a list
        yield MINCO, lambda: kind(listed, points), lambda curve: [curve.evaluate_batch(at.tolist(), o) for o in orders]
    yield (
        SCIPY,
        lambda: make_interp_spline(times, points, k=5, bc_type=(still, still)),
        lambda curve: [curve(at, order) for order in range(3)],
    )
    if count > PROGRAMS:
        return
    states = np.full((3, count, 1), np.nan)
    states[0], states[1:, [0, -1]] = 0.0, 0.0
    at_nodes = [_in_node_states(times, x) for x in points.T]
    programs = [one.program().to_qpsolvers() for one in at_nodes]

    def curve(answers: Any) -> Any:
        if any(a.x is None for a in answers):
            return np.full((3, len(at), dims), np.nan)
        nodes = [one.filled(a.x)[1:] for one, a in zip(at_nodes, answers, strict=True)]
        return Trajectory.from_states(times, points, np.concatenate(nodes, axis=2)).states(at, 3)

    def curve_by_powers(answers: Any) -> Any:
        powers = np.stack([a.x.reshape(count - 1, 6) for a in answers], axis=2)
        return Trajectory(times, np.ascontiguousarray(powers.transpose(1, 0, 2)[::-1])).states(at, 3)

    yield PIQP, partial(_solved, programs, "piqp", {}), curve
    patient = {"eps_abs": 1e-8, "eps_rel": 1e-8, "time_limit": PATIENCE}
    yield OSQP, partial(_solved, programs, "osqp", patient), curve
    yield USUAL, partial(_solved, _in_coefficients(times, points), "piqp", {}), curve_by_powers


def _in_node_states(times: Array, points: Array) -> MinimumDerivative:
    """Return the statement of one joint over the velocities and accelerations at the waypoints."""
    states = np.full((3, len(times), 1), np.nan)
    states[0], states[1:, [0, -1]] = 0.0, 0.0
    return MinimumDerivative(np.diff(times), points[:, None], states)


def _in_coefficients(times: Array, points: Array) -> list[qpsolvers.Problem]:
    """Return the joints' programs over six coefficients a gap, of powers of time scaled to it; waypoints, C2."""
    h = np.diff(times)
    gaps, cost = len(h), np.zeros((6, 6))
    cost[3:, 3:] = [[72.0, 144.0, 240.0], [144.0, 384.0, 720.0], [240.0, 720.0, 1440.0]]
    hessian = csc_matrix(kron(diags_array(h**-5.0), cost))
    here, unit = identity(gaps, format="csr"), np.eye(6)
    powers = np.arange(6)
    slope, bend = unit[1], 2.0 * unit[2]
    rows = [kron(here, unit[0]), kron(here, np.ones(6))]
    for order, left, right in ((1, slope, powers), (2, bend, powers * (powers - 1.0))):
        scaled = diags_array(h ** float(-order)).tocsr()
        rows += [kron(scaled[:-1], right) - kron(scaled[1:], left), kron(scaled[:1], left), kron(scaled[-1:], right)]
    matrix = csc_matrix(vstack(rows))
    joined = np.zeros((matrix.shape[0] - 2 * gaps, points.shape[1]))
    wanted = np.concatenate([points[:-1], points[1:], joined])
    return [qpsolvers.Problem(hessian, np.zeros(6 * gaps), A=matrix, b=np.ascontiguousarray(b)) for b in wanted.T]


def _solved(programs: list[Any], solver: str, settings: dict[str, Any]) -> list[Any]:
    return [qpsolvers.solve_problem(program, solver=solver, **settings) for program in programs]


def memory(count: int, dims: int) -> float | None:
    """Return the peak of what a call takes beside its input, over the size of its result; None where not known."""
    root = Path(__file__).parents[2]
    command = [sys.executable, "-m", "benchmarks.minimum_jerk.memory", str(count), str(dims)]
    told = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True).stdout.strip()
    return float(told) if told else None
