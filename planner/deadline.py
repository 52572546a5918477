"""How much of the caller's time is left."""

import time
from dataclasses import dataclass, field

from .errors import TimeLimit


@dataclass(frozen=True)
class Deadline:
    """A time limit in s (None: none), counted from the object's making."""

    seconds: float | None
    started: float = field(default_factory=time.perf_counter)

    def left(self) -> float | None:
        """Return the seconds left.

        Raises
        ------
        TimeLimit
            None are.
        """
        if self.seconds is None:
            return None
        remaining = self.seconds - (time.perf_counter() - self.started)
        if remaining <= 0:
            raise TimeLimit(self.seconds)
        return remaining
