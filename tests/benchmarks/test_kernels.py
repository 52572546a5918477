"""What a figure says of the times it was made from."""

import pytest

from benchmarks import figures, report
from benchmarks.figures import Figure, Task


def test_results_that_differ_are_not_timed():
    task = Task("a", "b", 10, lambda: 1.0, "peer", lambda: 2.0, goal=1.0, difference=lambda a, b: abs(a - b))
    (figure,) = figures.in_turn([task], 2)
    assert (figure.difference, figure.agrees, figure.ours_ms, figure.met) == (1.0, False, None, False)
    assert "| 1e+00 **(not timed)** |" in report._kernels([figure])


def test_every_round_calls_both_and_growth_is_by_item():
    called = []
    small = Task("small", "", 1, lambda: called.append("small"), "peer", lambda: called.append("peer"))
    (first, second) = figures.in_turn([small, Task("large", "", 10**6, lambda: called.append("large"))], 2)
    assert {"small", "peer", "large"} == set(called)
    assert first.rounds == second.rounds == 2
    assert first.growth is None and second.growth < 0.1
    assert first.ratio > 0 and second.ratio is None and second.met is None


@pytest.mark.parametrize(("ratio", "told"), [(2.5, "| ≥ 2 | yes |"), (1.5, "| ≥ 2 | **no** |")])
def test_the_report_tells_whether_the_goal_is_met(ratio, told):
    figure = Figure("a", "b", "peer", 1000, 1e-15, True, 2.0, 1.0, ratio, ratio, None, 3)
    assert told in report._kernels([figure])
    assert figure.each_ns == pytest.approx(1000.0)
