"""How the time grows with the waypoints: it should be the same a waypoint."""

from statistics import median

from planner import plan

from ..minimum_jerk.rounds import in_turn, over
from .problems import METHOD, long_request
from .rows import Line, of_plan, remarks

PART = "growth"
SIZES = (5, 10, 20, 50, 100, 200)
#: The most: time a waypoint at the most waypoints over that at this many.
GROWTH, BASE = 2.0, 10


def measure(quick: bool = False) -> list[Line]:
    """Return the lines."""
    sizes = (5, 10) if quick else SIZES
    asked = {n: long_request(n) for n in sizes}
    plans = {n: plan(request, METHOD) for n, request in asked.items()}
    calls = {n: (lambda request=request: plan(request, METHOD)) for n, request in asked.items()}
    seconds = in_turn(calls, 1 if quick else 5, budget=30.0)
    found = []
    for n, own in seconds.items():
        each = over(own, seconds[BASE]) * BASE / n
        goal = GROWTH if n == SIZES[-1] else None
        entry = (PART, "six joints", asked[n].dims, n, f"time a waypoint over that at {BASE}")
        found.append(
            Line(
                *entry,
                1e3 * median(own),
                each,
                goal,
                True,
                **of_plan(plans[n]),
                told=remarks(plans[n]),
                rounds=len(own),
            )
        )
    return found
