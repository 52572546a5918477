"""The checklist page: every system has its row, and every test that a row names exists."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PAGE = (ROOT / "docs" / "checklist.md").read_text(encoding="utf-8")
ROWS = [line for line in PAGE.splitlines() if line.startswith("| ") and not line.startswith(("| id", "| law"))]
NAMED = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", PAGE)

SYSTEMS = [
    f"{letter}{i}"
    for letter, count in (("G", 25), ("D", 7), ("T", 11), ("C", 4), ("M", 8))
    for i in range(1, count + 1)
]
BUILT = ["G2", "G3", "G4", "G5", "G6", "G7", "G8", "G9", "G12", "G13", "G14", "G15", "C1", "C2", "C3", "C4", "M1", "M2"]


@cache
def functions(file):
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


def row(name):
    (found,) = [r for r in ROWS if r.startswith(f"| {name} |")]
    return found


@pytest.mark.parametrize("name", SYSTEMS)
def test_every_system_has_a_row(name):
    assert ("::test_" in row(name)) or row(name).rstrip(" |").endswith("not built yet")


@pytest.mark.parametrize("name", BUILT)
def test_what_is_built_names_tests(name):
    assert "::test_" in row(name)


def test_every_test_named_exists():
    assert len(NAMED) > 100
    assert [f"{file}::{name}" for file, name in NAMED if name not in functions(file)] == []


def test_rows_that_name_tests_name_nothing_else():
    for each in ROWS:
        cell = each.rstrip(" |").rpartition(" | ")[2]
        assert cell == "not built yet" or all(
            re.fullmatch(r"`tests/[\w/]+\.py::\w+`", t) for t in cell.split("<br>")
        ), each
