"""The same bytes from a process that compiles the kernels and from those that load them, in any order of first use."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import planner

ROOT = Path(planner.__file__).resolve().parent.parent
RUN = """
import hashlib, json, sys
import numpy as np
from planner import PlanRequest, plan

rng = np.random.default_rng(0)
points = np.cumsum(rng.normal(size=(12, 3)), axis=0)
times = np.concatenate([[0.0], np.cumsum(10.0 ** rng.uniform(-1, 1, 11))])
limits = {"velocity": [1.0, 1.2, 0.9], "acceleration": [3.0, 2.5, 3.5], "jerk": [30.0, 20.0, 25.0]}
requests = {
    "septic_spline": PlanRequest.of(points, times=times),
    "quintic_spline": PlanRequest.of(points, times=times),
    "time_optimal_path": PlanRequest.of(points[:5], limits=limits),
}
found = {}
for method in json.loads(sys.argv[1]) or requests:
    motion = plan(requests[method], method).trajectory
    found[method] = hashlib.sha256(motion.breaks.tobytes() + motion.coefficients.tobytes()).hexdigest()
print(json.dumps(found))
"""


def outcome(cache, order=()):
    settings = {"NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    run = [sys.executable, "-c", RUN, json.dumps(order)]
    done = subprocess.run(run, capture_output=True, text=True, env={**os.environ, **settings}, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
def test_compiled_and_loaded_kernels_give_the_same_bytes(tmp_path):
    compiled = outcome(tmp_path)
    assert any(tmp_path.rglob("*.nbc"))
    assert outcome(tmp_path) == compiled
    assert outcome(tmp_path, sorted(compiled, reverse=True)) == compiled
