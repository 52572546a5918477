"""The catalogue is true, the docs page is fresh, and a method really is one file and one row."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from planner import METHODS, PlanRequest, Trajectory, UnknownMethod, Unsupported, describe_method, list_methods, plan
from planner.catalogue import markdown
from planner.method import Capabilities, Method, Reference
from planner.options import CAPABILITIES, Options
from planner.types import Solution, Stats

ROOT = Path(__file__).resolve().parent.parent
CONTRACT = {
    "id", "title", "family", "summary", "formula", "reference", "timing", "requires", "honours", "continuity",
    "variants", "path", "objective", "options",
}  # fmt: skip


@pytest.mark.parametrize("entry", list_methods(), ids=list(METHODS))
def test_entries_have_the_contracts_shape(entry):
    assert set(entry) == CONTRACT
    assert entry["family"] in ("interpolation", "smoothing", "time_optimal")
    assert entry["timing"] in ("given", "chosen", "either", "parameter")
    assert entry["path"] in ("free", "fixed", "approximate")
    assert set(entry["requires"]) <= set(entry["honours"]) <= set(CAPABILITIES)
    assert entry["continuity"] >= -1 and entry["summary"].endswith(".") and entry["formula"]
    assert entry["options"]["additionalProperties"] is False
    for option in entry["options"].get("properties", {}).values():
        assert option.get("description") or option.get("$ref"), option
    for variant in entry["variants"]:
        assert set(variant) <= {"options", "timing", "requires", "honours", "continuity"}
    assert json.loads(json.dumps(entry)) == entry


def test_one_method():
    assert describe_method("ruckig") == next(e for e in list_methods() if e["id"] == "ruckig")
    with pytest.raises(UnknownMethod) as caught:
        describe_method("fastest")
    assert caught.value.known == tuple(METHODS)


@pytest.mark.parametrize("method", METHODS)
def test_default_options_are_the_schemas(method):
    row = METHODS[method]
    assert row.options().model_dump() == row.options.model_validate({}).model_dump()
    for options in row.variants:
        assert row.options.model_validate(options) is not None


def test_the_page_is_fresh():
    assert (ROOT / "docs" / "methods.md").read_text(encoding="utf-8") == markdown(), "run `make docs`"


def test_the_readme_names_every_method():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert set(re.findall(r"`([a-z_]+)`", text.split("## Methods")[1].split("\n## ")[0])) >= set(METHODS)


def test_add_a_method_in_five_steps(monkeypatch):
    """What CONTRIBUTING says, with a dummy: a file with options, solve and a row; the row in the table."""

    class MidpointOptions(Options):
        """None."""

    def solve(request: PlanRequest, options: MidpointOptions) -> Solution:
        velocity = np.zeros_like(request.waypoints)
        return Solution(
            Trajectory.from_hermite(request.times, request.waypoints, velocity), request.times, Stats("dummy")
        )

    row = Method(
        id="stop_cubics",
        title="Cubics that stop",
        solve=solve,
        options=MidpointOptions,
        family="interpolation",
        summary="A cubic with zero end velocities between waypoints.",
        formula="q = q_i + d (3u² - 2u³)",
        reference=Reference("anyone", "anything", 2026, "nowhere"),
        capabilities=lambda options: Capabilities(
            "given", 1, frozenset({"times"}), frozenset({"times"}), rests=frozenset({"velocity"})
        ),
    )
    monkeypatch.setitem(METHODS, row.id, row)
    assert describe_method("stop_cubics")["honours"] == ["times"]
    done = plan(PlanRequest.of([0, 1, 3], times=[0, 1, 2]), "stop_cubics")
    assert done.certificate.holds and done.certificate.boundary_error == 0 and done.certificate.continuity == 1
    with pytest.raises(Unsupported) as caught:
        plan(PlanRequest.of([0, 1, 3], times=[0, 1, 2], limits={"velocity": 9}), "stop_cubics")
    assert "minimum_jerk" in caught.value.alternatives
