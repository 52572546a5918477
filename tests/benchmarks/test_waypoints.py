"""That the peers are given the same problems, and what the tables make of the lines."""

import numpy as np
import pytest

from benchmarks.path_timing.peers import COPP
from benchmarks.waypoints import growth, problems, program, quality, random_problems, speed
from benchmarks.waypoints.peers import quintic_course
from benchmarks.waypoints.rows import Line
from benchmarks.waypoints.tables import section

CASE = "d3_rand_1wp"


def test_plain_requests_have_no_waypoint_twice_and_only_what_the_peers_know():
    asked = problems.plain("ur6_duplicates")
    assert asked.count < problems.request_of("ur6_duplicates").count
    assert (np.diff(asked.waypoints, axis=0) != 0).any(axis=1).all()
    assert problems.request_of("d3_poslimits_5wp").limits.position is not None
    assert problems.plain("d3_poslimits_5wp").limits.position is None


@pytest.mark.parametrize("seed", range(6))
def test_random_states_at_the_ends_keep_the_limits(seed):
    asked = problems.random_request(seed, moving=True)
    for side in (asked.start, asked.end):
        for order, state in ((1, side.velocity), (2, side.acceleration)):
            limit = asked.limits.bounds(order, asked.dims)
            assert (limit.lower < state).all() and (state < limit.upper).all()
    assert problems.random_request(seed, moving=False).start.velocity is None


def test_long_requests_begin_alike():
    short, longer = problems.long_request(5), problems.long_request(9)
    assert (longer.waypoints[:5] == short.waypoints).all()


def test_the_curve_of_the_peers_passes_the_waypoints_smoothly():
    asked = problems.plain("d3_rand_5wp")
    times = problems.stop_times(asked)
    course = quintic_course(asked, times)
    assert course.curve(times) == pytest.approx(asked.waypoints, abs=1e-9)
    for order in range(1, 5):
        before, after = (course.curve(times[1:-1] + 1e-9 * side, order) for side in (-1, 1))
        assert after == pytest.approx(before, rel=1e-5, abs=1e-5)
    assert course.upper.shape == (3, course.curve.pieces, asked.dims)


def test_every_effort_is_near_the_best_known():
    rows = [quality._row(CASE, effort, 1) for effort in quality.EFFORTS]
    assert [r.entry for r in rows] == list(quality.EFFORTS)
    for row in rows:
        assert row.over < 5e-3 and row.over_stops < 0 and row.beyond <= 1e-6 and row.missed < 1e-9 and row.gap >= 0


def test_whole_plans_are_timed_beside_the_peers():
    rows = {r.entry: r for r in speed._problem(CASE, quick=True)}
    copp = [speed.copp_entry(n) for n in speed.STATIONS]
    assert {speed.OURS, speed.STOPS, speed.TOPPRA, copp[0]} <= set(rows)
    assert rows[speed.OURS].ratio == 1.0 and rows[speed.STOPS].over > 0
    if COPP is not None:
        fine, coarse = (rows[name] for name in copp)
        assert 0 < fine.over < coarse.over and fine.strict >= fine.duration


def test_the_program_has_one_optimum_for_both_solvers():
    rows = {r.entry: r for r in program._problem(CASE, quick=True)}
    assert rows[program.OURS].told == ""
    if program.CASADI is not None:
        assert rows[program.IPOPT].told == "" and abs(rows[program.IPOPT].over) < program.AGREE
        assert rows[program.BUILDING].ms > rows[program.IPOPT].ms


def test_growth_is_relative_to_its_base():
    rows = {r.waypoints: r for r in growth.measure(quick=True)}
    assert rows[growth.BASE].ratio == 1.0 and rows[5].goal is None


def test_random_problems_are_summed_up_by_kind():
    ends = random_problems.KINDS
    rows = [
        Line(
            random_problems.PART, f"seed 0, {ends[0]}", 1, 3, "", 3.0, duration=8.0, stops=10.0, beyond=-0.1, missed=0.0
        ),
        Line(random_problems.PART, f"seed 1, {ends[1]}", 1, 2, "", 5.0, duration=9.0, beyond=1e-7, missed=1e-12),
        Line(random_problems.PART, f"seed 2, {ends[0]}", 1, 2, "", 4.0, stops=10.0, told="refused"),
    ]
    still, moving, whole = random_problems.summaries(rows)
    assert (still.count, still.solved, still.stops, still.both, still.shorter, still.longer) == (2, 1, 2, 1, 1, 0)
    assert still.ratio == pytest.approx(0.8) and moving.ratio is None
    assert (whole.count, whole.solved, whole.beyond, whole.missed, whole.slowest) == (3, 2, 1e-7, 1e-12, 5.0)
    assert "| seed 2, at rest at both ends | 1 | 2 | refused |" in section(rows)


def test_a_random_problem_is_solved_or_its_refusal_told():
    row = random_problems._row(1)
    assert row.duration is not None and row.told == ""
    done, why = random_problems._tried(problems.random_request(1, moving=True), "trapezoidal")
    assert done is None and why.startswith("Unsupported: ")


def test_nothing_measured_is_nothing_told():
    assert section([]) == ""
