"""Answers as plain text: the comparison of methods and the certificate of a plan."""

from collections.abc import Mapping, Sequence
from typing import Any

#: Columns of ratios, where the request limits the quantity.
_QUANTITIES = ("position", "velocity", "acceleration", "jerk")


def table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the rows of a comparison as text, the method's id first.

    Peaks are ratios to the limit that comes nearest, for the quantities that were limited; a method that refuses has
    its reason in the last column.
    """
    ratios = [
        {c["quantity"]: _number(c["ratio"]) for c in (row["certificate"] or {"checks": ()})["checks"]} for row in rows
    ]
    limited = [q for q in _QUANTITIES if any(q in found for found in ratios)]
    head = ["method", "duration s", *(f"{q} / limit" for q in limited), "squared jerk", "ms", "certified"]
    lines = []
    for row, found in zip(rows, ratios, strict=True):
        if row["ok"]:
            cost = _number(row["cost"].get("squared_jerk"))
            peaks = [found.get(q, "-") for q in limited]
            verdict = "yes" if row["certificate"]["holds"] else "no"
            lines.append([row["method"], _number(row["duration"]), *peaks, cost, f"{row['compute_ms']:.2f}", verdict])
        else:
            dashes = ["-"] * (len(limited) + 2)
            reason = str(row["error"].get("detail", row["error"].get("title", "")))
            lines.append([row["method"], *dashes, f"{row['compute_ms']:.2f}", f"refused: {_short(reason)}"])
    return aligned(head, lines)


def certificate_table(certificate: Mapping[str, Any]) -> str:
    """Return a certificate as text: a line per check, then the errors, costs and the bound."""
    head = ["quantity", "joint", "segment", "time s", "value", "bound", "ratio", "holds"]
    lines = []
    for check in certificate["checks"]:
        numbers = [_number(check[k]) for k in ("time", "value", "bound", "ratio")]
        places = [_number(check[k]) for k in ("joint", "segment")]
        lines.append([check["quantity"], *places, *numbers, "yes" if check["holds"] else "no"])
    text = aligned(head, lines) + "\n" if lines else ""
    for name in ("waypoint_error", "boundary_error", "path_deviation", "continuity"):
        if certificate[name] is not None:
            text += f"{name.replace('_', ' ')}: {_number(certificate[name])}\n"
    for name, value in certificate["cost"].items():
        text += f"{name.replace('_', ' ')}: {_number(value)}\n"
    objective = certificate["objective"]
    if objective is not None and objective["lower_bound"] is not None:
        text += f"{objective['name'].replace('_', ' ')} is within {_number(objective['gap'])} (relative) "
        text += f"of the lower bound for {objective['bound_scope']}\n"
    return text + ("certified" if certificate["holds"] else "NOT certified") + f" ({certificate['basis']})"


def aligned(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """Return columns padded to equal widths; the last one is free."""
    cells = [list(head), *(list(line) for line in lines)]
    widths = [max(len(line[i]) for line in cells) for i in range(len(head))]
    return "\n".join("  ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)).rstrip() for line in cells)


def _number(value: Any) -> str:
    """Return a number in six digits, a dash for what is not there."""
    if value is None:
        return "-"
    return str(value) if isinstance(value, int) else f"{value:.6g}"


def _short(text: str) -> str:
    """Return one line of at most 110 characters."""
    line = " ".join(text.split())
    return line if len(line) <= 110 else line[:109] + "…"
