"""``?shape=ruckig``: a body with the names of ruckig's InputParameter, which ``planner.compat`` reads."""

from typing import Annotated, Literal

from pydantic import Field

from planner.compat import NAMES, own_names, plan_fields

from .reading import parse
from .schemas import Body, Gaps, Included, Matrix, Number, PlanBody, SamplingBody, Seconds, Vector

__all__ = ["RuckigBody", "own_names", "to_plan"]

GapRows = Annotated[list[Gaps], Field(fail_fast=True)]


class RuckigBody(Body):
    """The names of ruckig's InputParameter; null or absent stands for ruckig's default."""

    degrees_of_freedom: Annotated[int, Field(strict=True, ge=1)] | None = Field(None, description="Number of joints")
    current_position: Vector = Field(description="D positions at the start")
    current_velocity: Vector | None = Field(None, description="D velocities at the start, unit/s")
    current_acceleration: Vector | None = Field(None, description="D accelerations at the start, unit/s²")
    target_position: Vector = Field(description="D positions at the end")
    target_velocity: Vector | None = Field(None, description="D velocities at the end, unit/s")
    target_acceleration: Vector | None = Field(None, description="D accelerations at the end, unit/s²")
    intermediate_positions: Matrix | None = Field(None, description="Positions to pass between start and end")
    max_velocity: Gaps | None = Field(None, description="D velocity limits, unit/s; null: unlimited")
    max_acceleration: Gaps | None = Field(None, description="D acceleration limits, unit/s²; null: unlimited")
    max_jerk: Gaps | None = Field(None, description="D jerk limits, unit/s³; null: unlimited")
    min_velocity: Gaps | None = Field(None, description="D lower velocity limits, < 0; default -max_velocity")
    min_acceleration: Gaps | None = Field(None, description="D lower limits, < 0; default -max_acceleration")
    max_position: Gaps | None = Field(None, description="D upper position limits")
    min_position: Gaps | None = Field(None, description="D lower position limits")
    per_section_max_velocity: GapRows | None = Field(
        None, description="Velocity limits of each section, in place of max_velocity; null: max_velocity"
    )
    per_section_max_acceleration: GapRows | None = Field(None, description="Acceleration limits of each section")
    per_section_max_jerk: GapRows | None = Field(None, description="Jerk limits of each section")
    per_section_min_velocity: GapRows | None = Field(None, description="Lower velocity limits of each section")
    per_section_min_acceleration: GapRows | None = Field(None, description="Lower acceleration limits of each section")
    per_section_max_position: GapRows | None = Field(None, description="Upper position limits of each section")
    per_section_min_position: GapRows | None = Field(None, description="Lower position limits of each section")
    per_section_minimum_duration: Annotated[list[Seconds | None], Field(fail_fast=True)] | None = Field(
        None, description="Shortest duration of each section, s"
    )
    minimum_duration: Seconds | None = Field(None, description="Shortest duration of the whole, s")
    enabled: Annotated[list[Literal[True]], Field(fail_fast=True)] | None = Field(
        None, description="All true: every joint moves"
    )
    control_interface: Literal["position"] | None = Field(None, description="position only")
    synchronization: Literal["time"] | None = Field(None, description="time only: all joints arrive together")
    duration_discretization: Literal["continuous"] | None = Field(None, description="continuous only")
    per_dof_control_interface: Annotated[list[Literal["position"]], Field(fail_fast=True)] | None = Field(
        None, description="All position"
    )
    per_dof_synchronization: Annotated[list[Literal["time"]], Field(fail_fast=True)] | None = Field(
        None, description="All time"
    )
    interrupt_calculation_duration: Number | None = Field(
        None, description="null only: a calculation cannot be interrupted and still answer; see timeout"
    )
    sampling: SamplingBody | None = Field(None, description="Where to sample the answer; by default 200 samples")
    include: Annotated[list[Included], Field(max_length=16)] | None = Field(None, description="As in a plan request")
    timeout: Seconds | None = Field(None, description="The caller's own limit on the computing time, s")


def to_plan(body: RuckigBody) -> PlanBody:
    """Return the plan request that says the same: method ``auto``, without a jerk limit ``ruckig``.

    There ``auto`` would pick a method on a path, which honours no end states.

    Raises
    ------
    InvalidRequest
        With pointers to the names of this body.
    """
    fields = plan_fields({name: getattr(body, name) for name in (*NAMES, "timeout")})
    method = "auto" if "jerk" in fields.get("limits", {}) else "ruckig"
    return parse(PlanBody, {**fields, "method": method, "sampling": body.sampling, "include": body.include})
