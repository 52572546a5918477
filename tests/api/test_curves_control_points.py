"""Curves by control points, B-splines and the minimum-jerk motion over HTTP: worked numbers, clocks, refusals, and
rational polynomials judged by the certificate service."""

import numpy as np
import pytest

from api.answers import CertifyReply, PlanReply

PLAN, CERTIFY = "/v1/trajectories", "/v1/certificates"
HALF = 0.5**0.5
BEZIER = {"waypoints": [[0, 0], [1, 2], [3, 3], [4, 0]], "method": "bezier"}
BSPLINE = {
    "waypoints": [[0, 0], [1, 2], [3, 3], [4, 0], [6, 1]],
    "method": "bspline",
    "options": {"interpolate": False, "knots": [0, 0, 0, 0, 0.5, 1, 1, 1, 1]},
}
QUARTER = {
    "waypoints": [[1, 0], [1, 1], [0, 1]],
    "method": "nurbs",
    "options": {"degree": 2, "weights": [1, HALF, 1]},
}
CIRCLE = {
    "waypoints": [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]],
    "method": "nurbs",
    "options": {
        "degree": 2,
        "knots": [0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1],
        "weights": [1, HALF, 1, HALF, 1, HALF, 1, HALF, 1],
    },
}
MANCHESTER = [[0], [0], [1.25], [2], [2.75], [3], [3]]


def plan(service, body, times=None, **changes):
    asked = {**body, **changes, "include": ["samples", "polynomial"]}
    if times is not None:
        asked["sampling"] = {"times": times}
    response = service.post(PLAN, json=asked)
    assert response.status_code == 200, response.text[:2000]
    answer = response.json()
    PlanReply.model_validate(answer)
    assert answer["certificate"]["holds"] is True
    return answer


def certify(service, polynomial, **given):
    response = service.post(CERTIFY, json={"trajectory": {"polynomial": polynomial}, **given})
    assert response.status_code == 200, response.text[:1000]
    CertifyReply.model_validate(response.json())
    return response.json()["certificate"]


def evaluated(polynomial, times):
    """Values of what the answer says: powers of (t - break) over those of the denominator."""
    breaks, powers = np.array(polynomial["breaks"]), np.array(polynomial["coefficients"])
    times = np.asarray(times, dtype=float)
    piece = np.clip(np.searchsorted(breaks, times, side="right") - 1, 0, len(breaks) - 2)
    local = times - breaks[piece]
    above = sum(powers[k][piece] * local[:, None] ** k for k in range(len(powers)))
    if polynomial.get("weights") is None:
        return above
    below = sum(np.array(w)[piece] * local**k for k, w in enumerate(polynomial["weights"]))
    return above / below[:, None]


def rows(answer, quantity):
    return np.array(answer["samples"][quantity])


# -- worked numbers ------------------------------------------------------------------------------------------------


def test_the_worked_bezier_curve(service):
    answer = plan(service, BEZIER, [0, 0.25, 0.5, 1])
    assert answer["duration"] == 1 and answer["waypoint_times"] is None
    np.testing.assert_allclose(rows(answer, "position"), [[0, 0], [0.90625, 1.265625], [2, 1.875], [4, 0]], atol=1e-12)
    velocity = [[3, 6], [4.125, 3.9375], [4.5, 0.75], [3, -9]]  # the ends: n (P1 - P0), n (Pn - Pn-1)
    np.testing.assert_allclose(rows(answer, "velocity"), velocity, atol=1e-12)
    np.testing.assert_allclose(rows(answer, "acceleration")[2], [0, -15], atol=1e-12)
    np.testing.assert_allclose(rows(answer, "jerk"), [[-12, -18]] * 4, atol=1e-11)
    assert "weights" not in answer["polynomial"]
    assert answer["certificate"]["basis"] == "exact" and answer["certificate"]["waypoint_error"] is None
    assert answer["certificate"]["continuity"] is None


def test_E7_the_quadratic_in_time(service):
    """Points 0, 1, 3: acceleration 2, divided by the duration squared."""
    body = {"waypoints": [[0], [1], [3]], "method": "bezier"}
    assert rows(plan(service, body, [0, 0.5, 1]), "acceleration")[:, 0] == pytest.approx([2, 2, 2], abs=1e-12)
    slow = plan(service, body, [0, 2, 4], duration={"min": 4, "max": 4})
    assert rows(slow, "acceleration")[:, 0] == pytest.approx([2 / 16] * 3, abs=1e-12)
    assert rows(slow, "velocity")[:, 0] == pytest.approx([0.5, 0.75, 1.0], abs=1e-12)


def test_E8_the_derivative_at_a_quarter(service):
    velocity = rows(plan(service, BEZIER, [0.25]), "velocity")[0]
    assert velocity == pytest.approx([4.125, 3.9375], abs=1e-12)
    assert velocity != pytest.approx([4.125, -3.5625], abs=1)


def test_the_worked_composite_is_the_cubic_spline(service):
    """Two cubic Béziers over one second each, joined C2."""
    body = {"waypoints": MANCHESTER, "method": "bezier", "options": {"degree": 3, "knots": [0, 1, 2], "joints": "C2"}}
    answer = plan(service, body, [0, 0.5, 1, 1.5, 2])
    assert answer["duration"] == 2 and answer["certificate"]["continuity"] == 2
    powers = np.array(answer["polynomial"]["coefficients"])[:, :, 0]
    np.testing.assert_allclose(powers.T, [[0, 0, 3.75, -1.75], [2, 2.25, -1.5, 0.25]], atol=1e-12)
    np.testing.assert_allclose(rows(answer, "position")[:, 0], [0, 0.71875, 2, 2.78125, 3], atol=1e-12)
    np.testing.assert_allclose(rows(answer, "velocity")[:, 0], [0, 2.4375, 2.25, 0.9375, 0], atol=1e-12)


def test_the_same_points_over_uneven_durations_are_not_joined(service, problem):
    options = {"degree": 3, "knots": [0, 1, 3], "joints": "C1"}
    body = {"waypoints": MANCHESTER, "method": "bezier", "options": options}
    document = problem(service.post(PLAN, json=body), "invalid_request")
    assert [(e["field"], e["code"]) for e in document["errors"]] == [("/waypoints", "conflict")]
    assert "velocity" in document["errors"][0]["reason"]
    loose = plan(service, {**body, "options": {**options, "joints": "C0"}}, [0, 3])
    assert loose["certificate"]["continuity"] == 0
    for knots, joints, ratio in (([0, 1, 3], "C1", 2), ([0, 1, 1.5], "C1", 0.5)):
        points = [row[:] for row in MANCHESTER]
        points[4], points[5] = [2 + ratio * (2 - 1.25)], [2.9]  # P1 - P0 over h as C1 asks
        body["waypoints"], body["options"] = points, {"degree": 3, "knots": knots, "joints": joints}
        assert plan(service, body)["certificate"]["continuity"] == 1


def test_the_worked_b_spline(service):
    answer = plan(service, BSPLINE, [0, 0.25, 0.5, 0.75, 1])
    expected = [[0, 0], [1.46875, 1.9375], [2.75, 2], [3.90625, 0.9375], [6, 1]]
    np.testing.assert_allclose(rows(answer, "position"), expected, atol=1e-12)
    np.testing.assert_allclose(rows(answer, "velocity")[[0, 2, 4]], [[6, 12], [4.5, -3], [12, 6]], atol=1e-12)
    np.testing.assert_allclose(rows(answer, "acceleration")[[0, 2]], [[0, -36], [-6, -24]], atol=1e-11)
    assert answer["certificate"]["continuity"] == 2 and answer["waypoint_times"] is None
    defaults = {**BSPLINE, "options": {"interpolate": False}}  # clamped and even: the same knots
    np.testing.assert_allclose(rows(plan(service, defaults, [0.25]), "position")[0], [1.46875, 1.9375], atol=1e-12)


def test_E12_uniform_knots_are_a_curve_on_the_valid_span_only(service, problem):
    """Knots 0 … 8, degree 3, five points: the clock is [3, 5], where the weights sum to 1."""
    body = {**BSPLINE, "options": {"interpolate": False, "knots": list(range(9))}}
    answer = plan(service, body, [3, 3.5, 5])
    assert answer["duration"] == 2 and answer["polynomial"]["breaks"] == [3, 4, 5]
    points = np.array(BSPLINE["waypoints"], dtype=float)
    np.testing.assert_allclose(rows(answer, "position")[1], np.array([1, 23, 23, 1, 0]) / 48 @ points, atol=1e-12)
    np.testing.assert_allclose(rows(answer, "position")[0], (points[0] + 4 * points[1] + points[2]) / 6, atol=1e-12)
    still = plan(service, {**body, "waypoints": [[7.0]] * 4 + [[7.0 + 1e-6]]}, [3, 3.5, 4])
    assert np.abs(rows(still, "position") - 7).max() <= 1e-6  # of sum 1, so a constant stays
    problem(service.post(PLAN, json={**body, "sampling": {"times": [2.5]}}), "invalid_request")


def test_the_worked_collocation(service):
    """The Manchester spline: its points as control points, and its values interpolated on its knots."""
    knots = [0, 0, 0, 0, 1, 2, 2, 2, 2]
    body = {"waypoints": [[0], [0], [2.5], [3], [3]], "method": "bspline"}
    answer = plan(service, body, [0, 0.5, 1, 1.5, 2], options={"interpolate": False, "knots": knots})
    values = rows(answer, "position")
    np.testing.assert_allclose(values[:, 0], [0, 0.71875, 2, 2.78125, 3], atol=1e-12)
    np.testing.assert_allclose(rows(answer, "velocity")[[0, 4], 0], [0, 0], atol=1e-12)
    np.testing.assert_allclose(rows(answer, "acceleration")[[0, 2, 4], 0], [7.5, -3, -1.5], atol=1e-11)
    times = [0, 0.5, 1, 1.5, 2]
    through = {"waypoints": values.tolist(), "times": times, "method": "bspline", "options": {"knots": knots}}
    again = plan(service, through, [0.25, 1.75])
    assert again["waypoint_times"] == times and again["certificate"]["waypoint_error"] <= 1e-12
    np.testing.assert_allclose(
        np.array(again["polynomial"]["coefficients"]), answer["polynomial"]["coefficients"], atol=1e-11
    )


def test_the_worked_quarter_circle(service):
    answer = plan(service, QUARTER, [0, 0.25, 0.5, 1])
    np.testing.assert_allclose(rows(answer, "position")[1], [0.92978830, 0.36809471], atol=5e-9)
    np.testing.assert_allclose(rows(answer, "position")[2], [HALF, HALF], atol=1e-12)
    assert np.abs(np.linalg.norm(rows(answer, "position"), axis=1) - 1).max() <= 1e-12
    assert answer["certificate"]["basis"] == "enclosure"
    assert answer["certificate"]["cost"]["path_length"] == pytest.approx(np.pi / 2, rel=1e-9)


def test_the_worked_circle(service):
    answer = plan(service, CIRCLE, [0, 0.1, 0.3, *np.linspace(0.31, 1, 60).tolist()])
    positions = rows(answer, "position")
    np.testing.assert_allclose(positions[1], [0.81382604, 0.58110858], atol=5e-9)
    np.testing.assert_allclose(positions[2], [-0.29381194, 0.95586325], atol=5e-9)
    assert np.abs(np.linalg.norm(positions, axis=1) - 1).max() <= 1e-13
    assert answer["certificate"]["cost"]["path_length"] == pytest.approx(2 * np.pi, rel=1e-9)
    polynomial = answer["polynomial"]
    assert np.array(polynomial["weights"]).shape == (3, 4) == np.array(polynomial["coefficients"]).shape[:2]
    at = np.linspace(0, 1, 401)
    assert np.abs(np.linalg.norm(evaluated(polynomial, at), axis=1) - 1).max() <= 1e-13


@pytest.mark.parametrize("body", [BEZIER, BSPLINE, QUARTER, CIRCLE], ids=["bezier", "bspline", "quarter", "circle"])
def test_the_polynomial_gives_the_samples(service, body):
    answer = plan(service, body)
    times = answer["samples"]["time"]
    assert np.abs(evaluated(answer["polynomial"], times) - rows(answer, "position")).max() <= 1e-12
    h = 1e-5
    inner = np.array(times[1:-1])
    slopes = (evaluated(answer["polynomial"], inner + h) - evaluated(answer["polynomial"], inner - h)) / (2 * h)
    assert np.abs(slopes - rows(answer, "velocity")[1:-1]).max() <= 1e-2


def test_equal_weights_are_the_b_spline_with_a_denominator_of_one(service):
    plain = plan(service, BSPLINE)
    options = {"knots": BSPLINE["options"]["knots"], "weights": [3.0] * 5}
    equal = plan(service, {**BSPLINE, "method": "nurbs", "options": options})
    assert equal["polynomial"].pop("weights") == [[1, 1], [0, 0], [0, 0], [0, 0]]
    assert equal["polynomial"] == plain["polynomial"] and "weights" not in plain["polynomial"]
    assert equal["certificate"]["basis"] == "exact"
    np.testing.assert_allclose(equal["samples"]["position"], plain["samples"]["position"], rtol=0, atol=1e-14)


def test_the_worked_minimum_jerk_motions(service):
    rest = {"waypoints": [[0], [1]], "times": [0, 2], "method": "minimum_jerk"}
    limits = {"velocity": 1, "acceleration": 1.5, "jerk": 8}
    answer = plan(service, rest, [0, 0.6, 1, 2], limits=limits)
    powers = np.array(answer["polynomial"]["coefficients"])[:, 0, 0]
    np.testing.assert_allclose(powers, [0, 0, 0, 1.25, -0.9375, 0.1875], atol=1e-9)
    np.testing.assert_allclose(rows(answer, "position")[1:3, 0], [0.16308, 0.5], atol=1e-9)
    checks = {c["quantity"]: c for c in answer["certificate"]["checks"]}
    peaks = [abs(checks[q]["value"]) for q in ("velocity", "acceleration", "jerk")]
    assert peaks == pytest.approx([0.9375, 1.44337567, 7.5], abs=5e-9)
    assert checks["velocity"]["time"] == pytest.approx(1, abs=1e-5)
    assert checks["acceleration"]["time"] == pytest.approx(0.42265, abs=5e-6)
    assert checks["jerk"]["time"] == pytest.approx(0, abs=1e-9)
    assert answer["certificate"]["cost"]["squared_jerk"] == pytest.approx(22.5, abs=1e-9)


def test_E9_the_cost_is_the_squared_norm(service):
    body = {
        "waypoints": [[0.2], [1]],
        "times": [0, 2],
        "method": "minimum_jerk",
        "start": {"velocity": [0.5], "acceleration": [-0.3]},
        "end": {"velocity": [-0.4], "acceleration": [0.6]},
    }
    answer = plan(service, body, [0.6, 1])
    powers = np.array(answer["polynomial"]["coefficients"])[:, 0, 0]
    np.testing.assert_allclose(powers, [0.2, 0.5, -0.15, 1.025, -0.8625, 0.1875], atol=1e-9)
    np.testing.assert_allclose(rows(answer, "position")[:, 0], [0.5702, 0.9], atol=1e-9)
    assert answer["certificate"]["cost"]["squared_jerk"] == pytest.approx(25.065, abs=1e-9)
    assert answer["certificate"]["objective"]["value"] == pytest.approx(25.065, abs=1e-9)
    loop = plan(service, {**body, "waypoints": [[1], [1]]})  # equal ends, but not at rest
    assert loop["certificate"]["cost"]["squared_jerk"] > 1


def test_no_distance_at_rest_is_a_hold_without_cost(service):
    answer = plan(service, {"waypoints": [[1], [1]], "times": [0, 2], "method": "minimum_jerk"})
    assert answer["certificate"]["cost"]["squared_jerk"] == 0
    assert np.ptp(rows(answer, "position")) == 0 and answer["duration"] == 2


# -- clocks --------------------------------------------------------------------------------------------------------

SPLINE = {**BSPLINE, "options": {"interpolate": False}}
PLAIN_NURBS = {**QUARTER, "options": {"degree": 2, "weights": [1, 2, 1]}}


@pytest.mark.parametrize("body", [BEZIER, SPLINE, PLAIN_NURBS], ids=["bezier", "bspline", "nurbs"])
def test_the_clock_is_one_second_or_the_duration_asked(service, body):
    unit = plan(service, body, [0, 0.25, 1])
    assert unit["duration"] == 1 and unit["samples"]["time"] == [0, 0.25, 1]
    slow = plan(service, body, [0, 2, 8], duration={"min": 8, "max": 8})
    assert slow["duration"] == 8 and slow["polynomial"]["breaks"][-1] == 8
    np.testing.assert_allclose(rows(slow, "position"), rows(unit, "position"), atol=1e-12)
    for order, quantity in enumerate(("position", "velocity", "acceleration", "jerk")):
        np.testing.assert_allclose(rows(slow, quantity) * 8**order, rows(unit, quantity), atol=1e-9)
    (check,) = slow["certificate"]["checks"]
    assert (check["quantity"], check["value"], check["bound"], check["holds"]) == ("duration", 8, 8, True)


@pytest.mark.parametrize("body", [BEZIER, SPLINE, PLAIN_NURBS], ids=["bezier", "bspline", "nurbs"])
@pytest.mark.parametrize(
    "bounds, expected", [({"min": 0.5, "max": 3}, 1), ({"min": 2}, 2), ({"max": 0.25}, 0.25), ({"min": 2, "max": 5}, 2)]
)
def test_of_a_range_of_durations_the_nearest_to_one_is_taken(service, body, bounds, expected):
    assert plan(service, body, duration=bounds)["duration"] == pytest.approx(expected)


@pytest.mark.parametrize(
    "body, knots, span",
    [
        (BEZIER, [5, 9], (5, 9)),
        (BSPLINE, [-1, -1, -1, -1, 0, 2, 2, 2, 2], (-1, 2)),
        (BSPLINE, [0, 1, 2, 3, 4, 5, 6, 7, 8], (3, 5)),
        (QUARTER, [2, 2, 2, 7, 7, 7], (2, 7)),
    ],
)
def test_the_clock_is_the_knots_span(service, problem, body, knots, span):
    options = {**body.get("options", {}), "knots": knots}
    answer = plan(service, body, options=options)
    assert (answer["polynomial"]["breaks"][0], answer["polynomial"]["breaks"][-1]) == span
    assert answer["duration"] == span[1] - span[0]
    assert (answer["samples"]["time"][0], answer["samples"]["time"][-1]) == span
    length = span[1] - span[0]
    assert plan(service, body, options=options, duration={"min": length, "max": length})["duration"] == length
    other = {**body, "options": options, "duration": {"min": length + 1, "max": length + 1}}
    document = problem(service.post(PLAN, json=other), "invalid_request")
    assert [(e["field"], e["code"]) for e in document["errors"]] == [("/duration", "conflict")]


def test_the_catalogue_says_what_these_methods_are(service):
    for name in ("bezier", "nurbs"):
        row = service.get(f"/v1/methods/{name}").json()
        assert row["timing"] == "parameter" and row["requires"] == [] and "times" not in row["honours"]
    row = service.get("/v1/methods/bspline").json()
    assert row["timing"] == "given" and "times" in row["requires"]
    (variant,) = [v for v in row["variants"] if v["options"] == {"interpolate": False}]
    assert variant["timing"] == "parameter"


# -- bad input -----------------------------------------------------------------------------------------------------

THROUGH = {"waypoints": [[0], [1], [0], [2], [1], [0]], "times": [0, 1, 2, 3, 4, 5], "method": "bspline"}


def clamped(inner, end=5.0):
    return [0] * 4 + inner + [end] * 4


@pytest.mark.parametrize(
    "body, changes, field, code",
    [
        (BEZIER, {"options": {"degree": 2}}, "/options/degree", "bad_degree"),
        (BEZIER, {"options": {"degree": 5}}, "/options/degree", "bad_degree"),
        (BEZIER, {"options": {"degree": 0}}, "/options/degree", "out_of_range"),
        (BEZIER, {"waypoints": [[i] for i in range(202)]}, "/waypoints", "bad_degree"),
        (BEZIER, {"options": {"knots": [0, 0]}}, "/options/knots", "bad_knots"),
        (BEZIER, {"options": {"knots": [1, 0]}}, "/options/knots", "bad_knots"),
        (BEZIER, {"options": {"knots": [0, 1, 2]}}, "/options/knots", "bad_knots"),
        (BEZIER, {"options": {"degree": 1, "joints": "C1"}}, "/waypoints", "conflict"),
        (BEZIER, {"waypoints": [[0, 0]]}, "/waypoints", "too_few_points"),
        (BEZIER, {"duration": {"min": 0, "max": 0}}, "/duration", "bad_duration"),
        (SPLINE, {"duration": {"max": 0}}, "/duration", "bad_duration"),
        (QUARTER, {"duration": {"min": 0, "max": 0}}, "/duration", "bad_duration"),
        (
            BSPLINE,
            {"options": {"interpolate": False, "knots": [0, 0, 0, 0, 0.5, 1, 1, 1]}},
            "/options/knots",
            "bad_knots",
        ),
        (
            BSPLINE,
            {"options": {"interpolate": False, "knots": [0, 0, 0, 0, 1, 0.5, 1, 1, 1]}},
            "/options/knots/5",
            "bad_knots",
        ),
        (BSPLINE, {"options": {"interpolate": False, "knots": [0] * 5 + [1] * 4}}, "/options/knots", "bad_knots"),
        (
            BSPLINE,
            {"options": {"interpolate": False, "knots": [0, 0.1, 0.2, 1, 1, 1, 1.5, 2, 2]}},
            "/options/knots",
            "bad_knots",
        ),
        (SPLINE, {"options": {"interpolate": False, "degree": 0}}, "/options/degree", "bad_degree"),
        (SPLINE, {"options": {"interpolate": False, "degree": 11}}, "/options/degree", "bad_degree"),
        (SPLINE, {"options": {"interpolate": False, "degree": 5}}, "/waypoints", "too_few_points"),
        (SPLINE, {"options": {"interpolate": False, "spacing": "uniform"}}, "/options/spacing", "conflict"),
        (THROUGH, {"options": {"degree": 0}}, "/options/degree", "bad_degree"),
        (THROUGH, {"options": {"degree": 6}}, "/waypoints", "too_few_points"),
        (THROUGH, {"options": {"knots": clamped([3])}}, "/options/knots", "bad_knots"),
        (THROUGH, {"options": {"knots": clamped([3, 2])}}, "/options/knots/5", "bad_knots"),
        (THROUGH, {"options": {"knots": clamped([2, 3], 6)}}, "/options/knots", "bad_knots"),  # other than the times
        (THROUGH, {"options": {"knots": clamped([4.5, 4.9])}}, "/options/knots", "bad_knots"),  # Schoenberg-Whitney
        (THROUGH, {"options": {"knots": clamped([0, 2])}}, "/options/knots", "bad_knots"),  # five at the start
        (THROUGH, {"times": [0, 1, 1, 2, 3, 4]}, "/times/2", "not_increasing"),
        (QUARTER, {"options": {"degree": 2, "weights": [1, 0, 1]}}, "/options/weights/1", "bad_weights"),
        (QUARTER, {"options": {"degree": 2, "weights": [1, 1, -1]}}, "/options/weights/2", "bad_weights"),
        (QUARTER, {"options": {"degree": 2, "weights": [1, 1e-7, 1]}}, "/options/weights", "bad_weights"),
        (QUARTER, {"options": {"degree": 2, "weights": [1, 1]}}, "/options/weights", "shape_mismatch"),
        (QUARTER, {"options": {"degree": 3}}, "/waypoints", "too_few_points"),
        (QUARTER, {"options": {"degree": 0}}, "/options/degree", "bad_degree"),
        (QUARTER, {"options": {"degree": 2, "knots": [0, 0, 0, 1, 1]}}, "/options/knots", "bad_knots"),
        (QUARTER, {"options": {"degree": 2, "knots": [0, 0, 0, 1, 0.5, 1]}}, "/options/knots/4", "bad_knots"),
    ],
)
def test_bad_input(service, problem, body, changes, field, code):
    document = problem(service.post(PLAN, json={**body, **changes}), "invalid_request")
    assert [(e["field"], e["code"]) for e in document["errors"]] == [(field, code)], document


@pytest.mark.parametrize("body", [BEZIER, SPLINE, QUARTER], ids=["bezier", "bspline", "nurbs"])
@pytest.mark.parametrize(
    "changes, what",
    [
        ({"times": [0, 1, 2, 3, 4]}, "times"),
        ({"limits": {"velocity": 100}}, "velocity"),
        ({"limits": {"position": {"lower": -100, "upper": 100}}}, "position"),
        ({"start": {"velocity": [0, 0]}}, "boundary_velocity"),
        ({"segment_durations": [{"min": 0.01}]}, "segment_durations"),
        ({"segment_limits": [{"velocity": 100}]}, "segment_limits, velocity"),
    ],
)
def test_what_control_points_cannot_honour_is_refused_by_name(service, problem, body, changes, what):
    n = len(body["waypoints"])
    changes = {
        k: v[:n] if k == "times" else v + [None] * (n - 2) if isinstance(v, list) else v for k, v in changes.items()
    }
    document = problem(service.post(PLAN, json={**body, **changes}), "unsupported")
    assert document["method"] == body["method"] and document["what"] == what
    assert body["method"] not in document["alternatives"] and document["alternatives"]


def test_through_waypoints_needs_times_and_control_points_take_none(service, problem):
    document = problem(service.post(PLAN, json={k: v for k, v in THROUGH.items() if k != "times"}), "invalid_request")
    assert [(e["field"], e["code"]) for e in document["errors"]] == [("/times", "missing")]
    answer = plan(service, {**THROUGH, "times": None, "duration": {"min": 2, "max": 2}})
    assert answer["duration"] == 2 and [w["code"] for w in answer["warnings"]] == ["times_chosen"]


# -- rational polynomials judged -----------------------------------------------------------------------------------


@pytest.mark.parametrize("body", [QUARTER, CIRCLE, PLAIN_NURBS], ids=["quarter", "circle", "uneven"])
def test_a_plans_own_answer_certified_again(service, body):
    answer = plan(service, body)
    again = certify(service, answer["polynomial"])
    ours = answer["certificate"]
    assert again["holds"] and again["basis"] == ours["basis"] == "enclosure"
    assert again["continuity"] == ours["continuity"]
    assert again["cost"]["path_length"] == pytest.approx(ours["cost"]["path_length"], rel=1e-12)
    if ours["cost"]["squared_jerk"] is not None:
        assert again["cost"]["squared_jerk"] == pytest.approx(ours["cost"]["squared_jerk"], rel=1e-9)


def test_limits_of_a_rational_polynomial_are_judged(service):
    """The bounds are those of dense evaluation, from above, and the value is taken at the time that is named."""
    polynomial = plan(service, PLAIN_NURBS)["polynomial"]
    answer = plan(service, PLAIN_NURBS, np.linspace(0, 1, 20_001).tolist())
    limits = {"position": {"lower": -2, "upper": 3}, "velocity": 50, "acceleration": 500, "jerk": 5000}
    found = certify(service, polynomial, limits=limits)
    assert found["holds"] and found["basis"] == "enclosure"
    times = np.array(answer["samples"]["time"])
    assert [c["quantity"] for c in found["checks"]] == ["position", "velocity", "acceleration", "jerk"]
    for check in found["checks"][1:]:
        values = rows(answer, check["quantity"])
        dense = np.abs(values).max()
        assert dense * (1 - 1e-12) <= abs(check["value"]) <= dense * (1 + 1e-6)
        k = int(np.argmin(np.abs(times - check["time"])))
        assert values[k, check["joint"]] == pytest.approx(check["value"], rel=1e-2)
        tight = certify(service, polynomial, limits={check["quantity"]: dense * (1 - 1e-3)})
        assert not tight["holds"] and tight["checks"][0]["ratio"] == pytest.approx(1 / (1 - 1e-3), rel=1e-5)
        assert certify(service, polynomial, limits={check["quantity"]: dense * (1 + 1e-6)})["holds"]


def test_the_time_of_the_worst_position_is_where_it_is(service):
    """x = 1 at the start of the circle, and nowhere else in its first quarter."""
    polynomial = plan(service, CIRCLE)["polynomial"]
    found = certify(service, polynomial, limits={"position": {"lower": -3, "upper": 1.5}})
    (check,) = found["checks"]
    value = evaluated(polynomial, [check["time"]])[0, check["joint"]]
    assert value == pytest.approx(check["value"], abs=1e-6)


def test_waypoints_and_jumps_of_a_rational_polynomial(service):
    polynomial = plan(service, CIRCLE)["polynomial"]
    good = certify(service, polynomial, waypoints=[[1, 0], [HALF, HALF], [0, 1], [1, 0]], times=[0, 0.125, 0.25, 1])
    assert good["holds"] and good["waypoint_error"] <= 1e-12
    assert certify(service, polynomial, waypoints=[[1, 0], [-1, 0], [1, 0]])["holds"]
    assert not certify(service, polynomial, waypoints=[[1, 0], [1, 1], [1, 0]])["holds"]
    assert certify(service, polynomial, start={"velocity": [0, 4 * 2**0.5]})["holds"]
    assert not certify(service, polynomial, start={"velocity": [0, 4]})["holds"]
    jerk = certify(service, polynomial, limits={"jerk": 1e6})  # the acceleration jumps at the quarters
    assert not jerk["holds"] and jerk["checks"][0]["value"] is None and jerk["continuity"] == 1


UNIT = {"breaks": [0, 1], "coefficients": [[[1]], [[0]], [[0]]], "weights": [[1], [-3.9], [3.9]]}


def test_a_denominator_with_a_negative_bernstein_coefficient_is_judged(service):
    """1 - 3.9 u (1 - u) is least, 1 / 40, in the middle."""
    found = certify(service, UNIT, limits={"position": {"lower": 0, "upper": 41}})
    assert found["holds"] and found["basis"] == "enclosure"
    assert found["checks"][0]["value"] == pytest.approx(40, rel=1e-8)
    assert found["checks"][0]["time"] == pytest.approx(0.5, abs=1e-4)


@pytest.mark.parametrize(
    "weights, field, code",
    [
        ([[1], [-4], [4]], "/weights", "bad_weights"),  # touches zero
        ([[1], [-5], [5]], "/weights", "bad_weights"),
        ([[0], [1], [0]], "/weights", "bad_weights"),
        ([[1], [-1], [0]], "/weights", "bad_weights"),
        ([[-1], [0], [0]], "/weights", "bad_weights"),
        ([[0], [0], [0]], "/weights", "bad_weights"),
        ([[1], [0]], "/weights", "shape_mismatch"),
        ([[1], [0], [0], [0]], "/weights", "shape_mismatch"),
        ([[1, 1], [0, 0], [0, 0]], "/weights", "shape_mismatch"),
        ([[1], [0], []], "/weights", "shape_mismatch"),
        ([], "/weights", "shape_mismatch"),
        ([1, 0, 0], "/weights/0", "wrong_type"),
        ([[1], [0], ["0"]], "/weights/2/0", "wrong_type"),
        ([[1], [0], [1e101]], "/weights/2/0", "out_of_range"),
    ],
)
def test_weights_that_are_wrong(service, problem, weights, field, code):
    body = {"trajectory": {"polynomial": {**UNIT, "weights": weights}}}
    document = problem(service.post(CERTIFY, json=body), "invalid_request")
    assert ("/trajectory/polynomial" + field, code) in [(e["field"], e["code"]) for e in document["errors"]], document


def test_basis_says_how_it_was_judged(service):
    plain = {"breaks": [0, 1], "coefficients": [[[0]], [[0]], [[3]], [[-2]]]}
    assert certify(service, plain, limits={"velocity": 2})["basis"] == "exact"
    assert certify(service, UNIT)["basis"] == "enclosure"
    samples = {"time": [0, 1, 2], "position": [[0], [1], [2]]}
    found = service.post(CERTIFY, json={"trajectory": {"samples": samples}}).json()["certificate"]
    assert found["basis"] == "finite_differences"
