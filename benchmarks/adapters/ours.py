"""Our methods: every one that takes the problem, checked and certified as always."""

from collections.abc import Mapping
from functools import partial
from typing import Any

from planner import METHODS, InvalidRequest, Plan, plan
from planner.method import Method
from planner.options import read_options

from ..cases import Problem
from .entry import Answer, Entry


def entries(problem: Problem) -> list[Entry]:
    """Return the methods that answer this kind of problem."""
    request = problem.asked
    options: Mapping[str, Any] = {} if problem.path is None else {"path": problem.path}
    return [
        Entry(m.id, "waywright", partial(plan, request, m.id, options), _read, _solving)
        for m in METHODS.values()
        if _fits(m, problem, options)
    ]


def _fits(method: Method, problem: Problem, options: Mapping[str, Any]) -> bool:
    """Return whether the method keeps given times, follows a given path and rests at its ends."""
    if problem.path is not None and "path" not in method.options.model_fields:
        return False
    try:
        can = method.capabilities(read_options(method.options, options))
    except InvalidRequest:  # a path of a kind that it does not know
        return False
    return can.timing == "given" if problem.group == "times" else "velocity" in can.rests | can.start


def _read(answer: Plan) -> Answer:
    return Answer(answer.trajectory, answer.waypoint_times)


def _solving(answer: Plan) -> float:
    return answer.seconds["pose"] + answer.seconds["solve"]
