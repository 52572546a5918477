"""How far a trajectory is from the straight lines between the waypoints: against dense samples, and by hand."""

import time
from dataclasses import replace

import numpy as np
import pytest

import planner.planning
from planner import PlanRequest, Trajectory, plan
from planner.corridors import polyline_distance
from planner.methods import METHODS
from planner.pieces import from_bernstein
from planner.types import Demands
from planner.verify import verify


def seen(curve, points, segment, count=2001):
    """Return the largest distance at ``count`` places of every piece."""
    largest = 0.0
    for i, (a, b) in enumerate(zip(curve.breaks, curve.breaks[1:], strict=False)):
        x = curve(np.linspace(a, np.nextafter(b, a), count)) - points[segment[i]]
        step = points[segment[i] + 1] - points[segment[i]]
        square = step @ step
        share = np.clip(x @ step / square, 0, 1) if square > 0 else np.zeros(count)
        largest = max(largest, np.linalg.norm(x - share[:, None] * step, axis=1).max())
    return largest


def random_motion(rng, degree=3):
    n, dims, per = int(rng.integers(2, 8)), int(rng.integers(1, 8)), int(rng.integers(1, 5))
    points = rng.normal(size=(n, dims))
    if n > 2 and rng.random() < 0.5:
        points[1] = points[0]  # held, or left and come back to
    at = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 2, (n - 1) * per))])
    path = Trajectory.from_hermite(np.arange(n), points)(np.linspace(0, n - 1, len(at)))
    states = [rng.normal(size=path.shape) * rng.choice([0.1, 1, 10]) for _ in range((degree - 1) // 2)]
    path[np.arange(len(at)) % per > 0] += 0.1 * rng.normal(size=(int((np.arange(len(at)) % per > 0).sum()), dims))
    return Trajectory.from_hermite(at, path, *states), points, np.repeat(np.arange(n - 1), per)


def told(curve, points, at=None, **demands):
    at = np.array([curve.start, curve.end]) if at is None else at
    return verify(curve, Demands(curve.dims, waypoints=np.array(points), **demands), at, polyline=True).path_deviation


@pytest.mark.parametrize("degree", [1, 3, 5, 7])
def test_against_dense_samples(degree):
    rng = np.random.default_rng(degree)
    print("seed", degree)
    for _ in range(40):
        curve, points, segment = random_motion(rng, degree)
        unit, shift = 10 ** rng.uniform(-4, 3), rng.normal(size=curve.dims)
        curve, points = Trajectory(curve.breaks, curve.coefficients * unit), points * unit
        found, sampled = polyline_distance(curve, points, segment), seen(curve, points, segment)
        assert sampled * (1 - 1e-9) <= found + 1e-13 * unit and found <= sampled * (1 + 1e-3) + 1e-13 * unit
        at = np.append(curve.breaks[:-1][np.diff(segment, prepend=-1) > 0], curve.end)
        assert told(curve, points, at) == pytest.approx(found, rel=1e-12, abs=1e-13 * unit)
        moved = Trajectory(curve.breaks, np.vstack([curve.coefficients[:-1], curve.coefficients[-1:] + shift]))
        assert polyline_distance(moved, points + shift, segment) == pytest.approx(found, rel=2e-8, abs=1e-13)


def test_extrema_to_the_last_digits():
    rng = np.random.default_rng(2)
    for _ in range(20):
        curve, points, segment = random_motion(rng)
        found = polyline_distance(curve, points, segment)
        piece = max(range(curve.pieces), key=lambda i: seen(curve.part(i, i + 1), points, segment[i : i + 1], 301))
        x = curve.part(piece, piece + 1)
        left, right = x.start, x.end
        for _ in range(12):  # ever closer around the farthest sample
            t = np.linspace(left, right, 301)
            offset, step = x(t) - points[segment[piece]], points[segment[piece] + 1] - points[segment[piece]]
            share = np.clip(offset @ step / max(step @ step, 1e-300), 0, 1)
            far = np.linalg.norm(offset - share[:, None] * step, axis=1)
            k = int(far.argmax())
            left, right = t[max(k - 1, 0)], t[min(k + 1, 300)]
        assert far.max() * (1 - 1e-12) <= found <= far.max() * (1 + 1.1e-8)


def test_by_hand():
    line = [[0.0, 0.0], [1.0, 0.0]]
    # along x = t, y = c (t - 3 t² + 2 t³): extrema ±c √3/18
    bump = Trajectory.from_powers([0, 1], np.array([[[0.0, 0.0]], [[1.0, 18.0]], [[0.0, -54.0]], [[0.0, 36.0]]]))
    assert told(bump, line) == pytest.approx(3**0.5, rel=1e-8)
    # beyond either end of the line the nearest point is that end
    over = Trajectory.from_powers([0, 1], np.array([[[0.0]], [[3.0]], [[-2.0]]]))  # to 1 by way of 1.125
    assert told(over, [[0.0], [1.0]]) == pytest.approx(0.125, rel=1e-8)
    before = Trajectory.from_powers([0, 1], np.array([[[0.0]], [[-1.0]], [[2.0]]]))  # back to -0.125 first
    assert told(before, [[0.0], [1.0]]) == pytest.approx(0.125, rel=1e-8)
    # (1, 0) + (3, 4) from the end: not 4 across the line, but 5
    assert told(Trajectory.from_hermite([0, 1, 2], [[0.0, 0.0], [4.0, 4.0], [1.0, 0.0]]), line) == pytest.approx(5.0)
    # a waypoint to itself: distance from the point
    dwell = Trajectory.from_powers([0, 1], np.array([[[0.0, 0.0]], [[4.0, 0.0]], [[-4.0, 0.0]]]))
    assert told(dwell, [[0.0, 0.0], [0.0, 0.0]]) == pytest.approx(1.0, rel=1e-8)
    # what counts is the line of the own segment, not the nearest one
    corner, at = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], np.array([0.0, 1.0, 2.0])
    early = Trajectory.from_hermite([0, 0.5, 1, 2], [[0, 0], [1, 0.5], [1, 0], [1, 1]])
    assert told(early, corner, at) == pytest.approx(0.5)
    assert told(Trajectory.from_hermite(at, corner), corner, at) == 0.0
    assert told(Trajectory.hold([1.0, 2.0], 0.0, 1.0), [[1.0, 2.0], [1.0, 2.0]]) == 0.0


def test_a_quarter_of_a_circle_is_one_away_from_its_centre():
    half = 0.5**0.5
    control = np.array([[[1.0, 0.0]], [[half, half]], [[0.0, 1.0]]])
    circle = Trajectory(np.array([0.0, 1.0]), from_bernstein(control), from_bernstein(np.array([[1.0], [half], [1.0]])))
    found = polyline_distance(circle, np.zeros((2, 2)), np.zeros(1, dtype=np.int64))
    assert 1.0 - 1e-15 <= found <= 1.0 + 1.1e-8
    found = polyline_distance(circle, np.array([[1.0, 0.0], [0.0, 1.0]]), np.zeros(1, dtype=np.int64))
    assert found == pytest.approx(1 - half, rel=1e-8)


def test_numbers_beyond_squares():
    rest = np.zeros(1, dtype=np.int64)
    for unit in (1e-300, 1e-160, 1e120):
        curve = Trajectory.from_powers([0, 1], np.array([[[0.0]], [[3.0]], [[-2.0]]]) * unit)
        assert polyline_distance(curve, np.array([[0.0], [unit]]), rest) == pytest.approx(0.125 * unit, rel=1e-7)
    assert polyline_distance(Trajectory.hold([1e200], 0.0, 1.0), np.array([[0.0], [1.0]]), rest) == np.inf


def test_it_is_told_and_not_judged():
    points, at = np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([0.0, 1.0])
    arc = Trajectory.from_powers([0, 1], np.array([[[0.0, 0.0]], [[1.0, 400.0]], [[0.0, -400.0]]]))
    demands = Demands(2, waypoints=points)
    found = verify(arc, demands, at, polyline=True)
    assert found.holds and not found.checks and found.path_deviation == pytest.approx(100.0)
    assert verify(arc, demands, at).path_deviation is None
    assert verify(arc, demands, polyline=True).path_deviation is None  # nobody knows when the waypoints are passed
    assert verify(arc, Demands(2), at, polyline=True).path_deviation is None
    wrong = verify(arc, demands, np.array([0.0, 2.0]), polyline=True)
    assert not wrong.holds and wrong.path_deviation is None


def test_a_method_asks_for_it(monkeypatch):
    request = PlanRequest.of([[0.0, 0.0], [1.0, 0.5], [0.5, 2.0]], times=[0, 1, 2])
    plain = plan(request, "cubic_spline")
    assert plain.certificate.path_deviation is None
    row = METHODS["cubic_spline"]
    asking = replace(row, solve=lambda *given: replace(row.solve(*given), polyline=True))
    monkeypatch.setitem(planner.planning.METHODS, "cubic_spline", asking)
    found = plan(request, "cubic_spline").certificate
    assert found.holds and found.checks == plain.certificate.checks
    assert found.path_deviation == pytest.approx(seen(plain.trajectory, request.waypoints, np.arange(2)), rel=1e-5)
    assert found.path_deviation > 0.01


@pytest.mark.parametrize("method", ["cubic_spline", "quintic_spline", "minimum_jerk", "ruckig"])
def test_other_methods_tell_none(method):
    timed = {"times": [0, 1, 2]} if METHODS[method].capabilities(METHODS[method].options()).timing == "given" else {}
    limits = {"velocity": 5.0, "acceleration": 50.0, "jerk": 5000.0} if method == "ruckig" else {}
    request = PlanRequest.of([[0.0, 0.0], [1.0, 0.5], [0.5, 2.0]], limits=limits, **timed)
    assert plan(request, method).certificate.path_deviation is None


def test_it_takes_little_time():
    rng = np.random.default_rng(0)
    points = rng.normal(size=(11, 7))
    at = np.linspace(0, 10, 151)
    path = Trajectory.from_hermite(np.arange(11), points)(at)
    curve, segment = Trajectory.from_hermite(at, path, rng.normal(size=path.shape)), np.repeat(np.arange(10), 15)
    polyline_distance(curve, points, segment)
    taken = []
    for _ in range(20):
        started = time.perf_counter()
        polyline_distance(curve, points, segment)
        taken.append(time.perf_counter() - started)
    assert min(taken) < 2e-3
