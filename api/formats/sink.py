"""What libraries that write to files write to here: the bytes are taken away as they come."""

from typing import Any


class Sink:
    """A file that can only be written to; it cannot seek, so nothing written is changed later."""

    closed = False

    def __init__(self) -> None:
        self._parts: list[bytes] = []

    def write(self, data: Any) -> int:
        """Keep some bytes until they are taken."""
        part = bytes(data)
        self._parts.append(part)
        return len(part)

    def flush(self) -> None:
        """Do nothing: there is nowhere to flush to."""

    def close(self) -> None:
        """Do nothing: what was written is still to be taken."""

    def take(self) -> bytes:
        """Return what was written since it was last asked."""
        taken = b"".join(self._parts)
        self._parts.clear()
        return taken
