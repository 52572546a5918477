"""MessagePack: the tree of JSON, with floats in 8 bytes each; in pieces, so that no array is packed at once."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import orjson
import ormsgpack
from numpy.typing import NDArray

from planner import NotVerified

from ..draft import ORDERS, PIECE, WHOLE, Draft, Drawn, count, refuse_infinite
from . import json

Array = NDArray[np.float64]

#: Without the second, samples would be written as the dataclass they are.
_OPTION = ormsgpack.OPT_SERIALIZE_NUMPY | ormsgpack.OPT_PASSTHROUGH_DATACLASS


def write(draft: Draft) -> Iterator[bytes]:
    """Write a draft as the contract's tree."""
    if draft.numbers <= WHOLE:
        yield _whole(draft.tree)
    else:
        yield from _pieces(draft.tree, draft.method or "")


def _whole(tree: Any) -> bytes:
    """Return a tree whose arrays are known to be finite."""
    refused: list[Exception] = []

    def drawn(value: Any) -> Any:
        try:
            return json.plain(value)
        except NotVerified as error:
            refused.append(error)
            raise

    try:
        return ormsgpack.packb(tree, default=drawn, option=_OPTION)
    except ormsgpack.MsgpackEncodeError:
        if refused:  # it was swallowed
            raise refused[0] from None
        raise


def dumps(value: Any) -> bytes:
    """Return a tree in one piece.

    Raises
    ------
    NotVerified
        An array holds NaN or infinity.
    """
    return b"".join(_pieces(value, ""))


def _pieces(value: Any, method: str) -> Iterator[bytes]:
    if isinstance(value, Drawn):
        yield from _samples(value)
    elif isinstance(value, np.ndarray) and value.ndim:
        refuse_infinite(method, value)
        yield from _rows(value)
    elif count(value) == 0:  # by way of JSON: what is null or a list there is one here
        yield ormsgpack.packb(orjson.loads(json.dumps(value)))
    elif isinstance(value, Mapping):
        yield _head(len(value), 0x80, b"\xde", b"\xdf")
        for name, entry in value.items():
            yield ormsgpack.packb(name)
            yield from _pieces(entry, method)
    else:
        yield _head(len(value), 0x90, b"\xdc", b"\xdd")
        for entry in value:
            yield from _pieces(entry, method)


def _head(length: int, few: int, some: bytes, many: bytes) -> bytes:
    """Return the head of an array or a map, in the shortest of its three forms."""
    if length < 16:
        return bytes([few + length])
    return some + length.to_bytes(2, "big") if length < 65536 else many + length.to_bytes(4, "big")


def _array_head(length: int) -> bytes:
    return _head(length, 0x90, b"\xdc", b"\xdd")


def _rows(array: Array) -> Iterator[bytes]:
    """Write an array, some rows at a time; a row that is long itself is written in pieces too."""
    yield _array_head(len(array))
    per_row = array[0].size if len(array) else 0
    if per_row > PIECE:
        for row in array:
            yield from _rows(row)
    elif per_row:
        step = PIECE // per_row
        for begin in range(0, len(array), step):
            yield _packed(array[begin : begin + step])
    else:
        yield from (ormsgpack.packb(row.tolist()) for row in array)


def _packed(rows: Array) -> bytes:
    """Return the entries of an array without its head."""
    packed = ormsgpack.packb(np.ascontiguousarray(rows), option=ormsgpack.OPT_SERIALIZE_NUMPY)
    return packed[len(_array_head(len(rows))) :]


def _samples(drawn: Drawn) -> Iterator[bytes]:
    yield _head(1 + len(ORDERS), 0x80, b"\xde", b"\xdf") + ormsgpack.packb("time")
    yield from _rows(drawn.times)
    for order, name in enumerate(ORDERS):
        yield ormsgpack.packb(name) + _array_head(len(drawn.times))
        for begin, end in drawn.slices(drawn.dims):
            yield _packed(drawn.order(order, begin, end))
