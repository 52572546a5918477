"""The report of all campaigns that left a state: what was asked, how far each ran, what was measured, what failed."""

import json
import os
import platform
from pathlib import Path
from typing import Any

from planner import __version__

from ..markdown import table


def write(folder: Path) -> Path:
    """Write ``report.md`` from the states in a folder; return its path."""
    from .campaigns import CAMPAIGNS

    states = {}
    for name in CAMPAIGNS:
        path = folder / f"{name}.json"
        if path.exists():
            states[name] = json.loads(path.read_text(encoding="utf-8"))
    lines = ["# Reliability campaigns", ""]
    lines += [f"Waywright {__version__}, Python {platform.python_version()}, {os.cpu_count()} hardware threads. ", ""]
    head = ["campaign", "what", "asked", "ran", "seed", "time, s", "load", "failures"]
    rows = [
        [
            name,
            CAMPAIGNS[name].TITLE,
            f"{s['size']:,} {CAMPAIGNS[name].UNIT}",
            f"{s['done']:,}" + ("" if s["done"] >= s["size"] else " so far"),
            str(s["seed"]),
            f"{s['seconds']:.0f}",
            " to ".join(f"{x:.1f}" for x in s["load"]),
            f"{s['failed']:,}",
        ]
        for name, s in states.items()
    ]
    lines += [table(head, rows), ""]
    for name, s in states.items():
        lines += [f"## {name}: {CAMPAIGNS[name].TITLE}", ""]
        if s["figures"]:
            figures = [[key, _value(f), f["goal"], _met(f["met"])] for key, f in s["figures"].items()]
            lines += [table(["figure", "measured", "goal", "met"], figures), ""]
        if s["failures"]:
            lines += [f"{s['failed']:,} failures; the first of them:", ""]
            lines += ["- " + ", ".join(f"{key}: {_plain(value)}" for key, value in f.items()) for f in s["failures"]]
            lines += [""]
    path = folder / "report.md"
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def _value(figure: dict[str, Any]) -> str:
    value, unit = figure["value"], figure["unit"]
    shown = "-" if value is None else f"{value:,.4g}" if isinstance(value, float) else str(value)
    return f"{shown} {unit}".strip()


def _met(met: bool | None) -> str:
    return "" if met is None else "yes" if met else "**no**"


def _plain(value: Any) -> str:
    return str(value).replace("\n", " ").replace("|", "\\|")
