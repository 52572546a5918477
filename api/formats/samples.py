"""What the formats that hold samples share."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from planner import InvalidRequest

from ..draft import ORDERS, Draft, Drawn
from .json import dumps


def samples_of(draft: Draft) -> Drawn:
    """Return the samples of a draft that includes them."""
    drawn = draft.drawn
    assert drawn is not None, "a format of samples is refused where none are included"
    return drawn


def columns(draft: Draft) -> list[str]:
    """Return the names of a row's numbers: time, then each order of every joint."""
    names = draft.joint_names or [str(i + 1) for i in range(samples_of(draft).dims)]
    return ["time"] + [f"{order}_{name}" for order in ORDERS for name in names]


def matrices(draft: Draft) -> Iterator[NDArray[np.float64]]:
    """Return the samples as rows of the columns, some at a time."""
    drawn = samples_of(draft)
    for begin, end in drawn.slices(1 + len(ORDERS) * drawn.dims):
        part = drawn.part(begin, end)
        yield np.column_stack([part.time, *(getattr(part, order) for order in ORDERS)])


def rest(draft: Draft, *without: str) -> bytes:
    """Return the answer's tree as JSON, without some of its fields."""
    return dumps({name: entry for name, entry in draft.tree.items() if name not in without})


def nanoseconds(draft: Draft) -> NDArray[np.int64]:
    """Return the times of a ROS 2 message (K,), in ns from the trajectory's start, increasing strictly.

    A hold without duration has two equal samples and one time: K = 1.

    Raises
    ------
    InvalidRequest
        Two samples fall on the same nanosecond, or one lies beyond the 2^31 s that the message can hold.
    """
    elapsed = samples_of(draft).times - draft.start
    if elapsed[-1] >= 2**31:
        raise InvalidRequest.of("/sampling", "out_of_range", "a ROS 2 duration holds less than 2^31 s")
    times = np.round(elapsed * 1e9).astype(np.int64)
    if len(times) == 2 and elapsed[0] == elapsed[1]:  # a hold without duration
        return times[:1]
    if not (np.diff(times) > 0).all():
        raise InvalidRequest.of("/sampling", "out_of_range", "ROS 2 counts nanoseconds: samples must be further apart")
    return times
