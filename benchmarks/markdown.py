"""Tables and numbers in Markdown."""

from collections.abc import Iterable, Sequence


def number(value: float | None, form: str) -> str:
    """Return a number in a format; nothing for None."""
    return "" if value is None else "∞" if value == float("inf") else format(value, form)


def table(heads: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """Return a table."""
    out = [heads, ["---"] * len(heads), *lines]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in out) + "\n"
