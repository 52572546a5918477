"""Every format read back by its own reader equals the JSON answer; requests in MessagePack; what is refused."""

import csv
import io
import json
import struct
import time
import zipfile

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from api import draft as drafts
from api.formats import FORMATS, encoded, installed, offered, written
from api.media import ARROW, CSV, JSON, MSGPACK, NPZ, PLOTLY, ROS2
from api.packed import DEEPEST, MOST
from api.reading import decode, parse
from api.schemas import PlanBody
from api.settings import Caps
from api.work import draft_plan
from planner import CASES, InvalidRequest, NotVerified, TooLarge

PLAN = "/v1/trajectories"
BODY = {
    "waypoints": [[0, 0], [1, 2], [2, 3]],
    "times": [5, 6, 7],
    "method": "cubic_spline",
    "sampling": {"count": 301},
}
ORDERS = ("position", "velocity", "acceleration", "jerk")
ALL = list(FORMATS)


def draft(media_type=JSON, caps=None, **changes):
    return draft_plan(parse(PlanBody, BODY | changes), caps or Caps(), media_type)


def unpacked(raw):
    return msgpack.unpackb(raw, strict_map_key=True)


def table(tree):
    """Return the samples of a JSON answer as rows."""
    samples = tree["samples"]
    return np.column_stack([samples["time"], *(samples[order] for order in ORDERS)])


def read_arrow(raw):
    import pyarrow

    with pyarrow.ipc.open_stream(raw) as stream:
        return stream.read_all()


# each returns the samples' rows, and the rest of the tree or None
def from_msgpack(raw):
    tree = unpacked(raw)
    return table(tree), {k: v for k, v in tree.items() if k != "samples"}


def from_csv(raw):
    return np.array([[float(x) for x in row] for row in list(csv.reader(io.StringIO(raw.decode())))[1:]]), None


def from_arrow(raw):
    read = read_arrow(raw)
    return np.column_stack([column.to_numpy() for column in read.columns]), json.loads(
        read.schema.metadata[b"waywright"]
    )


def from_npz(raw):
    with np.load(io.BytesIO(raw), allow_pickle=False) as read:
        rest = json.loads(read["answer"].item())
        names = ("breaks", "coefficients", "weights")
        polynomial = {name: read[name].tolist() for name in names if name in read}
        return np.column_stack([read["time"], *(read[order] for order in ORDERS)]), rest | (
            {"polynomial": polynomial} if polynomial else {}
        )


def from_plotly(raw):
    traces = [t for t in json.loads(raw)["data"] if t["mode"] == "lines"]
    assert all(t["x"] == traces[0]["x"] for t in traces)
    assert [t["meta"]["quantity"] for t in traces[::2]] == list(ORDERS)
    return np.column_stack([traces[0]["x"], *(t["y"] for t in traces)]), None


READERS = {MSGPACK: from_msgpack, CSV: from_csv, ARROW: from_arrow, NPZ: from_npz, PLOTLY: from_plotly}


@pytest.mark.parametrize("media_type", READERS)
@pytest.mark.parametrize("include", [["samples"], ["samples", "polynomial"]], ids=len)
def test_read_back_it_is_the_json_answer(media_type, include):
    made = draft(include=include)
    tree = json.loads(written(made, JSON))
    rows, rest = READERS[media_type](written(made, media_type))
    assert np.array_equal(rows, table(tree))
    if rest is not None:
        assert rest == {k: v for k, v in tree.items() if k != "samples"}


@pytest.mark.parametrize("media_type", ALL)
def test_pieces_are_the_whole(media_type, monkeypatch):
    monkeypatch.setattr(drafts, "PIECE", 64)
    for module in ("json", "msgpack", "npz"):
        monkeypatch.setattr(f"api.formats.{module}.PIECE", 64)
    made = draft(include=["samples", "polynomial"])
    whole = json.loads(written(made, JSON))
    for module in ("json.WHOLE", "msgpack.WHOLE"):
        monkeypatch.setattr(f"api.formats.{module}", 0)
    pieces = list(FORMATS[media_type].write(made))
    assert len(pieces) > 20
    if media_type in READERS:
        assert np.array_equal(READERS[media_type](b"".join(pieces))[0], table(whole))
    elif media_type == JSON:
        assert json.loads(b"".join(pieces)) == whole
    else:
        points = json.loads(b"".join(pieces))["points"]
        assert [p["positions"] for p in points] == whole["samples"]["position"]


def test_msgpack_in_pieces_has_the_bytes_of_one(monkeypatch):
    made = draft(include=["samples", "polynomial"])
    whole = written(made, MSGPACK)
    monkeypatch.setattr(drafts, "PIECE", 64)
    monkeypatch.setattr("api.formats.msgpack.PIECE", 1)  # rows longer than a piece are split too
    assert written(made, MSGPACK) == whole
    assert whole == msgpack.packb(unpacked(whole))


@pytest.mark.parametrize("media_type", ALL)
def test_the_same_request_gives_the_same_bytes(media_type):
    first = written(draft(), media_type)
    time.sleep(0.01)
    assert written(draft(), media_type) == first


@pytest.mark.parametrize("media_type", ALL)
def test_what_is_not_finite_never_gets_out(media_type, monkeypatch):
    made = draft(include=["samples", "polynomial"])
    trajectory = type(made.drawn.trajectory)
    states = trajectory.states

    def broken(self, *args, **given):
        found = states(self, *args, **given)
        found[-1, -1, -1] = np.nan
        return found

    monkeypatch.setattr(trajectory, "states", broken)
    with pytest.raises(NotVerified):
        written(made, media_type)


def test_arrays_that_are_not_finite_are_no_msgpack():
    with pytest.raises(NotVerified):
        encoded({"a": np.array([1.0, np.inf])}, MSGPACK)
    assert unpacked(encoded({"a": float("nan"), "b": {1, 2}, "c": np.float64(2)}, MSGPACK)) == {
        "a": None,
        "b": [1, 2],
        "c": 2.0,
    }


def test_names_of_columns():
    names = ["a,b", "ß"]
    expected = ["time"] + [f"{order}_{name}" for order in ORDERS for name in names]
    made = draft(joint_names=names)
    assert read_arrow(written(made, ARROW)).column_names == expected
    assert next(csv.reader(io.StringIO(written(made, CSV).decode()))) == expected
    assert read_arrow(written(draft(), ARROW)).column_names[:3] == ["time", "position_1", "position_2"]


def test_arrow_comes_in_batches_without_nulls(monkeypatch):
    import pyarrow

    monkeypatch.setattr(drafts, "PIECE", 90)
    with pyarrow.ipc.open_stream(written(draft(), ARROW)) as stream:
        batches = list(stream)
        assert not any(field.nullable for field in stream.schema)
    assert len(batches) == 31 and max(b.num_rows for b in batches) == 10


def test_npz_without_samples():
    with np.load(io.BytesIO(written(draft(NPZ, include=["polynomial"]), NPZ))) as read:
        assert sorted(read) == ["answer", "breaks", "coefficients"]
    raw = written(draft(NPZ, include=[]), NPZ)
    with np.load(io.BytesIO(raw)) as read:
        assert list(read) == ["answer"] and json.loads(str(read["answer"]))["certificate"]["holds"]
    with zipfile.ZipFile(io.BytesIO(raw)) as archive:
        assert archive.testzip() is None
        assert {info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}


def test_npz_of_a_rational_curve():
    made = draft(NPZ, method="nurbs", times=None, options={"degree": 2}, include=["samples", "polynomial"])
    tree = json.loads(written(made, JSON))
    with np.load(io.BytesIO(written(made, NPZ))) as read:
        for name, values in tree["polynomial"].items():
            assert read[name].tolist() == values


def test_plotly_says_what_a_figure_needs():
    limits = {"velocity": 9, "position": {"lower": -5, "upper": [4, None]}}
    made = draft(PLOTLY, joint_names=["a", "b"], method="minimum_jerk", limits=limits)
    figure = json.loads(written(made, PLOTLY))
    marks = [t for t in figure["data"] if t["mode"] == "markers"]
    assert [t["x"] for t in marks] == [[5, 6, 7]] * 2
    assert np.allclose(np.transpose([t["y"] for t in marks]), BODY["waypoints"])
    assert (
        {t["yaxis"] for t in figure["data"]}
        == {"y", "y2", "y3", "y4"}
        <= {"y"} | {k.replace("axis", "") for k in figure["layout"]}
    )
    shapes = figure["layout"]["shapes"]
    assert {s["yref"]: s["y0"] for s in shapes} == {"y": 4, "y2": 9}
    assert all(s["y1"] > s["y0"] and s["label"]["text"].startswith("limit of ") for s in shapes)
    plotly = pytest.importorskip("plotly.graph_objects")
    plotly.Figure(figure)  # validates every property


def test_a_hold_and_one_joint():
    body = {
        "waypoints": [[1], [1]],
        "times": None,
        "method": "ruckig",
        "limits": {"velocity": 1, "acceleration": 1, "jerk": 1},
    }
    made = draft(**body)
    for media_type, read in READERS.items():
        rows, _ = read(written(made, media_type)) if media_type != PLOTLY else (None, None)
        assert media_type == PLOTLY or rows.tolist() == [[0, 1, 0, 0, 0]] * 2
    assert unpacked(written(made, MSGPACK))["samples"]["position"] == [[1], [1]]


@pytest.mark.parametrize("media_type", [CSV, ARROW, ROS2, PLOTLY])
def test_formats_of_samples_need_them(media_type):
    with pytest.raises(InvalidRequest) as caught:
        draft(media_type, include=["polynomial"])
    assert caught.value.errors[0].field == "/include"


def test_without_the_library_a_format_is_not_offered(monkeypatch):
    assert offered() == tuple(FORMATS) and offered(whole=False) == (JSON, MSGPACK)
    monkeypatch.setattr("api.formats.installed", lambda library: library != "pyarrow")
    assert ARROW not in offered() and NPZ in offered()
    assert installed("json") and not installed("no_such_library_of_ours")


def test_too_many_samples_say_what_would_fit():
    caps = Caps(samples=1000)
    with pytest.raises(TooLarge) as caught:
        draft(caps=caps, sampling={"dt": 1e-3})
    assert '"include": ["polynomial"]' in str(caught.value)
    assert "a motion of 2 s fits with a dt of 0.00401 s or more" in str(caught.value)
    assert draft(caps=caps, sampling={"dt": 0.00401}).numbers
    with pytest.raises(TooLarge, match="a count of 500 fits"):
        draft(caps=caps, sampling={"count": 501})
    free = {"waypoints": [[0], [1]], "times": None, "method": "ruckig", "sampling": {"dt": 1e-4}}
    with pytest.raises(TooLarge, match="fits with a dt of"):  # known after solving
        draft(caps=caps, **free, limits={"velocity": 1, "acceleration": 1, "jerk": 1})


# ---- requests in MessagePack

GOOD = msgpack.packb(BODY)


def refusal(raw):
    with pytest.raises(InvalidRequest) as caught:
        decode(raw, MSGPACK)
    (error,) = caught.value.errors
    assert (error.field, error.code) == ("", "not_json")
    assert "MessagePack" in error.reason and len(error.reason) <= 300
    return error.reason


HOSTILE = {
    "empty": b"",
    "cut short": GOOD[:-1],
    "bytes after": GOOD + b"\xc0",
    "reserved byte": b"\xc1",
    "not UTF-8": b"\xa2\xff\xfe",
    "surrogate": b"\xa3\xed\xa0\x80",
    "key not UTF-8": b"\x81\xa1\xff\x01",
    "binary": msgpack.packb({"waypoints": b"\x00\x01"}),
    "binary of no length": b"\x81\xa1a\xc4\x00",
    "binary key": b"\x81\xc4\x01a\x01",
    "binary key of no length": b"\x81\xc4\x00\x01",
    "extension": b"\xd4\x05a",
    "extension of no length": b"\xc7\x00\x05",
    "timestamp": msgpack.packb([msgpack.Timestamp(1)]),
    "timestamp of no length": b"\xc7\x00\xff",
    "integer key": msgpack.packb({1: 2}),
    "nil key": msgpack.packb({None: 2}),
    "array as key": b"\x81\x91\x01\x02",
    "key twice": b"\x82\xa1a\x01\xa1a\x02",
    "key twice inside": b"\x91\x81\xa1x\x82\xa1a\x01\xa1a\x02",
    "too deep": b"\x91" * (DEEPEST + 1) + b"\xc0",
    "much too deep": b"\x91" * (8 << 20),
    "maps much too deep": b"\x81\xa1a" * (1 << 20),
    "a length of 4 billion": b"\xdd\xff\xff\xff\xff",
    "a map of 4 billion": b"\xdf\xff\xff\xff\xff",
    "a string of 4 billion": b"\xdb\xff\xff\xff\xff",
    "many lengths of 4 billion": b"\xdd\xff\xff\xff\xff" * 1000,
    "many arrays": b"\xdd" + struct.pack(">I", MOST + 1) + b"\x90" * (MOST + 1),
    "many maps": b"\xdd" + struct.pack(">I", MOST + 1) + b"\x80" * (MOST + 1),
    "JSON": json.dumps(BODY).encode(),
}


@pytest.mark.parametrize("raw", HOSTILE.values(), ids=HOSTILE)
def test_msgpack_that_is_none(raw):
    began = time.perf_counter()
    refusal(raw)
    assert time.perf_counter() - began < 5


def test_msgpack_reasons_name_what_is_wrong():
    assert "'a'" in refusal(HOSTILE["key twice"])
    assert "binary" in refusal(HOSTILE["binary"])
    assert "extension" in refusal(HOSTILE["timestamp"])
    assert "deep" in refusal(HOSTILE["too deep"])
    assert "1 bytes follow" in refusal(HOSTILE["bytes after"])


def test_millions_of_nils_are_read_soon_and_more_are_refused():
    began = time.perf_counter()
    found = decode(b"\xdd" + struct.pack(">I", 2 << 20) + b"\xc0" * (2 << 20), MSGPACK)
    assert len(found) == 2 << 20
    with pytest.raises(InvalidRequest, match="3,000,000 nulls"):
        decode(b"\xdd" + struct.pack(">I", 8 << 20) + b"\xc0" * (8 << 20), MSGPACK)
    assert time.perf_counter() - began < 5


def test_msgpack_numbers():
    assert decode(msgpack.packb([0.1], use_single_float=True), MSGPACK) == [float(np.float32(0.1))]
    found = decode(msgpack.packb([1, -1, 2**63, float("inf"), float("nan"), True, None, "ß"]), MSGPACK)
    assert found[:4] == [1, -1, 2**63, float("inf")] and found[4] != found[4] and found[5:] == [True, None, "ß"]


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**63) | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner, max_size=4),
    max_leaves=12,
)


@settings(max_examples=60)
@given(VALUES)
def test_msgpack_is_read_as_it_was_written(value):
    assert repr(decode(msgpack.packb(value), MSGPACK)) == repr(value)


@settings(max_examples=150)
@given(st.binary(max_size=40))
def test_any_bytes_are_read_or_refused(raw):
    try:
        found = decode(raw, MSGPACK)
    except InvalidRequest as error:
        assert [e.code for e in error.errors] == ["not_json"]
    else:
        json.dumps(found)


@settings(max_examples=60)
@given(st.integers(0, len(GOOD) - 1), st.integers(0, 255))
def test_a_changed_byte_is_read_or_refused(place, byte):
    try:
        draft_plan(
            parse(PlanBody, decode(GOOD[:place] + bytes([byte]) + GOOD[place + 1 :], MSGPACK)), Caps(samples=10_000)
        )
    except Exception as error:
        assert type(error).__module__.startswith("planner"), repr(error)


def test_reading_msgpack_is_quick():
    raw = msgpack.packb({"waypoints": [[0.1] * 7] * 100, "times": list(range(100))})
    spent = []
    for _ in range(30):
        began = time.perf_counter()
        decode(raw, MSGPACK)
        spent.append(time.perf_counter() - began)
    assert min(spent) < 1e-3


# ---- over HTTP


def post(service, body, path=PLAN, accept=None, content_type=MSGPACK):
    raw = msgpack.packb(body) if content_type == MSGPACK else json.dumps(body).encode()
    headers = {"content-type": content_type} | ({"accept": accept} if accept else {})
    return service.post(path, content=raw, headers=headers)


def test_a_request_in_msgpack_has_the_answer_of_json(service):
    assert post(service, BODY).content == post(service, BODY, content_type=JSON).content
    assert post(service, BODY, accept=MSGPACK).headers["content-type"] == MSGPACK


@pytest.mark.parametrize(
    "changes, field, code",
    [
        ({"waypoints": [[0, 0], [1, float("nan")], [2, 3]]}, "/waypoints/1/1", "not_finite"),
        ({"times": [0, 1, float("inf")]}, "/times/2", "not_finite"),
        ({"colour": "red"}, "/colour", "unknown_field"),
        ({"waypoints": [[0, 0], [True, 2], [2, 3]]}, "/waypoints/1/0", "wrong_type"),
    ],
)
def test_a_wrong_field_is_named(service, problem, changes, field, code):
    document = problem(post(service, BODY | changes), "invalid_request")
    assert [(e["field"], e["code"]) for e in document["errors"]] == [(field, code)]


def test_hostile_msgpack_over_http(service, problem):
    for name in ("empty", "bytes after", "much too deep", "a length of 4 billion", "timestamp", "JSON"):
        document = problem(service.post(PLAN, content=HOSTILE[name], headers={"content-type": MSGPACK}))
        if name == "much too deep":  # of so many arrays none is read
            assert document["type"] == "/errors/too_large"
        else:
            assert document["errors"][0]["code"] == "not_json"


def test_every_json_answer_comes_in_msgpack(service):
    polynomial = {"breaks": [0, 1], "coefficients": [[[0]], [[0]], [[3]], [[-2]]]}
    bodies = {
        "/v1/certificates": {"trajectory": {"polynomial": polynomial}, "limits": {"velocity": 2}},
        "/v1/retimings": {
            "trajectory": {"samples": {"time": [0, 1, 2], "position": [[0, 0], [1, 2], [2, 3]]}},
            "limits": {"velocity": 2, "acceleration": 5},
            "include": ["samples", "polynomial"],
        },
        PLAN: BODY | {"include": ["samples", "polynomial"]},
    }
    for path, body in bodies.items():
        packed = post(service, body, path, MSGPACK)
        assert packed.status_code == 200 and packed.headers["content-type"] == MSGPACK
        assert unpacked(packed.content) == post(service, body, path).json()
    body = {k: v for k, v in BODY.items() if k != "method"} | {"methods": ["linear", "ruckig"]}
    first = unpacked(post(service, body | {"include": ["samples"]}, "/v1/comparisons", MSGPACK).content)
    second = post(service, body | {"include": ["samples"]}, "/v1/comparisons").json()
    for row, other in zip(first["rows"], second["rows"], strict=True):
        for one in (row, other):
            one.pop("compute_ms")
            one.get("error", {}).pop("request_id", None)
        assert row == other
    for path in ("/v1/methods", "/v1/methods/linear", "/v1/cases", "/v1/limits", "/v1/version", "/errors/timeout"):
        packed = service.get(path, headers={"accept": MSGPACK})
        assert packed.headers["content-type"] == MSGPACK
        assert unpacked(packed.content) == service.get(path).json()


def test_problems_stay_json(service, problem):
    problem(post(service, BODY | {"method": "teleport"}, accept=MSGPACK), "unknown_method")
    problem(service.get("/v1/methods/teleport", headers={"accept": MSGPACK}), "unknown_method")


@pytest.mark.parametrize("media_type", ALL)
def test_every_format_is_served(service, media_type):
    answer = post(service, BODY, accept=f"text/html, {media_type};q=0.9, */*;q=0.1")
    assert answer.status_code == 200 and answer.headers["content-type"].split(";")[0] == media_type
    assert answer.content == written(draft(media_type), media_type)


def test_negotiation(service, problem):
    assert post(service, BODY, accept="application/*").headers["content-type"] == JSON
    assert post(service, BODY, accept="application/json;q=0.5, application/msgpack").headers["content-type"] == MSGPACK
    document = problem(post(service, BODY, accept="image/png"), "not_acceptable")
    assert document["available"] == ALL
    document = problem(post(service, BODY | {"methods": "all"}, "/v1/comparisons", CSV), "not_acceptable")
    assert document["available"] == [JSON, MSGPACK]


def test_a_large_answer_is_streamed_in_every_format(service):
    body = BODY | {"sampling": {"count": 20_000}}
    tree = json.loads(post(service, body).content)
    for media_type, read in READERS.items():
        answer = post(service, body, accept=media_type)
        assert "content-length" not in answer.headers
        assert np.array_equal(read(answer.content)[0], table(tree))


def test_openapi_lists_the_formats(service):
    document = service.get("/openapi.json").json()
    plan = document["paths"][PLAN]["post"]
    assert set(plan["responses"]["200"]["content"]) == set(ALL)
    assert set(plan["requestBody"]["content"]) == {JSON, MSGPACK}
    assert set(document["paths"]["/v1/methods"]["get"]["responses"]["200"]["content"]) == {JSON, MSGPACK}


def test_every_case_in_msgpack():
    for case in list(CASES.values())[:6]:
        made = draft_plan(parse(PlanBody, dict(case.request)), Caps())
        assert unpacked(written(made, MSGPACK)) == json.loads(written(made, JSON))
