"""The README's snippets run as they stand."""

import json
import re
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import pytest
import uvicorn

from api.__main__ import main
from api.app import create_app

README = (Path(__file__).resolve().parent.parent / "README.md").read_text(encoding="utf-8")
PYTHON = re.findall(r"```python\n(.*?)```", README, re.S)
SHELL = re.findall(r"```sh\n(.*?)```", README, re.S)


@contextmanager
def running():
    server = uvicorn.Server(uvicorn.Config(create_app(), host="127.0.0.1", port=0, log_level="error"))
    thread = threading.Thread(target=server.run)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    try:
        yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join()


def test_python_snippet(capsys):
    exec(compile(PYTHON[0], "README", "exec"), {})
    out = capsys.readouterr().out
    assert out.startswith("time_optimal_waypoints ") and "True" in out and ", 2)" in out


def test_through_waypoints_snippet(capsys):
    exec(compile(PYTHON[2], "README", "exec"), {})
    fastest, smooth, straight = (row.split() for row in capsys.readouterr().out.splitlines())
    assert float(fastest[0]) < float(smooth[0]) and float(fastest[0]) < float(straight[0])
    assert float(straight[1]) < 1e-9 < float(fastest[1]) and {fastest[2], smooth[2], straight[2]} == {"True"}


def test_corridor_and_free_times_snippets(capsys):
    exec(compile(PYTHON[3], "README", "exec"), {})
    rows = capsys.readouterr().out.splitlines()
    assert [row.split()[0] for row in rows] == ["velocity_norm", "waypoint_tolerance", "tube"]
    assert all(row.endswith(" True") for row in rows)
    exec(compile(PYTHON[4], "README", "exec"), {})
    assert capsys.readouterr().out.rstrip().endswith(" True")


def test_client_and_curl_snippets(capsys):
    import httpx2

    body = json.loads(re.search(r"-d '(.*?)'", SHELL[0], re.S).group(1))
    with running() as url:
        exec(compile(PYTHON[1].replace("http://127.0.0.1:8000", url), "README", "exec"), {})
        answer = httpx2.post(f"{url}/v1/trajectories", json=body)
    assert capsys.readouterr().out.startswith("minimum_jerk 2.0 ")
    assert answer.status_code == 200 and answer.json()["certificate"]["holds"]
    assert "/v1/trajectories" in SHELL[0]


@pytest.mark.parametrize("line", SHELL[1].strip().splitlines())
def test_command_lines(line, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("request.json").write_text(json.dumps({"waypoints": [[0] * 6, [1] * 6], "times": [0, 1]}))
    assert main(line.split()[1:]) == 0
    assert capsys.readouterr().out or Path("trajectory.csv").read_text().startswith("time,position_1")
