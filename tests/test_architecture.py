"""The import directions, the exported names, and that a method is one file and one row."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import planner

ROOT = Path(planner.__file__).resolve().parent.parent

#: Layers of planner, lowest first; a module may import from lower layers only, except where a line says otherwise.
LAYERS = [
    {"errors", "version"},
    {"options", "kernels"},
    {"reading", "deadline", "pieces", "quadrature"},
    {"rational"},
    {"trajectory"},
    {"jumps", "worst"},
    {"limits"},
    {"types"},
    {"curves", "solvers", "corridors"},
    {"paths"},
    {"smoothing", "timing", "fitting"},
    {"waypoints"},
    {"method", "verify", "bounds", "feasibility"},
    {"methods"},
    {"check"},
    {"sampling", "certification", "planning"},
    {"comparison", "catalogue", "cases", "compat", "retiming"},
]
RANK = {name: rank for rank, layer in enumerate(LAYERS) for name in layer}
SOURCES = [p for name in ("planner", "problems", "api") for p in sorted((ROOT / name).rglob("*.py"))]


def imports(path):
    """Absolute dotted names imported by a module, relative ones resolved."""
    package = list(path.relative_to(ROOT).with_suffix("").parts)
    package = package[:-1] if path.name != "__init__.py" else package[:-1]
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found += [a.name for a in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            stem = ".".join([*base, *([node.module] if node.module else [])])
            found += [stem] if node.module else [f"{stem}.{a.name}" for a in node.names]
    return found


def test_packages_point_one_way():
    for path in SOURCES:
        mine = path.relative_to(ROOT).parts[0]
        for name in imports(path):
            top = name.split(".")[0]
            allowed = {"problems": {"problems"}, "planner": {"planner", "problems"}, "api": {"api", "planner"}}[mine]
            assert top not in ("planner", "problems", "api") or top in allowed, f"{path}: imports {name}"


def test_planner_layers_import_leftwards_only():
    for path in SOURCES:
        parts = path.relative_to(ROOT).with_suffix("").parts
        if parts[0] != "planner" or parts == ("planner", "__init__"):
            continue
        mine = parts[1]
        for name in imports(path):
            if not name.startswith("planner.") or name.split(".")[1] == mine:
                continue
            assert RANK[name.split(".")[1]] <= RANK[mine], f"{path.relative_to(ROOT)} imports {name}"
            if RANK[name.split(".")[1]] == RANK[mine]:
                assert mine in ("reading", "comparison", "planning", "types"), f"{path}: {name} is of the same layer"


def test_methods_do_not_import_one_another():
    for path in sorted((ROOT / "planner" / "methods").glob("*.py")):
        if path.name != "__init__.py":
            assert not [n for n in imports(path) if n.startswith("planner.methods")], path


def test_verification_is_independent():
    """What the certificate is worth: verify knows no method, no path builder, no solver, no statement."""
    free = {"errors", "trajectory", "jumps", "kernels", "quadrature", "rational", "types", "limits", "worst", "pieces"}
    for module in ("verify", "corridors"):
        known = {n.split(".")[1] for n in imports(ROOT / "planner" / f"{module}.py") if n.startswith("planner.")}
        assert known <= free | {"corridors"}, module
    users = [p for p in SOURCES if any(n == "planner.verify" for n in imports(p))]
    assert {p.stem for p in users} == {"planning", "certification"}


def test_statements_are_pure():
    """At module level, problems import numpy and scipy only."""
    for path in sorted((ROOT / "problems").glob("*.py")):
        tree = ast.parse(path.read_text())
        for node in tree.body:
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) and not node.level else []
            for name in names:
                assert name.split(".")[0] in (
                    "numpy",
                    "scipy",
                    "dataclasses",
                    "functools",
                    "typing",
                    "math",
                    "problems",
                ), path


def test_modules_are_small():
    for path in SOURCES:
        limit = 150 if path.parent.name == "methods" and path.parent.parent.name == "planner" else 400
        assert len(path.read_text().splitlines()) <= limit, path


def test_kernels_leave_no_rounding_to_the_compiler():
    """Every copy that LLVM makes of a kernel, compiled or from the cache, inlined or not, is to give the same bytes."""
    for path in sorted((ROOT / "planner").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            where = f"{path}:{getattr(node, 'lineno', 0)}"
            if isinstance(node, ast.Call):
                assert not {"fastmath", "flags"} & {k.arg for k in node.keywords}, where
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                assert "fmuladd" not in node.value, f"{where}: fused only where LLVM sees fit"


def test_exported_names_exist_and_shadow_no_module():
    for name in planner.__all__:
        assert getattr(planner, name) is not None
    modules = {p.stem for p in (ROOT / "planner").iterdir()}
    assert not modules & set(planner.__all__)


def test_typed_names_are_the_runtime_names():
    tree = ast.parse((ROOT / "planner" / "__init__.py").read_text())
    typed = {(n.module, a.name) for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and n.level for a in n.names}
    assert typed == {(m, n) for m, names in planner._HOME.items() for n in names}


@pytest.mark.parametrize(
    ("statement", "heavy"),
    [
        ("import planner", ["numpy", "casadi", "numba", "toppra", "ruckig", "pydantic"]),
        ("import api", ["fastapi", "uvicorn", "numpy", "casadi"]),
        ("from planner import plan, PlanRequest", ["casadi", "toppra", "ruckig", "qpsolvers", "matplotlib"]),
    ],
)
def test_imports_stay_light(statement, heavy):
    code = f"import sys; {statement}; print([m for m in {heavy!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout.strip() == "[]"
