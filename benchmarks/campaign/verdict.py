"""What is wrong with an answer: nothing may be, whatever the request was."""

import csv
import io
import json
import math
import re
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np
import orjson
from pydantic import TypeAdapter

from api.errors import KINDS, LARGEST, REQUEST_ID
from api.media import ARROW, CSV, JSON, MARKDOWN, MSGPACK, NPZ, PLOTLY, PROBLEM, ROS2
from api.openapi import OPERATIONS

from .wire import Ask, Reply

_SENT_ID = re.compile(rb"\r\nx-request-id:[ \t]*([^\r\n]*)\r\n", re.IGNORECASE)


class Verdict:
    """Judges answers; knows the models of the answers from the service's own OpenAPI document."""

    def __init__(self, document: dict[str, Any]) -> None:
        self.document = document
        self._models: list[tuple[re.Pattern[str], str, TypeAdapter[Any]]] = []
        for path, verbs in document["paths"].items():
            pattern = re.compile(re.sub(r"\\{\w+\\}", "[^/]+", re.escape(path)))
            for verb, operation in verbs.items():
                row = OPERATIONS.get(operation.get("operationId"))
                if row is not None and row.reply is not None:
                    model = TypeAdapter(list[row.reply] if row.many else row.reply)  # type: ignore[name-defined]
                    self._models.append((pattern, verb.upper(), model))

    def faults(self, ask: Ask, reply: Reply) -> list[str]:
        """Return what is wrong; the empty list if nothing is."""
        if not reply.status or reply.broken:
            if not ask.intact and reply.broken in ("closed", "reset"):
                return []
            return [f"no whole answer: {reply.broken} after {reply.seconds:.2f} s, status {reply.status}"]
        if not ask.intact and reply.status == 400 and PROBLEM not in reply.headers.get("content-type", ""):
            return []  # the server's parser refused it before there was a request
        found = []
        request_id = reply.headers.get("x-request-id")
        if not request_id:
            found.append(f"{reply.status} without X-Request-ID")
        elif ask.intact and (sent := _SENT_ID.search(ask.raw)):
            text = sent[1].decode("latin-1").strip()
            if REQUEST_ID.fullmatch(text) and request_id != text:
                found.append(f"X-Request-ID {text!r} came back as {request_id!r}")
        if reply.status >= 500 and not (ask.patient and reply.status in (503, 504)):
            found.append(f"status {reply.status}: {reply.body[:300]!r}")
        if reply.status in (429, 503) and "retry-after" not in reply.headers:
            found.append(f"{reply.status} without Retry-After")
        if reply.status == 405 and "allow" not in reply.headers:
            found.append("405 without Allow")
        try:
            if reply.status >= 400:
                self._problem(ask, reply)
            elif reply.status == 200 and ask.verb != "HEAD":
                self._answer(ask, reply)
        except Exception as error:
            found.append(f"{reply.status} {type(error).__name__}: {str(error)[:300]}; body {reply.body[:200]!r}")
        return found

    def _problem(self, ask: Ask, reply: Reply) -> None:
        assert reply.headers.get("content-type") == PROBLEM, f"Content-Type {reply.headers.get('content-type')}"
        if ask.verb == "HEAD":
            return
        assert len(reply.body) < LARGEST, f"{len(reply.body)} bytes"
        tree = orjson.loads(reply.body)
        kind = KINDS[tree["type"].removeprefix("/errors/")]
        assert kind.status == reply.status == tree["status"], "status"
        assert tree["title"] == kind.title and tree["detail"], "title or detail"
        assert tree["request_id"] == reply.headers.get("x-request-id"), "request_id"

    def _answer(self, ask: Ask, reply: Reply) -> None:
        media_type = reply.headers.get("content-type", "").partition(";")[0]
        route = ask.path.partition("?")[0]
        reader = READERS.get(media_type)
        if reader is None:
            return  # a page, or a format that is not known here
        tree = reader(reply.body)
        if media_type not in (JSON, MSGPACK):
            return
        for pattern, verb, model in self._models:
            if verb == ask.verb and pattern.fullmatch(route):
                model.validate_python(tree)
                if ask.verb == "POST" and isinstance(tree, dict) and "digest" in tree and "certificate" in tree:
                    assert tree["certificate"]["holds"], "an answer whose certificate does not hold"
                return


def _loads(raw: bytes) -> Any:
    return orjson.loads(raw)


def _msgpack(raw: bytes) -> Any:
    import ormsgpack

    tree = ormsgpack.unpackb(raw)
    json.dumps(tree, allow_nan=False)  # the same tree as JSON: finite, and nothing that JSON has no form for
    return tree


def _csv(raw: bytes) -> None:
    rows = list(csv.reader(io.StringIO(raw.decode())))
    assert b"\r" not in raw and rows[0][0] == "time", "header"
    for row in rows[1:]:
        assert len(row) == len(rows[0]), "ragged"
        assert all(math.isfinite(float(entry)) for entry in row if entry), "not finite"


def _ros2(raw: bytes) -> None:
    points = orjson.loads(raw)["points"]
    times = [p["time_from_start"]["sec"] * 10**9 + p["time_from_start"]["nanosec"] for p in points]
    assert all(b > a for a, b in zip(times, times[1:], strict=False)), "times do not increase"


def _npz(raw: bytes) -> None:
    with np.load(io.BytesIO(raw), allow_pickle=False) as held:
        for name in held.files:
            assert held[name] is not None


def _arrow(raw: bytes) -> None:
    if find_spec("pyarrow") is None:
        return
    import pyarrow

    with pyarrow.ipc.open_stream(raw) as stream:
        stream.read_all().validate(full=True)


def _plotly(raw: bytes) -> None:
    assert {"data", "layout"} <= set(orjson.loads(raw)), "no figure"


READERS: dict[str, Callable[[bytes], Any]] = {
    JSON: _loads,
    MSGPACK: _msgpack,
    CSV: _csv,
    ROS2: _ros2,
    NPZ: _npz,
    ARROW: _arrow,
    PLOTLY: _plotly,
    MARKDOWN: lambda raw: raw.decode(),
}
