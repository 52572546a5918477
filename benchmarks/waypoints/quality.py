"""How good the answers are: all cases of the data at every effort."""

import time
from statistics import median

from planner import PlannerError, plan

from .problems import METHOD, cases, request_of
from .rows import Line, of_plan, remarks

PART = "quality"
EFFORTS = ("fast", "default", "best")
#: Rounds; one where a plan takes longer than so many s.
ROUNDS, SLOW = 3, 0.5


def measure(quick: bool = False) -> list[Line]:
    """Return the lines."""
    found = []
    for name in ("d3_rand_1wp", "ruckig_ex03") if quick else cases():
        for effort in EFFORTS:
            found.append(_row(name, effort, 1 if quick else ROUNDS))
    return found


def _row(name: str, effort: str, rounds: int) -> Line:
    asked, best = request_of(name), cases()[name]["reference"]
    entry = (PART, name, asked.dims, asked.count, effort)
    seconds: list[float] = []
    try:
        done = plan(asked, METHOD, {"effort": effort})  # kernels are compiled
        for _ in range(1 if sum(done.seconds.values()) > SLOW else rounds):
            began = time.process_time()
            done = plan(asked, METHOD, {"effort": effort})
            seconds.append(time.process_time() - began)
    except PlannerError as error:
        return Line(*entry, told=f"**{type(error).__name__}: {error}**")
    taken = done.trajectory.duration
    return Line(
        *entry,
        1e3 * median(seconds),
        over=taken / best["best_known"] - 1.0,
        stops=best["stop_at_waypoints"],
        over_pro=taken / best["ruckig_pro"] - 1.0 if "ruckig_pro" in best else None,
        **of_plan(done),
        told=remarks(done),
        rounds=len(seconds),
    )
