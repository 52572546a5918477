"""Where ruckig misses the end state by rounding of its roots: the same with a little room, and jerks that meet it."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..deadline import Deadline
from ..limits import Limit
from ..timing.state_to_state import Legs, profiles

Array = NDArray[np.float64]

#: What ruckig may miss the state at a leg's end by, relative to what the joint does on it; what can be mended.
MISSED, MENDED = 1e-11, 1e-6
#: By how much the limits are tightened for that, relatively.
ROOM = 1e-6
#: Phases shorter than this part of the leg are left alone.
SHORT = 1e-4


def mended(legs: Legs, durations: Array, phases: Array, deadline: Deadline) -> tuple[Array, Array]:
    """Return durations (S,) and phases (S, D, n, 5) of which fewer miss their end state; see ``missed``."""
    off = missed(legs, phases)
    bad = np.flatnonzero((off > MISSED) & (off <= MENDED) & np.isfinite(durations))
    if len(bad) == 0:
        return durations, phases
    part = legs.chosen(bad)
    tight = [Limit(x.lower * (1.0 - ROOM), x.upper * (1.0 - ROOM)) for x in (part.velocity, part.acceleration)]
    fewer = replace(part, velocity=tight[0], acceleration=tight[1], jerk=part.jerk * (1.0 - ROOM))
    longer, again = profiles(fewer, deadline)
    durations, phases = durations.copy(), phases.copy()
    for i, seconds, found in zip(bad, longer, again, strict=True):
        if np.isfinite(seconds):
            durations[i], phases[i] = seconds, _met(legs.chosen(np.array([i])), found)
    return durations, phases


def missed(legs: Legs, phases: Array) -> Array:
    """Return by how much the last phases with a duration miss the states asked, relative to the joints' peaks, (S,)."""
    off = np.abs(_off(legs, phases))
    scale = np.abs(phases[:, :, :-1, 1:4]).max(axis=2)
    scale = np.moveaxis(np.where(scale > 0, scale, 1.0), 2, 0)
    return np.asarray((off / scale).max(axis=(0, 2)))


def _off(legs: Legs, phases: Array) -> Array:
    """Return the states asked, less those at the ends of the last phases with a duration, (3, S, D)."""
    t, p, v, a, j = np.moveaxis(phases[:, :, -2], 2, 0)
    end = np.stack([p + t * (v + t * (a / 2 + t * j / 6)), v + t * (a + t * j / 2), a + t * j])
    return np.asarray(np.stack([legs.p1 - legs.p0, legs.v1, legs.a1]) - end)


def _met(leg: Legs, phases: Array) -> Array:
    """Return the phases (D, n, 5) of one leg with the least change of jerks that meets the end state."""
    out, off = phases.copy(), _off(leg, phases[None])[:, 0]
    total = phases[:, :-1, 0].sum(axis=1).max()
    scale = np.array([total**3, total**2, total])
    for d in range(len(phases)):
        t = phases[d, :-1, 0]
        left = t[::-1].cumsum()[::-1] - t  # after each phase
        effect = np.stack([t * (t * t / 6 + left * (t + left) / 2), t * (t / 2 + left), t]) / scale[:, None]
        effect[:, t < SHORT * total] = 0.0
        out[d, :-1, 4] += np.linalg.lstsq(effect, off[:, d] / scale, rcond=1e-12)[0]
        for k in range(len(t) - 1):
            h, p, v, a, j = out[d, k]
            out[d, k + 1, 1:4] = p + h * (v + h * (a / 2 + h * j / 6)), v + h * (a + h * j / 2), a + h * j
    return out
