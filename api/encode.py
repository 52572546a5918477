"""Plans and certificates as bytes. NaN and infinity never get out: they are refused here or told as null."""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from planner import Certificate, InvalidRequest, NotVerified, Plan, Samples, Sampling, Trajectory, __version__

Array = NDArray[np.float64]

JSON = "application/json"
CSV = "text/csv"
ROS2 = "application/vnd.ros2.joint-trajectory+json"

#: Formats of a plan, the default first.
FORMATS = (JSON, CSV, ROS2)

_ORDERS = ("position", "velocity", "acceleration", "jerk")


def dumps(value: Any) -> bytes:
    """Return compact JSON; NumPy arrays and scalars are written as they are."""
    return orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY, default=_plain)


def _plain(value: Any) -> Any:
    """Return what orjson cannot write by itself as something it can: arrays that are not contiguous, sets, models."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    if isinstance(value, (set, frozenset)):
        return sorted(value)
    if hasattr(value, "model_dump"):
        return value.model_dump()
    raise TypeError(f"{type(value).__name__} has no JSON form")


def certificate_tree(certificate: Certificate) -> dict[str, Any]:
    """Return a certificate as the HTTP contract names it; what is not finite is null."""
    tree: dict[str, Any] = {
        "holds": certificate.holds,
        "basis": certificate.basis,
        "checks": [asdict(check) for check in certificate.checks],
        "waypoint_error": certificate.waypoint_error,
        "boundary_error": certificate.boundary_error,
        "continuity": certificate.continuity,
        "path_deviation": certificate.path_deviation,
        "cost": dict(certificate.cost),
        "objective": None if certificate.objective is None else asdict(certificate.objective),
    }
    finite: dict[str, Any] = _finite(tree)
    return finite


def _finite(value: Any) -> Any:
    """Return the tree with null for every number that is not finite."""
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(v) for v in value]
    if isinstance(value, (float, np.floating)) and not math.isfinite(value):
        return None
    return value


def peaks_tree(certificate: Certificate) -> dict[str, list[float | None]]:
    """Return the largest magnitudes, a list over the joints for each quantity; null where unbounded."""
    tree: dict[str, list[float | None]] = _finite({k: list(v) for k, v in certificate.peaks.items()})
    return tree


def samples_tree(samples: Samples) -> dict[str, Array]:
    """Return samples as the HTTP contract names them."""
    return {"time": samples.time, **{name: np.ascontiguousarray(getattr(samples, name)) for name in _ORDERS}}


def polynomial_tree(trajectory: Trajectory) -> dict[str, Array]:
    """Return a trajectory's pieces: ``coefficients[k][i][d]`` belongs to (t - breaks[i])^k, as do ``weights[k][i]``."""
    tree = {"breaks": trajectory.breaks, "coefficients": np.ascontiguousarray(trajectory.powers())}
    weights = trajectory.weight_powers()
    return tree if weights is None else {**tree, "weights": np.ascontiguousarray(weights)}


def plan_tree(plan: Plan, samples: Samples | None, polynomial: bool, digest: str) -> dict[str, Any]:
    """Return a plan as the HTTP contract names it.

    Raises
    ------
    NotVerified
        A number of the answer is not finite.
    """
    tree: dict[str, Any] = {"method": plan.method}
    if plan.picked_because is not None:
        tree["picked_because"] = plan.picked_because
    tree["duration"] = plan.trajectory.duration
    tree["waypoint_times"] = plan.waypoint_times
    if samples is not None:
        tree["samples"] = samples_tree(samples)
    if polynomial:
        tree["polynomial"] = polynomial_tree(plan.trajectory)
    arrays = [plan.waypoint_times, *tree.get("samples", {}).values(), *tree.get("polynomial", {}).values()]
    refuse_infinite(plan.method, *(a for a in arrays if a is not None))
    tree["certificate"] = certificate_tree(plan.certificate)
    tree["solver"] = {"name": plan.stats.name, "status": plan.stats.status, "iterations": plan.stats.iterations}
    tree["warnings"] = [asdict(note) for note in plan.notes]
    tree["digest"] = digest
    return tree


def refuse_infinite(method: str, *arrays: Array) -> None:
    """Raise NotVerified if a number is not finite."""
    if not all(np.isfinite(array).all() for array in arrays):
        raise NotVerified(method, {"reason": "the answer holds a number that is not finite"})


def digest_of(plan: Plan, method: str, sampling: Sampling, include: tuple[str, ...], given: Mapping[str, Any]) -> str:
    """Return the SHA-256 of the canonical request, its keys sorted and its defaults filled in, and the version.

    Parameters
    ----------
    method : str
        As it was asked for, so ``auto`` too.
    given
        The rest of the request as it was sent.
    """
    canonical = {
        **{k: v for k, v in given.items() if v not in (None, {})},
        "waypoints": plan.request.waypoints,
        "method": method,
        "options": plan.options.model_dump(),
        "sampling": {k: v for k, v in vars(sampling).items() if v is not None},
        "include": include,
        "version": __version__,
    }
    option = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_SORT_KEYS | orjson.OPT_NON_STR_KEYS
    return hashlib.sha256(orjson.dumps(canonical, option=option, default=_plain)).hexdigest()


def to_csv(samples: Samples, joint_names: tuple[str, ...] | None) -> bytes:
    """Return a row per sample: time, then position, velocity, acceleration and jerk of every joint."""
    names = joint_names or [str(i + 1) for i in range(samples.position.shape[1])]
    header = ["time"] + [f"{order}_{name}" for order in _ORDERS for name in names]
    matrix = np.column_stack([samples.time, *(getattr(samples, order) for order in _ORDERS)])
    rows = dumps(np.ascontiguousarray(matrix))[2:-2].replace(b"],[", b"\n")
    return ",".join(_quoted(name) for name in header).encode() + b"\n" + rows + b"\n"


def _quoted(name: str) -> str:
    """Return a CSV field (RFC 4180), in quotes only where it must be."""
    return '"' + name.replace('"', '""') + '"' if any(c in name for c in ',"\r\n') else name


def to_ros2(samples: Samples, joint_names: tuple[str, ...] | None, start: float) -> bytes:
    """Return a trajectory_msgs/JointTrajectory whose times count from the trajectory's start and increase strictly.

    Raises
    ------
    InvalidRequest
        Two samples fall on the same nanosecond, or one lies beyond the 2^31 s that the message can hold.
    """
    elapsed = samples.time - start
    if elapsed[-1] >= 2**31:
        raise InvalidRequest.of("/sampling", "out_of_range", "a ROS 2 duration holds less than 2^31 s")
    times = np.round(elapsed * 1e9).astype(np.int64)
    count = 1 if len(times) == 2 and samples.time[0] == samples.time[1] else len(times)  # a hold without duration
    times = times[:count]
    if not (np.diff(times) > 0).all():
        raise InvalidRequest.of("/sampling", "out_of_range", "ROS 2 counts nanoseconds: samples must be further apart")
    seconds, nanoseconds = np.divmod(times, 1_000_000_000)
    rows = zip(
        *(getattr(samples, order)[:count].tolist() for order in _ORDERS[:3]),
        seconds.tolist(),
        nanoseconds.tolist(),
        strict=True,
    )
    points = [
        {"positions": p, "velocities": v, "accelerations": a, "time_from_start": {"sec": s, "nanosec": n}}
        for p, v, a, s, n in rows
    ]
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    names = joint_names or [f"joint_{i + 1}" for i in range(samples.position.shape[1])]
    return dumps({"header": header, "joint_names": names, "points": points})
