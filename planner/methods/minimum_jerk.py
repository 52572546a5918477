"""Method ``minimum_jerk``."""

from typing import Any, Literal

from pydantic import Field, model_validator

from ..curves.options import Spaced
from ..method import Capabilities, Method, Reference
from ..options import MAX_VALUE, Conflict
from ..smoothing.minimum_jerk import Smoothing, smoothest
from ..smoothing.timed import TIME_WEIGHT, freely_timed
from ..types import Minimised, PlanRequest, Solution

#: What is minimised by orders 2, 3 and 4.
OBJECTIVES = {2: "squared_acceleration", 3: "squared_jerk", 4: "squared_snap"}


class MinimumJerkOptions(Spaced):
    """Options of the minimum-jerk trajectory."""

    order: Literal[2, 3, 4] = Field(default=3, description="what is minimised: acceleration, jerk or snap, squared")
    ends: Literal["fixed", "free", "periodic"] = Field(
        default="fixed",
        description="derivatives at the ends: given (0 unless sent), left free, or the same at both",
    )
    free_times: bool = Field(
        default=False, description="choose the waypoints' times as well: the least cost plus time_weight * duration"
    )
    time_weight: float | None = Field(
        default=None,
        ge=0,
        le=MAX_VALUE,
        allow_inf_nan=False,
        description="what a second costs with free times; null: 1, but with limits the duration alone is minimised",
    )
    sub_segments: int | None = Field(
        default=None,
        ge=1,
        le=16,
        description="polynomials per gap; null: one, and 2 or 4 where fewer cannot keep the limits",
    )
    backend: Literal["auto", "interior_point", "clarabel", "piqp", "daqp", "osqp", "ipopt"] = Field(
        default="auto",
        description="solver of the quadratic program: auto eliminates where no limit binds, else takes the first of "
        "these that comes to an end; the norm of the velocity always takes clarabel. ipopt: for free times in limits",
    )

    @property
    def closed(self) -> bool:
        """Whether the ends are periodic."""
        return self.ends == "periodic"

    @model_validator(mode="after")
    def _agree(self) -> "MinimumJerkOptions":
        if not self.free_times and self.time_weight is not None:
            raise Conflict("time_weight counts with free_times only")
        if not self.free_times and self.backend == "ipopt":
            raise Conflict("ipopt solves for free_times only")
        if self.free_times and self.ends != "fixed":
            raise Conflict("free_times takes fixed ends only: others may let the times go to nothing")
        if self.free_times and self.sub_segments not in (None, 1):
            raise Conflict("free_times takes one polynomial per gap")
        return self


def solve(request: PlanRequest, options: MinimumJerkOptions) -> Solution:
    """Return the trajectory of least squared jerk (or acceleration, or snap) through the waypoints."""
    how = Smoothing(options.order, options.ends, options.sub_segments, options.backend)
    if options.free_times:
        return freely_timed(request, how, options.time_weight, OBJECTIVES[options.order])
    return smoothest(request, how)


def _capabilities(options: Any) -> Capabilities:
    rates = ("velocity", "acceleration", "jerk")
    taken = frozenset(rates[: options.order - 1] if options.ends == "fixed" else ())
    limits = {"position", *(rates if options.order > 2 else rates[:2]), "segment_limits"}
    honours = limits | {"segment_durations", "duration"}
    if options.free_times:
        return Capabilities("chosen", options.order - 1, honours=frozenset(honours), start=taken, end=taken)
    honours |= {"times", "velocity_norm", "waypoint_states", "waypoint_tolerance", "tube"}
    requires = frozenset({"times"})
    return Capabilities("given", options.order - 1, requires, frozenset(honours), start=taken, end=taken)


def _minimises(options: Any) -> Minimised:
    name, order = OBJECTIVES[options.order], options.order
    if not options.free_times:
        return Minimised(name, order)
    weight = TIME_WEIGHT if options.time_weight is None else options.time_weight
    return Minimised(f"{name}_plus_time", order, weight)


MINIMUM_JERK = Method(
    id="minimum_jerk",
    title="Minimum jerk",
    solve=solve,
    options=MinimumJerkOptions,
    family="smoothing",
    summary="The least squared jerk, acceleration or snap through the waypoints at given times, within limits and "
    "corridors that hold at all times.",
    formula="min ∫ ‖q^(k)‖² dt  s.t.  q(t_i) = q_i, end states, lower <= q, q', q'', q''' <= upper",
    reference=Reference(
        "T. Flash and N. Hogan",
        "The coordination of arm movements",
        1985,
        "https://doi.org/10.1523/JNEUROSCI.05-07-01688.1985",
    ),
    capabilities=_capabilities,
    objective="squared_jerk",
    minimises=_minimises,
    variants=({"order": 2}, {"order": 4}, {"ends": "free"}, {"ends": "periodic"}, {"free_times": True}),
)
