"""Reading the trajectory of a retiming request: a polynomial, samples, or a ROS 2 JointTrajectory."""

import re
from collections.abc import Iterator
from contextlib import contextmanager

from planner import FieldError, InvalidRequest, Recorded, Trajectory

from .judging import polynomial_of, recorded
from .reading import refuse_above
from .schemas import PointBody, RetimeBody, SamplesBody
from .settings import Caps

#: The names that samples have in a ROS 2 JointTrajectory.
_ROS2 = {
    "time": "time_from_start",
    "position": "positions",
    "velocity": "velocities",
    "acceleration": "accelerations",
}


def read_motion(body: RetimeBody, caps: Caps) -> tuple[Trajectory | Recorded, list[str] | None, int]:
    """Return the trajectory, the joints' names and the number of joints.

    Raises
    ------
    InvalidRequest, TooLarge
    """
    sent = body.trajectory
    given = [name for name in ("polynomial", "samples", "points") if getattr(sent, name) is not None]
    if len(given) != 1:
        raise InvalidRequest.of("/trajectory", "conflict", "needs exactly one of polynomial, samples and points")
    names = _names(body, given[0] == "points")
    if sent.polynomial is not None:
        refuse_above(len(sent.polynomial.breaks), caps.waypoints, "breaks")
        polynomial = polynomial_of(sent.polynomial, caps)
        return polynomial, names, polynomial.dims
    samples = _as_samples(sent.points) if sent.samples is None else sent.samples
    refuse_above(len(samples.position), caps.waypoints, "samples")
    with own_fields(body):
        motion = recorded(samples, caps)
    dims = int(motion.position.shape[1])
    if sent.joint_names is not None and len(sent.joint_names) != dims:
        reason = f"needs {dims} entries, has {len(sent.joint_names)}"
        raise InvalidRequest.of("/trajectory/joint_names", "shape_mismatch", reason)
    return motion, names, dims


def _names(body: RetimeBody, ros2: bool) -> list[str] | None:
    sent = body.trajectory
    if not ros2:
        for name in ("header", "joint_names"):
            if getattr(sent, name) is not None:
                raise InvalidRequest.of(f"/trajectory/{name}", "conflict", "belongs to a ROS 2 JointTrajectory")
        return body.joint_names
    inner = sent.joint_names or None
    if inner is not None and body.joint_names is not None and inner != body.joint_names:
        raise InvalidRequest.of("/joint_names", "conflict", "the trajectory has other names")
    return body.joint_names if inner is None else inner


def _as_samples(points: list[PointBody] | None) -> SamplesBody:
    """Return the points of a ROS 2 JointTrajectory as samples; without times they are numbered."""
    assert points is not None
    stamps = [p.time_from_start for p in points]
    times = [0.0 if s is None else s.sec + 1e-9 * s.nanosec for s in stamps]
    if not any(times):
        times = [float(i) for i in range(len(points))]
    velocity, acceleration = ([getattr(p, _ROS2[name]) or [] for p in points] for name in ("velocity", "acceleration"))
    return SamplesBody.model_construct(
        time=times,
        position=[p.positions for p in points],
        velocity=velocity if any(velocity) else None,
        acceleration=acceleration if any(acceleration) else None,
    )


@contextmanager
def own_fields(body: RetimeBody) -> Iterator[None]:
    """Tell of findings about samples as being about the points that were sent, where a ROS 2 message was."""
    try:
        yield
    except InvalidRequest as error:
        if body.trajectory.points is None:
            raise
        moved = [FieldError(_ros2_field(e.field), e.code, e.reason) for e in error.errors]
        raise InvalidRequest(moved, error.errors_total) from None


def _ros2_field(field: str) -> str:
    found = re.fullmatch(r"/trajectory/samples/(\w+)(?:/(\d+))?(/.*)?", field)
    if found is None:
        return field
    name, index, rest = found.groups()
    return "/trajectory/points" if index is None else f"/trajectory/points/{index}/{_ROS2[name]}{rest or ''}"
