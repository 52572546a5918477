"""JSON (RFC 8259): in one go, or in pieces where the answer is large."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from planner import PlannerError

from ..draft import ORDERS, PIECE, WHOLE, Draft, Drawn, count

Array = NDArray[np.float64]


#: Without the second, samples would be written as the dataclass they are.
_OPTION = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_PASSTHROUGH_DATACLASS


def dumps(value: Any) -> bytes:
    """Return compact JSON; NumPy arrays and scalars are written as they are.

    Raises
    ------
    NotVerified
        Samples hold NaN or infinity.
    """
    try:
        return orjson.dumps(value, option=_OPTION, default=plain)
    except TypeError as error:  # orjson has its own in place of what samples raise
        if isinstance(error.__cause__, PlannerError):
            raise error.__cause__ from None
        raise


def plain(value: Any) -> Any:
    """Return what orjson cannot write by itself as something it can: arrays not contiguous, samples, sets, models."""
    if isinstance(value, Drawn):
        samples = value.part()
        return {"time": samples.time, **{name: getattr(samples, name) for name in ORDERS}}
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    if isinstance(value, (set, frozenset)):
        return sorted(value)
    if hasattr(value, "model_dump"):
        return value.model_dump()
    raise TypeError(f"{type(value).__name__} has no JSON form")


def write(draft: Draft) -> Iterator[bytes]:
    """Write a draft as the contract's tree."""
    return tree_pieces(draft.tree, draft.numbers)


def tree_pieces(tree: Any, numbers: int | None = None) -> Iterator[bytes]:
    """Write a tree; pieces are of some hundred kB."""
    if (count(tree) if numbers is None else numbers) <= WHOLE:
        yield dumps(tree)
    else:
        yield from _pieces(tree)


def _pieces(value: Any) -> Iterator[bytes]:
    if isinstance(value, Drawn):
        yield from _samples(value)
    elif isinstance(value, np.ndarray) and value.size > PIECE:
        yield from _rows(value)
    elif isinstance(value, Mapping) and count(value) > PIECE:
        for i, (name, entry) in enumerate(value.items()):
            yield (b"," if i else b"{") + dumps(name) + b":"
            yield from _pieces(entry)
        yield b"}"
    elif isinstance(value, (list, tuple)) and count(value) > PIECE:
        for i, entry in enumerate(value):
            yield b"," if i else b"["
            yield from _pieces(entry)
        yield b"]"
    else:
        yield dumps(value)


def _rows(array: Array) -> Iterator[bytes]:
    """Write an array, some rows at a time; a row that is long itself is written in pieces too."""
    per_row = array[0].size
    if per_row > PIECE:
        for i, row in enumerate(array):
            yield b"," if i else b"["
            yield from _rows(row)
    else:
        step = PIECE // per_row
        for begin in range(0, len(array), step):
            yield (b"," if begin else b"[") + dumps(np.ascontiguousarray(array[begin : begin + step]))[1:-1]
    yield b"]"


def _samples(drawn: Drawn) -> Iterator[bytes]:
    yield b'{"time":'
    yield from _pieces(drawn.times)
    for order, name in enumerate(ORDERS):
        yield b"," + dumps(name) + b":"
        for begin, end in drawn.slices(drawn.dims):
            yield (b"," if begin else b"[") + dumps(drawn.order(order, begin, end))[1:-1]
        yield b"]"
    yield b"}"
