"""Paths of every kind over HTTP: followed exactly, judged with their denominators, refused by name."""

import numpy as np
import pytest

from api.answers import CertifyReply, PlanReply

PLAN, CERTIFY = "/v1/trajectories", "/v1/certificates"
HALF = 0.5**0.5
POINTS = [[0.0, 0.3], [1.0, -0.4], [1.5, 0.8], [0.4, 1.2], [-0.5, 0.2]]
CIRCLE_POINTS = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]]
CIRCLE = {
    "kind": "nurbs",
    "degree": 2,
    "knots": [0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1],
    "weights": [1, HALF, 1, HALF, 1, HALF, 1, HALF, 1],
}
LIMITS = {"velocity": [1.0, 0.7], "acceleration": {"lower": [-2.0, -3.0], "upper": [2.5, 3.0]}}
PATHS = {
    "linear": {"kind": "linear"},
    "polynomial": {"kind": "polynomial"},
    "hermite": {"kind": "hermite"},
    "cubic_hermite": {"kind": "cubic_hermite", "tangents": "monotone"},
    "cubic_spline": {"kind": "cubic_spline", "boundary": "natural", "spacing": "chord_length"},
    "quintic_spline": {"kind": "quintic_spline"},
    "septic_spline": {"kind": "septic_spline"},
    "bspline": {"kind": "bspline", "degree": 2},
    "bspline_points": {"kind": "bspline", "interpolate": False},
    "bezier": {"kind": "bezier"},
    "bezier_composite": {"kind": "bezier", "degree": 2},
    "nurbs": {"kind": "nurbs", "weights": [1, 3, 0.4, 2, 1]},
}
BY_CONTROL_POINTS = ("bspline_points", "bezier", "bezier_composite", "nurbs")


def plan(service, body):
    response = service.post(PLAN, json={"include": ["samples", "polynomial"], **body})
    assert response.status_code == 200, response.text[:2000]
    answer = response.json()
    PlanReply.model_validate(answer)
    return answer


def certify(service, polynomial, **given):
    response = service.post(CERTIFY, json={"trajectory": {"polynomial": polynomial}, **given})
    assert response.status_code == 200, response.text[:1000]
    CertifyReply.model_validate(response.json())
    return response.json()["certificate"]


def states(polynomial, times):
    """Position, velocity and acceleration of what the answer says, by the quotient rule on its own numbers."""
    breaks, powers = np.array(polynomial["breaks"]), np.array(polynomial["coefficients"])
    piece = np.clip(np.searchsorted(breaks, times, side="right") - 1, 0, len(breaks) - 2)
    local = (np.asarray(times) - breaks[piece])[:, None]

    def derived(rows, order):
        out = np.zeros((len(local), rows.shape[2]))
        for k in range(order, len(rows)):
            out = out + np.prod(np.arange(k - order + 1, k + 1)) * rows[k][piece] * local ** (k - order)
        return out

    a = [derived(powers, m) for m in range(3)]
    if "weights" not in polynomial:
        return a
    w = [derived(np.array(polynomial["weights"])[:, :, None], m) for m in range(3)]
    x = a[0] / w[0]
    v = (a[1] - w[1] * x) / w[0]
    return [x, v, (a[2] - 2 * w[1] * v - w[2] * x) / w[0]]


def inside(answer, count=4001):
    breaks = answer["polynomial"]["breaks"]
    return np.clip(np.linspace(breaks[0], breaks[-1], count), breaks[0], breaks[-1])


@pytest.mark.parametrize("name", PATHS)
@pytest.mark.parametrize("method", ["time_scaled", "toppra"])
def test_every_kind_is_followed_within_the_limits(service, method, name):
    limits = LIMITS if method == "toppra" or name not in ("linear", "bezier_composite") else {"velocity": [1.0, 0.7]}
    body = {"waypoints": POINTS, "method": method, "limits": limits, "options": {"path": PATHS[name]}}
    if method == "toppra" and name in ("quintic_spline", "septic_spline"):
        body["method"] = "time_optimal_nlp"  # the library has no answer on some paths that rest at their ends
        body["options"]["stations"] = 60
    answer = plan(service, body)
    certificate = answer["certificate"]
    assert certificate["holds"] and certificate["path_deviation"] <= 1e-9
    assert certificate["basis"] == ("enclosure" if name == "nurbs" else "exact")
    assert (answer["waypoint_times"] is None) == (name in BY_CONTROL_POINTS)
    assert ("weights" in answer["polynomial"]) == (name == "nurbs")
    x, v, a = states(answer["polynomial"], inside(answer))
    assert (np.abs(v) <= np.array([1.0, 0.7]) * (1 + 1e-7)).all()
    if "acceleration" in limits:
        assert (a <= np.array([2.5, 3.0]) * (1 + 1e-7)).all() and (a >= np.array([-2.0, -3.0]) * (1 + 1e-7)).all()
    assert np.abs(x[[0, -1]] - np.array(POINTS)[[0, -1]]).max() <= 1e-9
    if name not in BY_CONTROL_POINTS:
        at = np.clip(answer["waypoint_times"], answer["polynomial"]["breaks"][0], answer["polynomial"]["breaks"][-1])
        assert np.abs(states(answer["polynomial"], at)[0] - POINTS).max() <= 1e-8


@pytest.mark.parametrize("method, stations", [("time_scaled", None), ("toppra", None), ("time_optimal_nlp", 60)])
def test_the_circle_stays_a_circle(service, method, stations):
    options = {"path": CIRCLE} if stations is None else {"path": CIRCLE, "stations": stations}
    limits = {"velocity": 1.0, "acceleration": 2.0}
    answer = plan(service, {"waypoints": CIRCLE_POINTS, "method": method, "limits": limits, "options": options})
    assert answer["waypoint_times"] is None
    certificate = answer["certificate"]
    assert certificate["holds"] and certificate["basis"] == "enclosure" and certificate["path_deviation"] <= 1e-9
    assert certificate["cost"]["path_length"] == pytest.approx(2 * np.pi, rel=1e-8)
    samples = np.array(answer["samples"]["position"])
    assert np.abs(np.linalg.norm(samples, axis=1) - 1).max() <= 1e-9
    x, v, a = states(answer["polynomial"], inside(answer, 2001))
    assert np.abs(np.linalg.norm(x, axis=1) - 1).max() <= 1e-9
    assert np.abs(v).max() <= 1 + 1e-7 and np.abs(a).max() <= 2 * (1 + 1e-7)
    angle = np.unwrap(np.arctan2(x[:, 1], x[:, 0]))
    assert angle[-1] - angle[0] == pytest.approx(2 * np.pi, abs=1e-8) and (np.diff(angle) >= -1e-12).all()
    again = certify(service, answer["polynomial"], limits=limits)
    assert again["holds"] and again["basis"] == "enclosure"
    for ours, theirs in zip(certificate["checks"], again["checks"], strict=True):
        assert theirs["quantity"] == ours["quantity"] and theirs["value"] == pytest.approx(ours["value"], rel=1e-9)


def test_a_plans_polynomial_is_a_path(service):
    """The circle of the method nurbs, sent back with its weights: the waypoints are then on it, at its breaks."""
    options = {k: v for k, v in CIRCLE.items() if k != "kind"}
    circle = plan(service, {"waypoints": CIRCLE_POINTS, "method": "nurbs", "options": options})["polynomial"]
    on = [[1, 0], [0, 1], [-1, 0], [0, -1], [1, 0]]
    limits = {"velocity": 1.0, "acceleration": 2.0}
    body = {"waypoints": on, "method": "time_scaled", "limits": limits, "options": {"path": {"polynomial": circle}}}
    answer = plan(service, body)
    assert np.abs(np.linalg.norm(states(answer["polynomial"], inside(answer))[0], axis=1) - 1).max() <= 1e-9
    np.testing.assert_allclose(
        np.array(answer["waypoint_times"]) / answer["duration"], [0, 0.25, 0.5, 0.75, 1], atol=1e-12
    )
    same = {**body, "waypoints": CIRCLE_POINTS, "options": {"path": CIRCLE}}
    assert plan(service, same)["duration"] == pytest.approx(answer["duration"], rel=1e-9)


@pytest.mark.parametrize(
    "path, field, code",
    [
        ({"weights": [[1, 1, 1, 1]]}, "/weights", "shape_mismatch"),
        ({"weights": [[1, 1, 1, 1], [-8, -8, -8, -8], [16, 16, 16, 16]]}, "/weights", "bad_weights"),
        ({"weights": [[0, 0, 0, 0], [1, 1, 1, 1], [1, 1, 1, 1]]}, "/weights", "bad_weights"),
        ({"weights": [[1, 1, 1, 1], [0, 0, 0, 0], [0, 0, "0", 0]]}, "/weights/2/2", "wrong_type"),
        ({"breaks": [0, 0.25, 0.2, 0.75, 1]}, "/breaks/2", "not_increasing"),
    ],
)
def test_rational_paths_that_are_wrong(service, problem, path, field, code):
    options = {k: v for k, v in CIRCLE.items() if k != "kind"}
    circle = plan(service, {"waypoints": CIRCLE_POINTS, "method": "nurbs", "options": options})["polynomial"]
    body = {
        "waypoints": [[1, 0], [0, 1], [-1, 0], [0, -1], [1, 0]],
        "method": "time_scaled",
        "limits": {"velocity": 1.0},
        "options": {"path": {"polynomial": {**circle, **path}}},
    }
    document = problem(service.post(PLAN, json=body), "invalid_request")
    found = [(e["field"], e["code"]) for e in document["errors"]]
    assert ("/options/path/polynomial" + field, code) in found, document


@pytest.mark.parametrize(
    "changes, path, what",
    [
        ({"limits": {"velocity": 1, "jerk": 10}}, {"kind": "cubic_hermite"}, "jerk"),
        ({"limits": {"acceleration": 1}}, {"kind": "linear"}, "acceleration"),
        ({"segment_limits": [{"velocity": 1}, None, None, None]}, {"kind": "bezier"}, "segment_limits"),
        ({"segment_durations": [{"min": 1}, None, None, None]}, {"kind": "nurbs"}, "segment_durations"),
        ({"times": [0, 1, 2, 3, 4]}, {"kind": "bspline", "interpolate": False}, "times"),
        ({"start": {"velocity": [0, 0]}}, {"kind": "bezier"}, "boundary_velocity"),
    ],
)
def test_what_a_path_cannot_honour_is_refused_by_name(service, problem, changes, path, what):
    body = {"waypoints": POINTS, "method": "time_scaled", "limits": {"velocity": 1.0}, "options": {"path": path}}
    document = problem(service.post(PLAN, json={**body, **changes}), "unsupported")
    assert (document["method"], document["what"]) == ("time_scaled", what) and document["alternatives"]


@pytest.mark.parametrize(
    "path, field, code",
    [
        ({"kind": "spiral"}, "/options/path/kind", "out_of_range"),
        ({"kind": "bezier", "weights": [1, 1, 1, 1, 1]}, "/options/path/weights", "unknown_field"),
        ({"kind": "linear", "spacing": "uniform", "knots": [0, 1, 2, 3, 4]}, "/options/path/spacing", "conflict"),
        ({"kind": "linear", "spacing": "even"}, "/options/path/spacing", "out_of_range"),
        ({"kind": "nurbs", "weights": [1, 1, 1, 1, -1]}, "/options/path/weights/4", "bad_weights"),
        ({"kind": "nurbs", "degree": 5}, "/waypoints", "too_few_points"),
        ({"kind": "bspline", "interpolate": False, "knots": [0] * 9}, "/options/path/knots", "bad_knots"),
    ],
)
def test_paths_that_are_wrong(service, problem, path, field, code):
    body = {"waypoints": POINTS, "method": "time_scaled", "limits": {"velocity": 1.0}, "options": {"path": path}}
    document = problem(service.post(PLAN, json=body), "invalid_request")
    assert [(e["field"], e["code"]) for e in document["errors"]] == [(field, code)], document
