"""Waywright's service, its Python client and the command line.

``from api import Client`` never imports the web framework: names are imported on first use.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .client import AsyncClient, Client
    from .result import Result

_HOME = {"AsyncClient": "client", "Client": "client", "Result": "result"}

__all__ = ["AsyncClient", "Client", "Result"]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_HOME[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
