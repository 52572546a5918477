"""A trajectory_msgs/JointTrajectory as JSON, in the shape of rosbridge; times count from the trajectory's start."""

from collections.abc import Iterator

import numpy as np

from ..draft import ORDERS, Draft
from .json import dumps
from .samples import nanoseconds, samples_of


def write(draft: Draft) -> Iterator[bytes]:
    """Write the message.

    Raises
    ------
    InvalidRequest
        Two samples fall on the same nanosecond, or one lies beyond the 2^31 s that the message can hold.
    """
    drawn = samples_of(draft)
    times = nanoseconds(draft)
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    yield b'{"header":' + dumps(header) + b',"joint_names":' + dumps(names_of(draft)) + b',"points":['
    for begin, end in drawn.slices(4 * len(ORDERS) * drawn.dims):  # points cost more than plain rows
        part, stop = drawn.part(begin, end), min(end, len(times))
        seconds, nanosec = np.divmod(times[begin:stop], 1_000_000_000)
        rows = zip(
            *(getattr(part, order)[: stop - begin].tolist() for order in ORDERS[:3]),
            seconds.tolist(),
            nanosec.tolist(),
            strict=True,
        )
        points = [
            {"positions": p, "velocities": v, "accelerations": a, "time_from_start": {"sec": s, "nanosec": n}}
            for p, v, a, s, n in rows
        ]
        yield (b"," if begin else b"") + dumps(points)[1:-1]
    yield b"]}"


def names_of(draft: Draft) -> list[str]:
    """Return the joints' names; those that are not given are numbered from 1."""
    return list(draft.joint_names or (f"joint_{i + 1}" for i in range(draft.joints)))
