"""The program alone: our interior point beside IPOPT, from the same start, on the same statement."""

import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np

from planner.waypoints.program import solve
from problems.waypoint_timing import Spline, WaypointTiming

from ..minimum_jerk.rounds import in_turn, over
from ..path_timing.peers import imported
from .problems import cases, program, request_of
from .rows import Line

PART = "program"
OURS, IPOPT, BUILDING = "interior point", "IPOPT", "IPOPT, with building"
#: How far, relatively, the objective may be from the optimum.
TOLERANCE = 1e-5
#: What durations may differ by without a word.
AGREE = 1e-4
#: Joints times segments, at most: with more, IPOPT takes minutes.
LARGEST = 50
CASADI, WITHOUT_CASADI = imported("casadi")


def measure(quick: bool = False) -> list[Line]:
    """Return the lines."""
    sizes = {name: (request_of(name).count - 1) * request_of(name).dims for name in cases()}
    names = ("d3_rand_1wp",) if quick else [name for name, size in sizes.items() if size <= LARGEST]
    return [row for name in names for row in _problem(name, quick)]


def built(problem: WaypointTiming, start: Spline) -> Callable[[], Any]:
    """Return a call for IPOPT's answer; the program and its derivatives are built.

    What the call returns: the duration, s, the iterations, and IPOPT's own word.
    """
    posed = problem.to_casadi(start)
    settings = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.tol": TOLERANCE}
    solver = CASADI.nlpsol("solver", "ipopt", {k: posed[k] for k in "xfg"}, settings)
    given = {k: posed[k] for k in ("x0", "lbx", "ubx", "lbg", "ubg")}

    def run() -> tuple[float, int, str]:
        x = np.asarray(solver(**given)["x"]).reshape(-1)
        stats = solver.stats()
        duration = float(x[: len(start.durations)] @ start.durations)
        return duration, int(stats["iter_count"]), str(stats["return_status"])

    return run


def _problem(name: str, quick: bool) -> list[Line]:
    asked = request_of(name)
    problem, start = program(asked)
    found = solve(problem, start, TOLERANCE)
    taken = float(found.spline.durations.sum())
    title = (PART, name, asked.dims, asked.count)
    ours: dict[str, Any] = {"duration": taken, "iterations": found.iterations}
    ours["told"] = "" if found.solved else "**not solved**"
    if CASADI is None:
        return [Line(*title, OURS, **ours), Line(*title, IPOPT, told=WITHOUT_CASADI)]
    began = time.process_time()
    run = built(problem, start)
    building = time.process_time() - began
    duration, iterations, word = run()
    seconds = in_turn({OURS: lambda: solve(problem, start, TOLERANCE), IPOPT: run}, 1 if quick else 3, budget=2.0)
    more = duration / taken - 1.0
    words = ([] if word == "Solve_Succeeded" else [word]) + ([] if abs(more) < AGREE else ["**another optimum**"])
    theirs: dict[str, Any] = {"duration": duration, "over": more, "iterations": iterations, "told": "; ".join(words)}
    whole = {**seconds, BUILDING: [building + s for s in seconds[IPOPT]]}
    said = {OURS: ours, IPOPT: theirs, BUILDING: {"told": f"building once: {building:.2g} s"}}
    return [
        Line(*title, e, 1e3 * median(own), over(own, seconds[OURS]), **said[e], rounds=len(own))
        for e, own in whole.items()
    ]
