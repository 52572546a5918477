"""How far a motion is from its limits, and that the peers solve the same problems."""

import numpy as np
import pytest

from benchmarks.path_timing import given_stations, with_jerk
from benchmarks.path_timing.peers import COPP, copp_solve, imported, toppra_solve
from benchmarks.path_timing.problems import Posed, uniform
from benchmarks.path_timing.rows import Slowed, of_law, of_profile
from benchmarks.path_timing.tables import section
from planner import Trajectory
from planner.timing import third_order

CASE = "rand7_w10_s1"


def test_even_stations_have_the_breaks_among_them():
    course = Posed.of(CASE, jerk=False).course
    grid = uniform(course, 100)
    assert len(grid) == pytest.approx(100, abs=5) and (np.diff(grid) > 0).all()
    assert np.isin(course.curve.breaks, grid).all()


def test_slowing_is_by_the_root_that_the_derivative_asks_for():
    slow = Slowed.of(np.array([1.0, 1.44, 1.728]), 2.0)
    assert slow.beyond == pytest.approx(0.728) and slow.strict == pytest.approx(2.4)


@pytest.mark.parametrize("missing", [True, False])
def test_a_peer_that_is_not_there_says_why(missing):
    found, why = imported("no_such_package" if missing else "json")
    assert (found is None) == missing and why == ("not measured: No module named 'no_such_package'" if missing else "")


def test_peers_find_the_profile_on_the_same_stations():
    problem = Posed.of(CASE, jerk=False)
    grid = uniform(problem.course, 50)
    a = given_stations.ours(problem.course, grid)()
    peers = [toppra_solve(problem, grid)()] + ([] if COPP is None else [copp_solve(problem.course, grid)()])
    for other in peers:
        assert given_stations.seconds_of(other, grid) == pytest.approx(given_stations.seconds_of(a, grid), rel=1e-3)


def test_a_profile_is_looked_at_as_the_law_it_stands_for():
    """A straight line at constant path jerk on both intervals: the same from times and from places."""
    problem = Posed.of("toppra_straight_line", jerk=True)
    course = problem.course
    start, end = course.curve.start, course.curve.end
    h = 0.5 * (end - start)
    grid, far = np.array([start, start + h, end]), 0.3
    tau = 3.0 * h / np.sqrt(far)
    jerk = 6.0 * h / tau**3
    law = Trajectory.from_powers(
        [0.0, tau, 2.0 * tau],
        np.array([[start, start + h], [0.0, np.sqrt(far)], [0.0, -0.5 * jerk * tau], [jerk / 6.0, jerk / 6.0]])[
            ..., None
        ],
    )
    assert float(law(2.0 * tau)[0]) == pytest.approx(end)
    of_places = of_profile(course, grid, np.array([0.0, far, 0.0]), np.zeros(3), law.duration)
    of_times = of_law(course, law)
    assert of_places.strict == pytest.approx(of_times.strict, rel=1e-3)


def test_ours_with_jerk_on_many_stations_is_the_best_known():
    problem = Posed.of(CASE, jerk=True)
    spline = with_jerk.ours(problem.course, uniform(problem.course, 1000))
    law = third_order.law_of(spline).law
    assert law.duration == pytest.approx(problem.best["duration"], rel=5e-3)


def test_nothing_measured_is_nothing_told():
    assert section([]) == ""
