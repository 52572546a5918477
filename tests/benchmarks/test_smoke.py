"""The comparison runs, and reads the peers' answers as what they are."""

import csv
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]

#: All comparisons in their quick form: two minutes.
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench")
    command = [sys.executable, "-m", "benchmarks", "--quick", "--out", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == str(folder / "report.md")
    return folder


@pytest.fixture(scope="module")
def rows(out):
    with (out / "rows.csv").open(encoding="utf-8") as file:
        return {(r["group"], r["entry"]): r for r in csv.DictReader(file)}


def test_every_peer_has_its_rows(rows):
    assert {r["package"] for r in rows.values()} == {"waywright", "scipy", "toppra", "ruckig"}
    assert all(r["rounds"] == "1" for r in rows.values())


def test_our_answers_are_certified(rows):
    ours = [r for r in rows.values() if r["package"] == "waywright"]
    assert {r["entry"]: r["why"] for r in ours if r["certified"] != "True"} == {}


def test_the_quintic_spline_at_rest_is_the_curve_of_least_squared_jerk(rows):
    theirs, ours = rows["times", "scipy make_interp_spline(k=5)"], rows["times", "minimum_jerk"]
    assert float(theirs["squared_jerk"]) == pytest.approx(float(ours["squared_jerk"]), rel=1e-6)


def test_ruckig_is_read_exactly(rows):
    theirs, ours = rows["waypoints", "ruckig by segments"], rows["waypoints", "ruckig"]
    assert theirs["certified"] == "True", theirs["why"]
    assert float(theirs["duration"]) == pytest.approx(float(ours["duration"]), rel=1e-9)
    assert float(theirs["squared_jerk"]) == pytest.approx(float(ours["squared_jerk"]), rel=1e-6)


def test_toppra_is_read_at_the_right_waypoint_times(rows):
    assert float(rows["path", "toppra quick start"]["waypoint_error"]) < 1e-4


@pytest.fixture(scope="module")
def figures(out):
    with (out / "kernels.csv").open(encoding="utf-8") as file:
        return {r["name"]: r for r in csv.DictReader(file)}


def test_all_kernels_and_curves_are_measured_without_goals_for_small_sizes(figures):
    calls = {"sampling", "sampling, over filling", "sampling at random", "sampling every piece"}
    calls |= {"extrema", "extrema, kernel", "verdict", "certificate", "polynomial"}
    curves = ("cubic_spline", "septic_spline", "bspline")
    assert set(figures) == calls | {f"{curve}, N = {count}" for curve in curves for count in ("10^3", "10^4")}
    assert all(float(f["ours_ms"]) > 0 and f["rounds"] == "1" for f in figures.values())
    assert {name for name, f in figures.items() if not f["ratio"]} == {"certificate"}
    assert {f["goal"] for f in figures.values()} == {""}


def test_kernels_and_curves_agree_with_their_peers(figures):
    assert {name for name, f in figures.items() if f["agrees"] != "True"} == set()
    assert {name for name, f in figures.items() if not f["difference"]} == {"certificate", "sampling, over filling"}


def test_the_report_has_a_table_of_kernels(out, figures):
    report = (out / "report.md").read_text(encoding="utf-8")
    section = report.partition("## Kernels and curves\n")[2].partition("\n## ")[0]
    told = [line.split(" | ")[0].removeprefix("| ") for line in section.splitlines() if line.startswith("| ")]
    assert told == ["call", "---", *figures]


@pytest.fixture(scope="module")
def standings(out):
    with (out / "minimum_jerk.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_minimum_jerk_has_its_peers_without_goals_for_small_sizes(standings):
    entries = {part: {r["entry"] for r in standings if r["part"] == part} for part in {r["part"] for r in standings}}
    assert {"quintic_spline", "make_interp_spline(k=5)", "PIQP, coefficients"} <= entries["without limits"]
    assert ("spline-trajectory" in entries["without limits"]) == (find_spec("spline_trajectory") is not None)
    assert entries["within limits"] == {"smoothest", "plan", "PIQP", "Clarabel", "OSQP, polished", "DAQP"}
    assert {"optimal_times", "IPOPT"} <= entries["free times"]
    assert {r["goal"] for r in standings} == {""}
    assert all(float(r["ms"]) > 0 and r["rounds"] == "1" for r in standings if r["figure"] == "False")


def test_minimum_jerk_agrees_with_its_peers(standings):
    differences = [float(r["difference"]) for r in standings if r["difference"]]
    assert len(differences) > 10 and max(differences) < 1e-6
    costs = [float(r["beyond"]) for r in standings if r["part"] == "free times" and r["entry"] == "IPOPT"]
    assert costs and max(np.abs(costs)) < 1e-8


def test_our_limits_hold_where_samples_do_not_and_the_cost_is_the_optimum(standings):
    limited = {r["entry"]: r for r in standings if r["part"] == "within limits"}
    for entry in ("smoothest", "plan"):
        assert -1e-9 < float(limited[entry]["beyond"]) < 1e-6 and float(limited[entry]["violation"]) <= 1e-6
    for entry in ("PIQP", "Clarabel", "OSQP, polished", "DAQP"):
        assert float(limited[entry]["beyond"]) == pytest.approx(float(limited["PIQP"]["beyond"]), abs=1e-5)
        assert 1e-4 < float(limited[entry]["violation"]) < 0.1


def test_the_growth_is_drawn(out):
    assert (out / "growth.png").read_bytes().startswith(b"\x89PNG")
    assert "## Minimum jerk\n" in (out / "report.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def timings(out):
    with (out / "path_timing.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_path_timing_has_its_peers_without_goals_for_small_sizes(timings, out):
    entries = {part: {r["entry"] for r in timings if r["part"] == part} for part in {r["part"] for r in timings}}
    assert {"fastest_speeds", "toppra compute_parameterization", "copp-py topp2_ra"} <= entries["given stations"]
    assert {"plan, default", "plan, stations=200", "toppra"} <= entries["from waypoints to samples"]
    assert entries["jerk limits on given stations"] == {"pose and solve", "copp-py topp3_socp", "IPOPT"}
    assert {"from planner import plan", "first plan, with jerk"} <= entries["a new process"]
    assert "default" in entries["quality"]
    assert {r["goal"] for r in timings} == {""}
    copp = [r for r in timings if r["entry"].startswith("copp-py")]
    assert all(bool(r["ms"]) == (find_spec("copp_py") is not None) for r in copp)
    assert "## Path timing\n" in (out / "report.md").read_text(encoding="utf-8")


def test_our_laws_along_a_path_keep_the_limits_and_are_near_the_best(timings):
    ours = [r for r in timings if r["part"] == "quality" or r["entry"].startswith("plan, ")]
    assert len(ours) == 6 and max(float(r["beyond"]) for r in ours) <= 1e-6
    assert max(float(r["over_strict"]) for r in ours if r["over_strict"]) < 1e-3
    assert min(float(r["gap"]) for r in ours if r["gap"]) >= -1e-9


def test_motions_through_waypoints_have_their_peers_and_keep_everything(out):
    with (out / "waypoints.csv").open(encoding="utf-8") as file:
        motions = list(csv.DictReader(file))
    assert {r["part"] for r in motions} == {"quality", "speed", "program", "growth", "random problems"}
    assert {r["goal"] for r in motions} == {""}
    ours = [r for r in motions if r["missed"]]
    assert len(ours) >= 12 and max(float(r["beyond"]) for r in ours) <= 1e-6
    assert max(float(r["missed"]) for r in ours) < 1e-9
    assert "## Through waypoints\n" in (out / "report.md").read_text(encoding="utf-8")


def test_the_report_tells_the_machine_and_splits_a_request(out):
    report = (out / "report.md").read_text(encoding="utf-8")
    assert "Measured on" in report and "toppra 0." in report
    assert "| ur5e_jerk | time_optimal_waypoints |" in report
