"""W3C Trace Context, level 1: the caller's ``traceparent`` is read strictly, and what is not valid is ignored."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from random import getrandbits

#: Version, trace id, span id, flags, and what a later version may add.
_SHAPE = re.compile(rb"([0-9a-f]{2})-([0-9a-f]{32})-([0-9a-f]{16})-([0-9a-f]{2})(-.*)?")

#: The flags that version 00 knows: sampled, and random trace id (level 2). Others must not be passed on.
_KNOWN_FLAGS = 0x03


@dataclass(frozen=True)
class Trace:
    """A trace that a caller began.

    Parameters
    ----------
    trace_id, parent_id
        Hexadecimal.
    flags
        Of its caller, as far as they are known.
    """

    trace_id: str
    parent_id: str
    flags: int

    def response(self, span_id: str) -> bytes:
        """Return the value of ``traceresponse``: the same trace, our own span."""
        return f"00-{self.trace_id}-{span_id}-{self.flags:02x}".encode()


def incoming(headers: Iterable[tuple[bytes, bytes]]) -> Trace | None:
    """Return the trace that the headers name; None if they name none, several, or none that is valid."""
    found = [value for name, value in headers if name == b"traceparent"]
    return parse(found[0]) if len(found) == 1 else None


def parse(value: bytes) -> Trace | None:
    """Return what a ``traceparent`` says, None if it is not valid.

    A later version is read as far as it looks like version 00; version ff and ids of zeros only are not valid.
    """
    match = _SHAPE.fullmatch(value.strip(b" \t"))
    if match is None:
        return None
    version, trace_id, parent_id, flags, more = match.groups()
    if version == b"ff" or (version == b"00" and more is not None):
        return None
    if not trace_id.strip(b"0") or not parent_id.strip(b"0"):
        return None
    return Trace(trace_id.decode(), parent_id.decode(), int(flags, 16) & _KNOWN_FLAGS)


def new_span_id() -> str:
    """Return an id for a span of ours; never zeros only."""
    return f"{getrandbits(64) or 1:016x}"
