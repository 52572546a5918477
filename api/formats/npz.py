"""NumPy's .npz: the samples and the polynomial as arrays, the rest of the answer as a JSON string. No pickle."""

import io
import zipfile
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..draft import ORDERS, PIECE, Draft, Drawn
from .samples import rest
from .sink import Sink

#: (1980, 1, 1): the first day that a zip file knows, so that the same request gives the same bytes.
_EPOCH = (1980, 1, 1, 0, 0, 0)


def write(draft: Draft) -> Iterator[bytes]:
    """Write an array per file of the archive, not compressed."""
    sink = Sink()
    with zipfile.ZipFile(sink, "w", zipfile.ZIP_STORED) as archive:
        for name, kind, shape, chunks in _members(draft):
            info = zipfile.ZipInfo(f"{name}.npy", _EPOCH)
            info.create_system = 3  # the same on every system
            with archive.open(info, "w") as member:
                member.write(_header(kind, shape))
                for chunk in chunks:
                    member.write(chunk)
                    yield sink.take()
    yield sink.take()


def _members(draft: Draft) -> Iterator[tuple[str, str, tuple[int, ...], Iterator[bytes]]]:
    """Return name, type, shape and bytes of each array."""
    drawn = draft.drawn
    if drawn is not None:
        length = len(drawn.times)
        yield "time", "<f8", (length,), _flat(drawn.times)
        for order, name in enumerate(ORDERS):
            yield name, "<f8", (length, drawn.dims), _drawn(drawn, order)
    for name, array in draft.tree.get("polynomial", {}).items():
        yield name, "<f8", array.shape, _flat(array)
    text = rest(draft, "samples", "polynomial").decode()
    yield "answer", f"<U{len(text)}", (), iter([text.encode("utf-32-le")])


def _header(kind: str, shape: tuple[int, ...]) -> bytes:
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": kind, "fortran_order": False, "shape": shape})
    return header.getvalue()


def _flat(array: NDArray[np.float64]) -> Iterator[bytes]:
    numbers = np.ascontiguousarray(array, dtype="<f8").reshape(-1)
    for begin in range(0, len(numbers), PIECE):
        yield numbers[begin : begin + PIECE].tobytes()


def _drawn(drawn: Drawn, order: int) -> Iterator[bytes]:
    for begin, end in drawn.slices(drawn.dims):
        yield np.ascontiguousarray(drawn.order(order, begin, end), dtype="<f8").tobytes()
