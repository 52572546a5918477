"""Numba kernels: contiguous float64 arrays in, arrays out; no classes, no options."""

import hashlib
from pathlib import Path


def _drop_stale() -> None:
    """Delete compiled kernels that were made from other sources than these.

    Numba looks at a kernel's own file only, not at those of what it calls: after a change there it would run old code.
    """
    here = Path(__file__).parent
    cache = here / "__pycache__"
    now = hashlib.sha256(b"".join(p.read_bytes() for p in sorted(here.glob("*.py")))).hexdigest()
    stamp = cache / "sources.sha256"
    try:
        if stamp.exists() and stamp.read_text() == now:
            return
        for compiled in (*cache.glob("*.nbi"), *cache.glob("*.nbc")):
            compiled.unlink(missing_ok=True)
        cache.mkdir(exist_ok=True)
        stamp.write_text(now)
    except OSError:  # a folder that cannot be written to: then Numba keeps its files elsewhere, by this folder's path
        return


_drop_stale()
