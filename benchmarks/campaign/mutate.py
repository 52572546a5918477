"""Bent requests: right ones whose tree, bytes or head is changed at random places."""

import copy
import json
import random
from typing import Any

from planner import METHODS

from .bodies import Maker
from .wire import JSON, Ask, http

#: Written into the JSON text as they stand: no Python value has this form.
_TOKENS = ["NaN", "Infinity", "-Infinity", "1e999", "-1e999", "1e400", "-0", "-0.0", "01", "1.", "+1", "0x10", "1_000"]
_TOKENS += [
    "9" * 400,
    "1" + "0" * 5000,
    "1e-400",
    "4.9e-324",
    "\\u0000",
    "tru",
    "nul",
    '"\\ud800"',
    '"\\x"',
    "[[[[",
    "}",
]
_MARK = "@token@"

_LEAVES: list[Any] = [None, True, False, 0, 1, -1, 2, 3, 0.5, 1e-12, 1e-300, 5e-324, -0.0, 1e9, 1e9 + 1, 1e11, 1e12]
_LEAVES += [1e100, 1e101, 1e308, 2**31, 2**53, 2**63, 2**64, 10**30, -(2**63), "", "1", "NaN", "auto", "all", "x" * 300]
_LEAVES += ["\ud800", "\x00", "é", "joint", [], {}, [[]], [{}], {"": 0}, [None], [0], [[0]], {"lower": 0, "upper": 1}]
_LEAVES += [
    {"min": 1, "max": 1},
    {"lower": -1, "upper": [1, None]},
    {"kind": "linear"},
    "linear",
    "polynomial",
    "bound",
]

_KEYS = "waypoints times method options limits segment_limits segment_durations duration start end waypoint_states"
_KEYS += " waypoint_tolerance tube robot wrap joint_names sampling include timeout methods trajectory spacing velocity"
_KEYS += " acceleration jerk position torque velocity_norm lower upper min max dt count path kind knots degree weights"
_KEYS += " order ends backend boundary polynomial breaks coefficients samples points tolerance __proto__ #list \x00 é"
_NAMES = _KEYS.split(" ")

#: Each of the formats, and what browsers and mistakes send.
ACCEPTS = [
    "application/json",
    "application/msgpack",
    "application/vnd.apache.arrow.stream",
    "text/csv",
    "application/x-npz",
    "application/vnd.ros2.joint-trajectory+json",
    "application/vnd.plotly+json",
    "*/*",
    "text/*;q=0.5, application/json;q=0.4",
    "application/*;q=0.1,*/*;q=0.01",
    "application/json;q=nan",
    "text/html,application/xhtml+xml",
    ";;,,q=1",
    "a/b",
    "",
]

#: A time limit for each, so that the campaign goes on: more than right requests need.
_TIMEOUT = 2.0


class Bender:
    """Makes requests to attack with; ``rng`` is all it depends on."""

    def __init__(self, maker: Maker) -> None:
        self.maker = maker

    def structured(self, rng: random.Random) -> Ask:
        """Return a right request with some changes to its tree, or none."""
        path, body = self.maker.make(rng)
        if path != "/v1/certificates" and "shape" not in path:
            body["timeout"] = _TIMEOUT
        tree: Any = copy.deepcopy(body)
        for _ in range(rng.choice((0, 0, 1, 1, 2, 3))):
            tree = _bent(tree, rng)
        headers = {"Content-Type": JSON}
        raw = _msgpack(tree) if rng.random() < 0.15 else None
        if raw is not None:
            headers["Content-Type"] = "application/msgpack"
        else:
            raw = _text(tree, rng)
        return self._ask(rng, path, raw, headers)

    def raw(self, rng: random.Random) -> Ask:
        """Return a request whose bytes are changed: in its body, or more seldom in its head."""
        kind = rng.random()
        path, body = self.maker.make(rng)
        raw = json.dumps(body).encode()
        if kind < 0.3:
            raw = _flipped(raw, rng)
        elif kind < 0.5:
            raw = raw[: rng.randrange(len(raw))]
        elif kind < 0.6:
            raw = raw[: rng.randrange(len(raw))] + rng.randbytes(rng.randint(1, 40))
        elif kind < 0.7:
            raw = rng.choice((b"[", b'{"options":', b'{"waypoints":[', b'{"robot":{"a":')) * rng.randint(1, 3000)
        elif kind < 0.8:
            raw = rng.randbytes(rng.randint(0, 200))
        elif kind < 0.85:
            return self._get(rng)
        else:
            return self._broken(rng, path, raw)
        return self._ask(rng, path, raw, {"Content-Type": JSON})

    def _get(self, rng: random.Random) -> Ask:
        path = rng.choice([*self.maker.gets, "/", "/v1", "/v1/../healthz", "//", "/%00", "/%ff", "/v1/methods/%2e"])
        path = path.replace("{id}", rng.choice([*METHODS, "x", "%F0%9F%98%80"])).replace("{code}", "timeout")
        if rng.random() < 0.2:
            path += rng.choice(("?", "?a", "?a=1&a=2", "?shape=ruckig", "?%00", "?=", "#x", "?" + "x" * 3000))
        verb = rng.choice(("GET", "GET", "GET", "HEAD", "OPTIONS", "DELETE"))
        return Ask(http(verb, path, headers={"Accept": rng.choice(ACCEPTS)}), verb, path, patient=path == "/readyz")

    def _ask(self, rng: random.Random, path: str, raw: bytes, headers: dict[str, str]) -> Ask:
        verb = "POST" if rng.random() < 0.97 else rng.choice(("GET", "PUT", "PATCH", "DELETE", "OPTIONS", "HEAD"))
        if rng.random() < 0.4:
            headers["Accept"] = rng.choice(ACCEPTS)
        if rng.random() < 0.3:
            length = rng.choice((1, 8, 36, 128, 129, 300))
            headers["X-Request-ID"] = "".join(chr(rng.randint(33, 126)) for _ in range(length))
        if rng.random() < 0.05:
            headers["Content-Type"] = rng.choice(("", "text/plain", "application/json; charset=utf-16", "a", "*/*"))
        if rng.random() < 0.03:
            headers["Content-Encoding"] = rng.choice(("gzip", "identity", "br, gzip", ""))
        if rng.random() < 0.05:
            headers[rng.choice(("X-API-Key", "Authorization", "Cookie", "Prefer", "Range", "If-None-Match"))] = "x" * 50
        if rng.random() < 0.03:
            path += rng.choice(("?x=1", "&x", "?shape=ruckig", "/", "?shape=", "?shape=ruckig&shape=ruckig"))
        chunked = rng.choice((1, 7, 1000)) if rng.random() < 0.08 and len(raw) < 20_000 else 0
        return Ask(http(verb, path, raw, headers, chunked), verb, path, patient=True)

    def _broken(self, rng: random.Random, path: str, raw: bytes) -> Ask:
        """Return a request that is wrong as HTTP, or may be."""
        whole = http("POST", path, raw)
        end = whole.index(b"\r\n\r\n") + 4
        kind = rng.randrange(6)
        if kind == 0:
            whole = _flipped(whole[:end], rng) + whole[end:]
        elif kind == 1:
            whole = whole[: rng.randrange(1, len(whole))]
        elif kind == 2:
            line = b"%s: %s\r\n" % (rng.randbytes(rng.randint(0, 6)), rng.randbytes(rng.randint(0, 60)))
            whole = whole[: end - 2] + line + whole[end - 2 :]
        elif kind == 3:
            whole = whole.replace(b"HTTP/1.1", rng.choice((b"HTTP/1.0", b"HTTP/2.0", b"HTTP/9", b"", b"ICY")), 1)
        elif kind == 4:
            more = rng.choice((b"Content-Length: 5", b"Transfer-Encoding: chunked", b"Transfer-Encoding: x", b"Host:"))
            whole = whole[: end - 2] + more + b"\r\n" + whole[end - 2 :]
        else:
            whole = rng.randbytes(rng.randint(1, 300))
        return Ask(whole, "POST", path, intact=False, patient=True)


def _places(tree: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the paths of all nodes; of long lists the first few and the last."""
    found = [path]
    if isinstance(tree, dict):
        for key, value in tree.items():
            found += _places(value, (*path, key))
    elif isinstance(tree, list):
        for i in {*range(min(3, len(tree))), len(tree) - 1} - {-1}:
            found += _places(tree[i], (*path, i))
    return found


def _bent(tree: Any, rng: random.Random) -> Any:
    """Return the tree with one change."""
    path = rng.choice(_places(tree))
    if not path:
        return tree if rng.random() < 0.9 else rng.choice(_LEAVES)
    holder = tree
    for step in path[:-1]:
        holder = holder[step]
    key, old = path[-1], holder[path[-1]]
    kind = rng.randrange(10)
    if kind <= 2:
        holder[key] = copy.deepcopy(rng.choice(_LEAVES))
    elif kind == 3:
        holder[key] = _MARK
    elif kind == 4:
        del holder[key]
    elif kind == 5 and isinstance(holder, dict):
        holder[rng.choice(_NAMES)] = copy.deepcopy(rng.choice((old, rng.choice(_LEAVES))))
    elif kind == 5:
        holder.insert(key, copy.deepcopy(old))
    elif kind == 6 and isinstance(old, (int, float)) and not isinstance(old, bool):
        holder[key] = float(old) * 10.0 ** rng.randint(-20, 20)
    elif kind == 6:
        holder[key] = [old]
    elif kind == 7 and "method" in tree and isinstance(tree, dict):
        _optioned(tree, rng)
    elif kind == 8 and isinstance(old, list):
        rng.shuffle(old)
    elif kind == 9 and isinstance(old, list) and old:
        holder[key] = old * rng.choice((2, 10)) if rng.random() < 0.7 else old[:-1]
    else:
        holder[key] = rng.choice((str(old), [old, old], {"x": old}, -old if isinstance(old, float) else 0))
    return tree


def _optioned(tree: dict[str, Any], rng: random.Random) -> None:
    """Choose a method and one of its options, of a value that its schema allows, or nearly."""
    method = rng.choice(list(METHODS))
    schema = METHODS[method].options.model_json_schema()
    tree["method"], tree["options"] = method, {}
    names = list(schema.get("properties", {}))
    if names:
        name = rng.choice(names)
        field = schema["properties"][name]
        choices = field.get("enum") or [b for a in field.get("anyOf", []) for b in a.get("enum", [])]
        choices = choices or [True, False, 1, 2, 3, 5, 0.1, 1.0, {"kind": "linear"}]
        tree["options"][name] = rng.choice(choices)


def _text(tree: Any, rng: random.Random) -> bytes:
    text = json.dumps(tree)
    while _MARK in text:
        text = text.replace(f'"{_MARK}"', rng.choice(_TOKENS), 1).replace(_MARK, "", text.count(f'"{_MARK}"') == 0)
    return text.encode()


def _msgpack(tree: Any) -> bytes | None:
    import ormsgpack

    try:
        return ormsgpack.packb(tree)
    except (ormsgpack.MsgpackEncodeError, TypeError, OverflowError):  # it has no such form: sent as JSON
        return None


def _flipped(raw: bytes, rng: random.Random) -> bytes:
    changed = bytearray(raw)
    for _ in range(rng.randint(1, 4)):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)
