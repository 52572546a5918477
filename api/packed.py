"""A body in MessagePack, read as JSON would be: maps with string keys, arrays, strings, numbers, booleans and nil."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import msgpack

from planner import InvalidRequest

#: Nested as deeply as JSON bodies may be.
DEEPEST = 200

#: Arrays and maps: each takes a byte in the body, and a hundred to build.
MOST = 1_000_000

#: Bytes that say null; floats have some of them too, but never that many in a body.
NULLS = 3_000_000


def unpack(raw: bytes) -> Any:
    """Return the value of a body; NaN and infinity come through, so that their field can be named.

    Raises
    ------
    InvalidRequest
        ``not_json``: cut short, more than one value, binary or extended types, a key that is no string or there twice,
        text that is not UTF-8, nested too deeply.
    """
    try:
        if raw.count(b"\xc0") > NULLS:
            raise ValueError(f"it holds more than {NULLS:,} nulls")
        _refuse_lengths(raw)
        with _uncollected():
            value = _built(raw)
        _refuse_what_json_has_not(value)
        return value
    except msgpack.OutOfData:
        reason = "it ends before its value does"
    except msgpack.StackError:
        reason = "it is nested too deeply"
    except (ValueError, TypeError, OverflowError, msgpack.UnpackException) as error:
        reason = _told(error)
    raise InvalidRequest.of("", "not_json", f"the body is not MessagePack that can be read: {reason}"[:300])


def _built(raw: bytes) -> Any:
    counted = _Counted()
    return msgpack.unpackb(
        raw,
        strict_map_key=True,
        object_pairs_hook=counted.object,
        list_hook=counted.array,
        ext_hook=_extended,
        max_bin_len=0,
        max_ext_len=0,
    )


@contextmanager
def _uncollected() -> Iterator[None]:
    """Keep the garbage collector away: of a million new arrays none is garbage, and it would look again and again."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def _refuse_lengths(raw: bytes) -> None:
    """Walk over the value without building it: what claims to be longer than it is costs no memory."""
    unpacker = msgpack.Unpacker(max_buffer_size=0)
    unpacker.feed(raw)
    unpacker.skip()
    if unpacker.tell() != len(raw):
        raise ValueError(f"{len(raw) - unpacker.tell()} bytes follow its value")


class _Counted:
    """Makes arrays and maps, up to so many."""

    def __init__(self) -> None:
        self._left = MOST

    def array(self, items: list[Any]) -> list[Any]:
        """Count an array."""
        self._left -= 1
        if self._left < 0:
            raise ValueError(f"it holds more than {MOST:,} arrays and maps")
        return items

    def object(self, pairs: list[tuple[Any, Any]]) -> dict[str, Any]:
        """Return a map whose keys are strings that differ."""
        self._left -= 1
        if self._left < 0:
            raise ValueError(f"it holds more than {MOST:,} arrays and maps")
        found = dict(pairs)
        if len(found) != len(pairs):
            keys = [key for key, _ in pairs]
            twice = next(key for i, key in enumerate(keys) if key in keys[:i]) if len(keys) <= 1000 else ""
            raise ValueError(f"a map has a key twice: {str(twice)[:60]!r}")
        if b"" in found:
            raise ValueError("a key is no string")
        return found


def _extended(code: int, data: bytes) -> Any:
    raise ValueError(f"it holds the extension type {code}")


def _refuse_what_json_has_not(value: Any) -> None:
    """Refuse bytes without length, which the limit of 0 lets through, and deep nesting."""
    level = [value]
    for _ in range(DEEPEST):
        below: list[Any] = []
        for entry in level:
            items = entry.values() if isinstance(entry, dict) else entry if isinstance(entry, list) else (entry,)
            kinds = set(map(type, items))
            if not kinds <= _PLAIN:
                raise ValueError("it holds binary data or an extension type")
            if kinds & _NESTED:
                below.extend(item for item in items if item and type(item) in _NESTED)
        if not below:
            return
        level = below
    raise msgpack.StackError


_NESTED = {list, dict}
_PLAIN = {list, dict, str, int, float, bool, type(None)}


def _told(error: Exception) -> str:
    """Return a library's message in the words of the format."""
    text = str(error)
    if isinstance(error, UnicodeDecodeError):
        return "a string is not UTF-8"
    if "max_bin_len" in text:
        return "it holds binary data"
    if "max_ext_len" in text:
        return "it holds an extension type"
    if "map key" in text:
        return "a key is no string"
    return text or "a byte stands where no value can begin"
