"""The service: where a request's time goes, what it costs, what the solver processes add, and the page in a browser."""

from dataclasses import dataclass

from . import costs, page, split

__all__ = ["Served", "measure"]


@dataclass(frozen=True)
class Served:
    """What was measured of the service."""

    splits: list[split.Split]
    costs: list[costs.Cost]
    shown: list[page.Shown]


def measure(quick: bool) -> Served:
    """Return all of it; ``quick``: few rounds, only to see that everything runs."""
    with costs.served("api", "serve", "--port", "0") as ours:
        shown = page.measure(ours.address, *((1, page.CASES_DRAGGED[:1]) if quick else ()))
    return Served(split.measure(3 if quick else 30), costs.measure(1 if quick else 15), shown)
