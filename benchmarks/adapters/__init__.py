"""The ways to answer a problem, one file a peer: each offers ``entries(problem)``."""

from ..cases import Problem
from . import ours, ruckig, scipy, toppra
from .entry import Answer, Entry

__all__ = ["Answer", "Entry", "entries"]


def entries(problem: Problem) -> list[Entry]:
    """Return all entries that can take the problem, ours first."""
    return [entry for peer in (ours, scipy, toppra, ruckig) for entry in peer.entries(problem)]
