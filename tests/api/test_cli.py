"""The command line, called in this process."""

import csv
import errno
import io
import json
import socket
import sys

import pytest

from api.__main__ import main
from planner import CASES, METHODS, __version__

GOOD = {"waypoints": [[0, 0], [1, 2], [2, 3]], "times": [0, 1, 2]}


@pytest.fixture
def file(tmp_path):
    def write(value, name="request.json"):
        path = tmp_path / name
        path.write_bytes(value if isinstance(value, bytes) else json.dumps(value).encode())
        return str(path)

    return write


@pytest.fixture
def run(capsys):
    def call(*argv, code=0):
        assert main(argv) == code
        captured = capsys.readouterr()
        assert "Traceback" not in captured.err
        if code and not captured.err.startswith("usage:"):
            assert captured.err and all(line.startswith("waywright: ") for line in captured.err.splitlines())
        return captured.out if code == 0 else captured.err

    return call


def test_plan_prints_the_certificate(run, file):
    out = run("plan", file(dict(CASES["contract_example"].request)))
    assert "method: minimum_jerk (times were given)" in out
    assert "0.911504" in out and "certified (exact)" in out


def test_plan_from_standard_input(run, monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(json.dumps(GOOD).encode())))
    assert "certified" in run("plan", "-")


def test_method_and_options(run, file):
    out = run("plan", file(GOOD), "-m", "cubic_spline", "-o", "boundary=natural")
    assert "method: cubic_spline" in out
    err = run("plan", file(GOOD), "-m", "cubic_spline", "-o", "boundary=3", code=2)
    assert "/options/boundary" in err
    assert "/options/colour" in run("plan", file(GOOD), "-o", 'colour="red"', code=2)
    assert "NAME=VALUE" in run("plan", file(GOOD), "-o", "colour", code=2)


def test_out_json_is_the_services_answer(run, file, tmp_path, service):
    out = tmp_path / "answer.json"
    assert str(out) in run("plan", file(GOOD), "--out", str(out))
    assert out.read_bytes() == service.post("/v1/trajectories", json=GOOD).content
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == []


def test_out_csv(run, file, tmp_path):
    out = tmp_path / "answer.CSV"
    out.write_text("old")
    run("plan", file(GOOD), "--out", str(out))
    rows = list(csv.reader(io.StringIO(out.read_text())))
    assert rows[0][0] == "time" and len(rows) == 201


def test_out_in_a_format_not_there(run, file, tmp_path):
    err = run("plan", file(GOOD), "--out", str(tmp_path / "x.yaml"), code=2)
    assert ".json, .msgpack, .csv" in err


def test_out_that_cannot_be_written_is_named(run, file, tmp_path):
    (tmp_path / "folder.json").mkdir()
    (tmp_path / "plain").write_text("")
    for name in ("nowhere/x.csv", "folder.json", "plain/x.csv"):
        err = run("plan", file(GOOD), "--out", str(tmp_path / name), code=2)
        assert err.startswith(f"waywright: {tmp_path / name}: ")
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == []


def test_a_full_disk_is_not_bad_input(run, file, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device", str(tmp_path / ".x.csv.tmp"))

    monkeypatch.setattr("api.__main__.os.replace", full)
    err = run("plan", file(GOOD), "--out", str(tmp_path / "x.csv"), code=1)
    assert err == f"waywright: {tmp_path / 'x.csv'}: No space left on device\n"


@pytest.mark.parametrize("options", [[1], [], 0, "", "x", False])
def test_options_that_are_no_object(run, file, options):
    for extra in ((), ("-o", "backend=piqp")):
        assert "/options" in run("plan", file(GOOD | {"options": options}), *extra, code=2)
    assert "certified" in run("plan", file(GOOD | {"options": None}), "-o", "backend=piqp")


@pytest.mark.parametrize(
    "content, text",
    [
        (b"{", "not JSON"),
        (b"[]", "the request"),
        ({"waypoints": [[0], [1]], "times": [1, 0]}, "/times/1"),
        ({"waypoints": [[0], [1]], "times": [0, 1], "x": 1, "y": 2}, "/y"),
        (GOOD | {"method": "teleport"}, "teleport"),
        (GOOD | {"method": "linear", "limits": {"jerk": 1}}, "does not honour"),
        (GOOD | {"sampling": {"dt": 1e-12}}, "samples"),
    ],
)
def test_bad_input(run, file, content, text):
    assert text in run("plan", file(content), code=2)


def test_infeasible(run, file):
    body = {"waypoints": [[0], [1]], "times": [0, 1], "limits": {"velocity": 0.5}, "method": "minimum_jerk"}
    err = run("plan", file(body), code=3)
    assert err.startswith("waywright: infeasible: ") and "would do" in err


def test_no_such_file(run, tmp_path):
    assert "No such file" in run("plan", str(tmp_path / "none.json"), code=2)


def test_compare(run, file):
    for body in (GOOD | {"methods": ["linear", "ruckig"]}, GOOD | {"methods": ["linear", {"method": "ruckig"}]}):
        lines = run("compare", file(body)).splitlines()
        assert [line.split()[0] for line in lines] == ["method", "linear", "ruckig"]
        assert "refused: ruckig does not honour times" in lines[2]
    everything = run("compare", file(GOOD | {"method": "linear", "options": {}})).splitlines()
    assert [line.split()[0] for line in everything[1:]] == list(METHODS)


def test_certify(run, file):
    polynomial = {"breaks": [0, 1], "coefficients": [[[0]], [[0]], [[3]], [[-2]]]}
    body = {"trajectory": {"polynomial": polynomial}, "limits": {"velocity": 1.5}}
    assert "\ncertified (exact)" in run("certify", file(body))
    assert "NOT certified" in run("certify", file(body | {"limits": {"velocity": 1}}))
    assert "/trajectory" in run("certify", file({}), code=2)


def test_methods(run):
    lines = run("methods").splitlines()
    assert [line.split()[0] for line in lines[1:]] == list(METHODS)
    assert "option backend:" in run("methods", "minimum_jerk")
    assert "teleport" in run("methods", "teleport", code=2)


def test_version_and_usage(run, capsys):
    assert run("--version") == f"waywright {__version__}\n"
    assert "COMMAND" in run("--help")
    assert main([]) == 2
    assert main(["fly"]) == 2
    capsys.readouterr()


def test_serve_without_the_framework(run, monkeypatch):
    monkeypatch.delitem(sys.modules, "api.serving", raising=False)
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    assert "waywright[service]" in run("serve", code=1)


def test_a_bug_is_one_line_too(run, file, monkeypatch):
    def broken(*_):
        raise RuntimeError("boom")

    monkeypatch.setattr("api.__main__.draft_plan", broken)
    assert "boom" in run("plan", file(GOOD), code=1)


def test_serve_says_why_it_cannot(run, capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        assert f"127.0.0.1:{port}: Address already in use" in run("serve", "--port", port, code=1)
    assert "no.such.host.invalid" in run("serve", "--host", "no.such.host.invalid", code=1)
    for port in ("99999", "-1", "http"):
        assert main(["serve", f"--port={port}"]) == 2
    capsys.readouterr()


def test_serve_reads_its_settings(run, monkeypatch):
    monkeypatch.setenv("WAYWRIGHT_JOINTS", "65")
    assert "WAYWRIGHT_JOINTS" in run("serve", code=2)
