"""The log: a line per request, and what the standard library's loggers say, through one renderer on stderr.

Nothing is set up on import or by ``create_app()``: whoever uses the service as a library has a log of its own.
``waywright serve`` does.
"""

import logging
import sys
from collections.abc import Callable, Iterator, MutableMapping
from contextlib import contextmanager
from typing import Any, TextIO

import orjson
import structlog
from structlog.typing import Processor

from ..settings import Settings

#: Fields that a record of the standard library may carry by ``extra``.
_EXTRA = ("request_id", "trace_id", "trace")

Fields = dict[str, Any]

_write: Callable[[str, Fields], None] | None = None


def configure(settings: Settings, stream: TextIO | None = None) -> Callable[[], None]:
    """Set up the process' log as the setting ``log`` says; returns what undoes it.

    Parameters
    ----------
    stream
        Where the log goes; standard error by default.
    """
    global _write
    stream = sys.stderr if stream is None else stream
    mode = settings.log
    if mode == "auto":
        mode = "console" if stream.isatty() else "json"
    handler: logging.Handler = logging.NullHandler()  # without one, Python prints warnings by itself
    write = None
    if mode != "off":
        handler = logging.StreamHandler(stream)
        handler.setFormatter(_formatter(mode, stream))
        write = _writer(mode, stream)
    root, ours, access = logging.getLogger(), logging.getLogger("waywright"), logging.getLogger("uvicorn.access")
    before = (_write, root.level, ours.level, access.disabled)
    root.addHandler(handler)
    root.setLevel(logging.WARNING)
    ours.setLevel(logging.INFO)
    access.disabled = True  # its lines hold the query, and ours say more
    _write = write

    def undo() -> None:
        global _write
        root.removeHandler(handler)
        _write, root_level, ours_level, access.disabled = before
        root.setLevel(root_level)
        ours.setLevel(ours_level)

    return undo


@contextmanager
def configured(settings: Settings, stream: TextIO | None = None) -> Iterator[None]:
    """Set up the log from here to there."""
    undo = configure(settings, stream)
    try:
        yield
    finally:
        undo()


def is_on() -> bool:
    """Return whether requests are logged."""
    return _write is not None


def request_line(level: str, fields: Fields) -> None:
    """Write the line of a request, if there is a log."""
    if _write is not None:
        try:
            _write(level, fields)
        except (OSError, ValueError):  # nobody reads stderr any more: no reason to fail requests
            pass


def _shared() -> list[Processor]:
    return [structlog.processors.add_log_level, structlog.processors.TimeStamper(fmt="iso", utc=True)]


def _renderer(mode: str, stream: TextIO) -> list[Processor]:
    if mode == "console":
        return [structlog.dev.ConsoleRenderer(colors=stream.isatty(), pad_event_to=12)]
    return [structlog.processors.format_exc_info, structlog.processors.JSONRenderer(serializer=_json)]


def _writer(mode: str, stream: TextIO) -> Callable[[str, Fields], None]:
    """Return what writes requests: structlog alone, a third of the way through the standard library's logging."""
    log = structlog.wrap_logger(
        structlog.WriteLogger(stream),
        processors=[*_shared(), *_renderer(mode, stream)],
        wrapper_class=structlog.make_filtering_bound_logger(logging.INFO),
        context_class=dict,
    ).bind()
    at: dict[str, Callable[..., Any]] = {name: getattr(log, name) for name in ("info", "warning", "error")}

    def write(level: str, fields: Fields) -> None:
        at[level]("request", **fields)

    return write


def _formatter(mode: str, stream: TextIO) -> logging.Formatter:
    return structlog.stdlib.ProcessorFormatter(
        foreign_pre_chain=[*_shared(), structlog.stdlib.add_logger_name, structlog.stdlib.ExtraAdder(_EXTRA)],
        processors=[structlog.stdlib.ProcessorFormatter.remove_processors_meta, *_renderer(mode, stream)],
    )


def _json(event: MutableMapping[str, Any], default: Callable[[Any], Any]) -> str:
    first = {name: event.pop(name) for name in ("timestamp", "level", "event") if name in event}
    return orjson.dumps({**first, **event}, default=default).decode()
