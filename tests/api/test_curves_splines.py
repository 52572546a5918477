"""Splines over HTTP: the worked numbers of the methods' sections 1.3, 3 and 8.1, wraps, spacings, refusals."""

import numpy as np
import pytest

from planner import Trajectory

PLAN = "/v1/trajectories"
T, X = [0, 1, 2], [[0], [2], [3]]


def plan(service, method, points, times=None, at=None, **more):
    """Return the answer and its samples as arrays; the polynomial must give the samples."""
    body = {"waypoints": np.asarray(points).tolist(), "method": method, "include": ["samples", "polynomial"], **more}
    if times is not None:
        body["times"] = times
    if at is not None:
        body["sampling"] = {"times": at}
    response = service.post(PLAN, json=body)
    assert response.status_code == 200, response.text[:2000]
    answer = response.json()
    assert answer["certificate"]["holds"] and answer["method"] == method
    samples = {name: np.array(rows) for name, rows in answer["samples"].items()}
    curve = Trajectory.from_powers(answer["polynomial"]["breaks"], answer["polynomial"]["coefficients"])
    for order, name in enumerate(("position", "velocity", "acceleration", "jerk")):
        scale = 1 + np.abs(samples[name]).max()
        np.testing.assert_allclose(curve(samples["time"], order), samples[name], atol=1e-9 * scale)
    return answer, samples


def coefficients(answer):
    """Return the local coefficients of the first joint, a row for every piece."""
    return np.array(answer["polynomial"]["coefficients"])[:, :, 0].T


def codes(answer):
    return [w["code"] for w in answer["warnings"]]


# -- 3.2: the cubic spline -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("more", "first", "second"),
    [
        ({}, (0, 0, 3.75, -1.75), (2, 2.25, -1.5, 0.25)),
        ({"options": {"boundary": "natural"}}, (0, 2.25, 0, -0.25), (2, 1.5, -0.75, 0.25)),
        (
            {"start": {"velocity": [1]}, "end": {"velocity": [-0.5]}},
            (0, 1, 1.875, -0.875),
            (2, 2.125, -0.75, -0.375),
        ),
        (
            {
                "options": {"boundary": "second_derivative"},
                "start": {"acceleration": [1]},
                "end": {"acceleration": [-2]},
            },
            (0, 1.875, 0.5, -0.375),
            (2, 1.75, -0.625, -0.125),
        ),
        ({"options": {"boundary": ["clamped", "natural"]}}, (0, 0, 27 / 7, -13 / 7), (2, 15 / 7, -12 / 7, 4 / 7)),
    ],
    ids=["clamped", "natural", "clamped moving", "second_derivative", "mixed"],
)
def test_worked_coefficients(service, more, first, second):
    answer, found = plan(service, "cubic_spline", X, T, [0, 1, 2], **more)
    np.testing.assert_allclose(coefficients(answer), [first, second], atol=1e-9)
    end = 2 * second[2] + 6 * second[3]
    assert found["acceleration"][:, 0] == pytest.approx([2 * first[2], 2 * second[2], end], abs=1e-9)
    assert answer["certificate"]["continuity"] == 2 and answer["warnings"] == []


def test_worked_values(service):
    _, found = plan(service, "cubic_spline", X, T, [0, 0.5, 5 / 7, 1, 1.5, 2])
    assert found["position"][[1, 4], 0] == pytest.approx([0.71875, 2.78125], abs=1e-9)
    assert found["velocity"][:, 0] == pytest.approx([0, 2.4375, 75 / 28, 2.25, 0.9375, 0], abs=1e-9)
    assert found["acceleration"][[0, 3, 5], 0] == pytest.approx([7.5, -3, -1.5], abs=1e-9)
    assert found["jerk"][[0, 4], 0] == pytest.approx([-10.5, 1.5], abs=1e-9)


def test_worked_unequal_knots(service):
    t, x, at = [0, 1, 3, 4], [[0], [2], [1], [3]], [0, 0.5, 1, 2, 3, 3.5, 4]
    _, natural = plan(service, "cubic_spline", x, t, at, options={"boundary": "natural"})
    _, clamped = plan(service, "cubic_spline", x, t, at)
    knots, between = [0, 2, 4, 6], [1, 3, 5]
    assert natural["acceleration"][knots, 0] == pytest.approx([0, -3.75, 3.75, 0], abs=1e-9)
    assert natural["velocity"][knots, 0] == pytest.approx([2.625, 0.75, 0.75, 2.625], abs=1e-9)
    assert natural["position"][between, 0] == pytest.approx([1.234375, 1.5, 1.765625], abs=1e-9)
    assert clamped["acceleration"][knots, 0] == pytest.approx([9, -6, 6, -9], abs=1e-9)
    assert clamped["position"][between, 0] == pytest.approx([0.8125, 1.5, 2.1875], abs=1e-9)


def test_worked_periodic(service):
    options = {"boundary": "periodic"}
    _, found = plan(service, "cubic_spline", [[0], [1], [-1], [0]], [0, 1, 2, 4], [0, 0.5, 1.5, 3, 4], options=options)
    assert found["velocity"][[0, 4], 0] == pytest.approx([1.8, 1.8], abs=1e-9)
    assert found["acceleration"][[0, 4], 0] == pytest.approx([0.3, 0.3], abs=1e-9)
    assert found["position"][1:4, 0] == pytest.approx([0.81875, 0.13125, -1.4], abs=1e-9)


def test_worked_start_conditions_warn(service):
    more = {"options": {"boundary": "start_conditions"}, "start": {"velocity": [1], "acceleration": [0]}}
    answer, found = plan(service, "cubic_spline", X, T, [2], **more)
    assert coefficients(answer)[:, 3] == pytest.approx([1, -6], abs=1e-9)
    assert (found["velocity"][0, 0], found["acceleration"][0, 0]) == pytest.approx((-8, -30), abs=1e-9)
    assert codes(answer) == ["ill_conditioned"] and "3.7" in answer["warnings"][0]["message"]


def test_erratum_e6_natural_means_zero_end_accelerations(service):
    _, natural = plan(service, "cubic_spline", X, T, [0.5], options={"boundary": "natural"})
    assigned = {"options": {"boundary": "second_derivative"}, "start": {"acceleration": [1]}}
    _, other = plan(service, "cubic_spline", X, T, [0.5], end={"acceleration": [-2]}, **assigned)
    assert (natural["position"][0, 0], other["position"][0, 0]) == pytest.approx((1.09375, 1.015625), abs=1e-9)


def test_all_axes_of_one_request_are_those_of_many(service):
    x = np.random.default_rng(3).normal(size=(5, 3))
    t = [0, 1, 1.5, 3, 4]
    _, whole = plan(service, "cubic_spline", x, t)
    for axis in range(3):
        _, alone = plan(service, "cubic_spline", x[:, [axis]], t)
        np.testing.assert_allclose(alone["position"][:, 0], whole["position"][:, axis], atol=1e-11)
        np.testing.assert_allclose(alone["jerk"][:, 0], whole["jerk"][:, axis], atol=1e-9)


# -- 3.1, 3.3, 3.4: quintic, polyline, Hermite ---------------------------------------------------------------------


def test_worked_quintic(service):
    answer, found = plan(service, "quintic_spline", X, T, [0, 0.5, 1, 1.5, 2])
    assert found["position"][[1, 3], 0] == pytest.approx([0.50846354, 2.88736979], abs=1e-8)
    assert found["velocity"][:, 0][[0, 2, 4]] == pytest.approx([0, 2.8125, 0], abs=1e-9)
    assert found["acceleration"][:, 0][[0, 2, 4]] == pytest.approx([0, -10 / 3, 0], abs=1e-8)
    assert found["jerk"][1, 0] == pytest.approx(-12.8125, abs=1e-9)
    left, right = coefficients(answer)
    assert (24 * left[4] + 120 * left[5], 24 * right[4]) == pytest.approx((60, 60), abs=1e-7)
    assert answer["certificate"]["continuity"] == 4


def test_worked_quintic_peak(service):
    limits = {"velocity": 3.2}
    answer, _ = plan(service, "time_scaled", X, T, limits=limits, options={"path": {"kind": "quintic_spline"}})
    (check,) = answer["certificate"]["checks"]
    assert check["value"] == pytest.approx(3.19026, abs=1e-5) and answer["duration"] == 2


def test_worked_polyline_and_erratum_e22(service):
    q, thirds = [[0, 0], [1, 0], [1, 2], [3, 2]], {"options": {"spacing": "uniform"}, "duration": {"min": 1, "max": 1}}
    at = [0.1, 1 / 3, 0.5, 0.9, 1]
    answer, found = plan(service, "linear", q, None, at, **thirds)
    expected = [[0.3, 0], [1, 0], [1, 1], [2.4, 2], [3, 2]]
    np.testing.assert_allclose(found["position"], expected, atol=1e-9)
    assert found["velocity"][-1] == pytest.approx([6, 0], abs=1e-9)  # from the left: n (q_3 - q_2)
    assert answer["waypoint_times"] == pytest.approx([0, 1 / 3, 2 / 3, 1], abs=1e-12)
    assert codes(answer) == ["times_chosen"] and answer["certificate"]["continuity"] == 0


def test_worked_hermite_piece(service):
    points, tangents = [[0, 0], [2, 1]], {"tangents": [[1, 2], [0, -1]]}
    answer, found = plan(service, "cubic_hermite", points, [0, 1], [0.25, 0.5, 0.75], options=tangents)
    expected = [[0.453125, 0.484375], [1.125, 0.875], [1.734375, 1.078125]]
    np.testing.assert_allclose(found["position"], expected, atol=1e-9)
    assert found["velocity"][1] == pytest.approx([2.75, 1.25], abs=1e-9)
    powers = np.array(answer["polynomial"]["coefficients"])[:, 0]
    np.testing.assert_allclose(powers, [[0, 0], [1, 2], [4, 0], [-3, -1]], atol=1e-9)


def test_tangents_are_per_second(service):
    """The same piece over two seconds needs half the velocities."""
    tangents = {"tangents": [[0.5, 1], [0, -0.5]]}
    _, found = plan(service, "cubic_hermite", [[0, 0], [2, 1]], [0, 2], [1], options=tangents)
    assert found["position"][0] == pytest.approx([1.125, 0.875], abs=1e-9)
    assert found["velocity"][0] == pytest.approx([1.375, 0.625], abs=1e-9)


@pytest.mark.parametrize(
    ("options", "velocities"),
    [
        ({}, [2, 1 / 3, 1 / 3, 2]),
        ({"tangents": "catmull_rom"}, [2, 1 / 3, 1 / 3, 2]),
        ({"tangents": "finite_difference"}, [2, 0.75, 0.75, 2]),
        ({"tangents": "monotone"}, [2, 0, 0, 2]),
    ],
)
def test_tangent_rules(service, options, velocities):
    answer, found = plan(service, "cubic_hermite", [[0], [2], [1], [3]], [0, 1, 3, 4], [0, 1, 3, 4], options=options)
    assert found["velocity"][:, 0] == pytest.approx(velocities, abs=1e-9)
    assert answer["certificate"]["continuity"] == 1


# -- 1.3: time scaling ---------------------------------------------------------------------------------------------


def test_worked_scaling_by_two(service):
    by_times = plan(service, "cubic_spline", X, [0, 2, 4], [1])
    by_duration = plan(service, "time_scaled", X, T, [1], duration={"min": 4, "max": 4})
    by_limit = plan(service, "time_scaled", X, T, [1], limits={"velocity": 75 / 56})
    for answer, found in (by_times, by_duration, by_limit):
        assert answer["duration"] == pytest.approx(4, abs=1e-9)
        values = [found[name][0, 0] for name in ("position", "velocity", "acceleration", "jerk")]
        assert values == pytest.approx([0.71875, 1.21875, 0.5625, -1.3125], abs=1e-9)


def test_worked_factor_and_the_limit_that_binds(service):
    limits = {"velocity": 1, "acceleration": 2}
    answer, _ = plan(service, "time_scaled", X, T, limits=limits)
    alpha = 75 / 28
    assert answer["duration"] == pytest.approx(2 * alpha, rel=1e-9)
    assert answer["waypoint_times"] == pytest.approx([0, alpha, 2 * alpha], rel=1e-9)
    (warning,) = answer["warnings"]
    assert (
        warning["code"] == "binding_limit" and "velocity" in warning["message"] and "2.67857143" in warning["message"]
    )
    velocity, acceleration = answer["certificate"]["checks"]
    assert velocity["value"] == pytest.approx(1, rel=1e-9) and velocity["time"] == pytest.approx(5 / 7 * alpha)
    assert acceleration["value"] == pytest.approx(7.5 / alpha**2, rel=1e-9)


@pytest.mark.parametrize(
    ("limits", "alpha", "binding"),
    [
        ({"velocity": 10, "acceleration": 2}, np.sqrt(3.75), "acceleration"),
        ({"velocity": 10, "acceleration": 20, "jerk": 1}, np.cbrt(10.5), "jerk"),
        ({"velocity": 10, "acceleration": 20}, 1, None),
    ],
)
def test_the_smallest_factor(service, limits, alpha, binding):
    answer, _ = plan(service, "time_scaled", X, T, limits=limits)
    assert answer["duration"] == pytest.approx(2 * alpha, rel=1e-9)
    assert codes(answer) == ([] if binding is None else ["binding_limit"])
    assert binding is None or f"the {binding} limit" in answer["warnings"][0]["message"]


def test_speeding_up_only_when_asked(service):
    limits = {"velocity": 10, "acceleration": 20}
    assert plan(service, "time_scaled", X, T, limits=limits)[0]["duration"] == 2
    faster, _ = plan(service, "time_scaled", X, T, limits=limits, options={"allow_faster": True})
    assert faster["duration"] == pytest.approx(2 * np.sqrt(7.5 / 20), rel=1e-9)
    assert codes(faster) == ["binding_limit"] and "acceleration" in faster["warnings"][0]["message"]


def test_erratum_e14_boundary_derivatives_scale_too(service):
    def at(times, time, velocity):
        return plan(service, "cubic_spline", X, times, [time], start={"velocity": [velocity]})[1]["position"][0, 0]

    values = at(T, 0.5, 1), at([0, 2, 4], 1, 0.5), at([0, 2, 4], 1, 1)
    assert values == pytest.approx((0.875, 0.875, 1.03125), abs=1e-9)


# -- 3.3, 8.1: wraps, spacings, dwells -----------------------------------------------------------------------------


def test_wrapping_joints_take_the_shortest_turn(service):
    turn, points = 2 * np.pi, [[6, 6], [0.5, 0.5], [-0.5, 20]]
    answer, found = plan(service, "linear", points, T, T, wrap=[True, False])
    np.testing.assert_allclose(found["position"], [[6, 6], [turn + 0.5, 0.5], [turn - 0.5, 20]], atol=1e-12)
    assert codes(answer) == ["turns_added"]
    both, found = plan(service, "cubic_spline", points, T, T, wrap=True)
    np.testing.assert_allclose(found["position"][:, 1], [6, turn + 0.5, 20 - 2 * turn], atol=1e-9)
    assert codes(both) == ["turns_added"]


@pytest.mark.parametrize("wrap", [False, [False], None])
def test_joints_that_do_not_wrap_are_left(service, wrap):
    answer, found = plan(service, "linear", [[6], [0.5]], [0, 1], [0, 1], wrap=wrap)
    assert found["position"][:, 0].tolist() == [6, 0.5] and codes(answer) == []


@pytest.mark.parametrize("last", [np.pi, -np.pi, 3.0, 0.0])
def test_up_to_half_a_turn_nothing_is_added(service, last):
    answer, found = plan(service, "linear", [[0], [last]], [0, 1], [0, 1], wrap=True)
    assert found["position"][1, 0] == last and codes(answer) == []


def test_a_wrap_can_leave_a_standstill(service):
    answer, found = plan(service, "linear", [[0], [2 * np.pi]], [0, 1], [0, 1], wrap=True)
    assert codes(answer) == ["turns_added"] and found["position"][:, 0].tolist() == [0, 0]


@pytest.mark.parametrize(
    ("spacing", "word", "shares"),
    [
        ("uniform", "uniformly", [1, 1, 1]),
        ("chord_length", "chord length", [5, 4, 1]),
        ("centripetal", "centripetally", np.sqrt([5, 4, 1])),
        (None, "centripetally", np.sqrt([5, 4, 1])),
    ],
)
@pytest.mark.parametrize(
    "method", ["linear", "polynomial", "hermite", "cubic_hermite", "cubic_spline", "quintic_spline"]
)
def test_spacing_over_a_duration(service, method, spacing, word, shares):
    points = [[0, 0], [3, 4], [3, 8], [4, 8]]
    options = {} if spacing is None else {"spacing": spacing}
    answer, _ = plan(service, method, points, duration={"min": 3, "max": 3}, options=options)
    expected = 3 * np.append(0, np.cumsum(shares) / np.sum(shares))
    assert answer["waypoint_times"] == pytest.approx(expected, abs=1e-12)
    chosen = [w for w in answer["warnings"] if w["code"] == "times_chosen"]
    assert len(chosen) == 1 and word in chosen[0]["message"]


@pytest.mark.parametrize("spacing", ["uniform", "chord_length", "centripetal"])
def test_duplicates_are_merged_and_said_so(service, spacing):
    points, options = [[0, 0], [3, 4], [3, 4], [3, 8]], {"spacing": spacing}
    answer, found = plan(service, "cubic_spline", points, duration={"min": 2, "max": 2}, options=options)
    times = answer["waypoint_times"]
    assert len(times) == 4 and times[1] == times[2]
    assert codes(answer) == ["waypoints_merged", "times_chosen"]
    once, same = plan(service, "cubic_spline", points[:2] + points[3:], duration={"min": 2, "max": 2}, options=options)
    np.testing.assert_allclose(found["position"], same["position"], atol=1e-12)


def test_with_times_duplicates_are_a_dwell(service):
    answer, found = plan(service, "linear", [[0], [1], [1], [2]], [0, 1, 2, 3], [1, 1.5, 2])
    assert found["position"][:, 0].tolist() == [1, 1, 1] and codes(answer) == []
    loop, found = plan(service, "cubic_spline", [[0], [1], [1], [2]], [0, 1, 2, 3], [1, 2])
    assert found["position"][:, 0] == pytest.approx([1, 1], abs=1e-12) and codes(loop) == []


def test_waypoints_with_tangents_of_their_own_are_not_merged(service):
    tangents = {"tangents": [[0], [0.5], [0]]}
    _, found = plan(service, "cubic_hermite", [[0], [0], [1]], duration={"min": 2, "max": 2}, options=tangents)
    assert found["position"][[0, -1], 0].tolist() == [0, 1]


def test_tangents_of_a_standstill_are_not_ignored(service, problem):
    tangents = {"tangents": [[1], [-1]]}
    _, found = plan(service, "cubic_hermite", [[0], [0]], [0, 1], [0, 0.5, 1], options=tangents)
    assert found["position"][:, 0] == pytest.approx([0, 0.25, 0], abs=1e-12)
    body = {"waypoints": [[0], [0]], "times": [0, 1], "method": "cubic_hermite", "options": {"tangents": [[0]]}}
    (error,) = problem(service.post(PLAN, json=body), "invalid_request")["errors"]
    assert (error["field"], error["code"]) == ("/options/tangents", "shape_mismatch")


# -- 0: refusals ---------------------------------------------------------------------------------------------------

METHODS = ["linear", "cubic_hermite", "cubic_spline", "quintic_spline"]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("change", "field", "code"),
    [
        ({"waypoints": [[0]], "times": [0]}, "/waypoints", "too_few_points"),
        ({"waypoints": [], "times": []}, "/waypoints", "too_few_points"),
        ({"times": [0, 1, 1]}, "/times/2", "not_increasing"),  # equal times, different points
        ({"times": [0, 2, 1]}, "/times/2", "not_increasing"),
        ({"times": [0, 1]}, "/times", "shape_mismatch"),
        ({"waypoints": [[0], [1, 2], [3]]}, "/waypoints/1", "shape_mismatch"),
        ({"times": None}, "/times", "missing"),
        ({"times": None, "duration": {"min": 0, "max": 0}}, "/duration", "bad_duration"),
        ({"times": None, "duration": {"min": 2, "max": 1}}, "/duration", "bad_duration"),
        ({"times": None, "duration": {"min": 1, "max": 2}}, "/times", "missing"),
        ({"duration": {"min": 3, "max": 3}}, "/duration", "conflict"),
        ({"options": {"spacing": "uniform"}}, "/options/spacing", "conflict"),
        ({"options": {"spacing": "even"}}, "/options/spacing", "out_of_range"),
        ({"wrap": [True, True]}, "/wrap", "shape_mismatch"),
        ({"wrap": [1]}, "/wrap/0", "wrong_type"),
        ({"wrap": "yes"}, "/wrap", "wrong_type"),
        ({"limits": {"velocity": 0}}, "/limits/velocity", "bad_limits"),
        ({"limits": {"acceleration": -1}}, "/limits/acceleration", "bad_limits"),
    ],
)
def test_bad_input(service, problem, method, change, field, code):
    body = {"waypoints": X, "times": T, "method": method} | change
    (error,) = problem(service.post(PLAN, json=body), "invalid_request")["errors"]
    assert (error["field"], error["code"]) == (field, code)
    assert error["reason"]


@pytest.mark.parametrize(
    ("method", "change", "field", "code"),
    [
        ("cubic_spline", {"options": {"boundary": "periodic"}}, "/waypoints", "not_periodic"),
        (
            "cubic_spline",
            {"options": {"boundary": "periodic"}, "waypoints": [[0], [1]], "times": [0, 1]},
            "/waypoints",
            "too_few_points",
        ),
        ("cubic_spline", {"options": {"boundary": "free"}}, "/options/boundary", "out_of_range"),
        ("cubic_spline", {"options": {"boundary": ["clamped"]}}, "/options/boundary", "out_of_range"),
        ("cubic_spline", {"options": {"boundary": ["clamped", "periodic"]}}, "/options/boundary/1", "out_of_range"),
        (
            "cubic_spline",
            {
                "options": {"boundary": "start_conditions"},
                "waypoints": [[(-1) ** i] for i in range(40)],
                "times": list(range(40)),
            },
            "/options/boundary",
            "bad_boundary",
        ),
        ("cubic_spline", {"start": {"velocity": [1, 2]}}, "/start/velocity", "shape_mismatch"),
        ("quintic_spline", {"end": {"acceleration": []}}, "/end/acceleration", "shape_mismatch"),
        ("cubic_hermite", {"options": {"tangents": [[1], [2]]}}, "/options/tangents", "shape_mismatch"),
        ("cubic_hermite", {"options": {"tangents": [[1, 1]] * 3}}, "/options/tangents", "shape_mismatch"),
        ("cubic_hermite", {"options": {"tangents": "steep"}}, "/options/tangents", "out_of_range"),
        ("cubic_hermite", {"options": {"tangents": [[1], [None], [1]]}}, "/options/tangents/1/0", "wrong_type"),
        ("time_scaled", {"limits": {"velocity": 0}}, "/limits/velocity", "bad_limits"),
        ("time_scaled", {"limits": {"velocity": {"lower": 0.1, "upper": 1}}}, "/limits/velocity", "bad_limits"),
        ("time_scaled", {"times": None}, "/limits", "missing"),
        (
            "time_scaled",
            {"limits": {"velocity": 1}, "options": {"path": {"kind": "cubic_spline", "spacing": "uniform"}}},
            "/options/path/spacing",
            "conflict",
        ),
        (
            "time_scaled",
            {"limits": {"velocity": 1}, "options": {"path": {"kind": "linear", "knots": [0, 1, 2]}}},
            "/options/path/knots",
            "conflict",
        ),
    ],
)
def test_bad_input_of_one_method(service, problem, method, change, field, code):
    body = {"waypoints": X, "times": T, "method": method} | change
    (error,) = problem(service.post(PLAN, json=body), "invalid_request")["errors"]
    assert (error["field"], error["code"]) == (field, code)
    assert error["reason"]


@pytest.mark.parametrize("number", ["NaN", "1e999", "-Infinity"])
@pytest.mark.parametrize(
    ("text", "field"),
    [
        ('"waypoints": [[0], [%s], [3]], "times": [0, 1, 2], "method": "linear"', "/waypoints/1/0"),
        ('"waypoints": [[0], [2], [3]], "times": [0, %s, 2], "method": "quintic_spline"', "/times/1"),
        (
            '"waypoints": [[0], [2], [3]], "times": [0, 1, 2], "method": "cubic_spline", "start": {"velocity": [%s]}',
            "/start/velocity/0",
        ),
        (
            '"waypoints": [[0], [2]], "times": [0, 2], "method": "cubic_hermite", "options": {"tangents": [[0], [%s]]}',
            "/options/tangents/1/0",
        ),
    ],
)
def test_numbers_that_are_not_finite(service, problem, text, field, number):
    response = service.post(PLAN, content="{" + text % number + "}", headers={"content-type": "application/json"})
    (error,) = problem(response, "invalid_request")["errors"]
    assert (error["field"], error["code"]) == (field, "not_finite")


@pytest.mark.parametrize(
    ("method", "change", "what"),
    [
        ("linear", {"start": {"velocity": [0]}}, "boundary_velocity"),
        ("cubic_hermite", {"end": {"velocity": [0]}}, "boundary_velocity"),
        ("cubic_spline", {"options": {"boundary": "natural"}, "start": {"velocity": [0]}}, "boundary_velocity"),
        ("cubic_spline", {"start": {"acceleration": [0]}}, "boundary_acceleration"),
        ("quintic_spline", {"start": {"jerk": [0]}}, "boundary_jerk"),
        ("quintic_spline", {"limits": {"jerk": 1}}, "jerk"),
        ("time_scaled", {"start": {"velocity": [0]}}, "boundary_velocity"),
        ("time_scaled", {"limits": {"acceleration": 1}, "options": {"path": {"kind": "linear"}}}, "acceleration"),
    ],
)
def test_what_is_not_honoured_is_refused(service, problem, method, change, what):
    body = {"waypoints": X, "times": T, "method": method} | change
    assert problem(service.post(PLAN, json=body), "unsupported")["what"] == what
