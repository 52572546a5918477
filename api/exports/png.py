"""A picture, drawn without a display: position, velocity, acceleration and jerk over time."""

import io
from collections.abc import Iterator

from ..draft import Draft
from ..formats.samples import samples_of
from ..result import Result


def write(draft: Draft) -> Iterator[bytes]:
    """Write the figure of ``Result.plot``."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    drawn, tree = samples_of(draft), draft.tree
    figure = Result(
        method=tree["method"],
        duration=tree["duration"],
        waypoint_times=tree["waypoint_times"],
        samples=drawn.part(),
        polynomial=drawn.trajectory,
        certificate=tree["certificate"],
        solver=tree["solver"],
        warnings=(),
        digest=tree["digest"],
    ).plot()
    FigureCanvasAgg(figure)
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=120, metadata={"Software": None})  # which version drew it is not said
    yield file.getvalue()
