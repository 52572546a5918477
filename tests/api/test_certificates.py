"""POST /v1/certificates: anyone's trajectory, judged."""

import numpy as np
import pytest

from api.answers import CertifyReply

CERTIFY = "/v1/certificates"
STEP = {"breaks": [0, 1], "coefficients": [[[0]], [[0]], [[3]], [[-2]]]}


def certify(service, trajectory, **given):
    response = service.post(CERTIFY, json={"trajectory": trajectory, **given})
    assert response.status_code == 200, response.text[:1000]
    CertifyReply.model_validate(response.json())
    return response.json()["certificate"]


def test_a_polynomial_is_judged_exactly(service):
    found = certify(service, {"polynomial": STEP}, limits={"velocity": 1.5, "acceleration": 6})
    assert found["holds"] and found["basis"] == "exact"
    assert [(c["quantity"], c["value"]) for c in found["checks"]] == [("velocity", 1.5), ("acceleration", 6.0)]
    broken = certify(service, {"polynomial": STEP}, limits={"velocity": 1.4})
    assert not broken["holds"]
    assert broken["checks"][0]["value"] == pytest.approx(1.5)
    assert broken["checks"][0]["time"] == pytest.approx(0.5)


def test_a_jump_is_unbounded(service):
    jump = {"breaks": [0, 1, 2], "coefficients": [[[0], [5]], [[1], [1]]]}
    found = certify(service, {"polynomial": jump}, limits={"velocity": 2})
    assert not found["holds"]
    assert found["continuity"] == -1
    check = found["checks"][0]
    assert check["value"] is None and check["ratio"] is None and not check["holds"]


def test_waypoints_and_ends(service):
    good = certify(service, {"polynomial": STEP}, waypoints=[[0], [0.5], [1]], end={"velocity": [0]})
    assert good["holds"]
    late = certify(service, {"polynomial": STEP}, waypoints=[[0], [0.5], [1]], times=[0, 0.4, 1])
    assert not late["holds"]
    assert not certify(service, {"polynomial": STEP}, start={"velocity": [1]})["holds"]
    assert not certify(service, {"polynomial": STEP}, waypoints=[[0], [2]])["holds"]


def test_one_waypoint_at_any_time(service):
    line = {"polynomial": {"breaks": [0, 1], "coefficients": [[[0]], [[1]]]}}
    found = certify(service, line, waypoints=[[0.5]])
    assert found["holds"] and found["waypoint_error"] < 1e-9
    assert not certify(service, line, waypoints=[[2]])["holds"]
    assert certify(service, line, waypoints=[[0.5]], times=[0.5], limits={"velocity": 1})["holds"]


def chebyshev(degree):
    """The Chebyshev polynomial of [0, 1] in monomials: values within ±1, coefficients as large as such can have."""
    powers = np.polynomial.Chebyshev.basis(degree, domain=[0, 1]).convert(kind=np.polynomial.Polynomial).coef
    return {"breaks": [0, 1], "coefficients": powers[:, None, None].tolist()}


@pytest.mark.parametrize("degree, joint", [(15, 0), (15, 1), (13, 0)])
def test_coefficients_that_cancel_are_refused(service, problem, degree, joint):
    polynomial = chebyshev(degree)
    polynomial["coefficients"] = [[[0, c] if joint else [c, 0]] for ((c,),) in polynomial["coefficients"]]
    response = service.post(CERTIFY, json={"trajectory": {"polynomial": polynomial}})
    (error,) = problem(response, "invalid_request")["errors"]
    assert (error["field"], error["code"]) == ("/trajectory/polynomial/coefficients", "out_of_range")
    assert "cancel" in error["reason"]


@pytest.mark.parametrize("offset", [0, -1e3, 1e6, 1e9])
@pytest.mark.parametrize("start", [0, 1e3])
def test_ordinary_polynomials_are_judged_wherever_they_stand(service, offset, start):
    quintic = {"breaks": [start, start + 1], "coefficients": [[[c]] for c in (offset - 1, 0, 0, 10, -15, 6)]}
    waypoints = [[offset - 1], [offset]]
    assert certify(service, {"polynomial": quintic}, waypoints=waypoints, times=quintic["breaks"])["holds"]
    assert certify(service, {"polynomial": chebyshev(9)})["holds"]


def test_samples_are_judged_by_differences(service):
    time = np.linspace(0, 1, 101)
    position = (3 * time**2 - 2 * time**3)[:, None]
    samples = {"time": time.tolist(), "position": position.tolist()}
    found = certify(service, {"samples": samples}, limits={"velocity": 1.5 + 1e-3})
    assert found["holds"] and found["basis"] == "finite_differences"
    assert not certify(service, {"samples": samples}, limits={"velocity": 1.4})["holds"]


def test_what_was_planned_is_certified(service):
    body = {"waypoints": [[0, 0], [1, 2], [2, 3]], "times": [0, 1, 2], "limits": {"jerk": 60}}
    answer = service.post("/v1/trajectories", json=body | {"include": ["polynomial"]}).json()
    found = certify(service, {"polynomial": answer["polynomial"]}, **body)
    assert found["holds"]
    ours = answer["certificate"]["checks"][0]
    assert found["checks"][0]["value"] == pytest.approx(ours["value"])


@pytest.mark.parametrize(
    "changes, field, code",
    [
        ({"trajectory": None}, "/trajectory", "wrong_type"),
        ({"trajectory": {}}, "/trajectory", "conflict"),
        ({"trajectory": {"polynomial": STEP, "samples": {"time": [0], "position": [[0]]}}}, "/trajectory", "conflict"),
        ({"trajectory": {"spline": 1}}, "/trajectory/spline", "unknown_field"),
        ({"trajectory": {"polynomial": {"breaks": [0, 1]}}}, "/trajectory/polynomial/coefficients", "missing"),
        ({"limits": {"velocity": -1}}, "/limits/velocity", "bad_limits"),
        ({"waypoints": [[0, 0], [1, 1]]}, "/waypoints", "shape_mismatch"),
        ({"waypoints": []}, "/waypoints", "too_few_points"),
        ({"times": [0, 1]}, "/times", "conflict"),
        ({"waypoints": [[0], [1]], "times": [1, 0]}, "/times/1", "not_increasing"),
        ({"start": {"velocity": [0, 0]}}, "/start/velocity", "shape_mismatch"),
        ({"end": {"speed": [0]}}, "/end/speed", "unknown_field"),
    ],
)
def test_requests_that_are_wrong(service, problem, changes, field, code):
    response = service.post(CERTIFY, json={"trajectory": {"polynomial": STEP}} | changes)
    document = problem(response, "invalid_request")
    assert (field, code) in [(e["field"], e["code"]) for e in document["errors"]], document


@pytest.mark.parametrize(
    "changes, field, code",
    [
        ({"breaks": [0]}, "/breaks", "too_few_points"),
        ({"breaks": [1, 0]}, "/breaks/1", "not_increasing"),
        ({"breaks": [0, 0]}, "/breaks/1", "not_increasing"),
        ({"breaks": [0, 1, 2]}, "/coefficients/0", "shape_mismatch"),
        ({"coefficients": []}, "/coefficients", "too_few_points"),
        ({"coefficients": [[]]}, "/coefficients/0", "shape_mismatch"),
        ({"coefficients": [[[]]]}, "/coefficients/0/0", "shape_mismatch"),
        ({"coefficients": [[[0]], [[0, 1]]]}, "/coefficients/1/0", "shape_mismatch"),
        ({"coefficients": [[[1e101]]]}, "/coefficients/0/0/0", "out_of_range"),
        ({"coefficients": [[["1"]]]}, "/coefficients/0/0/0", "wrong_type"),
        ({"coefficients": [[[0]], [[1e10]]]}, "/coefficients", "out_of_range"),
        ({"breaks": [0, 1e11], "coefficients": [[[0]]] * 15 + [[[1e100]]]}, "/coefficients", "out_of_range"),
    ],
)
def test_polynomials_that_are_wrong(service, problem, changes, field, code):
    response = service.post(CERTIFY, json={"trajectory": {"polynomial": STEP | changes}})
    document = problem(response, "invalid_request")
    found = [(e["field"], e["code"]) for e in document["errors"]]
    assert ("/trajectory/polynomial" + field, code) in found, document


@pytest.mark.parametrize(
    "changes, field, code",
    [
        ({"time": [0]}, "/time", "too_few_points"),
        ({"time": [0, 0, 1]}, "/time/1", "not_increasing"),
        ({"position": []}, "/position", "too_few_points"),
        ({"position": [[0], [1]]}, "/position", "shape_mismatch"),
        ({"position": [[0], [1, 2], [3]]}, "/position/1", "shape_mismatch"),
        ({"velocity": [[0], [1]]}, "/velocity", "shape_mismatch"),
        ({"acceleration": [[0, 0], [1, 0], [1, 0]]}, "/acceleration", "shape_mismatch"),
    ],
)
def test_samples_that_are_wrong(service, problem, changes, field, code):
    samples = {"time": [0, 1, 2], "position": [[0], [1], [2]]} | changes
    document = problem(service.post(CERTIFY, json={"trajectory": {"samples": samples}}), "invalid_request")
    assert ("/trajectory/samples" + field, code) in [(e["field"], e["code"]) for e in document["errors"]], document


@pytest.mark.parametrize(
    "polynomial",
    [
        {"breaks": [0, 1], "coefficients": [[[0]]] * 65},
        {"breaks": [0, 1], "coefficients": [[[0] * 65]]},
    ],
    ids=["degree", "joints"],
)
def test_polynomials_over_the_caps(service, problem, polynomial):
    problem(service.post(CERTIFY, json={"trajectory": {"polynomial": polynomial}}), "too_large")


def test_very_high_coefficients_do_not_break_the_judge(service):
    wild = {"breaks": [0, 1e-9], "coefficients": [[[0]], [[0]], [[1e20]], [[-1e26]]]}
    response = service.post(CERTIFY, json={"trajectory": {"polynomial": wild}, "limits": {"jerk": 1}})
    assert response.status_code == 200 and not response.json()["certificate"]["holds"]
    assert "NaN" not in response.text and "Infinity" not in response.text


def test_the_norm_of_the_velocity(service):
    arc = {"breaks": [0, 1], "coefficients": [[[0, 0]], [[3, 0]], [[0, 4]]]}  # (3, 8 t): at the end 8.544
    found = certify(service, {"polynomial": arc}, limits={"velocity_norm": 8})
    row = found["checks"][0]
    assert (row["quantity"], row["joint"], row["time"], row["holds"]) == ("velocity_norm", None, 1.0, False)
    assert row["value"] == pytest.approx(73**0.5)
    samples = {"time": [0, 0.5, 1], "position": [[0, 0], [1.5, 1], [3, 4]]}
    found = certify(service, {"samples": samples}, limits={"velocity_norm": 8})
    assert found["checks"][0]["value"] == pytest.approx(45**0.5) and found["checks"][0]["holds"]
