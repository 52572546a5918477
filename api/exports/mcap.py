"""A recording for ``ros2 bag play`` and for viewers: the message in one MCAP file."""

import tempfile
from collections.abc import Iterator
from pathlib import Path

from ..draft import Draft
from .cdr import MESSAGE, message

#: Where a joint trajectory controller listens by default.
TOPIC = "/joint_trajectory_controller/joint_trajectory"


def write(draft: Draft) -> Iterator[bytes]:
    """Write the file; its one message is stamped 0, so that the same request gives the same bytes."""
    from rosbags.rosbag2 import StoragePlugin, Writer

    store, raw = message(draft)
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / "waywright"  # the library writes a folder; the file in it says all
        with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            connection = writer.add_connection(TOPIC, MESSAGE, typestore=store)
            writer.write(connection, 0, raw)
        yield (bag / "waywright.mcap").read_bytes()
