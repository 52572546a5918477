"""Which lane a job takes: at once on the event loop, or out of it in a solver's process.

At once means in some 2 ms, whatever the numbers are: methods that are a formula or one banded solve, and little of it.
Everything else goes to a solver, and so does every body that takes long to read.
"""

from pydantic import BaseModel

from ..media import MSGPACK
from ..schemas import PlanBody

#: Methods whose work is bounded by the size of the request, and the waypoints x joints that take some 2 ms.
QUICK = {
    "linear": 1_000,
    "polynomial": 60,
    "cubic_hermite": 500,
    "cubic_spline": 500,
    "quintic_spline": 500,
    "septic_spline": 500,
    "bezier": 100,
    "bspline": 300,
    "trapezoidal": 150,
    "ruckig": 60,
}

#: Samples x joints, and the degree of curves that can have any.
SAMPLES = 10_000
DEGREE = 5

#: Bytes of a body that is read on the event loop, and the arrays, maps and texts in it.
READ = 64 * 1024
PARTS = 2_000

#: Heads of MessagePack's short maps, arrays and texts; a float has such a byte now and then, which does no harm.
_HEADS = bytes(range(0x80, 0xC0))


def short(raw: bytes, coding: str) -> bool:
    """Tell whether a body is quickly read."""
    return len(raw) <= READ and parts(raw, coding) + (raw.count(b'"') // 2 if coding != MSGPACK else 0) <= PARTS


def parts(raw: bytes, coding: str) -> int:
    """Return about how many arrays and maps a body holds, of MessagePack texts, too; in a millisecond for 8 MiB."""
    if coding == MSGPACK:
        return (len(raw) - len(raw.translate(None, _HEADS))) // 2
    return raw.count(b"{") + raw.count(b"[")


def at_once(body: BaseModel) -> bool:
    """Tell whether a plan is quick enough for the event loop."""
    if not isinstance(body, PlanBody) or body.method not in QUICK:
        return False
    dims = len(body.waypoints[0]) if body.waypoints else 0
    if len(body.waypoints) * dims > QUICK[body.method]:
        return False
    degree = (body.options or {}).get("degree", 0)
    if not isinstance(degree, int) or degree > DEGREE:
        return False
    sampling = body.sampling
    if sampling is None:
        return True
    if sampling.times is not None:
        return len(sampling.times) * dims <= SAMPLES
    if sampling.dt is not None:
        if body.times is None or len(body.times) < 2 or not sampling.dt > 0:
            return False  # the number of samples is not known yet
        return (body.times[-1] - body.times[0]) / sampling.dt * dims <= SAMPLES
    return sampling.count is None or sampling.count * dims <= SAMPLES
