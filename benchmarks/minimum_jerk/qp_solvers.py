"""The solvers' own interfaces: set up and solve one program. Tolerances are their defaults unless it says otherwise."""

import warnings

import clarabel
import daqp
import numpy as np
import osqp
import piqp

from ..figures import Array
from .limited_problems import Program

PATIENCE = 20.0  # s for one program, of the solvers that know a time limit


def by_piqp(program: Program) -> Array:
    """Return PIQP's answer, sparse."""
    solver = piqp.SparseSolver()
    solver.settings.verbose = False
    solver.setup(program.hessian, program.gradient, None, None, program.rows, program.lower, program.upper)
    solver.solve()
    return np.array(solver.result.x)


def by_clarabel(program: Program) -> Array:
    """Return Clarabel's answer."""
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.time_limit = False, PATIENCE
    rows, upper = program.both
    cones = [clarabel.NonnegativeConeT(len(upper))]
    answer = clarabel.DefaultSolver(program.above, program.gradient, rows, upper, cones, settings).solve()
    return np.array(answer.x)


def by_osqp(program: Program) -> Array:
    """Return OSQP's answer to 1e-6, polished: at its defaults the limits are off by percents."""
    solver = osqp.OSQP()
    settings = {"verbose": False, "eps_abs": 1e-6, "eps_rel": 1e-6, "max_iter": 20_000, "time_limit": PATIENCE}
    solver.setup(
        program.above, program.gradient, program.rows, program.lower, program.upper, polishing=True, **settings
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return np.array(solver.solve(raise_error=False).x)


def by_daqp(program: Program) -> Array:
    """Return DAQP's answer: dense, so for few waypoints only."""
    hessian, rows = program.dense
    return np.array(daqp.solve(hessian, program.gradient, rows, program.upper, program.lower)[0])
