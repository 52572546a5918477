r"""The smoothest cubic spline within a tolerance of samples, of few pieces.

.. math:: \min_f \int |f''(u)|^2 du \quad\text{s.t.}\quad |f_d(u_i) - q_{i,d}| \le \varepsilon

exact at both ends. Joint by joint a quadratic program in the control points of B-splines: its Hessian has three bands
above the diagonal, a row four entries.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.sparse import csr_matrix, vstack

from problems.banded_qp import BandedQP

from .curves import knots
from .deadline import Deadline
from .errors import SolverFailed
from .solvers import select
from .solvers.qp import solve_qp
from .trajectory import Trajectory

Array = NDArray[np.float64]

#: Pieces, at most, before those at the ends are halved.
MOST = 1000
#: What is left of the tolerance to rounding and to the solver.
MARGIN = 1e-4
#: What every entry may add to a Hessian's diagonal, relative, so that it is definite.
RIDGE = 1e-13


def smoothed(points: Array, tolerance: float, deadline: Deadline) -> tuple[Trajectory, Array] | None:
    """Return a curve within ``tolerance`` of the points (M, D) in every joint, and their parameter values (M,).

    First over the points' numbers, where noise has no say in the parameter; then over the centripetal knots of that
    curve's values, so that a stop of the motion is none of the path. None where no spline of fewer pieces than points
    comes near enough.
    """
    first = _fewest(np.linspace(0.0, 1.0, len(points)), points, tolerance, deadline)
    if first is None:
        return None
    values = first(np.linspace(first.start, first.end, len(points)))
    at = knots(values)
    curve = _fewest(at, points, tolerance, deadline)
    if curve is None:
        return None
    at = np.minimum(at * curve.end, curve.end)
    return (curve, at) if np.abs(curve(at) - points).max() <= tolerance else None


def _fewest(at: Array, points: Array, tolerance: float, deadline: Deadline) -> Trajectory | None:
    """Return the smoothest spline of few pieces that comes near enough, over [0, its number of pieces].

    Pieces are halved where least squares miss the points by more than the tolerance in the mean, which nothing but more
    pieces can cure; then all are, until there is such a spline.
    """
    edges = np.array([0.0, 1.0])
    while len(edges) <= min(len(points), MOST):
        deadline.left()
        coarse = _coarse(edges, at, points, tolerance)
        if not coarse.any():
            for tried in (edges, _graded(edges, at)):
                spline = _smoothest(tried, at, points, tolerance, deadline)
                if spline is not None:
                    values, slopes = spline(tried), spline.derivative()(tried)
                    values[[0, -1]] = points[[0, -1]]
                    scale = len(tried) - 1
                    return Trajectory.from_hermite(tried * scale, values, slopes / scale)
            coarse[:] = True
        edges = np.sort(np.concatenate([edges, 0.5 * (edges[:-1] + edges[1:])[coarse]]))
    return None


def _coarse(edges: Array, at: Array, points: Array, tolerance: float) -> NDArray[np.bool_]:
    """Return the pieces, of two points or more, that least squares miss by more than the tolerance in the mean."""
    ends, inner = _basis(edges, at)
    gram = (inner.T @ inner).toarray()
    gram[np.diag_indices_from(gram)] += RIDGE * max(float(gram.trace()), 1.0)
    rest = (points - ends @ points[[0, -1]]) / tolerance
    missed = (inner @ np.linalg.solve(gram, inner.T @ rest) - rest) ** 2
    piece = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, len(edges) - 2)
    count = np.bincount(piece, minlength=len(edges) - 1)
    sums = np.stack([np.bincount(piece, column, len(edges) - 1) for column in missed.T]).max(axis=0)
    return np.asarray((count > 1) & (sums > count))


def _graded(edges: Array, at: Array) -> Array:
    """Return the pieces with the outer ones halved repeatedly, down to the points' steps.

    An end is exact, noise and all: to come from there to the middle of the noise may take a very short piece.
    """
    near = [edges]
    for width, step in ((edges[1], at[1]), (1.0 - edges[-2], 1.0 - at[-2])):
        halvings = int(np.ceil(np.log2(width / max(float(step), 1e-9))))
        near.append(width * 0.5 ** np.arange(1, max(halvings, 0) + 1))
    return np.unique(np.concatenate([edges, near[1], 1.0 - near[2]]))


def _basis(edges: Array, at: Array) -> tuple[Array, csr_matrix]:
    """Return the values at ``at`` of the first and last basis function, (M, 2), and of the others."""
    basis = csr_matrix(BSpline.design_matrix(at, _knots(edges), 3))
    return basis[:, [0, -1]].toarray(), csr_matrix(basis[:, 1:-1])


def _knots(edges: Array) -> Array:
    return np.concatenate([np.zeros(3), edges, np.ones(3)])


def _smoothest(edges: Array, at: Array, points: Array, tolerance: float, deadline: Deadline) -> BSpline | None:
    """Return the spline of least squared second derivative on these pieces, or None where there is none."""
    vector, count = _knots(edges), len(edges) + 2
    ends, inner = _basis(edges, at)
    energy = _energy(vector, edges, count)
    control = np.empty((count, points.shape[1]))
    control[[0, -1]] = points[[0, -1]]
    for d in range(points.shape[1]):
        # in units of the tolerance, without the part of the ends' control points
        rest = (points[:, d] - ends @ control[[0, -1], d]) / tolerance
        found = _program(energy, inner, rest, control[[0, -1], d] / tolerance, deadline)
        if found is None:
            return None
        control[1:-1, d] = found * tolerance
    return BSpline(vector, control, 3)


def _energy(vector: Array, edges: Array, count: int) -> Array:
    """Return the integrals of the products of the basis functions' second derivatives, (n, n).

    These are linear on a piece: two Gauss points are exact.
    """
    steps = np.diff(edges)[:, None]
    nodes = (edges[:-1, None] + steps * (0.5 + 0.5 * np.array([-1.0, 1.0]) / np.sqrt(3.0))).reshape(-1)
    bends = BSpline(vector, np.eye(count), 3).derivative(2)(nodes)
    return np.asarray(bends.T @ (np.repeat(steps[:, 0] / 2, 2)[:, None] * bends))


def _program(energy: Array, inner: csr_matrix, rest: Array, ends: Array, deadline: Deadline) -> Array | None:
    """Return the inner control points of least energy within the tolerance (one), or None."""
    unit = 1.0 / float(np.median(np.diag(energy)))
    hessian = energy[1:-1, 1:-1] * unit
    width = min(4, len(hessian))
    bands = np.zeros((width, len(hessian)))
    for k in range(width):
        bands[width - 1 - k, k:] = np.diagonal(hessian, k)
    ridge = RIDGE * float(bands[-1].max())
    bands[-1] += ridge
    gradient = energy[1:-1][:, [0, -1]] @ ends * unit
    constant = 0.5 * unit * float(ends @ energy[np.ix_([0, -1], [0, -1])] @ ends)
    upper = np.concatenate([1.0 - MARGIN + rest, 1.0 - MARGIN - rest])
    program = BandedQP(bands, gradient, constant, vstack([inner, -inner], format="csr"), upper, ridge=ridge)
    for backend in select("qp")[:2]:
        try:
            return solve_qp(program, backend, deadline.left()).y
        except SolverFailed:
            continue
    return None
