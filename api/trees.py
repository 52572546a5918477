"""Plans and certificates as trees: what the HTTP contract names, ready for any format. What is not finite is null."""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from planner import Certificate, Plan, Sampling, Trajectory, __version__

from .draft import Drawn, refuse_infinite
from .formats.json import plain

Array = NDArray[np.float64]


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


def polynomial_tree(trajectory: Trajectory) -> dict[str, Array]:
    """Return a trajectory's pieces: ``coefficients[k][i][d]`` belongs to (t - breaks[i])^k, as do ``weights[k][i]``."""
    tree = {"breaks": trajectory.breaks, "coefficients": np.ascontiguousarray(trajectory.powers())}
    weights = trajectory.weight_powers()
    return tree if weights is None else {**tree, "weights": np.ascontiguousarray(weights)}


def plan_tree(plan: Plan, samples: Drawn | None, polynomial: bool, digest: str) -> dict[str, Any]:
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
        tree["samples"] = samples
    if polynomial:
        tree["polynomial"] = polynomial_tree(plan.trajectory)
    arrays = [plan.waypoint_times, *tree.get("polynomial", {}).values()]
    refuse_infinite(plan.method, *(a for a in arrays if a is not None))
    tree["certificate"] = certificate_tree(plan.certificate)
    tree["solver"] = {"name": plan.stats.name, "status": plan.stats.status, "iterations": plan.stats.iterations}
    tree["warnings"] = [asdict(note) for note in plan.notes]
    tree["digest"] = digest
    return tree


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
    return hashlib.sha256(orjson.dumps(canonical, option=option, default=plain)).hexdigest()
