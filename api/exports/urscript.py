"""A URScript program: a ``servoj`` for every sample, which holds the robot to the trajectory's own clock."""

from collections.abc import Iterator

import numpy as np

from planner import InvalidRequest

from ..controllers import CONTROLLERS
from ..draft import Draft
from ..formats.samples import samples_of

#: Joints, and the period of the controller, s (e-Series and UR20/30: 500 Hz).
UR = CONTROLLERS["ur"]

#: Arguments of ``servoj``: seconds of looking ahead, and the gain of following.
LOOKAHEAD_TIME, GAIN = 0.1, 300

#: How far each joint may be from the first sample when the program starts, rad.
NEAR = 0.01

_HEAD = """# {title}
# A row every {period} s. Joints in rad. The robot has to stand at the first row when the program starts.
def waywright():
  start = {start}
  here = get_actual_joint_positions()
  i = 0
  while i < 6:
    if norm(here[i] - start[i]) > {near:g}:
      popup("The robot does not stand at the first row.", title="waywright", error=True, blocking=True)
      halt
    end
    i = i + 1
  end
"""

_TAIL = """  stopj(2.0)
end

waywright()
"""


def write(draft: Draft) -> Iterator[bytes]:
    """Write the program.

    Raises
    ------
    InvalidRequest
        Not six joints, or samples that are not one period apart, a whole multiple of 2 ms.
    """
    drawn = samples_of(draft)
    if drawn.dims != UR.joints:
        raise InvalidRequest.of("/waypoints", "shape_mismatch", f"a UR has {UR.joints} joints, not {drawn.dims}")
    period = _period(drawn.times)
    title = f"{draft.tree['method']}, {draft.tree['duration']:.6g} s, {len(drawn.times)} rows, waywright"
    start = _row(drawn.order(0, 0, 1)[0])
    yield _HEAD.format(title=title, period=f"{period:.3f}", start=start, near=NEAR).encode()
    settings = f"t={period:.3f}, lookahead_time={LOOKAHEAD_TIME:g}, gain={GAIN}"
    for begin, end in drawn.slices(4 * drawn.dims):
        rows = (f"  servoj({_row(row)}, {settings})\n" for row in drawn.order(0, begin, end))
        yield "".join(rows).encode()
    yield _TAIL.encode()


def _row(position: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    """Return joint positions to a nanoradian, never with an exponent."""
    return "[" + ", ".join(f"{value + 0.0:.9f}" for value in position.tolist()) + "]"


def _period(times: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    """Return the period of the samples, s."""
    steps = np.diff(times)
    cycles = round(float(steps[0]) / UR.period)
    period = cycles * UR.period
    slack = 1e-6 * UR.period + 4 * np.spacing(np.abs(times).max())
    off = np.abs(steps - period) > slack
    if cycles < 1 or off.any():
        k = int(np.argmax(off))
        reason = (
            f"a UR takes a row every {UR.period:g} s or a whole multiple of it, one as long as the other; "
            f"rows {k} and {k + 1} are {steps[k]:.9g} s apart (--controller ur makes such samples)"
        )
        raise InvalidRequest.of("/sampling", "out_of_range", reason)
    return period
