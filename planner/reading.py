"""Checked conversion of what a caller sends into arrays; every finding names its field by a JSON pointer."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .errors import FieldError, InvalidRequest
from .options import MAX_VALUE

Array = NDArray[np.float64]
T = TypeVar("T")


class Findings:
    """Collects the findings of several readers, so that a caller hears of all of them at once."""

    def __init__(self) -> None:
        self.errors: list[FieldError] = []

    def take(self, reader: Callable[..., T], *args: Any) -> T | None:
        """Return ``reader(*args)``, or None after noting why it refused."""
        try:
            return reader(*args)
        except InvalidRequest as error:
            self.errors.extend(error.errors)
            return None

    def close(self) -> None:
        """Raise what was found, if anything."""
        if self.errors:
            raise InvalidRequest(self.errors)


def number(value: Any, field: str, low: float = -MAX_VALUE, high: float = MAX_VALUE) -> float:
    """Return a finite number in [low, high]."""
    if isinstance(value, (bool, str)) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise InvalidRequest.of(field, "wrong_type", "must be a number")
    if not np.isfinite(value):
        raise InvalidRequest.of(field, "not_finite", "must be finite")
    if not low <= value <= high:
        raise InvalidRequest.of(field, "out_of_range", f"must lie in [{low:g}, {high:g}]")
    return float(value)


def vector(value: Any, field: str, size: int | None = None, largest: float = MAX_VALUE) -> Array:
    """Return a vector of finite numbers, of the given length if one is given."""
    array = _array(value, field, 1)
    if size is not None and len(array) != size:
        raise InvalidRequest.of(field, "shape_mismatch", f"needs {size} entries, has {len(array)}")
    return _bounded(array, field, largest)


def matrix(value: Any, field: str, columns: int | None = None, largest: float = MAX_VALUE) -> Array:
    """Return a matrix of finite numbers, row by row; rows must be of equal length. A vector is read as one column."""
    array = np.ascontiguousarray(_array(value, field, 2))  # kernels would be compiled anew for another layout
    if columns is not None and array.shape[1] != columns:
        raise InvalidRequest.of(field, "shape_mismatch", f"rows need {columns} entries, have {array.shape[1]}")
    return _bounded(array, field, largest)


def per_joint(value: Any, field: str, dims: int, missing: float) -> Array:
    """Return D entries from one number or D numbers, where ``None`` stands for ``missing``."""
    if isinstance(value, (int, float, np.number)) and not isinstance(value, bool):
        return np.full(dims, number(value, field))
    if isinstance(value, (str, Mapping)) or not isinstance(value, Iterable):
        raise InvalidRequest.of(field, "wrong_type", "must be a number or a list of numbers")
    entries = list(value)
    if len(entries) != dims:
        raise InvalidRequest.of(field, "shape_mismatch", f"needs {dims} entries, has {len(entries)}")
    read = [missing if e is None else number(e, f"{field}/{i}") for i, e in enumerate(entries)]
    return np.array(read, dtype=np.float64)


def increasing(array: Array, field: str) -> Array:
    """Return the vector if its entries increase strictly."""
    steps = array[1:] - array[:-1]
    if len(steps) and not (steps > 0).all():
        i = int(np.argmax(steps <= 0)) + 1
        word = "repeats" if steps[i - 1] == 0 else "falls below"
        raise InvalidRequest.of(f"{field}/{i}", "not_increasing", f"must increase, but {word} the entry before it")
    return array


def fields(value: Any, field: str, known: Iterable[str]) -> Mapping[str, Any]:
    """Return a mapping whose keys are all known."""
    if not isinstance(value, Mapping):
        raise InvalidRequest.of(field, "wrong_type", "must be an object")
    unknown = [str(k)[:60] for k in value if k not in set(known)]
    if unknown:
        raise InvalidRequest([FieldError(f"{field}/{k}", "unknown_field", "there is no such field") for k in unknown])
    return value


def _array(value: Any, field: str, ndim: int) -> Array:
    if isinstance(value, (str, Mapping)) or not isinstance(value, Iterable):
        raise InvalidRequest.of(field, "wrong_type", "must be a list of numbers")
    try:
        raw = np.asarray(value)
    except ValueError:
        _ragged(value, field)
        raise InvalidRequest.of(field, "shape_mismatch", "must be a matrix with rows of equal length") from None
    if raw.size and raw.dtype.kind not in "iuf":
        raise InvalidRequest.of(field, "wrong_type", "must hold numbers only")
    if ndim == 2 and raw.ndim == 1:
        raw = raw[:, None]
    if raw.ndim != ndim:
        raise InvalidRequest.of(field, "shape_mismatch", f"must have {ndim} dimension(s), has {raw.ndim}")
    return np.array(raw, dtype=np.float64)


def _ragged(value: Any, field: str) -> None:
    """Name the first row whose length differs from the first row's."""
    rows = list(value)
    sizes = [len(r) if hasattr(r, "__len__") else None for r in rows]
    for i, size in enumerate(sizes):
        if size != sizes[0]:
            raise InvalidRequest.of(f"{field}/{i}", "shape_mismatch", f"has {size} entries, the first has {sizes[0]}")


def _bounded(array: Array, field: str, largest: float) -> Array:
    if array.size and not np.abs(array).max() <= largest:  # so for NaN, too
        bad = ~(np.abs(array) <= largest)
        at = tuple(int(i) for i in np.argwhere(bad)[0])
        where = field + "".join(f"/{i}" for i in at)
        if not np.isfinite(array[at]):
            raise InvalidRequest.of(where, "not_finite", "must be finite")
        raise InvalidRequest.of(where, "out_of_range", f"must lie in [-{largest:g}, {largest:g}]")
    array.setflags(write=False)
    return array
