"""What the first plans of a new process take, with the kernels compiled before and kept on disk."""

import json
import subprocess
import sys
from pathlib import Path
from statistics import median
from typing import Any

from .problems import cases
from .rows import Timing

PART = "a new process"
CASE = "rand7_w10_s1"
GOAL = 1.0  # s
ROUNDS = 5
IMPORT, KINDS = "from planner import plan", ("without jerk", "with jerk")
#: Prints seconds by the clock and of the process: of importing the package, and of one plan.
SCRIPT = """
import json, sys, time
case = json.load(sys.stdin)
marks = [(time.perf_counter(), time.process_time())]
from planner import PlanRequest, plan
marks.append((time.perf_counter(), time.process_time()))
plan(PlanRequest.of(case["waypoints"], limits=case["limits"]), "time_optimal_path", case["options"])
marks.append((time.perf_counter(), time.process_time()))
print(json.dumps([[b - a for a, b in zip(x, y)] for x, y in zip(marks, marks[1:])]))
"""


def measure(quick: bool = False) -> list[Timing]:
    """Return the lines."""
    kinds = KINDS[1:] if quick else KINDS
    for kind in kinds:
        process(kind)  # may have kernels to compile
    runs = {kind: [] for kind in kinds}
    for _ in range(1 if quick else ROUNDS):
        for kind, own in runs.items():
            own.append(process(kind))
    found = []
    for kind, own in runs.items():
        for i, step in enumerate((IMPORT, f"first plan, {kind}")):
            wall, used = (median(run[i][k] for run in own) for k in (0, 1))
            told = f"{wall:.2f} s by the clock"
            found.append(Timing(PART, CASE, None, step, 1e3 * used, told=told, rounds=len(own)))
        wall, used = (median(sum(step[k] for step in run) for run in own) for k in (0, 1))
        entry = (PART, CASE, None, f"both, {kind}, s", 1e3 * used, used, None if quick else GOAL, True)
        found.append(Timing(*entry, told=f"{wall:.2f} s by the clock", rounds=len(own)))
    return found


def process(kind: str) -> list[list[float]]:
    """Return seconds by the clock and of the process, of importing and of the first plan of a new one."""
    request: dict[str, Any] = cases()[CASE]["request"]
    limits = {k: v for k, v in request["limits"].items() if kind == KINDS[1] or k != "jerk"}
    task = {"waypoints": request["waypoints"], "limits": limits, "options": {"path": request["options"]["path"]}}
    command = [sys.executable, "-c", SCRIPT]
    root = Path(__file__).parents[2]
    done = subprocess.run(command, cwd=root, input=json.dumps(task), capture_output=True, text=True, check=True)
    return json.loads(done.stdout)
