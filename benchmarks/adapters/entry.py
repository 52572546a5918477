"""What an adapter hands over."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner import Trajectory

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Answer:
    """An answer in our own type, exactly as the peer gave it; ``waypoint_times`` is when it passes the waypoints."""

    trajectory: Trajectory
    waypoint_times: Array | None


@dataclass(frozen=True)
class Entry:
    """One way to answer a problem.

    ``run`` is timed and returns what the package returns; ``read`` is not timed and makes an ``Answer`` of it.
    ``solving`` tells the seconds spent on the answer itself where the run also checks it.
    """

    name: str
    package: str
    run: Callable[[], Any]
    read: Callable[[Any], Answer]
    solving: Callable[[Any], float] | None = None
