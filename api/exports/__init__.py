"""Files of the command line: the service's formats and some that no service has. One file a format, and one row."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ..draft import Draft
from ..formats import FORMATS, installed
from . import cdr, html, mcap, png, urscript


@dataclass(frozen=True)
class Export:
    """What writes the files of an ending.

    ``samples`` tells whether it needs samples; ``library`` is what must be installed, ``extra`` what brings it.
    """

    suffix: str
    write: Callable[[Draft], Iterator[bytes]]
    samples: bool = True
    library: str | None = None
    extra: str = "formats"

    @property
    def missing(self) -> bool:
        """Whether the library it needs is not installed."""
        return self.library is not None and not installed(self.library)


_ROWS = (
    *(Export(row.suffix, row.write, row.samples, row.library, row.extra) for row in FORMATS.values()),
    Export(".png", png.write, library="matplotlib", extra="plot"),
    Export(".html", html.write, library="plotly"),
    Export(".urscript", urscript.write),
    Export(".cdr", cdr.write, library="rosbags"),
    Export(".mcap", mcap.write, library="rosbags"),
)

#: By the file's ending.
EXPORTS = {row.suffix: row for row in _ROWS}


def export_of(name: str) -> Export | None:
    """Return what writes a file of that name, by its longest ending."""
    fitting = [suffix for suffix in EXPORTS if name.lower().endswith(suffix)]
    return EXPORTS[max(fitting, key=len)] if fitting else None
