"""The comparison runs, and reads the peers' answers as what they are."""

import csv
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


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


def test_the_report_tells_the_machine_and_splits_a_request(out):
    report = (out / "report.md").read_text(encoding="utf-8")
    assert "Measured on" in report and "toppra 0." in report
    assert "| ur5e_jerk | ruckig |" in report
