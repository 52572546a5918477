"""What a method is: one row that says what it is, what it honours, and how it is called."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, Literal

from .options import CAPABILITIES, Options
from .types import Minimised, PlanRequest, Solution

Timing = Literal["given", "chosen", "either", "parameter"]
Family = Literal["interpolation", "smoothing", "time_optimal"]


@dataclass(frozen=True)
class Reference:
    """Where a method comes from: authors, title, year, and a DOI or address."""

    authors: str
    title: str
    year: int
    where: str


@dataclass(frozen=True)
class Capabilities:
    """What a method honours with certain options.

    ``start`` and ``end`` are the derivatives a caller may set there (zero unless sent); ``rests`` are zero at both ends
    and cannot be set. Those in ``with_jerk`` count only where a jerk limit is given. ``continuity`` is the guaranteed
    class, -1 none.
    """

    timing: Timing
    continuity: int
    requires: frozenset[str] = frozenset()
    honours: frozenset[str] = frozenset()
    start: frozenset[str] = frozenset()
    end: frozenset[str] = frozenset()
    rests: frozenset[str] = frozenset()
    with_jerk: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        unknown = (self.requires | self.honours) - set(CAPABILITIES)
        if unknown or not self.requires <= self.honours:
            raise ValueError(f"requires must be part of honours, and both of CAPABILITIES: {sorted(unknown)}")

    @cached_property
    def words(self) -> tuple[str, ...]:
        """Everything honoured, boundary states included, in the order of ``CAPABILITIES``."""
        boundary = {f"boundary_{name}" for name in self.start | self.end}
        return tuple(w for w in CAPABILITIES if w in self.honours | boundary)


@cache
def at_given_times(
    continuity: int, start: frozenset[str] = frozenset(), end: frozenset[str] = frozenset()
) -> Capabilities:
    """Return what a curve through waypoints at given times honours."""
    honours = frozenset({"times", "duration", "segment_durations"})
    return Capabilities("given", continuity, frozenset({"times"}), honours, start=start, end=end)


@cache
def by_control_points(continuity: int) -> Capabilities:
    """Return what a curve by control points honours: its clock is a parameter, whose span may be asked."""
    return Capabilities("parameter", continuity, honours=frozenset({"duration"}))


@dataclass(frozen=True)
class Method:
    """A row of the method table.

    ``capabilities`` is a function of the options; ``variants`` are the options where its value differs from the
    default's, so that the catalogue can list them. ``objective`` is the word for what it minimises; where that depends
    on the options, ``minimises`` tells it in full.
    """

    id: str
    title: str
    solve: Callable[[PlanRequest, Any], Solution]
    options: type[Options]
    family: Family
    summary: str
    formula: str
    reference: Reference
    capabilities: Callable[[Any], Capabilities]
    path: Literal["free", "fixed", "approximate"] = "free"
    objective: str | None = None
    minimises: Callable[[Any], Minimised | None] = lambda options: None
    variants: tuple[Mapping[str, Any], ...] = ()

    def honours(self, words: set[str]) -> bool:
        """Return whether the method honours all the words with its default options or in one of its variants."""
        chosen = [self.options(), *(self.options.model_validate(v) for v in self.variants)]
        return any(words <= set(self.capabilities(o).words) for o in chosen)
