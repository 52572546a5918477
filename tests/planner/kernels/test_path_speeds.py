"""Fastest speeds along a path and the bound on every law: laws, references, and paths that are hard on rounding."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import linprog

from planner import curves
from planner.kernels.path_speeds import fastest_speeds, interval_derivatives, speed_caps
from planner.kernels.path_speeds_bound import least_duration
from planner.paths import PathOptions, build_path
from planner.trajectory import Trajectory

ENDS = np.array([0.0, 1.0])
CASES = {c["name"]: c for c in json.loads((Path(__file__).parents[2] / "data" / "paths.json").read_text())["cases"]}


def sides(limit):
    if isinstance(limit, dict):
        return np.array(limit["lower"], float), np.array(limit["upper"], float)
    limit = np.array(limit, float)
    return (-limit, limit) if limit.ndim == 1 else (limit[:, 0], limit[:, 1])


def case(name):
    request = CASES[name]["request"]
    option = PathOptions.model_validate({"path": request["options"]["path"]}).path
    curve = build_path(option, np.array(request["waypoints"], float)).curve
    return curve, sides(request["limits"]["velocity"]), sides(request["limits"]["acceleration"])


def uniform(curve, n):
    """Return n intervals or a few more, the breaks among the stations."""
    width = np.diff(curve.breaks)
    each = np.maximum(np.ceil(n * width / width.sum() - 1e-9), 1).astype(int)
    parts = [np.linspace(a, b, m + 1)[1:] for a, b, m in zip(curve.breaks, curve.breaks[1:], each, strict=False)]
    return np.concatenate([curve.breaks[:1], *parts])


class Solved:
    """The profile on a grid, with what it was made from."""

    def __init__(self, curve, velocity, acceleration, grid, first=0.0, last=0.0, norm=np.inf):
        n, dims = len(grid) - 1, curve.dims

        def rows(limit):
            return np.broadcast_to(limit, (n, dims)).copy()

        self.grid, self.steps = grid, np.diff(grid)
        self.slopes, self.bends = derivatives(curve, grid, ENDS)
        self.lower, self.upper = (rows(x) for x in acceleration)
        self.v_lower, self.v_upper = (rows(x) for x in velocity)
        self.norm = np.full(n, norm)
        self.caps, self.best, self.least, self.a = np.empty((4, n + 1))
        self.solve(first, last)

    def solve(self, first, last):
        speed_caps(self.slopes, self.v_lower, self.v_upper, self.norm, np.ones(len(self.steps)), self.caps)
        self.first, self.last = first, last
        self.status = fastest_speeds(
            self.steps, self.slopes, self.bends, self.caps, self.lower, self.upper, first, last,
            self.best, self.least, self.a,
        )  # fmt: skip
        return self

    @property
    def taus(self):
        root = np.sqrt(self.a)
        return 2.0 * self.steps / (root[1:] + root[:-1])

    @property
    def duration(self):
        return float(self.taus.sum())

    def bound(self, curve, seconds=None):
        seconds = np.empty(len(self.steps)) if seconds is None else seconds
        return least_duration(
            curve.breaks, curve.coefficients, self.grid, self.lower, self.upper, self.v_lower, self.v_upper, self.norm,
            self.first, self.last, seconds,
        )  # fmt: skip

    def check(self):
        """All rows hold, to 1e-9 of the limit and to the rounding of their own terms, and the caps exactly."""
        assert self.status == (0, 0)
        assert np.isfinite(self.a).all() and (self.a >= 0.0).all()
        assert (self.a <= self.caps).all()
        assert (self.least <= self.a).all() and (self.a <= self.best).all()
        u = np.diff(self.a) / (2.0 * self.steps)
        rounding = (self.a[1:] + self.a[:-1]) / (2.0 * self.steps)
        for end, a in enumerate((self.a[:-1], self.a[1:])):
            value = self.bends[end] * a[:, None] + self.slopes[end] * u[:, None]
            own = np.abs(self.bends[end]) * a[:, None] + np.abs(self.slopes[end]) * rounding[:, None]
            slack = 1e-9 * np.minimum(self.upper, -self.lower)
            slack = np.where(np.isfinite(slack), slack, 0.0) + 1e-15 * own
            assert (value <= self.upper + slack).all() and (value >= self.lower - slack).all()
        return self


def derivatives(curve, grid, fractions, orders=2):
    out = np.empty((orders, len(fractions), len(grid) - 1, curve.dims))
    interval_derivatives(curve.breaks, curve.coefficients, grid, fractions, out)
    return out


def random_problem(seed):
    """Return a random spline with limits, printed when a test fails."""
    rng = np.random.default_rng(seed)
    dims, count = int(rng.integers(1, 12)), int(rng.integers(2, 8))
    points = rng.normal(size=(count, dims))
    knots = np.concatenate([[0.0], np.cumsum(np.exp(rng.uniform(-1.0, 1.0, count - 1)))])
    kind = seed % 3
    if kind == 0:
        curve = curves.cubic_spline(knots, points, "natural")
    elif kind == 1:
        curve = curves.cubic_spline(knots, points, "clamped")
    else:
        curve = curves.quintic_spline(knots, points)
    velocity = -np.exp(rng.normal(size=dims)), np.exp(rng.normal(size=dims))
    acceleration = -np.exp(rng.normal(size=dims)), np.exp(rng.normal(size=dims))
    if seed % 4 == 0:
        velocity[1][:] = np.inf
    print(f"seed {seed}: {dims} joints, {count} points, kind {kind}")
    return curve, velocity, acceleration, rng


# -- derivatives -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 5, 9])
@pytest.mark.parametrize("dims", [1, 3, 5, 7, 8, 9, 19])
@pytest.mark.parametrize("pieces", [1, 4])
def test_derivatives_are_the_paths(degree, dims, pieces):
    rng = np.random.default_rng(degree)
    breaks = np.cumsum(rng.uniform(0.3, 2.0, pieces + 1))
    curve = Trajectory(breaks, rng.normal(size=(degree + 1, pieces, dims)))
    grid, fractions = uniform(curve, 30), np.array([0.0, 0.3, 0.5, 1.0])
    out = derivatives(curve, grid, fractions, 3)
    places = grid[:-1] + fractions[1:3, None] * np.diff(grid)
    for order in (1, 2, 3):
        expected = np.stack([curve.derivative(order)(x) for x in places])
        assert out[order - 1, 1:3] == pytest.approx(expected, rel=1e-9, abs=1e-9 * (1 + np.abs(expected).max()))


def test_derivatives_at_breaks_are_those_of_the_intervals_own_piece():
    curve = Trajectory(np.array([0.0, 0.1, 0.3]), np.array([[[1.0], [-4.0]], [[0.0], [1.0]]]))
    for grid in (np.array([0.0, 0.05, 0.1, 0.3]), np.array([0.0, 0.05, np.nextafter(0.1, 1), 0.3])):
        out = derivatives(curve, grid, ENDS, 1)[0, :, :, 0]
        assert out == pytest.approx(np.array([[10.0, 10.0, -20.0]] * 2))


# -- laws ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(60))
def test_rows_and_caps_hold(seed):
    curve, velocity, acceleration, rng = random_problem(seed)
    grid = uniform(curve, int(rng.choice([7, 50, 400])))
    if seed % 5 == 0:
        grid = np.unique(np.concatenate([grid, grid[0] + 1e-6 * (grid - grid[0]), grid[-1] - 1e-6 * (grid - grid[0])]))
    solved = Solved(curve, velocity, acceleration, grid).check()
    assert np.isfinite(solved.duration)


@pytest.mark.parametrize("seed", range(40))
def test_end_speeds(seed):
    curve, velocity, acceleration, rng = random_problem(seed)
    solved = Solved(curve, velocity, acceleration, uniform(curve, 200))
    most = np.minimum(solved.best, 1e3)
    last = float(rng.uniform(0.0, 0.5)) * min(solved.caps[-1], 1.0)
    status, where = solved.solve(0.0, last).status
    if status == 1:
        assert 0 <= where <= len(solved.steps)
        return
    low, high = solved.least[0], min(solved.best[0], 1e3)
    solved.solve(high * 1.01 + 1e-9, last)
    assert solved.status[0] == 2 or solved.best[0] > 1e3
    if low > 1e-9:
        assert solved.solve(0.5 * low, last).status[0] == 3
    first = low + float(rng.uniform()) * (high - low)
    solved.solve(first, last).check()
    assert solved.a[0] == pytest.approx(first, rel=1e-9) and solved.a[-1] == last
    assert most.shape == solved.a.shape


@pytest.mark.parametrize("seed", range(12))
def test_the_controllable_speeds_are_those_of_linear_programs(seed):
    curve, velocity, acceleration, _ = random_problem(seed)
    solved = Solved(curve, velocity, acceleration, uniform(curve, 12)).check()
    for k in range(len(solved.steps)):
        p = solved.slopes[:, k] / (2.0 * solved.steps[k])
        x = np.concatenate([solved.bends[0, k] - p[0], -p[1]])
        y = np.concatenate([p[0], p[1] + solved.bends[1, k]])
        rows = np.stack([np.concatenate([x, -x]), np.concatenate([y, -y])], axis=1)
        limits = np.concatenate([solved.upper[k], solved.upper[k], -solved.lower[k], -solved.lower[k]])
        size = np.abs(rows).max(axis=1) + 1e-12
        ranges = [(0.0, min(solved.caps[k], 1e9)), (solved.least[k + 1], solved.best[k + 1])]
        found = linprog([-1.0, 0.0], rows / size[:, None], limits / size, bounds=ranges)
        assert solved.best[k] == pytest.approx(found.x[0], rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("seed", range(0, 24))
def test_the_reversed_path_mirrors_the_profile(seed):
    curve, velocity, acceleration, _ = random_problem(seed)
    grid = uniform(curve, 2000)
    forth = Solved(curve, velocity, acceleration, grid).check()
    flipped = Trajectory(curve.breaks[-1] - curve.breaks[::-1], reflected(curve.coefficients))
    turned = -velocity[1], -velocity[0]
    back = Solved(flipped, turned, acceleration, grid[-1] - grid[::-1]).check()
    assert back.duration == pytest.approx(forth.duration, rel=1e-4)  # at a joint's turn greed depends on the grid
    assert back.bound(flipped) == pytest.approx(forth.bound(curve), rel=1e-6)


def reflected(coefficients):
    """Return the pieces in reverse order, each in 1 - u."""
    size = len(coefficients)
    out = np.zeros_like(coefficients)
    for r in range(size):
        power = size - 1 - r
        poly = np.poly1d([-1.0, 1.0]) ** power if power else np.poly1d([1.0])
        for at, c in enumerate(poly.coeffs):
            out[size - len(poly.coeffs) + at] += c * coefficients[r]
    return np.ascontiguousarray(out[:, ::-1])


@pytest.mark.parametrize("seed", range(1, 13))
@pytest.mark.parametrize("factor", [1e-3, 3.0, 1e3])
def test_scaled_limits_scale_time(seed, factor):
    curve, velocity, acceleration, _ = random_problem(seed)
    grid = uniform(curve, 200)
    one = Solved(curve, velocity, acceleration, grid)
    other = Solved(curve, [v * factor for v in velocity], [a * factor**2 for a in acceleration], grid)
    assert other.duration * factor == pytest.approx(one.duration, rel=1e-9)
    assert other.bound(curve) * factor == pytest.approx(one.bound(curve), rel=1e-9)


def test_norm_and_tightening():
    curve = curves.linear(np.array([0.0, 1.0]), np.array([[0.0, 0.0], [3.0, 4.0]]))
    limits = (np.full(2, -2.0), np.full(2, 2.0))
    grid = np.linspace(0.0, 1.0, 51)
    slopes, _ = derivatives(curve, grid, ENDS)
    caps, tighten = np.empty(51), np.ones(50)
    tighten[20] = 0.25
    rows = [np.broadcast_to(x, (50, 2)).copy() for x in limits]
    speed_caps(slopes, *rows, np.full(50, 1.0), tighten, caps)
    expected = np.full(51, 0.04)
    expected[20:22] *= 0.25
    assert caps == pytest.approx(expected)
    solved = Solved(curve, limits, limits, grid, norm=1.0).check()
    assert solved.duration == pytest.approx(5.0 + 1.0 / 2.5, rel=1e-3)
    assert solved.bound(curve) == pytest.approx(5.0 + 1.0 / 2.5, rel=1e-8)


# -- references ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CASES)
def test_references(name):
    curve, velocity, acceleration = case(name)
    reference = CASES[name]["reference"]["velocity_acceleration"]["duration"]
    solved = Solved(curve, velocity, acceleration, uniform(curve, 10_000)).check()
    assert solved.duration == pytest.approx(reference, rel=1e-4)
    gap = solved.duration / solved.bound(curve) - 1.0
    # what the profile loses by its grid at rest ends and what the bound loses, both
    assert 0.0 <= gap < (4e-3 if "w200" in name else 2e-3)


@pytest.mark.parametrize("name", ["rand7_w5_s0", "rand7_w5_s1", "rand7_w10_s0", "rand7_w10_s1"])
def test_the_bound_closes_in(name):
    curve, velocity, acceleration = case(name)
    fine = Solved(curve, velocity, acceleration, uniform(curve, 20_000)).duration
    gaps = [fine / Solved(curve, velocity, acceleration, uniform(curve, n)).bound(curve) - 1.0 for n in (300, 1000)]
    assert gaps[0] > gaps[1] > 0.0
    assert gaps[0] < 3e-3 and gaps[1] < 3e-4


# -- the bound -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(30))
def test_no_law_undercuts_the_bound(seed):
    curve, velocity, acceleration, _ = random_problem(seed)
    fine = Solved(curve, velocity, acceleration, uniform(curve, 20_000))
    slack = 1.0 + 1e-4  # the fine profile breaks limits between stations by about this
    bounds = [Solved(curve, velocity, acceleration, uniform(curve, n)).bound(curve) for n in (10, 100, 1000)]
    assert all(0.0 <= b <= fine.duration * slack for b in bounds)
    assert bounds[0] <= bounds[1] * slack and bounds[1] <= bounds[2] * slack
    assert bounds[2] > 0.97 * fine.duration
    coarse = Solved(curve, velocity, acceleration, fine.grid[np.isin(fine.grid, curve.breaks)])
    seconds = np.empty(len(coarse.steps))
    assert coarse.bound(curve, seconds) == pytest.approx(seconds.sum())


@pytest.mark.parametrize("seed", range(12))
def test_the_bound_with_end_speeds_and_a_norm(seed):
    curve, velocity, acceleration, rng = random_problem(3 * seed)  # natural ends: q' is not zero there
    fine = Solved(curve, velocity, acceleration, uniform(curve, 20_000), norm=1.0)
    first = 0.5 * float(rng.uniform()) * fine.best[0]
    fine.solve(first, 0.0).check()
    for n in (30, 300):
        solved = Solved(curve, velocity, acceleration, uniform(curve, n), first=first, norm=1.0)
        assert solved.bound(curve) <= fine.duration * (1.0 + 1e-4)
    assert solved.bound(curve) > 0.97 * fine.duration


def test_the_bound_of_one_joint_is_the_optimum():
    curve = curves.linear(np.array([0.0, 1.0]), np.array([[0.0], [1.0]]))
    grid = np.linspace(0.0, 1.0, 21)
    solved = Solved(curve, (-np.ones(1), np.ones(1)), (-np.full(1, 2.0), np.full(1, 4.0)), grid)
    # 1/4 s up, 1/2 s down, over 1/8 and 1/4; the rest at speed 1
    assert solved.bound(curve) == pytest.approx(0.75 + 0.625, rel=1e-9)


# -- hard on rounding ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", [1e-12, 1e-7, 1e-5, 1.0, 1e5])
@pytest.mark.parametrize("boundary", ["natural", "clamped", "quintic"])
@pytest.mark.parametrize("kind", ["plain", "still joint", "repeated waypoint", "no velocity limit"])
def test_rest_to_rest_is_always_solved(scale, boundary, kind):
    rng = np.random.default_rng(3)
    points = rng.normal(size=(5, 4)) * scale
    if kind == "still joint":
        points[:, 0] = points[0, 0]
    if kind == "repeated waypoint":
        points[2] = points[1]
    knots = np.linspace(0.0, 1.0, 5)
    curve = curves.quintic_spline(knots, points) if boundary == "quintic" else None
    curve = curve or curves.cubic_spline(knots, points, boundary)
    speed = np.full(4, np.inf if kind == "no velocity limit" else 1.0)
    geometric = 0.5 ** np.arange(40)
    graded = np.unique(np.concatenate([uniform(curve, 400), geometric, 1.0 - geometric]))
    durations = []
    for grid in (uniform(curve, 400), graded, uniform(curve, 20_000)):
        solved = Solved(curve, (-speed, speed), (-np.ones(4), np.ones(4)), grid).check()
        assert 0.0 < solved.bound(curve) <= solved.duration * 1.05
        durations.append(solved.duration)
    assert durations == pytest.approx([durations[2]] * 3, rel=0.1)


def test_a_stretch_where_nothing_moves():
    points = np.array([[0.0, 0.0], [1.0, 2.0], [1.0, 2.0], [3.0, 0.0]])
    curve = curves.linear(np.arange(4.0), points)
    solved = Solved(curve, (-np.ones(2), np.ones(2)), (-np.ones(2), np.ones(2)), uniform(curve, 300)).check()
    assert np.isfinite(solved.duration)
    still = Solved(
        Trajectory(np.array([0.0, 1.0]), np.zeros((4, 1, 2))), (-np.ones(2), np.ones(2)), (-np.ones(2), np.ones(2)),
        np.linspace(0.0, 1.0, 11),
    )  # fmt: skip
    assert still.status == (0, 0) and np.isfinite(still.a).all()


@pytest.mark.parametrize("seed", range(40))
def test_rows_hold_on_data_that_is_no_path(seed):
    """Random rows, still and nearly still joints, stretches without motion, infinite limits and caps."""
    rng = np.random.default_rng(seed)
    print(f"seed {seed}")
    n, dims = int(rng.integers(1, 60)), int(rng.integers(1, 20))
    solved = Solved.__new__(Solved)
    solved.steps = 0.05 * np.exp(rng.uniform(-3.0, 3.0, n))
    solved.slopes, solved.bends = rng.normal(size=(2, n, dims)).cumsum(axis=1), 3.0 * rng.normal(size=(2, n, dims))
    if seed % 2:
        solved.slopes[:, n // 3 : n // 2] = 0.0
    if seed % 3 == 0:
        solved.slopes[:, :, -1] *= 1e-15
    solved.lower, solved.upper = -np.exp(rng.normal(size=(n, dims))), np.exp(rng.normal(size=(n, dims)))
    if seed % 5 == 0:
        solved.lower[:] = -np.inf
    solved.caps = np.exp(rng.normal(size=n + 1)) * float(rng.choice([0.1, 1.0, 100.0]))
    if seed % 7 == 0:
        solved.caps[rng.random(n + 1) < 0.5] = np.inf
    solved.best, solved.least, solved.a = np.empty((3, n + 1))
    solved.status = fastest_speeds(
        solved.steps, solved.slopes, solved.bends, solved.caps, solved.lower, solved.upper, 0.0, 0.0,
        solved.best, solved.least, solved.a,
    )  # fmt: skip
    solved.check()
