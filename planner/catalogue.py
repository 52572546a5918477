"""The method table as data: what the service lists, the docs print and the battery tests."""

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
