"""What a client gets back: a plan as NumPy arrays."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner import Samples, Trajectory

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Result:
    """A certified trajectory from the service.

    ``waypoint_times`` (N,) in s; ``samples`` with ``time`` (M,) and ``position``, ``velocity``, ``acceleration``,
    ``jerk`` (M, D); ``polynomial`` the exact pieces; both None where they were not included. ``certificate`` and
    ``solver`` are as in the HTTP contract.
    """

    method: str
    duration: float
    waypoint_times: Array | None
    samples: Samples | None
    polynomial: Trajectory | None
    certificate: Mapping[str, Any]
    solver: Mapping[str, Any]
    warnings: tuple[Mapping[str, str], ...]
    digest: str
    picked_because: str | None = None

    @classmethod
    def of(cls, answer: Mapping[str, Any]) -> "Result":
        """Read a plan answer."""
        times = answer["waypoint_times"]
        return cls(
            method=answer["method"],
            duration=answer["duration"],
            waypoint_times=None if times is None else np.array(times, dtype=np.float64),
            samples=read_samples(answer.get("samples")),
            polynomial=read_polynomial(answer.get("polynomial")),
            certificate=answer["certificate"],
            solver=answer["solver"],
            warnings=tuple(answer["warnings"]),
            digest=answer["digest"],
            picked_because=answer.get("picked_because"),
        )

    def plot(self) -> Any:
        """Return a matplotlib figure: position, velocity, acceleration and jerk over time, a line per joint.

        Raises
        ------
        ValueError
            The answer holds no samples.
        """
        if self.samples is None:
            raise ValueError("the answer holds no samples; ask for include=('samples',)")
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8, 9), layout="constrained")
        panels = figure.subplots(4, 1, sharex=True)
        for panel, name in zip(panels, ("position", "velocity", "acceleration", "jerk"), strict=True):
            values = getattr(self.samples, name)
            for joint in range(values.shape[1]):
                panel.plot(self.samples.time, values[:, joint], label=f"joint {joint}", linewidth=1.2)
            panel.set_ylabel(name)
            panel.grid(alpha=0.3)
        if self.waypoint_times is not None and self.polynomial is not None:
            at = self.waypoint_times
            panels[0].plot(at, self.polynomial(at), "k.", markersize=5)
        panels[0].legend(loc="best", fontsize="small")
        panels[0].set_title(f"{self.method}, {self.duration:.4g} s")
        panels[-1].set_xlabel("time, s")
        return figure


def read_polynomial(tree: Mapping[str, Any] | None) -> Trajectory | None:
    """Return the exact pieces of an answer as a trajectory."""
    return None if tree is None else Trajectory.from_powers(tree["breaks"], tree["coefficients"], tree.get("weights"))


def read_samples(tree: Mapping[str, Any] | None) -> Samples | None:
    """Return the samples of an answer as arrays."""
    if tree is None:
        return None
    names = ("time", "position", "velocity", "acceleration", "jerk")
    return Samples(*(np.array(tree[name], dtype=np.float64) for name in names))
