"""The parts without HTTP: problem documents, negotiation, caps, tables, imports."""

import json
import subprocess
import sys

import numpy as np
import orjson
import pytest
from hypothesis import given
from hypothesis import strategies as st

import api
from api.errors import KINDS, LARGEST, Refusal, problem
from api.negotiate import choose
from api.settings import Caps
from api.tables import certificate_table, table
from planner import ERRORS, FieldError, Infeasible, InvalidRequest, NotVerified, TooLarge, UnknownMethod, Unsupported

OFFERS = ("application/json", "text/csv")


def test_exported_names():
    assert api.__all__ == ["AsyncClient", "Client", "Result"]
    assert dir(api) == api.__all__
    for name in api.__all__:
        assert getattr(api, name).__name__ == name
    with pytest.raises(AttributeError, match="Server"):
        _ = api.Server


@pytest.mark.parametrize(
    "statement",
    ["import api", "import api; api.Client; api.AsyncClient; api.Result", "import api.__main__, api.work, api.tables"],
)
def test_the_client_and_the_command_line_are_light(statement):
    code = f"{statement}\nimport sys\nprint([m for m in ('fastapi', 'starlette', 'uvicorn') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_error_of_the_library_has_a_status():
    assert set(ERRORS) <= set(KINDS)
    for code, kind in ERRORS.items():
        assert KINDS[code].title == kind.title


def test_unsupported_names_alternatives():
    document = problem(Unsupported("linear", "jerk", ["ruckig"]), "/v1/trajectories", "id")
    assert list(document)[:6] == ["type", "title", "status", "detail", "instance", "request_id"]
    assert (document["method"], document["what"], document["alternatives"]) == ("linear", "jerk", ["ruckig"])


def test_infinities_become_null():
    document = problem(Infeasible("no", bound=float("inf"), needed=float("nan")))
    assert document["bound"] is None and document["needed"] is None


def test_numpy_scalars_and_arrays_are_told():
    values = {"a": np.float64(1.5), "b": np.int64(3), "c": np.bool_(True), "d": np.arange(3.0), "e": np.float32("nan")}
    document = orjson.loads(orjson.dumps(problem(Refusal("conflict", "x", values))))
    assert [document[k] for k in "abcde"] == [1.5, 3, True, [0, 1, 2], None]


def test_findings_are_capped():
    errors = [FieldError(f"/{i}", "wrong_type", "x" * 300) for i in range(500)]
    document = problem(InvalidRequest(errors))
    assert len(document["errors"]) == 20 and document["errors_total"] == 500
    assert len(orjson.dumps(document)) < LARGEST


@pytest.mark.parametrize(
    "error",
    [
        InvalidRequest([FieldError("/" + "ü" * 9000, "wrong_type", "\U0001f600" * 9000)] * 30),
        UnknownMethod("x" * 10_000, ["y" * 500] * 500),
        Unsupported("a" * 9000, "b" * 9000, ["c" * 9000] * 900),
        TooLarge("x", float("nan"), "h" * 9000),
        NotVerified("m", {f"k{i}": [{"deep": ["x" * 900] * 900}] for i in range(900)}),
        Refusal("not_found", "x" * 90_000, {"k" * 9000: object()}),
    ],
    ids=lambda e: type(e).__name__,
)
def test_documents_always_fit(error):
    document = problem(error, "/" + "x" * 9000, "i" * 128)
    raw = orjson.dumps(document)
    assert len(raw) < LARGEST
    assert json.loads(raw)["status"] == KINDS[error.code].status


JSONISH = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(), st.binary(max_size=4)),
    lambda inner: st.one_of(st.lists(inner), st.dictionaries(st.text(), inner)),
)


@given(st.dictionaries(st.text(), JSONISH), st.text())
def test_any_data_makes_a_document(data, detail):
    raw = orjson.dumps(problem(Refusal("conflict", detail, data), "/x", "id"))
    assert len(raw) < LARGEST
    json.loads(raw, parse_constant=pytest.fail)


@pytest.mark.parametrize(
    "accept, expected",
    [
        (None, "application/json"),
        ("", "application/json"),
        ("*/*", "application/json"),
        ("text/csv", "text/csv"),
        ("text/*", "text/csv"),
        ("TEXT/CSV; header=present", "text/csv"),
        ("text/csv, */*", "text/csv"),
        ("text/csv, application/json", "application/json"),
        ("text/csv;q=0.5, application/json;q=0.4", "text/csv"),
        ("application/json;q=0, */*", "text/csv"),
        ("text/html, application/xml;q=0.9, */*;q=0.8", "application/json"),
        ("application/json;q=nonsense, text/csv;q=0.1", "text/csv"),
        ("text/csv;q=1.0, application/*;q=0.9", "text/csv"),
        (", ,text/csv", "text/csv"),
    ],
)
def test_negotiation(accept, expected):
    assert choose(accept, OFFERS) == expected


@pytest.mark.parametrize("accept", ["text/html", "application/json;q=0", "*/*;q=0", "json", "text/csv;q=nan", ";q=1"])
def test_nothing_acceptable(accept):
    with pytest.raises(Refusal) as caught:
        choose(accept, OFFERS)
    assert caught.value.data == {"available": list(OFFERS)}


@given(st.text())
def test_any_accept_header(accept):
    try:
        assert choose(accept, OFFERS) in OFFERS
    except Refusal as refusal:
        assert refusal.code == "not_acceptable"


def test_caps_can_only_be_lowered():
    assert Caps.from_environment({}) == Caps()
    low = Caps.from_environment({"WAYWRIGHT_JOINTS": "7", "WAYWRIGHT_TIMEOUT": "2.5", "OTHER": "x"})
    assert (low.joints, low.timeout, low.waypoints) == (7, 2.5, 10_000)
    for text in ("65", "0", "-1", "many", "nan", ""):
        with pytest.raises(ValueError, match="WAYWRIGHT_JOINTS"):
            Caps.from_environment({"WAYWRIGHT_JOINTS": text})
    with pytest.raises(ValueError, match="WAYWRIGHT_TIMEOUT"):
        Caps.from_environment({"WAYWRIGHT_TIMEOUT": "nan"})


CHECK = {"joint": 0, "segment": 1, "time": 0.5, "value": 1.0, "bound": 2.0, "holds": True}
CERTIFICATE = {
    "holds": True,
    "basis": "exact",
    "checks": [{"quantity": "velocity", "ratio": 0.5, **CHECK}, {"quantity": "jerk", "ratio": None, **CHECK}],
    "waypoint_error": 1e-16,
    "boundary_error": None,
    "continuity": 2,
    "path_deviation": None,
    "cost": {"squared_jerk": None, "path_length": 3.0},
    "objective": {"name": "duration", "value": 1.0, "lower_bound": 1.0, "gap": 0.0, "bound_scope": "all"},
}


def test_the_table_of_a_comparison():
    answered = {"method": "a", "ok": True, "duration": 1.25, "cost": {"squared_jerk": 7.5}, "certificate": CERTIFICATE}
    refused = {"method": "b", "ok": False, "certificate": None, "error": {"detail": "no\nway " + "x" * 200}}
    lines = table([answered | {"compute_ms": 1.234}, refused | {"compute_ms": 0.1}]).splitlines()
    assert [line.split()[0] for line in lines] == ["method", "a", "b"]
    assert lines[0].split("  ")[-1] == "certified"
    assert "velocity / limit" in lines[0] and "jerk / limit" in lines[0] and "acceleration" not in lines[0]
    assert "0.5" in lines[1] and "1.23" in lines[1] and lines[1].endswith("yes")
    assert "refused: no way" in lines[2] and lines[2].endswith("…")
    assert len(table([]).splitlines()) == 1


def test_the_table_of_a_certificate():
    text = certificate_table(CERTIFICATE)
    assert text.endswith("certified (exact)")
    assert "duration is within 0" in text
    assert certificate_table(CERTIFICATE | {"holds": False, "checks": []}).endswith("NOT certified (exact)")
