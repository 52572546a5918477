"""One polynomial over HTTP: the worked numbers of the methods' sections 1.2 and 2, and what is refused."""

import json

import numpy as np
import pytest

from planner import Trajectory
from planner.curves import chebyshev_nodes

PLAN = "/v1/trajectories"
T, X = [0, 1, 2, 4], [[1], [3], [2], [5]]


def plan(service, method, points, times=None, at=None, **more):
    """Return the answer and its samples as arrays; the polynomial must give the samples."""
    body = {"waypoints": np.asarray(points).tolist(), "method": method, "include": ["samples", "polynomial"], **more}
    if times is not None:
        body["times"] = np.asarray(times).tolist()
    if at is not None:
        body["sampling"] = {"times": np.asarray(at).tolist()}
    response = service.post(PLAN, json=body)
    assert response.status_code == 200, response.text[:2000]
    answer = response.json()
    assert answer["certificate"]["holds"] and answer["method"] == method
    samples = {name: np.array(rows) for name, rows in answer["samples"].items()}
    curve = Trajectory.from_powers(answer["polynomial"]["breaks"], answer["polynomial"]["coefficients"])
    scale = 1 + np.abs(samples["position"]).max()
    np.testing.assert_allclose(curve(samples["time"]), samples["position"], atol=1e-9 * scale)
    return answer, samples


def refused(service, problem, code, field, body):
    text = body if isinstance(body, str) else json.dumps(body)
    response = service.post(PLAN, content=text, headers={"content-type": "application/json"})
    errors = problem(response, "invalid_request")["errors"]
    assert [(e["field"], e["code"]) for e in errors] == [(field, code)]
    assert errors[0]["reason"]
    return errors[0]["reason"]


# -- worked numbers ------------------------------------------------------------------------------------------------


def test_worked_line_with_a_quintic_law(service):
    _, found = plan(service, "quintic_spline", [[0, 0], [3, 4]], [0, 2], [0.5])
    assert found["position"][0] == pytest.approx([0.310546875, 0.4140625], abs=1e-9)
    assert found["velocity"][0] == pytest.approx([1.58203125, 2.109375], abs=1e-9)
    assert found["acceleration"][0] == pytest.approx([4.21875, 5.625], abs=1e-9)


def test_worked_polynomial(service):
    answer, found = plan(service, "polynomial", X, T, [0, 0.5, 1, 1.5, 2, 3, 4])
    assert found["position"][:, 0] == pytest.approx([1, 2.59375, 3, 2.65625, 2, 1.5, 5], abs=1e-9)
    coefficients = np.array(answer["polynomial"]["coefficients"])[:, :, 0]
    assert coefficients[:, 0] == pytest.approx([1, 14 / 3, -3.25, 7 / 12], abs=1e-9)
    assert found["velocity"][0] == pytest.approx(14 / 3, abs=1e-9)
    assert found["acceleration"][0] == pytest.approx(-6.5, abs=1e-9)
    assert found["jerk"][:, 0] == pytest.approx([3.5] * 7, abs=1e-9)


def test_worked_hermite(service):
    velocities = [[1], [0], [-1]]
    answer, found = plan(
        service, "hermite", [[0], [2], [1]], [0, 1, 3], [0, 0.5, 2, 3], options={"velocities": velocities}
    )
    assert found["position"][:, 0] == pytest.approx([0, 1.2719907407, 0.6296296296, 1], abs=1e-9)
    assert found["velocity"][:, 0] == pytest.approx([1, 2.7210648148, -0.9629629630, -1], abs=1e-9)
    assert answer["warnings"] == []


def test_hermite_says_which_velocities_it_chose(service):
    chosen, found = plan(service, "hermite", [[0], [2], [1]], [0, 1, 3], [0, 1, 3])
    assert [w["code"] for w in chosen["warnings"]] == ["velocities_chosen"]
    assert found["velocity"][:, 0] == pytest.approx([2, 0.75, -0.5], abs=1e-9)


@pytest.mark.parametrize(
    ("degree", "even", "chebyshev", "tame"),
    [
        (4, 0.438357, 0.40202, 2.2282e-2),
        (8, 1.045174, 0.17084, 2.2584e-3),
        (10, 1.915643, 0.10915, 7.9137e-4),
        (16, 14.393851, 3.2613e-2, 3.9906e-5),
        (20, 59.822309, 1.5334e-2, 5.8480e-6),
        (30, 2387.998, 2.0615e-3, 5.4e-8),
    ],
)
def test_worked_runge_table_and_erratum_e3(service, degree, even, chebyshev, tame):
    def worst(function, nodes, times, **more):
        answer, found = plan(service, "polynomial", function(nodes), times, sampling={"count": 4001}, **more)
        if times is None:
            assert answer["waypoint_times"] == pytest.approx(nodes, abs=1e-15)
        return np.abs(found["position"] - function(found["time"])).max(axis=0)

    def functions(t):
        return np.stack([1 / (1 + 25 * t**2), 1 / (1 + t**2)], axis=1)

    evenly, nodes = np.linspace(-1, 1, degree + 1), chebyshev_nodes(degree + 1)
    here, there = worst(functions, evenly, evenly)
    assert here == pytest.approx(even, rel=1e-4)
    assert there == pytest.approx(tame, rel=0.05 if degree == 30 else 1e-4)
    options = {"nodes": "chebyshev", "interval": [-1, 1]}
    assert worst(functions, nodes, None, options=options)[0] == pytest.approx(chebyshev, rel=1e-4)


def test_fifty_chebyshev_nodes_are_stable(service):
    nodes, at = chebyshev_nodes(50, 2, 5), np.linspace(2, 5, 501)
    options = {"nodes": "chebyshev", "interval": [2, 5]}
    answer, found = plan(service, "polynomial", np.sin(7 * nodes)[:, None], None, at, options=options)
    assert np.abs(found["position"][:, 0] - np.sin(7 * at)).max() < 1e-12
    assert np.abs(found["velocity"][:, 0] - 7 * np.cos(7 * at)).max() < 1e-10
    assert answer["duration"] == 3 and answer["waypoint_times"] == pytest.approx(nodes, abs=1e-14)


def test_equal_neighbours_keep_their_own_chebyshev_nodes(service):
    options = {"nodes": "chebyshev", "interval": [0, 1]}
    answer, found = plan(service, "polynomial", [[0], [1], [1], [0]], None, chebyshev_nodes(4, 0, 1), options=options)
    assert found["position"][:, 0] == pytest.approx([0, 1, 1, 0], abs=1e-12)
    assert answer["warnings"] == []


# -- refusals ------------------------------------------------------------------------------------------------------


def even(count):
    t = np.linspace(0, 1, count)
    return {"waypoints": np.sin(t)[:, None].tolist(), "times": t.tolist(), "method": "polynomial"}


@pytest.mark.parametrize("count", [51, 52, 80])
def test_too_many_equispaced_nodes_are_refused_with_condition_and_alternatives(service, problem, count):
    reason = refused(service, problem, "bad_degree", "/waypoints", even(count))
    assert "condition number" in reason and "e+" in reason
    assert "cubic_spline" in reason and "chebyshev" in reason


def test_fifty_equispaced_nodes_are_still_answered(service):
    body = even(50)
    answer, found = plan(service, "polynomial", body["waypoints"], body["times"], body["times"])
    assert answer["certificate"]["waypoint_error"] <= 1e-6
    assert np.abs(found["position"] - body["waypoints"]).max() <= 1e-6


def test_hermite_is_refused_where_it_is_ill_conditioned(service, problem):
    body = {"waypoints": [[i % 2] for i in range(40)], "times": list(range(40)), "method": "hermite"}
    reason = refused(service, problem, "bad_degree", "/waypoints", body)
    assert "condition number" in reason and "cubic_hermite" in reason


def test_degrees_past_all_use_are_refused(service, problem):
    points = [[i % 2] for i in range(401)]
    body = {"waypoints": points, "method": "polynomial", "options": {"nodes": "chebyshev", "interval": [0, 1]}}
    assert "cubic_spline" in refused(service, problem, "bad_degree", "/waypoints", body)


BASE = {"waypoints": X, "times": T, "method": "polynomial"}
HERMITE = {"waypoints": X, "times": T, "method": "hermite"}
CHEBYSHEV = {"waypoints": X, "method": "polynomial"}


@pytest.mark.parametrize(
    ("body", "field", "code"),
    [
        (BASE | {"waypoints": [[1]], "times": [0]}, "/waypoints", "too_few_points"),
        (BASE | {"times": [0, 1, 1, 4]}, "/times/2", "not_increasing"),
        (BASE | {"times": [0, 2, 1, 4]}, "/times/2", "not_increasing"),
        (BASE | {"times": [0, 1, 2]}, "/times", "shape_mismatch"),
        (BASE | {"waypoints": [[1], [3], [2, 2], [5]]}, "/waypoints/2", "shape_mismatch"),
        (CHEBYSHEV, "/times", "missing"),
        (BASE | {"options": {"nodes": "equal"}}, "/options/nodes", "out_of_range"),
        (BASE | {"options": {"interval": [0, 1]}}, "/options/interval", "conflict"),
        (BASE | {"waypoints": [[1]] * 4, "options": {"interval": [0, 1]}}, "/options/interval", "conflict"),
        (CHEBYSHEV | {"options": {"nodes": "chebyshev"}}, "/options/interval", "missing"),
        (CHEBYSHEV | {"options": {"nodes": "chebyshev", "interval": [0]}}, "/options/interval", "out_of_range"),
        (CHEBYSHEV | {"options": {"nodes": "chebyshev", "interval": [1, 1]}}, "/options/interval/1", "not_increasing"),
        (CHEBYSHEV | {"options": {"nodes": "chebyshev", "interval": [1, 0]}}, "/options/interval/1", "not_increasing"),
        (
            CHEBYSHEV | {"options": {"nodes": "chebyshev", "interval": [0, 1], "spacing": "uniform"}},
            "/options/spacing",
            "conflict",
        ),
        (BASE | {"options": {"spacing": "uniform"}}, "/options/spacing", "conflict"),
        (BASE | {"options": {"degree": 3}}, "/options/degree", "unknown_field"),
        (HERMITE | {"options": {"velocities": [[0], [1], [1]]}}, "/options/velocities", "shape_mismatch"),
        (HERMITE | {"options": {"velocities": [[0, 1]] * 4}}, "/options/velocities", "shape_mismatch"),
        (HERMITE | {"options": {"velocities": [[0], [1], [1, 2], [3]]}}, "/options/velocities/2", "shape_mismatch"),
        (HERMITE | {"options": {"velocities": [[0], [1], ["1"], [3]]}}, "/options/velocities/2/0", "wrong_type"),
    ],
)
def test_bad_input(service, problem, body, field, code):
    refused(service, problem, code, field, body)


@pytest.mark.parametrize("number", ["NaN", "1e999", "-Infinity"])
def test_numbers_that_are_not_finite(service, problem, number):
    body = '{"waypoints": [[1], [%s], [2]], "times": [0, 1, 2], "method": "polynomial"}'
    refused(service, problem, "not_finite", "/waypoints/1/0", body % number)
    body = '{"waypoints": [[1], [3], [2]], "times": [0, 1, %s], "method": "polynomial"}'
    refused(service, problem, "not_finite", "/times/2", body % number)
    options = '{"velocities": [[1], [%s], [0]]}'
    body = '{"waypoints": [[1], [3], [2]], "times": [0, 1, 2], "method": "hermite", "options": %s}'
    refused(service, problem, "not_finite", "/options/velocities/1/0", body % (options % number))


@pytest.mark.parametrize(
    ("more", "what"),
    [
        ({"start": {"velocity": [0]}}, "boundary_velocity"),
        ({"end": {"acceleration": [0]}}, "boundary_acceleration"),
        ({"limits": {"velocity": 1}}, "velocity"),
    ],
)
@pytest.mark.parametrize("method", ["polynomial", "hermite"])
def test_what_is_not_honoured_is_refused(service, problem, method, more, what):
    document = problem(service.post(PLAN, json=BASE | {"method": method} | more), "unsupported")
    assert document["what"] == what and document["alternatives"]


def test_chebyshev_nodes_take_no_times(service, problem):
    body = BASE | {"options": {"nodes": "chebyshev", "interval": [0, 1]}}
    assert problem(service.post(PLAN, json=body), "unsupported")["what"] == "times"


def test_velocities_of_a_standstill_are_not_ignored(service, problem):
    velocities = {"velocities": [[1], [-1]]}
    _, found = plan(service, "hermite", [[0], [0]], [0, 1], [0, 0.5, 1], options=velocities)
    assert found["position"][:, 0] == pytest.approx([0, 0.25, 0], abs=1e-12)
    assert found["velocity"][:, 0] == pytest.approx([1, 0, -1], abs=1e-12)
    body = {"waypoints": [[0], [0]], "times": [0, 1], "method": "hermite", "options": {"velocities": [[0], [0], [0]]}}
    refused(service, problem, "shape_mismatch", "/options/velocities", body)


def test_waypoints_with_velocities_of_their_own_are_not_merged(service):
    velocities = {"velocities": [[0], [0.5], [0]]}
    _, found = plan(service, "hermite", [[0], [0], [1]], duration={"min": 2, "max": 2}, options=velocities)
    assert found["position"][[0, -1], 0].tolist() == [0, 1]
