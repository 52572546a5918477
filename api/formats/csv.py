"""CSV (RFC 4180, lines end in LF): a header, then a row per sample, with the shortest digits that read back equal."""

from collections.abc import Iterator

from ..draft import Draft
from .json import dumps
from .samples import columns, matrices


def write(draft: Draft) -> Iterator[bytes]:
    """Write time, then position, velocity, acceleration and jerk of every joint."""
    yield ",".join(_quoted(name) for name in columns(draft)).encode() + b"\n"
    for matrix in matrices(draft):
        yield dumps(matrix)[2:-2].replace(b"],[", b"\n") + b"\n"


def _quoted(name: str) -> str:
    """Return a field, in quotes only where it must be."""
    return '"' + name.replace('"', '""') + '"' if any(c in name for c in ',"\r\n') else name
