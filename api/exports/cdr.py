"""A ROS 2 message, trajectory_msgs/msg/JointTrajectory, as it goes over the wire: CDR, little-endian."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..draft import Draft
from ..formats.ros2 import names_of
from ..formats.samples import nanoseconds, samples_of

MESSAGE = "trajectory_msgs/msg/JointTrajectory"


def write(draft: Draft) -> Iterator[bytes]:
    """Write the serialized message."""
    yield bytes(message(draft)[1])


def message(draft: Draft) -> tuple[Any, bytes]:
    """Return the type store that knows the message, and the message.

    Raises
    ------
    InvalidRequest
        Two samples fall on the same nanosecond, or one lies beyond the 2^31 s that the message can hold.
    """
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)  # the message has not changed since
    types = store.types
    point = types["trajectory_msgs/msg/JointTrajectoryPoint"]
    duration = types["builtin_interfaces/msg/Duration"]
    times, part = nanoseconds(draft), samples_of(draft).part()
    seconds, nanosec = np.divmod(times, 1_000_000_000)
    nothing = np.empty(0)
    points = [
        point(
            positions=part.position[k],
            velocities=part.velocity[k],
            accelerations=part.acceleration[k],
            effort=nothing,
            time_from_start=duration(sec=int(seconds[k]), nanosec=int(nanosec[k])),
        )
        for k in range(len(times))
    ]
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="")
    built = types[MESSAGE](header=header, joint_names=names_of(draft), points=points)
    return store, bytes(store.serialize_cdr(built, MESSAGE))
