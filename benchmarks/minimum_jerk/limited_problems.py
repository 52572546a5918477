"""Problems with limits between what is barely possible and what nothing breaks, and the programs that peers solve.

Random walks with times that follow the steps. A joint's limits of velocity, acceleration and jerk are its peaks without
limits times g + f (1 - g): g, the edge, is the least factor that 20 samples a gap can keep, f = 1 binds nothing.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csc_matrix, hstack, triu, vstack

from planner import PlanRequest, Trajectory
from planner.curves import quintic_spline
from planner.limits import QUANTITIES, Boundary
from problems.minimum_derivative import MinimumDerivative

from ..figures import Array

SAMPLES = 20
#: The edges of the joints' limits, by waypoints and joints, as ``edges`` finds them; that takes too long for the large.
EDGES = {
    (10, 7): (0.950343, 0.956622, 0.990759, 0.966498, 0.896499, 0.940152, 0.975776),
    (100, 7): (0.995301, 0.883386, 0.916479, 0.895229, 0.852112, 0.940140, 0.898512),
    (1000, 3): (0.880925, 0.809793, 0.878906),
}


@dataclass(frozen=True, eq=False)
class Program:
    """min 1/2 y'Hy + g'y, lower <= G y <= upper: one joint's node states, limits at samples, in units near one.

    In the forms that solvers want, none of which is timed: ``above`` is the upper half of H.
    """

    hessian: csc_matrix
    gradient: Array
    rows: csc_matrix
    lower: Array
    upper: Array

    @cached_property
    def above(self) -> csc_matrix:
        """The upper triangle of H."""
        return csc_matrix(triu(self.hessian))

    @cached_property
    def both(self) -> tuple[csc_matrix, Array]:
        """Rows and bounds of the same limits on one side only."""
        return csc_matrix(vstack([self.rows, -self.rows])), np.concatenate([self.upper, -self.lower])

    @cached_property
    def dense(self) -> tuple[Array, Array]:
        """H and G with all their zeros."""
        return self.hessian.toarray(), np.ascontiguousarray(self.rows.toarray())


@dataclass(frozen=True, eq=False)
class Limited:
    """A request with limits, as it comes to a method: at rest at both ends."""

    request: PlanRequest
    limits: Array  # (3, D)

    @classmethod
    def of(cls, count: int, dims: int, share: float) -> "Limited":
        """Return the problem with limits at this share f of the way from the edge to the peaks."""
        times, points = walk(count, dims)
        edge = np.array(EDGES[count, dims])
        return cls.within(times, points, free_peaks(times, points) * (edge + share * (1.0 - edge)))

    @classmethod
    def within(cls, times: Array, points: Array, limits: Array) -> "Limited":
        """Return the problem with these limits (3, D)."""
        bounds = {name: row.tolist() for name, row in zip(QUANTITIES[1:], limits, strict=True)}
        still = np.zeros(points.shape[1])
        rest = Boundary(velocity=still, acceleration=still)
        return cls(replace(PlanRequest.of(points, times=times, limits=bounds), start=rest, end=rest), limits)

    @cached_property
    def statements(self) -> list[MinimumDerivative]:
        """The joints' statements, in units of the median gap and of the joint's range."""
        points = self.request.waypoints
        states = np.full((3, len(points), 1), np.nan)
        states[0], states[1:, [0, -1]] = 0.0, 0.0
        moved = (points - points[0]) / self._ranges
        return [MinimumDerivative(self._gaps / self._second, x[:, None], states) for x in moved.T]

    @cached_property
    def _gaps(self) -> Array:
        assert self.request.times is not None
        return np.diff(self.request.times)

    @cached_property
    def _second(self) -> float:
        return float(np.median(self._gaps))

    @cached_property
    def _ranges(self) -> Array:
        return np.ptp(self.request.waypoints, axis=0)

    def programs(self, samples: int = SAMPLES) -> list[Program]:
        """Return the joints' programs with limits at the ends and so many samples of every gap."""
        found = []
        for one, limits, unit in zip(self.statements, self.limits.T, self._ranges, strict=True):
            parts = [_sampled(one, m, limits[m - 1] * self._second**m / unit, samples) for m in (1, 2, 3)]
            rows, lower, upper = (list(part) for part in zip(*parts, strict=True))
            bounds = np.concatenate(lower), np.concatenate(upper)
            program = one.program()
            found.append(Program(program.hessian(), program.gradient, csc_matrix(vstack(rows)), *bounds))
        return found

    def motion(self, answers: list[Array]) -> Trajectory:
        """Return the trajectory of the programs' answers."""
        nodes = [one.filled(y)[1:] for one, y in zip(self.statements, answers, strict=True)]
        rates = np.concatenate(nodes, axis=2) * self._ranges / self._second ** np.arange(1.0, 3.0)[:, None, None]
        return Trajectory.from_states(self.request.times, self.request.waypoints, np.ascontiguousarray(rates))

    def violation(self, motion: Trajectory) -> float:
        """Return by how much the worst exact peak exceeds its limit, relative to it."""
        found = motion.extrema(4)
        return max(float((found.peak(m) / self.limits[m - 1]).max()) - 1.0 for m in (1, 2, 3))


def walk(count: int, dims: int) -> tuple[Array, Array]:
    """Return times (N,) that suit speeds of 2, accelerations of 10, jerks of 100, and a random walk (N, D)."""
    points = np.cumsum(np.random.default_rng(0).normal(0.0, 0.6, (count, dims)), axis=0)
    steps = np.abs(np.diff(points, axis=0)).max(axis=1)
    gaps = np.maximum.reduce([1.2 * steps / 2.0, np.sqrt(4.0 * steps / 10.0), np.cbrt(20.0 * steps / 100.0)]) + 0.02
    return np.concatenate([[0.0], np.cumsum(gaps)]), points


def free_peaks(times: Array, points: Array) -> Array:
    """Return the peaks of velocity, acceleration and jerk of the motion without limits, (3, D)."""
    found = quintic_spline(times, points).extrema(4)
    return np.stack([found.peak(m) for m in (1, 2, 3)])


def edges(count: int, dims: int) -> Array:
    """Return the least factors of the free peaks that motions keep at the samples, (D,): linear programs."""
    times, points = walk(count, dims)
    found = []
    for one in Limited.within(times, points, free_peaks(times, points)).programs():
        half, middle = 0.5 * (one.upper - one.lower), 0.5 * (one.upper + one.lower)
        matrix = vstack([hstack([one.rows, -half[:, None]]), hstack([-one.rows, -half[:, None]])])
        size = len(one.gradient)
        bounds = [(None, None)] * size + [(0.0, None)]
        cost = np.append(np.zeros(size), 1.0)
        answer = linprog(cost, csc_matrix(matrix), np.concatenate([middle, -middle]), bounds=bounds, method="highs-ipm")
        found.append(answer.fun)
    return np.array(found)


def _sampled(one: MinimumDerivative, order: int, limit: float, samples: int) -> tuple[csc_matrix, Array, Array]:
    """Return rows and bounds of a derivative's limit at samples, divided by it; none twice, none without unknowns."""
    gaps, u = len(one.h), np.linspace(0.0, 1.0, samples + 1)
    u = u if order == 3 else u[:-1]  # only the jerk may jump between gaps
    gap, u = np.repeat(np.arange(gaps), len(u)), np.tile(u, gaps)
    matrix, constant = one.rows(gap, u, np.full(len(gap), order), np.ones((len(gap), 1)))
    kept = np.diff(matrix.indptr) > 0
    constant = constant[kept] / limit
    return csc_matrix(matrix[kept] / limit), -1.0 - constant, 1.0 - constant
