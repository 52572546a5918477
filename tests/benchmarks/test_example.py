import json
from pathlib import Path

from planner import CASES
from planner.cases import UR5E

ROOT = Path(__file__).parents[2]


def test_the_demo_sends_the_librarys_own_case():
    task = json.loads((ROOT / "examples" / "pick_and_place.json").read_text(encoding="utf-8"))
    assert task["limits"] == UR5E
    assert {k: task[k] for k in ("waypoints", "times")} == CASES["ur5e_times"].request
    assert len(set(task["joint_names"])) == len(task["waypoints"][0])
