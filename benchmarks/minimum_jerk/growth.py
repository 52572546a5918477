"""How the time of a spline without limits grows with its waypoints: a picture with logarithmic axes."""

from collections.abc import Sequence
from pathlib import Path

from . import unlimited
from .rounds import Standing

NAME = "growth.png"


def draw(rows: Sequence[Standing], out: Path) -> Path | None:
    """Draw the standings without limits, a panel for each number of joints; return the file, or None without any."""
    import matplotlib
    from matplotlib.figure import Figure

    from examples.gallery import STYLE

    shown = [r for r in rows if r.part == unlimited.PART and r.ms is not None]
    joints = sorted({r.joints for r in shown})
    if not joints:
        return None
    entries = list(dict.fromkeys(r.entry for r in shown))
    timed = [entry for entry in entries if entry != unlimited.FILL]
    styles = {entry: {"color": f"C{i}", "marker": "o", "markersize": 4} for i, entry in enumerate(timed)}
    styles[unlimited.FILL] = {"color": "0.5", "linestyle": ":"}
    with matplotlib.rc_context({**STYLE, "figure.figsize": (4.0 * len(joints), 4.5)}):
        figure = Figure()
        panels = figure.subplots(1, len(joints), sharey=True, squeeze=False)[0]
        for panel, dims in zip(panels, joints, strict=True):
            for entry in entries:
                mine = [r for r in shown if (r.joints, r.entry) == (dims, entry)]
                counts, seconds = [r.waypoints for r in mine], [1e-3 * r.ms for r in mine if r.ms is not None]
                panel.loglog(counts, seconds, label=entry, **styles[entry])
            panel.set(title=f"{dims} joints", xlabel="waypoints")
        panels[0].set_ylabel("process time of a call, s")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
        out.mkdir(parents=True, exist_ok=True)
        figure.savefig(out / NAME, metadata={"Software": None})
    return out / NAME
