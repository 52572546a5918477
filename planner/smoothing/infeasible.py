"""Infeasible, explained: which limits are in conflict, by how much one must give, how long would be long enough."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..deadline import Deadline
from ..errors import Infeasible, SolverFailed, TimeLimit
from ..solvers import Backend
from .linear import WIDTHS, LinearLimits
from .posing import Posed, digits
from .rounds import NoPoint
from .within import kept

Array = NDArray[np.float64]

#: To this part the smallest relaxation and the shortest duration are found, and both where a norm is limited.
RELAXATION, STRETCH, BY_NORM = 1e-7, 1e-4, 1e-3
#: No limit is asked to give by more than so many sizes, no motion to take more than so many times as long.
WIDEST, LONGEST = 1e4, 1e3
#: Limits that press less than this part of the hardest are not told, and of the others so many.
PRESSES, TOLD = 1e-3, 4
#: Most unknowns of a statement for which these searches are made: of joints by themselves, of joints that a tube binds,
#: and of those that the norm of their velocity binds; and how many limits are tried alone.
SEARCHED, SEARCHED_BOUND, SEARCHED_CONES, TRIED = 6000, 600, 40, 3

#: A limit, the segment and the side it presses on.
Key = tuple[int, int, int]


@dataclass(frozen=True)
class Search:
    """With what to look for what would do: back ends and time; ``parts`` per gap; ``at_rest``: slowing is allowed."""

    backends: Sequence[Backend]
    deadline: Deadline
    parts: int
    at_rest: bool

    def keeps(self, posed: Posed, limits: LinearLimits, norm: Array | None) -> bool:
        """Return whether a motion within such limits is found."""
        try:
            tried = 1 if posed.statement.bound else 2
            kept(posed, limits, norm, self.backends[:tried], self.deadline, optimal=False)
        except (NoPoint, SolverFailed):
            return False
        return True


def explained(posed: Sequence[Posed], at: int, proof: NoPoint, search: Search) -> Infeasible:
    """Return the error that tells what is in conflict in statement ``at``, what would do, and whether it is proved.

    What presses is read off the multipliers of the proof. ``needed`` is the smallest value that would do (to 1e-7 of
    its size) of the hardest pressing limit that alone can help, ``minimum_duration`` the least for which the times,
    stretched alike, let all limits be kept (to 1e-4); either is None where it is not found.
    """
    one = posed[at]
    size = max(p.statement.size for p in posed)
    small = size <= (SEARCHED if not one.statement.bound else SEARCHED_BOUND if one.norm is None else SEARCHED_CONES)
    pressing = _pressing(one, proof)
    (limit, segment, side), gap, u = pressing[0]
    if limit < 0:  # the norm
        return _norm_refused(posed, at, proof, search, segment, one.clock(gap, u), small)
    limits = one.limits
    part, remedy, every = None, "", np.ones(len(limits.names), dtype=bool)
    if small:
        (limit, segment, side), gap, u, part = _remedied(one, pressing, search)
        if part is not None:
            remedy = f"; it would have to give by {100 * part:.4g} %"
        elif (all_of := _relaxation(one, every, every, search)) is not None:
            remedy = f"; all of its limits would have to give, by {100 * all_of:.4g} %"
    name, joint = limits.names[limit], limits.joints[limit]
    bound, needed = _told_values(one, limit, gap, side, part)
    others = dict.fromkeys(key[:2] for key, *_ in pressing if key[:2] != (limit, segment))
    names = [f"{limits.names[c] if c >= 0 else 'velocity_norm'} on segment {s}" for c, s in others]
    against = f", against {', '.join(names[:TOLD])}" if names else ""
    whose = f"of joint {joint}" if joint >= 0 else "that bind its joints"
    return Infeasible(
        f"{_family(search)} cannot keep the limits {whose}: its {name} limit presses most, on segment "
        f"{segment}{against}{remedy}{_told(proof)}",
        joint=joint if joint >= 0 else None,
        quantity=name,
        segment=segment,
        time=one.clock(gap, u),
        bound=bound,
        needed=needed,
        minimum_duration=_duration(posed, search) if small else None,
        certified=proof.proved,
    )


def _norm_refused(
    posed: Sequence[Posed], at: int, proof: NoPoint, search: Search, segment: int, time: float, small: bool
) -> Infeasible:
    one = posed[at]
    assert one.norm is not None
    gap = int(np.flatnonzero(one.segment == segment)[0])
    speed, needed = float(one.unit[0]) / one.second, None

    def enough(part: float) -> bool:
        assert one.norm is not None
        return search.keeps(one, one.limits, one.norm * (1.0 + part))

    if small and (found := _least(enough, 0.0, 1e-3, WIDEST, BY_NORM)) is not None:
        needed = float(one.norm[gap] * (1.0 + found) * speed)
    return Infeasible(
        f"{_family(search)} cannot keep the limits: that of the velocity's norm presses most, on segment {segment}"
        + _told(proof),
        quantity="velocity_norm",
        segment=segment,
        time=time,
        bound=digits(one.norm[gap] * speed),
        needed=needed,
        minimum_duration=_duration(posed, search) if small else None,
        certified=proof.proved,
    )


def _family(search: Search) -> str:
    return ("one polynomial" if search.parts == 1 else f"even {search.parts} polynomials") + " per gap at these times"


def _told(proof: NoPoint) -> str:
    return "" if proof.proved else "; this was found by search, not proved"


def _pressing(posed: Posed, proof: NoPoint) -> list[tuple[Key, int, float]]:
    """Return limit (-1: the norm), segment and side, gap and place of what presses, the hardest first."""
    gap, limit, side = proof.rows.place
    entries = list(zip(limit, gap, side, proof.rows.u, proof.z, strict=False))
    if proof.norm is not None:
        gaps, places, z = proof.norm
        heads = z.reshape(len(gaps), -1)[:, 0] if len(gaps) else z
        entries += [(-1, i, 1, u, x) for i, u, x in zip(gaps, places, heads, strict=True)]
    total: dict[Key, float] = {}
    where: dict[Key, tuple[float, int, float]] = {}
    for c, i, s, u, z in entries:
        key = (int(c), int(posed.segment[i]), int(s))
        total[key] = total.get(key, 0.0) + float(z)
        if float(z) > where.get(key, (-1.0, 0, 0.0))[0]:
            where[key] = (float(z), int(i), float(u))
    most = max(total.values())
    # alike but for rounding, as in a problem that mirrors itself: the earliest segment, from above
    ranked = sorted(total, key=lambda k: (-round(total[k] / most, 6) if most else 0.0, k[1], k[0], -k[2]))
    return [(key, *where[key][1:]) for key in ranked if total[key] >= PRESSES * total[ranked[0]]]


def _remedied(
    posed: Posed, pressing: Sequence[tuple[Key, int, float]], search: Search
) -> tuple[Key, int, float, float | None]:
    """Return the hardest pressing limit that alone can help, and by how much it must give; else the hardest, None."""
    tried: list[bytes] = []
    for key, gap, u in pressing:
        if key[0] < 0 or len(tried) == TRIED:
            continue
        sides = posed.limits.alike(key[0], key[2])
        if (same := np.stack(sides).tobytes()) in tried:
            continue
        tried.append(same)
        if (part := _relaxation(posed, *sides, search)) is not None:
            return key, gap, u, part
    return (*pressing[0], None)


def _told_values(posed: Posed, limit: int, gap: int, side: int, part: float | None) -> tuple[float, float | None]:
    """Return the bound in the caller's terms, and what it must be where it has to give by a part of its size."""
    limits = posed.limits
    if limits.names[limit] in WIDTHS:
        own = limit
        if limits.joints[limit] < 0:  # of two joints the one that moves less: its width counts more
            other = posed.joints[int(np.argmax(np.abs(limits.directions[limit, gap])))]
            own = next(c for c, n in enumerate(limits.names) if n == limits.names[limit] and limits.joints[c] == other)
        unit = posed.unit[posed.joints.index(limits.joints[own])]
        width = float(limits.sizes[own, gap] * unit)
        return digits(width), None if part is None else digits(width * (1.0 + part))
    bound = float((limits.upper if side > 0 else limits.lower)[limit, gap])
    bounded = posed.physical(limit, bound)
    if part is None:
        return bounded, None
    return bounded, posed.physical(limit, bound + side * part * float(limits.sizes[limit, gap]))


def _relaxation(posed: Posed, below: NDArray[np.bool_], above: NDArray[np.bool_], search: Search) -> float | None:
    """Return the least part by which these sides must give for the others to be kept; None if that cannot help."""

    def enough(part: float) -> bool:
        return search.keeps(
            posed, posed.limits.widened(np.where(below, part, 0.0), np.where(above, part, 0.0)), posed.norm
        )

    return _least(enough, 0.0, 1e-3, WIDEST, RELAXATION)


def _duration(posed: Sequence[Posed], search: Search) -> float | None:
    """Return the least duration for which times stretched alike let all limits be kept, or None."""
    if not search.at_rest:
        return None
    longest = 1.0
    for one in posed:

        def enough(factor: float, one: Posed = one) -> bool:
            norm = None if one.norm is None else one.norm * factor
            return search.keeps(one, one.limits.slowed(factor), norm)

        try:
            if enough(longest):
                continue
        except TimeLimit:
            return None
        factor = _least(enough, longest, longest, LONGEST, STRETCH if one.norm is None else BY_NORM)
        if factor is None:
            return None
        longest = factor
    return float(longest * (posed[0].times[-1] - posed[0].times[0]))


def _least(enough: Callable[[float], bool], low: float, step: float, most: float, accuracy: float) -> float | None:
    """Return the least x above ``low`` that is enough, to an accuracy and from above; None if ``most`` is not.

    None too where the time runs out.
    """
    base, high = low, low + step
    try:
        while not enough(high):
            if high >= most:
                return None
            low, step = high, 4.0 * step
            high = min(base + step, most)
        while high - low > accuracy * max(1.0, high):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if enough(middle) else (middle, high)
    except TimeLimit:
        return None
    return high
