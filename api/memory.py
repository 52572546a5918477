"""Memory that large bodies needed goes back to the system (GNU C library; elsewhere nothing is done)."""

import ctypes
from contextlib import suppress

#: Parameters of mallopt(3).
_TRIM_THRESHOLD, _MMAP_THRESHOLD, _ARENA_MAX = -1, -3, -8

#: Bytes from which a block is mapped by itself, and unmapped when it is freed: more than an ordinary answer, whose
#: every page would be a fault, half a millisecond in all. Left alone, the library raises this with every such block up
#: to 32 MiB, and keeps what is below in heaps that seldom shrink.
LARGE = 2 * 1024 * 1024

#: Bytes that may stay free at the end of a heap, for the next answer.
KEPT = 4 * 1024 * 1024

#: Heaps: each thread that handles a large body would otherwise have one of its own.
HEAPS = 2


def give_back() -> None:
    """Set up the process' allocator."""
    with suppress(OSError, AttributeError, TypeError):
        library = ctypes.CDLL(None)
        library.mallopt(_MMAP_THRESHOLD, LARGE)
        library.mallopt(_TRIM_THRESHOLD, KEPT)
        library.mallopt(_ARENA_MAX, HEAPS)
