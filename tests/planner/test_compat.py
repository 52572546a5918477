"""from_ruckig: ruckig's InputParameter read as a plan request; what is not honoured is refused by name."""

import re
import subprocess
import sys
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from ruckig import ControlInterface, DurationDiscretization, InputParameter, Result, Ruckig, Synchronization, Trajectory

from planner import InvalidRequest, PlanRequest, from_ruckig, plan
from planner.compat import NAMES, own_names

INF = float("inf")


def made(**changes):
    """A real InputParameter of two joints with limits, and the changes."""
    given = InputParameter(2)
    basic = {
        "target_position": [1.0, -2.0],
        "max_velocity": [1.0, 2.0],
        "max_acceleration": [3.0, 4.0],
        "max_jerk": [10.0, 20.0],
    }
    for name, value in (basic | changes).items():
        setattr(given, name, value)
    return given


def attributes(given):
    return {n: getattr(given, n) for n in dir(given) if not n.startswith("_") and not callable(getattr(given, n))}


def tree(value):
    """The request as comparable lists."""
    if is_dataclass(value):
        return {f.name: tree(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, tuple):
        return [tree(v) for v in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


def findings(given):
    with pytest.raises(InvalidRequest) as caught:
        from_ruckig(given)
    return [(e.field, e.code) for e in caught.value.errors]


#: For every attribute: a value that is honoured, and what the request of it has; else a value that is refused.
HONOURED = {
    "degrees_of_freedom": (None, lambda r: r.dims == 2),
    "current_position": ([0.5, 0.25], lambda r: r.waypoints[0].tolist() == [0.5, 0.25]),
    "current_velocity": ([0.5, 0.0], lambda r: r.start.velocity.tolist() == [0.5, 0.0]),
    "current_acceleration": ([0.0, 1.0], lambda r: r.start.acceleration.tolist() == [0.0, 1.0]),
    "target_position": ([3.0, 4.0], lambda r: r.waypoints[-1].tolist() == [3.0, 4.0]),
    "target_velocity": ([0.5, 0.0], lambda r: r.end.velocity.tolist() == [0.5, 0.0]),
    "target_acceleration": ([0.0, 1.0], lambda r: r.end.acceleration.tolist() == [0.0, 1.0]),
    "intermediate_positions": ([[7.0, 8.0]], lambda r: r.waypoints.tolist() == [[0, 0], [7, 8], [1, -2]]),
    "max_velocity": ([5.0, 6.0], lambda r: r.limits.velocity.upper.tolist() == [5.0, 6.0]),
    "max_acceleration": ([5.0, 6.0], lambda r: r.limits.acceleration.lower.tolist() == [-5.0, -6.0]),
    "max_jerk": ([5.0, INF], lambda r: r.limits.jerk.upper.tolist() == [5.0, INF]),
    "min_velocity": ([-5.0, -6.0], lambda r: r.limits.velocity.lower.tolist() == [-5.0, -6.0]),
    "min_acceleration": ([-5.0, -6.0], lambda r: r.limits.acceleration.lower.tolist() == [-5.0, -6.0]),
    "max_position": ([5.0, INF], lambda r: r.limits.position.upper.tolist() == [5.0, INF]),
    "min_position": ([-5.0, -INF], lambda r: r.limits.position.lower.tolist() == [-5.0, -INF]),
    "per_section_max_velocity": ([[5.0, 1.0]], lambda r: r.limits.velocity.upper.tolist() == [5.0, 1.0]),
    "per_section_max_acceleration": ([[5.0, 1.0]], lambda r: r.limits.acceleration.lower.tolist() == [-5.0, -1.0]),
    "per_section_max_jerk": ([[5.0, 1.0]], lambda r: r.limits.jerk.upper.tolist() == [5.0, 1.0]),
    "per_section_min_velocity": ([[-5.0, -1.0]], lambda r: r.limits.velocity.lower.tolist() == [-5.0, -1.0]),
    "per_section_min_acceleration": ([[-5.0, -1.0]], lambda r: r.limits.acceleration.lower.tolist() == [-5.0, -1.0]),
    "per_section_max_position": ([[5.0, INF]], lambda r: r.limits.position.upper.tolist() == [5.0, INF]),
    "per_section_min_position": ([[-5.0, -INF]], lambda r: r.limits.position.lower.tolist() == [-5.0, -INF]),
    "per_section_minimum_duration": ([4.0], lambda r: r.segment_durations[0].min == 4.0),
    "minimum_duration": (4.0, lambda r: r.duration.min == 4.0),
}
REFUSED = {
    "interrupt_calculation_duration": [(500.0, "")],
    "enabled": [([True, False], "/1")],
    "control_interface": [(ControlInterface.Velocity, "")],
    "synchronization": [(s, "") for s in Synchronization if s.name != "Time"],
    "duration_discretization": [(DurationDiscretization.Discrete, "")],
    "per_dof_control_interface": [([ControlInterface.Position, ControlInterface.Velocity], "/1")],
    "per_dof_synchronization": [([Synchronization.Phase, Synchronization.Time], "/0")],
}


def test_every_attribute_of_ruckig_is_honoured_or_refused():
    found = {n for n in dir(InputParameter) if not n.startswith("_") and n != "validate"}
    assert found == set(NAMES) == set(HONOURED) | set(REFUSED)
    assert not set(HONOURED) & set(REFUSED)


@pytest.mark.parametrize("name", HONOURED)
def test_honoured(name):
    value, holds = HONOURED[name]
    request = from_ruckig(made(**({} if value is None else {name: value})))
    assert isinstance(request, PlanRequest) and holds(request)
    if value is not None:
        assert not np.array_equal(tree(request), tree(from_ruckig(made())))


@pytest.mark.parametrize("name, value, place", [(n, *case) for n, cases in REFUSED.items() for case in cases])
def test_refused_by_name(name, value, place):
    assert findings(made(**{name: value})) == [(f"/{name}{place}", "out_of_range")]


def test_defaults_of_ruckig_ask_for_nothing():
    request = from_ruckig(made())
    assert request.limits.given() == ("velocity", "acceleration", "jerk")
    assert request.start.given() == request.end.given() == ()
    assert request.segment_limits is request.segment_durations is request.duration is request.timeout is None
    assert from_ruckig(made(max_jerk=[INF, INF])).limits.jerk is None
    spelled = {
        "enabled": [True, True],
        "per_dof_control_interface": [ControlInterface.Position] * 2,
        "per_dof_synchronization": [Synchronization.Time] * 2,
        "per_section_minimum_duration": [0.0],
        "minimum_duration": 0.0,
    }
    plain = tree(request)
    assert tree(from_ruckig(made(**spelled))) | {"segment_durations": None} == plain


FULL = {
    "intermediate_positions": [[1.0, 1.0], [2.0, 2.0]],
    "current_velocity": [0.1, 0.0],
    "min_velocity": [-2.0, -3.0],
    "per_section_max_velocity": [[1.0, 2.0], [3.0, 4.0], [5.0, INF]],
    "per_section_minimum_duration": [0.0, 1.5, 2.0],
    "minimum_duration": 4.0,
}


@pytest.mark.parametrize("changes", [{}, FULL])
def test_an_input_a_mapping_and_a_look_alike_are_the_same(changes):
    given = made(**changes)
    values = attributes(given)
    expected = tree(from_ruckig(given))
    assert tree(from_ruckig(values)) == expected
    words = values | {"control_interface": "position", "synchronization": "time", "degrees_of_freedom": None}
    assert tree(from_ruckig(words)) == expected
    arrays = {k: np.array(v) if isinstance(v, list) and not k.startswith("per_dof") else v for k, v in values.items()}
    assert tree(from_ruckig(SimpleNamespace(**arrays))) == expected
    short = {k: v for k, v in values.items() if k in changes or k.startswith(("current", "target", "max"))}
    assert tree(from_ruckig(short)) == expected


def test_limits_of_sections_take_the_place_of_the_general_ones():
    request = from_ruckig(
        made(
            intermediate_positions=[[1.0, 1.0]],
            per_section_max_velocity=[[9.0, 1.0], [0.5, 8.0]],
            per_section_min_acceleration=[[-1.0, -9.0], [-3.0, -4.0]],
        )
    )
    assert request.limits.velocity.upper.tolist() == [9.0, 8.0]
    assert request.limits.acceleration.lower.tolist() == [-3.0, -9.0]
    assert request.limits.acceleration.upper.tolist() == [3.0, 4.0]
    first, second = request.segment_limits
    assert first.velocity.upper.tolist() == [9.0, 1.0] and first.velocity.lower.tolist() == [-9.0, -1.0]
    assert second.velocity.upper.tolist() == [0.5, 8.0]
    assert first.acceleration.lower.tolist() == [-1.0, -9.0] and first.acceleration.upper.tolist() == [3.0, 4.0]


def test_a_general_lower_limit_stays_beside_upper_limits_of_sections():
    request = from_ruckig(made(min_velocity=[-1.0, -9.0], per_section_max_velocity=[[5.0, 5.0]]))
    assert request.limits.velocity.lower.tolist() == [-1.0, -5.0]


def test_general_limits_left_at_zero_where_all_sections_have_their_own():
    given = made(max_velocity=[0.0, 0.0], per_section_max_velocity=[[1.0, 1.0]])
    assert from_ruckig(given).limits.velocity.upper.tolist() == [1.0, 1.0]
    assert findings(made(max_velocity=[0.0, 1.0])) == [("/max_velocity", "bad_limits")]
    rows = attributes(given) | {"per_section_max_velocity": [[1.0, None]]}
    assert findings(rows) == [("/max_velocity", "bad_limits")]


NAN = float("nan")


@pytest.mark.parametrize(
    "changes, field, code",
    [
        ({"target_position": [1.0, NAN]}, "/target_position/1", "not_finite"),
        ({"target_position": [1.0]}, "/target_position", "shape_mismatch"),
        ({"current_velocity": [0.0]}, "/current_velocity", "shape_mismatch"),
        ({"current_acceleration": [NAN, 0.0]}, "/current_acceleration/0", "not_finite"),
        ({"intermediate_positions": [[1.0, 2.0], [3.0]]}, "/intermediate_positions/1", "shape_mismatch"),
        ({"intermediate_positions": [[1.0, 2.0], [3.0, NAN]]}, "/intermediate_positions/1/1", "not_finite"),
        ({"max_velocity": [1.0, 2.0, 3.0]}, "/max_velocity", "shape_mismatch"),
        ({"max_velocity": [1.0, NAN]}, "/max_velocity/1", "not_finite"),
        ({"max_velocity": [1.0, -INF]}, "/max_velocity/1", "not_finite"),
        ({"max_jerk": [1.0, -1.0]}, "/max_jerk", "bad_limits"),
        ({"min_acceleration": [-1.0, 1.0]}, "/min_acceleration", "bad_limits"),
        ({"min_acceleration": [-1.0, 0.0]}, "/min_acceleration", "bad_limits"),
        ({"max_velocity": [1e10, 1.0]}, "/max_velocity/0", "out_of_range"),
        ({"max_position": [1.0, 1.0], "min_position": [-1.0, 1.0]}, "/max_position", "bad_limits"),
        ({"min_position": [2.0, 2.0], "per_section_max_position": [[5.0, 1.0]]}, "/per_section_max_position/0", None),
        ({"max_position": [2.0, 2.0], "per_section_min_position": [[0.0, 3.0]]}, "/per_section_min_position/0", None),
        ({"per_section_max_velocity": [[1.0, 1.0]] * 2}, "/per_section_max_velocity", "shape_mismatch"),
        ({"per_section_max_velocity": [[1.0]]}, "/per_section_max_velocity/0", "shape_mismatch"),
        ({"per_section_max_velocity": [[1.0, 0.0]]}, "/per_section_max_velocity/0", "bad_limits"),
        ({"per_section_max_jerk": [[1.0, NAN]]}, "/per_section_max_jerk/0/1", "not_finite"),
        ({"per_section_minimum_duration": [1.0, 2.0]}, "/per_section_minimum_duration", "shape_mismatch"),
        ({"per_section_minimum_duration": [-1.0]}, "/per_section_minimum_duration/0", "out_of_range"),
        ({"minimum_duration": NAN}, "/minimum_duration", "not_finite"),
        ({"enabled": [True]}, "/enabled", "shape_mismatch"),
    ],
)
def test_errors_point_to_ruckigs_names(changes, field, code):
    found = findings(made(**changes))
    assert found == [(field, code or "bad_limits")]


@pytest.mark.parametrize(
    "changes, field, code",
    [
        ({"current_position": None}, "/current_position", "missing"),
        ({"current_position": "ab"}, "/current_position", "wrong_type"),
        ({"current_position": [], "target_position": []}, "/current_position", "too_few_points"),
        ({"degrees_of_freedom": 1.5}, "/degrees_of_freedom", "out_of_range"),
        ({"degrees_of_freedom": 3}, "/current_position", "shape_mismatch"),
        ({"max_velocity": 1.0}, "/max_velocity", "wrong_type"),
        ({"max_velocity": np.array(1.0)}, "/max_velocity", "wrong_type"),
        ({"max_velocity": ["1", 1]}, "/max_velocity/0", "wrong_type"),
        ({"target_velocity": [None, 1.0]}, "/target_velocity", "wrong_type"),
        ({"intermediate_positions": [1.0, 2.0]}, "/intermediate_positions/0", "wrong_type"),
        ({"per_section_max_velocity": [[[1.0], [1.0]]]}, "/per_section_max_velocity/0/0", "wrong_type"),
        ({"per_section_max_velocity": [[[1.0, 2.0], 1.0]]}, "/per_section_max_velocity/0/0", "wrong_type"),
        ({"intermediate_positions": [[[1.0, 2.0], 1.0]]}, "/intermediate_positions", "shape_mismatch"),
        ({"enabled": [True, 1]}, "/enabled/1", "wrong_type"),
        ({"synchronization": "phase"}, "/synchronization", "out_of_range"),
        ({"synchronization": 7}, "/synchronization", "out_of_range"),
        ({"timeout": 0.0}, "/timeout", "out_of_range"),
        ({"max_snap": [1.0, 1.0]}, "/max_snap", "unknown_field"),
    ],
)
def test_errors_of_mappings(changes, field, code):
    given = {"current_position": [0.0, 0.0], "target_position": [1.0, 1.0]} | changes
    assert (field, code) in findings(given)


def test_all_findings_come_at_once():
    found = findings(made(max_velocity=[1.0], enabled=[False, True], current_velocity=[NAN, 0.0]))
    assert {field for field, _ in found} == {"/max_velocity", "/enabled/0", "/current_velocity/0"}


def test_what_a_later_ruckig_adds_is_refused_where_it_is_set():
    values = attributes(made())
    assert from_ruckig(SimpleNamespace(**values, max_snap=None, validate=print)).dims == 2
    assert findings(SimpleNamespace(**values, max_snap=[1.0, 1.0])) == [("/max_snap", "unknown_field")]


@pytest.mark.parametrize("given", [None, 5, "ab", [1, 2], object()])
def test_what_is_no_input_at_all(given):
    assert findings(given) == [("", "wrong_type")]


def test_errors_of_the_plan_can_be_told_in_ruckigs_names():
    request = from_ruckig(made(max_acceleration=[INF, INF]))
    with pytest.raises(InvalidRequest) as caught:
        plan(request)
    assert own_names(caught.value, request.count - 1).errors[0].field == "/max_acceleration"


def test_the_plan_keeps_what_was_asked():
    given = made(
        intermediate_positions=[[1.0, 1.0]],
        min_velocity=[-0.5, -1.5],
        per_section_max_velocity=[[0.5, 0.5], [1.0, 2.0]],
    )
    answer = plan(from_ruckig(given))
    assert answer.certificate.holds
    assert answer.trajectory(answer.waypoint_times) == pytest.approx(np.array([[0, 0], [1, 1], [1, -2]]), abs=1e-6)
    time = np.linspace(0, answer.waypoint_times[1], 301)[:-1]
    assert np.abs(answer.trajectory(time, 1)).max() <= 0.5 * (1 + 1e-6)
    assert answer.trajectory(answer.trajectory.duration, 1) == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize("jerk, method", [([10.0, 20.0], "auto"), ([INF, INF], "ruckig")])
def test_state_to_state_is_as_fast_as_ruckig(jerk, method):
    given = made(max_jerk=jerk, current_velocity=[0.5, 0.0], target_velocity=[0.0, -0.5])
    theirs = Trajectory(2)
    assert Ruckig(2).calculate(given, theirs) == Result.Working
    ours = plan(from_ruckig(given), method)
    assert ours.trajectory.duration == pytest.approx(theirs.duration, rel=1e-2)
    assert ours.trajectory(0.0, 1) == pytest.approx([0.5, 0.0], abs=1e-6)
    assert ours.trajectory(ours.trajectory.duration, 1) == pytest.approx([0.0, -0.5], abs=1e-6)


def test_ruckig_is_not_imported():
    code = "import sys, planner.compat; print('ruckig' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


PAGE = (Path(__file__).resolve().parents[2] / "docs" / "from_ruckig.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```python\n(.*?)```\n\n```text\n(.*?)```", PAGE, re.S)


@pytest.mark.parametrize("number", range(PAGE.count("```python")))
def test_the_page_prints_what_it_shows(number, capsys):
    code, shown = EXAMPLES[number]
    exec(compile(code, "from_ruckig.md", "exec"), {})
    assert capsys.readouterr().out == shown


def test_the_page_tells_of_every_field():
    rows = PAGE.partition("## Fields")[2].partition("## The answer")[0]
    assert {n for line in rows.splitlines() if line.startswith("| `") for n in re.findall(r"`(\w+)`", line)} >= set(
        NAMES
    )
