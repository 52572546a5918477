"""A Plotly figure as JSON: position, velocity, acceleration and jerk over time; needs no library to be written."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..draft import ORDERS, Draft
from .json import dumps
from .ros2 import names_of
from .samples import samples_of

#: A colour per joint, in turn, and that of limits.
COLOURS = ("#1f77b4", "#ff7f0e", "#2ca02c", "#9467bd", "#8c564b", "#e377c2", "#7f7f7f", "#bcbd22", "#17becf", "#d62728")
_LIMIT = "rgba(214, 39, 40, 0.25)"

#: What is written after a coordinate's unit, which only its user knows.
UNITS = ("", " per s", " per s²", " per s³")

#: Share of the height that one panel has, with the gap below it, and the band beyond a limit as a share of the limit.
_PANEL, _SHARE, _BAND = 0.25, 0.22, 0.04


def write(draft: Draft) -> Iterator[bytes]:
    """Write the traces, in pieces, then the layout."""
    drawn, names = samples_of(draft), names_of(draft)
    yield b'{"data":['
    for order, quantity in enumerate(ORDERS):
        values = np.empty((len(drawn.times), drawn.dims))  # drawn with the first joint, piece by piece
        for joint, name in enumerate(names):
            style = {
                "type": "scatter",
                "mode": "lines",
                "name": name,
                "legendgroup": name,
                "showlegend": order == 0,
                "line": {"color": COLOURS[joint % len(COLOURS)], "width": 1.5},
                "xaxis": "x",
                "yaxis": _axis("y", order),
                "meta": {"quantity": quantity, "joint": joint},
            }
            yield (b"," if order or joint else b"") + dumps(style)[:-1] + b',"x":['
            for begin, end in drawn.slices(1):
                yield (b"," if begin else b"") + dumps(drawn.times[begin:end])[1:-1]
            yield b'],"y":['
            for begin, end in drawn.slices(drawn.dims):
                if joint == 0:
                    values[begin:end] = drawn.order(order, begin, end)
                yield (b"," if begin else b"") + dumps(values[begin:end, joint].copy())[1:-1]
            yield b"]}"
    for trace in _waypoints(draft, names):
        yield b"," + dumps(trace)
    yield b'],"layout":' + dumps(_layout(draft, names)) + b"}"


def _axis(letter: str, order: int) -> str:
    return letter if order == 0 else f"{letter}{order + 1}"


def _waypoints(draft: Draft, names: list[str]) -> Iterator[dict[str, Any]]:
    """Return a trace of marks for every joint; none where the waypoints are control points."""
    at = draft.tree.get("waypoint_times")
    if at is None:
        return
    reached = samples_of(draft).trajectory.states(at, 1)[0]
    for joint, name in enumerate(names):
        yield {
            "type": "scatter",
            "mode": "markers",
            "name": f"{name}, waypoints",
            "legendgroup": name,
            "showlegend": False,
            "marker": {"color": COLOURS[joint % len(COLOURS)], "size": 7},
            "xaxis": "x",
            "yaxis": "y",
            "x": at,
            "y": reached[:, joint].tolist(),
            "meta": {"quantity": "waypoints", "joint": joint},
        }


def _layout(draft: Draft, names: list[str]) -> dict[str, Any]:
    tree = draft.tree
    layout: dict[str, Any] = {
        "title": {"text": f"{tree['method']}, {tree['duration']:.4g} s"},
        "hovermode": "x unified",
        "xaxis": {"title": {"text": "time, s"}, "anchor": _axis("y", len(ORDERS) - 1)},
        "shapes": list(_bands(tree["certificate"]["checks"], names)),
    }
    for order, quantity in enumerate(ORDERS):
        bottom = 1.0 - _PANEL * (order + 1)
        axis = {"title": {"text": quantity + UNITS[order]}, "anchor": "x"}
        layout[f"yaxis{order + 1 if order else ''}"] = {**axis, "domain": [bottom, bottom + _SHARE]}
    return layout


def _bands(checks: list[dict[str, Any]], names: list[str]) -> Iterator[dict[str, Any]]:
    """Return what lies just beyond each limit that the certificate names: that of the worst joint, on its side."""
    for check in checks:
        bound, joint = check["bound"], check["joint"]
        if check["quantity"] not in ORDERS or bound is None or joint is None:
            continue
        side = bound
        if check["quantity"] == "position" and check["value"] is not None:  # its bounds may have any sign
            side = bound - check["value"] if check["holds"] else check["value"] - bound
        beyond = 1.0 if side >= 0 else -1.0
        yield {
            "type": "rect",
            "xref": "x domain",
            "yref": _axis("y", ORDERS.index(check["quantity"])),
            "x0": 0,
            "x1": 1,
            "y0": bound,
            "y1": bound + beyond * _BAND * max(abs(bound), 1e-9),
            "fillcolor": _LIMIT,
            "line": {"width": 0},
            "label": {"text": f"limit of {names[joint]}", "textposition": "bottom right", "font": {"size": 10}},
        }
