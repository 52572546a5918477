"""Method ``minimum_jerk``."""

from typing import Literal

from pydantic import Field

from ..curves.options import Spaced
from ..method import Capabilities, Method, Reference
from ..smoothing.minimum_jerk import minimum_jerk
from ..types import PlanRequest, Solution


class MinimumJerkOptions(Spaced):
    """Options of the minimum-jerk trajectory."""

    backend: Literal["auto", "piqp", "osqp"] = Field(
        default="auto",
        description="solver of the quadratic program: auto eliminates where no limit binds, else piqp, then osqp",
    )


def solve(request: PlanRequest, options: MinimumJerkOptions) -> Solution:
    """Return the quintic spline of least squared jerk through the waypoints at the given times."""
    return minimum_jerk(request, options.backend)


MINIMUM_JERK = Method(
    id="minimum_jerk",
    title="Minimum jerk",
    solve=solve,
    options=MinimumJerkOptions,
    family="smoothing",
    summary="The least squared jerk through the waypoints at given times, with limits that hold at all times.",
    formula="min ∫ ‖q'''‖² dt  s.t.  q(t_i) = q_i, end states, lower <= q, q', q'', q''' <= upper",
    reference=Reference(
        "T. Flash and N. Hogan",
        "The coordination of arm movements",
        1985,
        "https://doi.org/10.1523/JNEUROSCI.05-07-01688.1985",
    ),
    capabilities=lambda options: Capabilities(
        "given",
        2,
        requires=frozenset({"times"}),
        honours=frozenset(
            {
                "times",
                "position",
                "velocity",
                "acceleration",
                "jerk",
                "segment_limits",
                "segment_durations",
                "duration",
            }
        ),
        start=frozenset({"velocity", "acceleration"}),
        end=frozenset({"velocity", "acceleration"}),
    ),
    objective="squared_jerk",
)
