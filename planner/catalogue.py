"""The method table as data: what the service lists, the docs print and the battery tests."""

import json
from dataclasses import asdict
from typing import Any

from .errors import UnknownMethod
from .method import Capabilities, Method
from .methods import METHODS
from .options import CAPABILITIES


def list_methods() -> list[dict[str, Any]]:
    """Return one JSON-ready entry per method, in order of presentation."""
    return [entry(m) for m in METHODS.values()]


def describe_method(name: str) -> dict[str, Any]:
    """Return the entry of one method.

    Raises
    ------
    UnknownMethod
    """
    if name not in METHODS:
        raise UnknownMethod(name, list(METHODS))
    return entry(METHODS[name])


def entry(method: Method) -> dict[str, Any]:
    """Return a method's row as JSON-ready data; ``variants`` holds what differs with other options."""
    default = _capabilities(method.capabilities(method.options()))
    variants = []
    for options in method.variants:
        other = _capabilities(method.capabilities(method.options.model_validate(options)))
        variants.append({"options": dict(options), **{k: v for k, v in other.items() if v != default[k]}})
    return {
        "id": method.id,
        "title": method.title,
        "family": method.family,
        "summary": method.summary,
        "formula": method.formula,
        "reference": asdict(method.reference),
        **default,
        "variants": variants,
        "path": method.path,
        "objective": method.objective,
        "options": method.options.model_json_schema(),
    }


def _capabilities(can: Capabilities) -> dict[str, Any]:
    return {
        "timing": can.timing,
        "requires": [w for w in CAPABILITIES if w in can.requires],
        "honours": list(can.words),
        "continuity": can.continuity,
    }


def markdown() -> str:
    """Return the catalogue as a Markdown page: a table, then a section per method."""
    entries, columns = list_methods(), ("title", "family", "timing", "path", "continuity")
    lines = [
        "# Methods",
        "",
        "Made from the method table by `make docs`; a test fails when this page is stale.",
        "",
        "| id | what | family | timing | path | continuity |",
        "|---|---|---|---|---|---|",
    ]
    lines += ["| " + " | ".join([f"[`{e['id']}`](#{e['id']})", *(str(e[k]) for k in columns)]) + " |" for e in entries]
    for e in entries:
        reference = e["reference"]
        lines += ["", f"## {e['id']}", "", f"{e['title']}. {e['summary']}", "", f"    {e['formula']}", ""]
        lines += [f"- requires: {_words(e['requires'])}", f"- honours: {_words(e['honours'])}"]
        lines += [f"- minimises: {e['objective']}"] if e["objective"] else []
        lines += [
            f"- with `{json.dumps(v['options'])}`: "
            + "; ".join(f"{k} {_words(x) if isinstance(x, list) else x}" for k, x in v.items() if k != "options")
            for v in e["variants"]
            if len(v) > 1
        ]
        lines += [
            f"- option `{name}`: {o.get('description', '')} (default {json.dumps(o.get('default'))})"
            for name, o in e["options"].get("properties", {}).items()
        ]
        work = f"{reference['authors']}, {reference['title']}, {reference['year']}"
        lines += [f"- reference: {work}. {reference['where']}"]
    return "\n".join(lines) + "\n"


def _words(words: list[str]) -> str:
    return ", ".join(f"`{w}`" for w in words) or "nothing"
