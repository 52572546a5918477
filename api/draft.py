"""An answer before it is encoded: everything but the samples, which are drawn from the trajectory as they are written.

A draft is small whatever it will become: it crosses from a solver's process to the service's in a fraction of a
millisecond, and a million samples are never in memory at once.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner import NotVerified, Samples, Trajectory

Array = NDArray[np.float64]

#: Numbers that are written in one go, some 2 MB of JSON in some 4 ms; what holds more is written in pieces.
WHOLE = 100_000

#: Numbers of a piece: some 0.7 ms.
PIECE = 16_384

ORDERS = ("position", "velocity", "acceleration", "jerk")


@dataclass(frozen=True, eq=False)
class Drawn:
    """Samples of a trajectory at the times (M,), drawn when they are asked for."""

    trajectory: Trajectory
    times: Array
    method: str

    @property
    def dims(self) -> int:
        """Number of joints, D."""
        return self.trajectory.dims

    @property
    def numbers(self) -> int:
        """How many numbers the samples are."""
        return len(self.times) * (1 + len(ORDERS) * self.dims)

    def part(self, begin: int = 0, end: int | None = None) -> Samples:
        """Return the samples begin … end - 1.

        Raises
        ------
        NotVerified
            A number is not finite: NaN and infinity never get out.
        """
        times = self.times[begin:end]
        states = self.trajectory.states(times, len(ORDERS))
        if not np.isfinite(states).all():
            raise not_finite(self.method)
        return Samples(times, *states)

    def order(self, order: int, begin: int, end: int) -> Array:
        """Return one derivative (end - begin, D) of the samples begin … end - 1.

        Raises
        ------
        NotVerified
            A number is not finite.
        """
        found: Array = getattr(self.part(begin, end), ORDERS[order])  # drawn alone, the last digit may differ
        return found

    def slices(self, per_sample: int) -> Iterator[tuple[int, int]]:
        """Return the ranges of samples that make pieces, where a sample has so many numbers."""
        step = max(1, PIECE // per_sample)
        for begin in range(0, len(self.times), step):
            yield begin, min(begin + step, len(self.times))

    def check(self) -> None:
        """Raise NotVerified if a number is not finite; holds a piece of them at a time."""
        for begin, end in self.slices(len(ORDERS) * self.dims):
            self.part(begin, end)


@dataclass(frozen=True, eq=False)
class Draft:
    """What an answer says.

    Parameters
    ----------
    tree
        As the HTTP contract names it: JSON-ready, with NumPy arrays and, where samples are asked for, ``Drawn``.
    seconds
        Spent on each stretch of the road here.
    method, waypoints, joints
        What was solved, for logs and metrics; None and 0 where it is not one plan.
    joint_names, start
        For the formats of samples: names or None, and the clock at the first sample, s.
    """

    tree: Mapping[str, Any]
    seconds: Mapping[str, float] = field(default_factory=dict)
    method: str | None = None
    waypoints: int = 0
    joints: int = 0
    joint_names: tuple[str, ...] | None = None
    start: float = 0.0

    @property
    def drawn(self) -> Drawn | None:
        """The samples of a plan; None where they are not included."""
        found = self.tree.get("samples")
        return found if isinstance(found, Drawn) else None

    @cached_property
    def numbers(self) -> int:
        """How many numbers its arrays and samples are."""
        return count(self.tree)


def count(value: Any) -> int:
    """Return how many numbers the arrays and samples in a tree of dicts, lists and tuples are."""
    kind = type(value)
    if kind is dict:
        return sum([count(v) for v in value.values()])
    if kind is list or kind is tuple:
        return sum([count(v) for v in value])
    if kind is np.ndarray:
        return int(value.size)
    return value.numbers if isinstance(value, Drawn) else 0


def refuse_infinite(method: str, *arrays: Array) -> None:
    """Raise NotVerified if a number is not finite."""
    if not all(np.isfinite(array).all() for array in arrays):
        raise not_finite(method)


def not_finite(method: str) -> NotVerified:
    """Return the error for an answer that holds NaN or infinity."""
    return NotVerified(method, {"reason": "the answer holds a number that is not finite"})
