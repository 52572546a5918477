"""Shared by the tests of minimum jerk: random problems with a known answer, and a reference that is none of ours.

The reference is the program over node states with limits at samples only, a relaxation, on matrices of its own (linear
algebra and quadrature), solved by Clarabel.
"""

from dataclasses import dataclass
from math import factorial, perm

import clarabel
import numpy as np
import pytest
from scipy import sparse

from planner import Trajectory

NAMES = ("position", "velocity", "acceleration", "jerk")


class Sampled:
    """min ∫ |q^(k)|² over states (k, N, D) at the nodes; NaN is free. Rows are added by the tests."""

    def __init__(self, times, states, periodic=False):
        states = np.array(states, dtype=float)
        self.k, self.n, self.dims = states.shape
        self.h = np.diff(times)
        self.second = float(np.median(self.h))
        self.origin = np.nan_to_num(states[0, 0])
        self.unit = float(np.nanmax(np.abs(states[0] - self.origin)) or 1.0)
        given = (states - np.eye(self.k)[0][:, None, None] * self.origin) / self.unit
        given *= (self.second ** np.arange(self.k))[:, None, None]
        flat, free = given.reshape(-1), np.isnan(given)
        number = np.arange(flat.size).reshape(given.shape)
        if periodic:
            number[1:, -1] = number[1:, 0]
            free[1:, -1] = False
        unknowns = number[free]
        place = np.full(flat.size, -1)
        place[unknowns] = np.arange(len(unknowns))
        column = place[number.reshape(-1)]
        kept = column >= 0
        self.select = sparse.csr_matrix(
            (np.ones(kept.sum()), (np.flatnonzero(kept), column[kept])), (flat.size, len(unknowns))
        )
        self.base = np.where(kept, 0.0, np.nan_to_num(flat[number.reshape(-1)]))
        u, w = np.polynomial.legendre.leggauss(self.k)
        gaps = np.repeat(np.arange(self.n - 1), self.k)
        root = sparse.diags(np.sqrt(np.tile(0.5 * w, self.n - 1) * self.h[gaps] / self.second))
        self.root = sparse.kron(root @ self._at(gaps, np.tile(0.5 * (u + 1), self.n - 1), self.k), np.eye(self.dims))
        self.weight = self.unit**2 / self.second ** (2 * self.k - 1)
        self.rows, self.uppers, self.cones = [], [], []

    def _at(self, gap, u, order):
        """Return the rows over (k, N) states of one joint, scaled: derivative ``order`` at places of gaps."""
        k, size = self.k, 2 * self.k
        ends = np.zeros((size, size))
        for r in range(k):
            ends[r, r] = factorial(r)
            ends[k + r] = [perm(i, r) for i in range(size)]
        monomials = np.array([[perm(i, order) * x ** max(i - order, 0) for i in range(size)] for x in u])
        weights = np.linalg.solve(ends.T, monomials.T).T
        h = self.h[gap][:, None] / self.second
        weights = weights * np.tile(h ** np.arange(k), 2) / h**order
        columns = np.concatenate([np.arange(k) * self.n + gap[:, None], np.arange(k) * self.n + gap[:, None] + 1], 1)
        starts = np.arange(len(gap) + 1) * size
        return sparse.csr_matrix((weights.ravel(), columns.ravel(), starts), (len(gap), k * self.n))

    def derivative(self, gap, u, order, along):
        """Return rows over the unknowns and constants (scaled) of the derivative of ``along @ q``, along (R, D)."""
        rows = self._at(gap, u, order)
        full = sum(
            sparse.kron(sparse.diags(along[:, d]) @ rows, sparse.csr_matrix(np.eye(self.dims)[d : d + 1]))
            for d in range(self.dims)
        )
        return sparse.csr_matrix(full @ self.select), full @ self.base

    def places(self, samples, gaps=None):
        gaps = np.arange(self.n - 1) if gaps is None else np.asarray(gaps)
        return np.repeat(gaps, samples), np.tile(np.linspace(0, 1, samples), len(gaps))

    def limit(self, order, along, lower, upper, samples=40, at=None):
        """Bound a derivative of ``along @ q`` on every gap: lower, upper scalars or (M,), in the caller's units."""
        if not (np.isfinite(lower).any() or np.isfinite(upper).any()):
            return
        gap, u = self.places(samples) if at is None else at
        along = np.broadcast_to(along, (self.n - 1, self.dims))[gap]
        matrix, constant = self.derivative(gap, u, order, along)
        factor = self.second**order / self.unit
        for side, bound in ((1, upper), (-1, lower)):
            offset = (along * self.origin).sum(axis=1) if order == 0 else 0.0
            scaled = (np.broadcast_to(bound, (self.n - 1,))[gap] - offset) * factor
            finite = np.isfinite(scaled)
            size = np.maximum(np.abs(scaled[finite]), 1e-3)
            self.rows.append(sparse.diags(side / size) @ matrix[finite])
            self.uppers.append(side * (scaled - constant)[finite] / size)

    def norm(self, bound, samples=40):
        """Bound the norm of the velocity."""
        gap, u = self.places(samples)
        scaled = (np.broadcast_to(bound, (self.n - 1,)) * self.second / self.unit)[gap]
        eye = np.eye(self.dims)
        each = [self.derivative(gap, u, 1, np.tile(eye[d], (len(gap), 1))) for d in range(self.dims)]
        for r in range(len(gap)):
            self.cones.append(
                (
                    sparse.vstack([sparse.csr_matrix((1, self.select.shape[1])), *[m[r] / scaled[r] for m, _ in each]]),
                    np.concatenate([[1.0], [-c[r] / scaled[r] for _, c in each]]),
                )
            )

    def _solved(self, hessian, gradient, extra=None):
        rows, uppers = (
            sparse.vstack(self.rows or [sparse.csr_matrix((0, len(gradient)))]),
            np.concatenate(self.uppers or [np.zeros(0)]),
        )
        if extra is not None:
            rows, uppers = extra(rows, uppers)
        parts, cones = [rows], [clarabel.NonnegativeConeT(rows.shape[0])] if rows.shape[0] else []
        for matrix, side in self.cones:
            parts.append(matrix if extra is None else sparse.hstack([matrix, sparse.csr_matrix((len(side), 1))]))
            uppers = np.concatenate([uppers, side])
            cones.append(clarabel.SecondOrderConeT(len(side)))
        settings = clarabel.DefaultSettings()
        settings.verbose, settings.max_iter = False, 500
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-10
        matrix = sparse.csc_matrix(sparse.vstack(parts))
        return clarabel.DefaultSolver(
            sparse.csc_matrix(sparse.triu(hessian)), gradient, matrix, uppers, cones, settings
        ).solve()

    def minimum(self):
        """Return a lower bound of the cost (the dual value), or None where there is proved to be no point."""
        root = self.root @ self.select
        offset = self.root @ self.base
        answer = self._solved(sparse.csc_matrix(2 * root.T @ root), np.asarray(2 * root.T @ offset))
        if "PrimalInfeasible" in str(answer.status):
            return None
        assert "Solved" in str(answer.status), answer.status
        return float(answer.obj_val_dual + offset @ offset) * self.weight

    def giving(self):
        """Return the least part by which all linear limits must give: below 0 where there is room."""

        def elastic(rows, uppers):
            rows = sparse.hstack([rows, -np.ones((rows.shape[0], 1))])
            least = sparse.csr_matrix(([-1.0], ([0], [rows.shape[1] - 1])), (1, rows.shape[1]))
            return sparse.vstack([rows, least]), np.append(uppers, 1.0)

        n = self.select.shape[1] + 1
        gradient = np.eye(1, n, n - 1)[0]
        # far states cost a little, so that the program has one answer
        answer = self._solved(sparse.csc_matrix(1e-9 * sparse.eye(n)), gradient, elastic)
        assert "Solved" in str(answer.status), answer.status
        return float(np.array(answer.x)[-1])


@dataclass
class Problem:
    """A request's body and options, and a curve that keeps all of it (None where that is not known)."""

    seed: int
    body: dict
    order: int
    known: Trajectory | None

    @property
    def options(self):
        return {"order": self.order}

    def sampled(self, parts=1, samples=40, scale=1.0):
        """Return the reference for it: positions, node states at the ends, and all limits at samples."""
        times, points = np.array(self.body["times"]), np.array(self.body["waypoints"])
        n, dims = points.shape
        at = np.concatenate([np.linspace(a, b, parts, endpoint=False) for a, b in zip(times, times[1:], strict=False)])
        at = np.append(at, times[-1])
        states = np.full((self.order, len(at), dims), np.nan)
        states[0, ::parts] = points
        for side, node in (("start", 0), ("end", -1)):
            for r in range(1, self.order):
                states[r, node] = self.body.get(side, {}).get(NAMES[r], np.zeros(dims))
        made = Sampled(at, states)
        own = self.body.get("segment_limits") or [None] * (n - 1)
        for m, name in enumerate(NAMES):
            sides = np.array([bounds(entry, name, dims) for entry in [self.body.get("limits"), *own]])
            lower = np.maximum(sides[0, 0], sides[1:, 0])[np.repeat(np.arange(n - 1), parts)]
            upper = np.minimum(sides[0, 1], sides[1:, 1])[np.repeat(np.arange(n - 1), parts)]
            for d in range(dims):
                made.limit(m, np.eye(dims)[d], lower[:, d] * scale, upper[:, d] * scale, samples)
        return made


def bounds(limits, name, dims):
    value = (limits or {}).get(name)
    if value is None:
        return np.full((2, dims), [[-np.inf], [np.inf]])
    if isinstance(value, dict):
        sides = [value.get("lower", -np.inf), value.get("upper", np.inf)]
    else:
        sides = [-np.array(value, dtype=float), value]
    read = np.array([np.broadcast_to(np.array(s, dtype=float), dims) for s in sides])
    return np.where(np.isnan(read), [[-np.inf], [np.inf]], read)


def make_limited(seed, tightest=-9.0):
    """Return a problem that a known spline keeps, with room of 10^tightest to 0.1 of its peaks; or free, at fractions.

    Mixed: orders 2 to 4, gaps up to a ratio of 100, sizes from 1e-2 to 1e2, symmetric and asymmetric limits, positions,
    limits of segments, joints without limits, moving ends.
    """
    rng = np.random.default_rng(seed)
    n, dims, order = int(rng.integers(2, 14)), int(rng.integers(1, 4)), int(rng.choice([2, 3, 3, 3, 4]))
    spread = rng.uniform(0, 1)
    times = np.cumsum(10 ** rng.uniform(-spread, spread, n))
    points = rng.normal(size=(n, dims)) * 10 ** rng.uniform(-2, 2)
    step, gap = np.abs(np.diff(points, axis=0)).max(), np.median(np.diff(times))
    rates = [rng.normal(size=(n, dims)) * step / gap ** (m + 1) for m in range(order - 1)]
    moving = rng.random() < 0.3
    body = {"waypoints": points.tolist(), "times": times.tolist()}
    for m, x in enumerate(rates):
        if moving:
            for side, i in (("start", 0), ("end", -1)):
                body.setdefault(side, {})[NAMES[m + 1]] = x[i].tolist()
        else:
            x[0] = x[-1] = 0
    known = Trajectory.from_hermite(times, points, *rates)
    room = 1 + 10 ** rng.uniform(tightest, -1)
    found, limits, own = known.extrema(4), {}, [{} for _ in range(n - 1)]
    for m, name in enumerate(NAMES[: 3 if order == 2 else 4]):
        if rng.random() < 0.4:
            continue
        low, high, peak = found.low[m].min(axis=0), found.high[m].max(axis=0), found.peak(m)
        if m == 0:
            width = (high - low) * (room - 1 + 1e-3)
            limits[name] = {"lower": (low - width).tolist(), "upper": (high + width).tolist()}
        elif rng.random() < 0.5:
            limits[name] = [None if rng.random() < 0.1 else float(p * room) for p in peak]
        else:
            low, high = np.minimum(low * room, -1e-3 * peak), np.maximum(high * room, 1e-3 * peak)
            limits[name] = {"lower": low.tolist(), "upper": high.tolist()}
        if m and rng.random() < 0.3:
            for i in range(n - 1):
                if rng.random() < 0.3:
                    own[i][name] = (np.maximum(-found.low[m][i], found.high[m][i]) * room).tolist()
    body["limits"] = limits
    if any(own):
        body["segment_limits"] = [entry or None for entry in own]
    return Problem(seed, body, order, known)


def make_doubtful(seed, request_free):
    """Return a problem whose limits are the free optimum's peaks times 0.6 to 1.1: some cannot be kept."""
    rng = np.random.default_rng(seed)
    problem = make_limited(seed)
    body = {k: v for k, v in problem.body.items() if k not in ("limits", "segment_limits")}
    found, limits = request_free(body, problem.options).extrema(4), {}
    points, factor = np.array(body["waypoints"]), rng.uniform(0.6, 1.1)
    for m, name in enumerate(NAMES[: 3 if problem.order == 2 else 4]):
        if rng.random() < 0.4:
            continue
        if m == 0:
            low, high = found.low[0].min(axis=0), found.high[0].max(axis=0)
            width = (high - low) * max(factor - 1, 0) + 1e-3 * (high - low)
            low, high = np.minimum(low - width, points.min(axis=0)), np.maximum(high + width, points.max(axis=0))
            limits[name] = {"lower": low.tolist(), "upper": high.tolist()}
        else:
            limits[name] = (found.peak(m) * factor).tolist()
    return Problem(seed, {**body, "limits": limits}, problem.order, None)


@pytest.fixture(scope="session")
def sampled():
    """Return the reference program."""
    return Sampled


@pytest.fixture(scope="session")
def limited():
    """Return the function seed -> problem that is feasible by construction."""
    return make_limited


@pytest.fixture(scope="session")
def doubtful():
    """Return the function (seed, plan) -> problem that may be infeasible."""
    return make_doubtful


@pytest.fixture(scope="session")
def infeasible_by_samples():
    """Return whether limits at samples alone, four polynomials per gap, leave no point: by Clarabel, or by how much
    they would have to give."""

    def judge(problem):
        for samples in (12, 40, 120):
            made = problem.sampled(4, samples)
            try:
                if made.minimum() is None:
                    return True
            except AssertionError:  # Clarabel comes to no end at the edge
                pass
            if made.giving() > 1e-8:
                return True
        return False

    return judge
