"""What the written pages say can be run: examples give what they show, links and names exist."""

import importlib
import json
import re
from pathlib import Path

import pytest
from starlette.testclient import TestClient

import planner
from api.app import create_app
from planner import METHODS

ROOT = Path(__file__).resolve().parent.parent
PAGE = (ROOT / "docs" / "minimum_jerk.md").read_text(encoding="utf-8")
RETIMING = (ROOT / "docs" / "retiming.md").read_text(encoding="utf-8")
TIMING = (ROOT / "docs" / "time_optimal_path.md").read_text(encoding="utf-8")
WAYPOINTS = (ROOT / "docs" / "time_optimal_waypoints.md").read_text(encoding="utf-8")
PYTHON = re.findall(r"```python\n(.*?)```\n\n```text\n(.*?)```", PAGE + RETIMING + TIMING + WAYPOINTS, re.S)
BODIES = [json.loads(text) for text in re.findall(r"```json\n(.*?)```", PAGE + TIMING + WAYPOINTS, re.S)]
REQUESTS = [body for body in BODIES if "waypoints" in body]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]


@pytest.mark.parametrize("number", range((PAGE + RETIMING + TIMING + WAYPOINTS).count("```python")))
def test_python_prints_what_is_shown(number, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    code, shown = PYTHON[number]
    exec(compile(code, "docs", "exec"), {})
    assert capsys.readouterr().out == shown


@pytest.fixture(scope="module")
def service():
    with TestClient(create_app()) as client:
        yield client


@pytest.mark.parametrize("number", range(len(REQUESTS)))
def test_requests_are_answered_as_shown(number, service):
    body = REQUESTS[number]
    after = BODIES[BODIES.index(body) + 1 :]
    shown = after[0] if after and "type" in after[0] else None
    answer = service.post("/v1/trajectories", json=body)
    if shown is None:
        assert answer.status_code == 200 and answer.json()["certificate"]["holds"]
    else:
        found = answer.json()
        assert answer.status_code == 422
        assert [
            k for k, v in shown.items() if found[k] != (pytest.approx(v, rel=3e-4) if type(v) is float else v)
        ] == []


def test_retimings_are_answered(service):
    bodies = [json.loads(text) for text in re.findall(r"```json\n(.*?)```", RETIMING, re.S)]
    assert bodies
    for body in bodies:
        answer = service.post("/v1/retimings", json=body)
        assert answer.status_code == 200 and answer.json()["certificate"]["holds"]


def test_the_shown_command_is_answered(service):
    (body,) = re.findall(r"-d '(.*?)'", WAYPOINTS, re.S)
    answer = service.post("/v1/trajectories", json=json.loads(body))
    assert answer.status_code == 200 and answer.json()["certificate"]["holds"]


@pytest.mark.parametrize("page", PAGES, ids=[page.name for page in PAGES])
def test_links_lead_somewhere(page):
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if not re.match(r"[a-z]+:", target):
            file, _, place = target.partition("#")
            to = page if not file else (page.parent / file).resolve()
            root = Path(planner.__file__).resolve().parent.parent  # where the packages are, installed or not
            elsewhere = root / re.sub(r"^(\.\./)+", "", file)
            assert to.exists() or elsewhere.exists(), target
            if place:
                assert re.search(f'^## {place}$|<a id="{place}">', to.read_text(encoding="utf-8"), re.M), target


def test_names_exist():
    for name in set(re.findall(r"`(planner\.[\w.]+)`", PAGE)):
        module, _, attribute = name.rpartition(".")
        assert hasattr(importlib.import_module(module), attribute), name
    options = METHODS["minimum_jerk"].options.model_fields
    for name in ("free_times", "time_weight", "sub_segments", "backend", "ends"):
        assert name in options and f"`{name}" in PAGE
