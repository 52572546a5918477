"""The problems with limits, and what a standing says."""

import numpy as np
import pytest

from benchmarks.minimum_jerk.limited_problems import EDGES, Limited, edges, free_peaks, walk
from benchmarks.minimum_jerk.qp_solvers import by_clarabel, by_piqp
from benchmarks.minimum_jerk.rounds import Standing, in_turn


def test_the_edges_are_what_the_linear_programs_find():
    assert edges(10, 7) == pytest.approx(EDGES[10, 7], abs=1e-6)


def test_programs_without_binding_limits_give_the_spline():
    times, points = walk(6, 2)
    problem = Limited.within(times, points, 10.0 * free_peaks(times, points))
    for solver in (by_piqp, by_clarabel):
        motion = problem.motion([solver(p) for p in problem.programs()])
        assert problem.violation(motion) == pytest.approx(-0.9, abs=1e-5)


def test_programs_keep_the_limits_at_their_samples():
    problem = Limited.of(10, 7, 0.5)
    motion = problem.motion([by_clarabel(p) for p in problem.programs(4)])
    at = np.concatenate([np.linspace(a, b, 5)[:-1] for a, b in zip(motion.breaks[:-1], motion.breaks[1:], strict=True)])
    sampled = [np.abs(motion(at, m)).max(axis=0) / problem.limits[m - 1] for m in (1, 2, 3)]
    assert np.max(sampled) < 1.0 + 1e-6 < 1.0 + problem.violation(motion)


@pytest.mark.parametrize(("figure", "ratio", "met"), [(False, 2.0, True), (False, 1.0, False), (True, 1.0, True)])
def test_goals_are_least_ratios_of_peers_and_most_of_figures(figure, ratio, met):
    standing = Standing("part", "problem", 3, 1000, "entry", 2.0, ratio, 1.5, figure)
    assert standing.met is met and standing.each_ns == pytest.approx(2000.0)


def test_slow_calls_are_made_in_two_rounds_unless_all_are_asked(monkeypatch):
    monkeypatch.setattr("benchmarks.minimum_jerk.rounds.SLOW", 0.0)
    seconds = in_turn({"slow": lambda: None, "always": lambda: None}, 3, 60.0, always=("always",))
    assert {name: len(own) for name, own in seconds.items()} == {"slow": 2, "always": 3}
