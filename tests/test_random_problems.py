"""Random feasible problems through HTTP: none refused that is feasible, no 5xx, no broken limit.

`make check` runs a slice, `make check-slow` 2,000; WAYWRIGHT_SEEDS=first:last runs any others. A failure names its
seed.
"""

import json
import os

import numpy as np
import pytest
from starlette.testclient import TestClient

from api.app import create_app
from planner import METHODS, PlanRequest, Trajectory
from planner.check import asked_words

SLOW = ("time_optimal_nlp",)


@pytest.fixture(scope="module")
def client():
    with TestClient(create_app()) as made:
        yield made


def methods_for(body):
    """Every method that honours all that is asked (by its row), with its default options."""
    given = dict(body)
    request = PlanRequest.of(given.pop("waypoints"), **given)
    words = asked_words(request)
    found = []
    for row in METHODS.values():
        can = row.capabilities(row.options())
        if words <= set(can.words) and can.requires <= words and not (row.id == "bspline" and request.count < 4):
            found.append(row.id)  # a B-spline of degree 3 needs four waypoints
    return found


def check(client, seed, body, slow):
    methods = methods_for(body)
    assert methods, f"seed {seed}: nobody honours {body}"
    for method in methods:
        if method in SLOW and not slow:
            continue
        sent = {**body, "method": method, "sampling": {"count": 50}, "include": ["samples", "polynomial"]}
        answer = client.post("/v1/trajectories", content=json.dumps(sent), headers={"content-type": "application/json"})
        where = f"seed {seed}, {method}: {answer.text[:600]}"
        if answer.status_code == 422 and METHODS[method].path == "fixed" and "position" in body.get("limits", {}):
            problem = answer.json()  # the known spline keeps the position limits, this method's own path need not
            assert problem["quantity"] == "position" and problem["certified"], where
            continue
        assert answer.status_code == 200, where
        plan = answer.json()
        assert plan["certificate"]["holds"], where
        pieces = plan["polynomial"]
        breaks = np.array(pieces["breaks"])
        shortest = np.diff(breaks).min()  # 0 where nothing moves
        clock = np.finfo(float).eps * np.abs(breaks).max() / shortest if shortest else 0.0  # how well phases are known
        for row in plan["certificate"]["checks"]:
            assert row["holds"], where
            if row["quantity"] in ("velocity", "acceleration", "jerk"):
                assert row["ratio"] <= 1 + 1e-9 + 4 * clock, where
        scale = max(1.0, float(np.ptp(body["waypoints"], axis=0).max()))
        swing = float(np.abs(plan["samples"]["position"]).max())  # one polynomial may leave the waypoints far behind
        assert plan["certificate"]["waypoint_error"] <= max(1e-9, 1e-14 * swing / scale), where
        trajectory = Trajectory.from_powers(**{"powers" if k == "coefficients" else k: v for k, v in pieces.items()})
        times = np.clip(plan["samples"]["time"], trajectory.start, trajectory.end)
        assert np.abs(trajectory(times) - plan["samples"]["position"]).max() <= 1e-9 * max(scale, swing), where


def seeds(default):
    given = os.environ.get("WAYWRIGHT_SEEDS")
    first, last = (int(x) for x in given.split(":")) if given else default
    return range(first, last)


def test_a_slice_of_random_problems(client, random_problem):
    for seed in seeds((0, 80)):
        check(client, seed, random_problem(seed), slow=seed % 40 == 0)


@pytest.mark.slow
def test_two_thousand_random_problems(client, random_problem):
    for seed in seeds((10_000, 12_000)):
        check(client, seed, random_problem(seed), slow=seed % 40 == 0)
