r"""The smoothest curve of one polynomial per gap, over node states.

.. math::

    \min \int \lVert q^{(k)} \rVert^2 dt \quad\text{s.t.}\quad q \in C^{k-1},\
    \text{some of the } q^{(r)}(t_i),\ r < k, \text{ given}

k = 2, 3, 4: acceleration, jerk, snap. On a gap the polynomial of degree 2k - 1 is fixed by the derivatives 0 … k-1 at
both ends, scaled to the gap (w = [q0, q0' h, …, q1, q1' h, …]), and its cost is h^{1-2k} w'Qw. The unknowns y are those
of the nodes' derivatives that are not given: no equality constraints remain, and the Hessian is banded and positive
definite. A limit on a derivative at one instant is one row in y. Joints meet in rows only.

Positions are counted from a reference, so that none of the digits of a small step far from the origin are lost.
"""

from dataclasses import dataclass, replace
from functools import cache, cached_property
from math import factorial, perm

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from .banded_qp import BandedQP

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


#: Relative; the cost that it adds is that part of what the curve's own terms cost one by one.
RIDGE = 1e-12


@cache
def hermite_basis(order: int) -> Array:
    """Return B (2k, 2k): the coefficients of u^0 … u^(2k-1) on [0, 1] are B w, w the derivatives at 0, then at 1."""
    size = 2 * order
    at = np.zeros((size, size))
    for r in range(order):
        at[r, r] = factorial(r)
        at[order + r] = [perm(i, r) for i in range(size)]
    return np.asarray(np.round(12 * np.linalg.inv(at)) / 12)  # twelfths, exactly


@cache
def element_cost(order: int) -> Array:
    """Return Q (2k, 2k): the integral of the squared k-th derivative over u in [0, 1] is w'Qw."""
    upper = hermite_basis(order)[order:]
    return np.asarray(upper.T @ _gram(order) @ upper)


@cache
def _gram(order: int) -> Array:
    """Return the same over the coefficients of u^k … u^(2k-1)."""
    powers = range(order, 2 * order)
    return np.array([[perm(i, order) * perm(j, order) / (i + j - 2 * order + 1) for j in powers] for i in powers])


@dataclass(frozen=True, eq=False)
class MinimumDerivative:
    """The statement above.

    ``h`` (M,) are the durations of the gaps, ``reference`` (M + 1, D) positions, ``states`` (k, M + 1, D) what is given
    at the nodes: displacements from the reference, then derivatives of order 1 … k-1; NaN where free. ``periodic``: the
    derivatives at the last node are those at the first. ``bound``: whether a row may hold several joints, so that the
    unknowns must follow node by node rather than joint by joint. ``base`` (k, M + 1, D) is what the unknowns count
    from, 0 by default: where that is the free optimum, costs near it keep their digits.

    Where what is given leaves a polynomial of degree below k open, the Hessian's diagonal is raised by ``RIDGE``: of
    curves that cost the same, the one nearest to rest at the reference is then taken.
    """

    h: Array
    reference: Array
    states: Array
    periodic: bool = False
    bound: bool = False
    base: Array | None = None

    @property
    def order(self) -> int:
        """Order k of the derivative that is minimised."""
        return len(self.states)

    @property
    def dims(self) -> int:
        """Number of joints, D."""
        return int(self.reference.shape[1])

    def only(self, joint: int) -> "MinimumDerivative":
        """Return the statement of one joint."""
        one = slice(joint, joint + 1)
        base = None if self.base is None else self.base[:, :, one]
        return replace(self, reference=self.reference[:, one], states=self.states[:, :, one], base=base)

    def rebased(self, y: Array) -> "MinimumDerivative":
        """Return the same statement with unknowns that count from these."""
        return replace(self, base=self.filled(y))

    @cached_property
    def known(self) -> Array:
        """Return all states for y = 0, (k, M + 1, D)."""
        base = np.zeros(self.states.shape) if self.base is None else self.base
        return np.asarray(np.where(np.isnan(self.states), base, self.states))

    @cached_property
    def index(self) -> Indices:
        """Return the place in y of every state, (k, M + 1, D); -1 where it is given.

        Nodes follow one another; around a closed curve those before and after the start alternate, so that neighbours
        stay close there too.
        """
        free = np.isnan(self.states)
        count = free.shape[1]
        nodes = np.arange(count)
        if self.periodic:
            free[1:, -1] = False
            inner = np.stack([nodes[1:-1], nodes[-2:0:-1]]).T.reshape(-1)[: count - 2]
            nodes = np.concatenate([[0], inner, [count - 1]])
        axes = (1, 2, 0) if self.bound else (2, 1, 0)
        ordered = free[:, nodes].transpose(axes)
        numbers = np.where(ordered, np.cumsum(ordered).reshape(ordered.shape) - 1, -1)
        index = np.empty(free.shape, dtype=np.int64)
        index[:, nodes] = numbers.transpose(np.argsort(axes))
        if self.periodic:
            index[1:, -1] = index[1:, 0]
        return index

    @cached_property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.index.max(initial=-1)) + 1

    @cached_property
    def local(self) -> Indices:
        """Return the places in y of every gap's w, (2k, M, D)."""
        return np.concatenate([self.index[:, :-1], self.index[:, 1:]])

    @cached_property
    def width(self) -> int:
        """Half bandwidth: how far apart in y the states of one gap (of one joint, unless ``bound``) lie."""
        if not self.size:
            return 0
        axes = (0, 2) if self.bound else 0
        low = np.where(self.local < 0, self.size, self.local).min(axis=axes)
        return int(np.maximum(self.local.max(axis=axes) - low, 0).max())

    @cached_property
    def given(self) -> Array:
        """Return every gap's w for y = 0, (2k, M, D), with the reference's step."""
        w = np.concatenate([self.known[:, :-1], self.known[:, 1:]])
        w[self.order] += np.diff(self.reference, axis=0)
        return w

    def _powers(self, pieces: Array) -> Array:
        """Return what scales the entries of w, (2k, …), for gaps of these durations."""
        exponent = np.concatenate([np.arange(self.order)] * 2)
        return np.asarray(pieces ** exponent.reshape(-1, *[1] * pieces.ndim))

    @cached_property
    def _elements(self) -> Array:
        """Return twice every gap's cost matrix over the unscaled w, (2k, 2k, M)."""
        scale = self._powers(self.h)
        cost = 2.0 * element_cost(self.order)[:, :, None] * scale[:, None] * scale[None, :]
        return np.asarray(cost * self.h ** (1.0 - 2 * self.order))

    @cached_property
    def bands(self) -> Array:
        """Return the Hessian in LAPACK's upper banded form, (width + 1, n)."""
        n, width = self.size, self.width
        flat = np.zeros((width + 1) * n)
        for d in range(self.dims):
            i, j = self.local[:, None, :, d], self.local[None, :, :, d]
            there = (i >= 0) & (i <= j)
            where = ((width + i - j) * n + j)[there]
            flat += np.bincount(where, self._elements[there], len(flat))
        bands = flat.reshape(width + 1, n)
        if self.undetermined:
            bands[-1] *= 1.0 + RIDGE
        return bands

    @cached_property
    def undetermined(self) -> bool:
        """Whether a polynomial of degree below k, in some joint, is zero in all that is given."""
        if self.periodic:
            return False
        k = self.order
        at = np.concatenate([[0.0], np.cumsum(self.h)]) / float(self.h.sum())
        table = np.zeros((k, len(at), k))  # derivative r of the monomial j at every node
        for r in range(k):
            for j in range(r, k):
                table[r, :, j] = perm(j, r) * at ** (j - r)
        given = ~np.isnan(self.states)
        return any(np.linalg.matrix_rank(table[given[:, :, d]], 1e-9) < k for d in range(self.dims))

    @cached_property
    def gradient(self) -> Array:
        """Return the linear term, (n,)."""
        pull = np.einsum("abm,bmd->amd", self._elements, self.given)
        there = self.local >= 0
        return np.asarray(np.bincount(self.local[there], pull[there], self.size))

    @property
    def constant(self) -> float:
        """Return the constant term."""
        return float(self.constants.sum())

    @cached_property
    def constants(self) -> Array:
        """Return each joint's constant term, (D,)."""
        upper = np.einsum(
            "pa,amd->pmd", hermite_basis(self.order)[self.order :], self.given * self._powers(self.h)[:, :, None]
        )
        each = np.einsum("pmd,pq,qmd->md", upper, _gram(self.order), upper)  # squares: nothing cancels
        return np.asarray(self.h ** (1.0 - 2 * self.order) @ each)

    def filled(self, y: Array) -> Array:
        """Return displacements and derivatives at all nodes, (k, M + 1, D)."""
        return self.known + np.where(self.index >= 0, np.append(y, 0.0)[self.index], 0.0)

    def unknowns(self, states: Array) -> Array:
        """Return y (n,) from displacements and derivatives at all nodes: what ``filled`` undoes."""
        y = np.zeros(self.size)
        there = self.index >= 0
        y[self.index[there]] = (states - self.known)[there]
        return y

    def rows(self, gap: Indices, u: Array, order: Indices, direction: Array) -> tuple[csr_matrix, Array]:
        """Return derivatives at places u in [0, 1] of gaps as a matrix over y and constants.

        Row r is the derivative ``order[r]`` of ``direction[r] @ q``; ``direction`` (R, D).
        """
        k, size = self.order, 2 * self.order
        powers = np.array([[perm(i, m) for i in range(size)] for m in range(size)])[order]
        exponents = np.maximum(np.arange(size) - order[:, None], 0)
        weights = (powers * u[:, None] ** exponents) @ hermite_basis(k)
        h = self.h[gap]
        weights = weights * self._powers(h).T / (h**order)[:, None]
        each = weights[:, :, None] * direction[:, None, :]  # (R, 2k, D)
        columns = self.local[:, gap].transpose(1, 0, 2)
        constant = (each * self.given[:, gap].transpose(1, 0, 2)).sum(axis=(1, 2))
        constant += np.where(order == 0, (direction * self.reference[gap]).sum(axis=1), 0.0)
        there = (columns >= 0) & (direction != 0.0)[:, None, :]
        starts = np.concatenate([[0], np.cumsum(there.sum(axis=(1, 2)))])
        matrix = csr_matrix((each[there], columns[there], starts), shape=(len(gap), self.size))
        return matrix, constant

    def program(self, rows: csr_matrix | None = None, upper: Array | None = None) -> BandedQP:
        """Return the quadratic program, with rows G y <= h."""
        rows = csr_matrix((0, self.size)) if rows is None else rows
        upper = np.zeros(0) if upper is None else upper
        ridge = RIDGE if self.undetermined else 0.0
        return BandedQP(self.bands, self.gradient, self.constant, rows, upper, ridge=ridge)
