"""Formats of an answer: a format is one file and one row.

``write(draft)`` gives the bytes in pieces; what it refuses, it refuses before the first of them.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec

from ..draft import Draft
from ..media import ARROW, CSV, JSON, MSGPACK, NPZ, PLOTLY, ROS2
from . import arrow, csv, json, msgpack, npz, plotly, ros2


@dataclass(frozen=True)
class Format:
    """A format: its media type, the ending of files, and what writes it.

    ``samples`` tells whether it holds nothing but samples, so that an answer without them has no such form;
    ``any_tree`` whether it holds what is no plan too; ``library`` is what must be installed for it, and ``extra`` what
    brings it.
    """

    media_type: str
    suffix: str
    write: Callable[[Draft], Iterator[bytes]]
    says: str
    samples: bool = True
    any_tree: bool = False
    library: str | None = None
    extra: str = "formats"

    @property
    def available(self) -> bool:
        """Whether the library it needs is installed."""
        return self.library is None or installed(self.library)


@cache
def installed(library: str) -> bool:
    """Tell whether a library is there, without importing it."""
    return find_spec(library) is not None


_ROWS = (
    Format(JSON, ".json", json.write, "The answer", samples=False, any_tree=True),
    Format(MSGPACK, ".msgpack", msgpack.write, "The answer in MessagePack", samples=False, any_tree=True),
    Format(CSV, ".csv", csv.write, "Header `time,position_1,…,velocity_1,…`, a row per sample"),
    Format(
        ARROW,
        ".arrow",
        arrow.write,
        "An Arrow IPC stream: a row per sample, the rest of the answer as JSON in the schema's metadata `waywright`",
        library="pyarrow",
    ),
    Format(
        NPZ,
        ".npz",
        npz.write,
        "NumPy arrays: the samples and the polynomial, as included, and the rest as JSON in the string `answer`",
        samples=False,
    ),
    Format(ROS2, ".ros2.json", ros2.write, "A trajectory_msgs/JointTrajectory, times strictly increasing"),
    Format(PLOTLY, ".plotly.json", plotly.write, "A Plotly figure of the samples"),
)

#: By media type, the default first.
FORMATS = {row.media_type: row for row in _ROWS}


def offered(whole: bool = True) -> tuple[str, ...]:
    """Return the media types that can be answered here, the default first; not ``whole``: those of any tree."""
    return tuple(name for name, row in FORMATS.items() if row.available and (whole or row.any_tree))


def written(draft: Draft, media_type: str) -> bytes:
    """Return an answer in one piece."""
    return b"".join(FORMATS[media_type].write(draft))


def encoded(tree: object, media_type: str) -> bytes:
    """Return any data in one of the formats that any data comes in."""
    return msgpack.dumps(tree) if media_type == MSGPACK else json.dumps(tree)
