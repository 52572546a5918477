"""The bodies of requests as pydantic models; they are also the OpenAPI document's schemas.

Shapes and types are judged here; whether the parts fit together is the planner's to say (``PlanRequest.of``).
"""

from itertools import islice
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator

from planner import MAX_TIME, MAX_VALUE

#: More keys than any object of ours has; what lies beyond is not even listed as unknown.
_MOST_KEYS = 1000

Number = Annotated[float, Field(strict=True, ge=-MAX_VALUE, le=MAX_VALUE, allow_inf_nan=False)]
Time = Annotated[float, Field(strict=True, ge=-MAX_TIME, le=MAX_TIME, allow_inf_nan=False)]
Seconds = Annotated[float, Field(strict=True, ge=0, le=MAX_TIME, allow_inf_nan=False)]
Coefficient = Annotated[float, Field(strict=True, ge=-1e100, le=1e100, allow_inf_nan=False)]
Text = Annotated[str, Field(strict=True, max_length=200)]

Names = Annotated[list[Text], Field(fail_fast=True)]

Vector = Annotated[list[Number], Field(fail_fast=True)]
Times = Annotated[list[Time], Field(fail_fast=True)]
Matrix = Annotated[list[Vector], Field(fail_fast=True)]
Gaps = Annotated[list[Number | None], Field(fail_fast=True)]


def _kind(value: Any) -> str:
    return "#list" if isinstance(value, list) else "#number"


def _limit_kind(value: Any) -> str:
    return "#range" if isinstance(value, (dict, LimitRange)) else _kind(value)


PerJoint = Annotated[
    Annotated[Number, Tag("#number")] | Annotated[Gaps, Tag("#list")],
    Discriminator(_kind),
]


Flag = Annotated[bool, Field(strict=True)]
Flags = Annotated[
    Annotated[Flag, Tag("#flag")] | Annotated[list[Flag], Field(fail_fast=True), Tag("#list")],
    Discriminator(lambda value: "#list" if isinstance(value, list) else "#flag"),
]


class Body(BaseModel):
    """Base of all bodies: frozen, and with no field that is not declared."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @model_validator(mode="before")
    @classmethod
    def _bounded(cls, data: Any) -> Any:
        """Keep the work on an object of a million unknown keys small; it is refused all the same."""
        return dict(islice(data.items(), _MOST_KEYS)) if isinstance(data, dict) and len(data) > _MOST_KEYS else data


class LimitRange(Body):
    """Lower and upper bound of a quantity."""

    lower: PerJoint | None = Field(None, description="One number for all joints, or D entries; null: unlimited below")
    upper: PerJoint | None = Field(None, description="One number for all joints, or D entries; null: unlimited above")


LimitValue = Annotated[
    Annotated[Number, Tag("#number")] | Annotated[Gaps, Tag("#list")] | Annotated[LimitRange, Tag("#range")],
    Discriminator(_limit_kind),
]


class LimitsBody(Body):
    """Limits of the motion: a per-joint value > 0 (both directions), or a lower and an upper bound."""

    position: LimitRange | None = Field(None, description="Joint positions, in the joint's unit")
    velocity: LimitValue | None = Field(None, description="Joint velocities, unit/s")
    acceleration: LimitValue | None = Field(None, description="Joint accelerations, unit/s²")
    jerk: LimitValue | None = Field(None, description="Joint jerks, unit/s³")
    torque: LimitValue | None = Field(None, description="Joint torques, N m (N); needs a robot")
    velocity_norm: Number | None = Field(None, description="Euclidean norm of the joint velocity, unit/s")
    tip_speed: Number | None = Field(None, description="Speed of the robot's tip, m/s; needs a robot")
    tip_acceleration: Number | None = Field(None, description="Acceleration of the tip, m/s²; needs a robot")


class DurationBody(Body):
    """Bounds of a duration; equal ones make it exact."""

    min: Seconds | None = Field(None, description="Shortest duration, s")
    max: Seconds | None = Field(None, description="Longest duration, s")


class BoundaryBody(Body):
    """The state at an end."""

    velocity: Vector | None = Field(None, description="D velocities, unit/s")
    acceleration: Vector | None = Field(None, description="D accelerations, unit/s²")
    jerk: Vector | None = Field(None, description="D jerks, unit/s³")


class StateBody(Body):
    """The state asked at a waypoint; null for a joint that is free."""

    velocity: Gaps | None = Field(None, description="D velocities, unit/s")
    acceleration: Gaps | None = Field(None, description="D accelerations, unit/s²")


class SamplingBody(Body):
    """Where the answer is sampled: one of the three; by default 200 samples."""

    dt: Time | None = Field(None, description="Time from sample to sample, s, > 0; the last sample is the end")
    count: Annotated[int, Field(strict=True)] | None = Field(None, description="Number of samples, ≥ 2, evenly spread")
    times: Times | None = Field(None, description="Exactly these increasing times, s, inside the trajectory")


Included = Literal["samples", "polynomial", "bound"]


class MotionBody(Body):
    """What is asked of a trajectory, whichever method makes it."""

    waypoints: Matrix = Field(description="N×D joint positions, N ≥ 2, one row a waypoint", examples=[[[0, 0], [1, 2]]])
    times: Times | None = Field(None, description="N increasing waypoint times, s; the clock of the answer")
    limits: LimitsBody | None = Field(None, description="Limits on the whole trajectory")
    segment_limits: Annotated[list[LimitsBody | None], Field(fail_fast=True)] | None = Field(
        None, description="N-1 entries, null or limits; on that segment the tighter of both counts"
    )
    segment_durations: Annotated[list[DurationBody | None], Field(fail_fast=True)] | None = Field(
        None, description="N-1 entries, null or bounds of the segment's duration, s"
    )
    duration: DurationBody | None = Field(None, description="Bounds of the whole duration, s")
    start: BoundaryBody | None = Field(None, description="State at the start")
    end: BoundaryBody | None = Field(None, description="State at the end")
    waypoint_states: Annotated[list[StateBody | None], Field(fail_fast=True)] | None = Field(
        None, description="N entries, null or the state asked at that waypoint"
    )
    waypoint_tolerance: PerJoint | None = Field(None, description="Half-width of a box around each interior waypoint")
    tube: PerJoint | None = Field(None, description="Half-width of a tube around the path between waypoints")
    robot: dict[str, Any] | None = Field(None, description="A robot, for torque and tip limits")
    wrap: Flags | None = Field(
        None, description="Which joints turn without end, one for all or D: waypoints are reached by the shortest turn"
    )
    joint_names: Names | None = Field(None, description="D names, used by the ROS 2 and CSV formats")
    sampling: SamplingBody | None = Field(None, description="Where to sample the answer; by default 200 samples")
    include: Annotated[list[Included], Field(max_length=16)] | None = Field(
        None, description="What the answer holds besides the certificate; by default the samples"
    )
    timeout: Seconds | None = Field(None, description="The caller's own limit on the computing time, s")


MethodOptions = Annotated[dict[str, Any], Field(max_length=100)]


class PlanBody(MotionBody):
    """A trajectory through waypoints under limits."""

    method: Text | None = Field(None, description="An id of /v1/methods, or auto (the default)")
    options: MethodOptions | None = Field(None, description="The method's options, see /v1/methods")


class MethodChoice(Body):
    """A method with options of its own."""

    method: Text = Field(description="An id of /v1/methods, or auto")
    options: MethodOptions | None = Field(None, description="The method's options, see /v1/methods")


def _choice_kind(value: Any) -> str:
    return "#choice" if isinstance(value, (dict, MethodChoice)) else "#id"


def _methods_kind(value: Any) -> str:
    return "#list" if isinstance(value, list) else "#all"


Choice = Annotated[Annotated[Text, Tag("#id")] | Annotated[MethodChoice, Tag("#choice")], Discriminator(_choice_kind)]
Choices = Annotated[list[Choice], Field(min_length=1, max_length=64, fail_fast=True)]


class CompareBody(MotionBody):
    """The same trajectory by several methods."""

    methods: Annotated[
        Annotated[Literal["all"], Tag("#all")] | Annotated[Choices, Tag("#list")], Discriminator(_methods_kind)
    ] = Field(description="all, or 1 to 64 entries: an id of /v1/methods or an object with options")
    include: Annotated[list[Included], Field(max_length=16)] | None = Field(
        None, description="What the rows hold besides the certificate; by default nothing"
    )


class PolynomialBody(Body):
    """A piecewise polynomial."""

    breaks: Times = Field(description="K+1 increasing times, s")
    coefficients: Annotated[
        list[Annotated[list[Annotated[list[Coefficient], Field(fail_fast=True)]], Field(fail_fast=True)]],
        Field(fail_fast=True),
    ] = Field(description="[power][piece][joint], lowest power first, of (t - breaks[piece])")
    weights: Annotated[list[Annotated[list[Coefficient], Field(fail_fast=True)]], Field(fail_fast=True)] | None = Field(
        None, description="[power][piece] of the denominator, > 0 on every piece, for a rational trajectory"
    )


class SamplesBody(Body):
    """Samples of a motion."""

    time: Times = Field(description="M increasing times, s")
    position: Matrix = Field(description="M×D positions")
    velocity: Matrix | None = Field(None, description="M×D velocities, unit/s, to be checked against the positions")
    acceleration: Matrix | None = Field(None, description="M×D accelerations, unit/s², to be checked likewise")


class TrajectoryBody(Body):
    """Anyone's trajectory: exactly one of the two."""

    polynomial: PolynomialBody | None = Field(None, description="A piecewise polynomial, judged exactly")
    samples: SamplesBody | None = Field(None, description="Samples, judged by finite differences")


class CertifyBody(Body):
    """A trajectory and what it should keep."""

    trajectory: TrajectoryBody = Field(description="The trajectory to judge")
    limits: LimitsBody | None = Field(None, description="Limits it should keep")
    waypoints: Matrix | None = Field(None, description="N×D positions to be passed in this order")
    times: Times | None = Field(None, description="N increasing times of the waypoints, s; without: at any times")
    start: BoundaryBody | None = Field(None, description="State it should start with")
    end: BoundaryBody | None = Field(None, description="State it should end with")


class StampBody(Body):
    """A time of ROS 2."""

    sec: Annotated[int, Field(strict=True, ge=-(2**31), lt=2**31)] = Field(0, description="Whole seconds")
    nanosec: Annotated[int, Field(strict=True, ge=0, lt=10**9)] = Field(0, description="Nanoseconds, 0 to 999,999,999")


class HeaderBody(Body):
    """A header of ROS 2; the path does not depend on it."""

    stamp: StampBody | None = Field(None, description="When it was made")
    frame_id: Text | None = Field(None, description="Its frame")


class PointBody(Body):
    """A point of a ROS 2 JointTrajectory; empty lists count as not sent, as in the message."""

    positions: Vector = Field(description="D positions")
    velocities: Vector | None = Field(None, description="D velocities, unit/s: the path has their directions")
    accelerations: Vector | None = Field(None, description="D accelerations, unit/s²")
    effort: Annotated[list[Number], Field(max_length=0)] | None = Field(None, description="Must be empty")
    time_from_start: StampBody | None = Field(None, description="Increasing; left out or zero everywhere: no times")


class MotionTrajectoryBody(Body):
    """Anyone's trajectory: a polynomial, samples, or a ROS 2 JointTrajectory (``points`` and ``joint_names``)."""

    polynomial: PolynomialBody | None = Field(None, description="A piecewise polynomial; its path is followed exactly")
    samples: SamplesBody | None = Field(None, description="Samples; the path passes all of them, or near to them")
    header: HeaderBody | None = Field(None, description="Of a ROS 2 JointTrajectory")
    joint_names: Names | None = Field(None, description="Of a ROS 2 JointTrajectory: D names, used in the answer")
    points: Annotated[list[PointBody], Field(fail_fast=True)] | None = Field(
        None, description="Of a ROS 2 JointTrajectory: its M points"
    )


class RetimeBody(Body):
    """A trajectory whose path is to be run through as fast as the limits allow."""

    trajectory: MotionTrajectoryBody = Field(description="Exactly one of polynomial, samples and points")
    limits: LimitsBody = Field(description="Limits on the answer: acceleration at least; with jerk it is jerk limited")
    tolerance: Annotated[float, Field(strict=True, ge=0, le=MAX_VALUE, allow_inf_nan=False)] | None = Field(
        None, description="Samples are smoothed: how far the path may be from each, in every joint; without: not at all"
    )
    duration: DurationBody | None = Field(None, description="Bounds of the duration, s")
    joint_names: Names | None = Field(None, description="D names, used by the ROS 2 and CSV formats")
    sampling: SamplingBody | None = Field(None, description="Where to sample the answer; by default 200 samples")
    include: Annotated[list[Included], Field(max_length=16)] | None = Field(
        None, description="What the answer holds besides the certificate; by default the samples"
    )
    timeout: Seconds | None = Field(None, description="The caller's own limit on the computing time, s")
