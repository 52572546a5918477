"""The tab that plans: what is dragged, typed or pasted is what is planned, and the newest answer is what is drawn."""

import json
import math
from itertools import pairwise

import numpy as np
import pytest

TIMED = {"waypoints": [[0, 0], [1, 2], [2, 3]], "times": [0, 1, 2]}
TIGHT = {"waypoints": [[0], [1]], "times": [0, 1], "limits": {"velocity": 0.5}}
FREE = {"waypoints": [[0, 0], [1, 2], [2, 0.5]], "limits": {"velocity": 1, "acceleration": 2, "jerk": 10}}
AXES = {"position": "y", "velocity": "y2", "acceleration": "y3", "jerk": "y4"}
AHEAD = """([id, name, value, by]) => {
  const axis = document.getElementById(id)._fullLayout[name];
  return axis.p2d(axis.d2p(value) + by);
}"""


def plan(ask, request):
    include = sorted({*request.get("include", []), "samples"})
    return ask("/v1/trajectories", {**request, "include": include})


def check_drawn(screen, ask):
    """The curves are those of the answer to the last request."""
    answer, lines = plan(ask, screen.sent), screen.lines()
    for name, axis in AXES.items():
        rows = np.array(answer["samples"][name])
        assert len(lines[axis]) == rows.shape[1]
        for d, (x, y) in enumerate(lines[axis]):
            np.testing.assert_allclose(x, answer["samples"]["time"], rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(y, rows[:, d], rtol=1e-9, atol=1e-9 * max(1.0, np.abs(rows).max()))
    assert f"{answer['duration']:.4g}"[:4] in screen.tile("Duration")
    return answer


def centre(node):
    box = node.bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def value_at(screen, chart, axis, value, by):
    """What lies so many pixels further on an axis of a chart; and what a pixel is worth."""
    there, next_to = (screen.page.evaluate(AHEAD, [chart, axis, value, by + one]) for one in (0, 1))
    return there, abs(next_to - there)


def drag(screen, label, dx, dy, steps=8):
    """Drag a handle in steps, each as soon as the one before is drawn; returns the plans drawn before it was let go."""
    mouse, before = screen.page.mouse, screen.planned
    x, y = centre(screen.handle(label))
    mouse.move(x, y)
    mouse.down()
    for k in range(1, steps + 1):
        now = screen.planned
        mouse.move(x + dx * k / steps, y + dy * k / steps)
        screen.more_than(now)
    held = screen.planned - before
    mouse.up()
    screen.settled()
    return held


@pytest.mark.parametrize("given", [TIMED, FREE], ids=["timed", "free"])
def test_a_waypoint_is_dragged(loaded, ask, given):
    screen, before = loaded.show(given), given["waypoints"]
    first = screen.lines()
    wanted, pixel = value_at(screen, "time-chart", "yaxis", before[1][1], -40)
    assert drag(screen, "waypoint 1, joint 1", 0, -40) >= 8
    assert screen.lines() != first
    moved = screen.sent["waypoints"]
    assert abs(moved[1][1] - wanted) <= pixel
    assert (moved[0], moved[1][0], moved[2]) == (before[0], before[1][0], before[2])
    assert screen.sent.get("times") == given.get("times")
    check_drawn(screen, ask)
    assert float(screen.field("/waypoints/1/1").locator("input").input_value()) == moved[1][1]


#: Of each line over time that is on the screen, by axis: what its points are worth.
SEEN = """() => {
  const div = document.getElementById("time-chart");
  const seen = {};
  for (const name of ["y", "y2", "y3", "y4"]) {
    const axis = div._fullLayout[name.replace("y", "yaxis")];
    const lines = [...div.querySelectorAll(`.subplot.x${name} path.js-line`)];
    const heights = (line) => line.getAttribute("d").slice(1).split("L").map((place) => place.split(",")[1]);
    seen[name] = lines.map((line) => heights(line).map((height) => axis.p2l(height)));
  }
  return seen;
}"""


#: Count from now on how often the motion is drawn as a whole.
COUNT = """() => {
  window.drawWhole ??= Plotly.react;
  window.whole = 0;
  Plotly.react = (div, ...rest) => {
    whole += div.id === "time-chart" ? 1 : 0;
    return drawWhole(div, ...rest);
  };
}"""


def check_seen(screen, ask):
    """What is on the screen is the answer to the last request, to a tenth of a pixel."""
    answer, seen = plan(ask, screen.sent), screen.page.evaluate(SEEN)
    for name, axis in AXES.items():
        rows = np.array(answer["samples"][name])
        near = 0.1 * value_at(screen, "time-chart", axis.replace("y", "yaxis"), 0, 0)[1]
        assert len(seen[axis]) == rows.shape[1]
        for d, line in enumerate(seen[axis]):
            np.testing.assert_allclose(line, rows[:, d], rtol=0, atol=near)


@pytest.mark.parametrize("given", [TIMED, FREE], ids=["timed", "free"])
def test_what_is_held_is_seen_at_once_and_put_back(loaded, ask, given):
    screen = loaded.show(given)
    check_seen(screen, ask)
    first = screen.page.evaluate(SEEN)
    screen.page.evaluate(COUNT)
    mouse, (x, y) = screen.page.mouse, centre(screen.handle("waypoint 1, joint 1"))
    mouse.move(x, y)
    mouse.down()
    for k in range(1, 9):
        now = screen.planned
        mouse.move(x, y - k / 2)
        screen.more_than(now).settled()
        check_seen(screen, ask)
    assert screen.page.evaluate("whole") <= 4  # mostly lines and marks alone are moved
    assert screen.sent["waypoints"] != given["waypoints"]
    now = screen.planned
    screen.page.keyboard.press("Escape")
    screen.more_than(now).settled()
    mouse.up()
    assert screen.sent["waypoints"] == given["waypoints"]
    check_seen(screen, ask)
    assert screen.page.evaluate(SEEN) == first


def test_what_was_only_held_is_drawn_as_a_whole_when_let_go(loaded, ask):
    """While something is held only lines are moved: plotly's own data, for its pictures and labels, follow."""
    screen = loaded.show(FREE)
    mouse = screen.page.mouse
    mouse.move(*centre(screen.handle("waypoint 1, joint 1")))
    mouse.down()
    with screen.planning():
        screen.page.evaluate("""() => {
          const box = document.querySelector('#panel-plan [data-at="/limits/velocity"] input');
          box.value = "0.95";
          box.dispatchEvent(new Event("input"));
        }""")
    mouse.up()
    end = plan(ask, screen.sent)["samples"]["time"][-1]
    last = "end => document.querySelector('#time-chart').data[0].x.at(-1) === end"
    screen.page.wait_for_function(last, arg=end)
    check_drawn(screen, ask)


def test_limits_of_a_segment_go_with_the_waypoint_that_is_held(loaded):
    screen = loaded.show({**FREE, "segment_limits": [{"velocity": 0.5}, None]})
    edge = "document.querySelector('#time-chart').layout.shapes.find(({ xref, x0 }) => xref === 'x' && x0 > 0).x0"
    mouse, (x, y), first = screen.page.mouse, centre(screen.handle("waypoint 1, joint 0")), screen.page.evaluate(edge)
    mouse.move(x, y)
    mouse.down()
    with screen.planning():
        mouse.move(x, y + 30)
    assert screen.page.evaluate(edge) != first
    marks = (
        "document.querySelector('#time-chart').data.find(({ mode, yaxis }) => mode === 'markers' && yaxis === 'y').x[1]"
    )
    assert screen.page.evaluate(edge) == screen.page.evaluate(marks)
    mouse.up()
    screen.settled()


def test_a_zoom_stays_until_it_is_reset(loaded):
    screen = loaded.show(TIMED)
    window = "document.querySelector('#time-chart')._fullLayout.xaxis.range"
    screen.page.evaluate("Plotly.relayout('time-chart', { 'xaxis.range[0]': 0.4, 'xaxis.range[1]': 1.2 })")
    drag(screen, "waypoint 1, joint 1", 0, -20)
    with screen.planning():
        screen.field("/times/2").locator("input").fill("2.5")
    assert screen.page.evaluate(window) == [0.4, 1.2]
    screen.page.evaluate("document.querySelector('#time-chart').emit('plotly_doubleclick')")
    with screen.planning():
        screen.field("/times/2").locator("input").fill("3")
    assert screen.page.evaluate(window)[1] > 3
    screen.page.evaluate("Plotly.relayout('time-chart', { 'xaxis.range[0]': 0.4, 'xaxis.range[1]': 1.2 })")
    screen.show(FREE)  # of other waypoints
    screen.show({**TIMED, "waypoints": [[0], [1], [2]]})
    assert screen.page.evaluate(window)[0] <= 0


def test_a_waypoint_is_dragged_in_time(loaded, ask):
    screen = loaded.show(TIMED)
    time, pixel = value_at(screen, "time-chart", "xaxis", 1, 60)
    value, unit = value_at(screen, "time-chart", "yaxis", 1, 25)
    drag(screen, "waypoint 1, joint 0", 60, 25)
    sent = screen.sent
    assert abs(sent["times"][1] - time) <= pixel and abs(sent["waypoints"][1][0] - value) <= unit
    assert sent["times"][::2] == [0, 2]
    check_drawn(screen, ask)
    # past its neighbour it does not go: the order of the waypoints is what the user gave
    drag(screen, "waypoint 1, joint 0", 600, -10)
    assert all(a < b for a, b in pairwise(screen.sent["times"]))
    check_drawn(screen, ask)


def test_a_waypoint_is_dragged_in_the_plane(loaded, ask):
    screen = loaded.show(FREE)
    before = zip(("xaxis", "yaxis"), FREE["waypoints"][1], strict=True)
    wanted = [value_at(screen, "plane-chart", axis, value, 30) for axis, value in before]
    assert drag(screen, "waypoint 1", 30, 30) >= 8
    for value, (there, pixel) in zip(screen.sent["waypoints"][1], wanted, strict=True):
        assert abs(value - there) <= pixel
    answer = check_drawn(screen, ask)
    path = screen.page.evaluate("document.querySelector('#plane-chart').data.find(({ name }) => name === 'path')")
    positions = answer["samples"]["position"]
    np.testing.assert_allclose(np.column_stack([path["x"], path["y"]]), positions, rtol=1e-9, atol=1e-9)


def test_the_chart_stays_where_it_is(loaded):
    screen = loaded.show(TIMED)
    boxes, take = [], lambda: boxes.append(screen.page.locator("#time-chart").bounding_box())
    take()
    mouse, (x, y) = screen.page.mouse, centre(screen.handle("waypoint 1, joint 0"))
    mouse.move(x, y)
    mouse.down()
    for k in range(1, 6):
        with screen.planning():
            mouse.move(x, y - 10 * k)
        take()
    mouse.up()
    screen.settled()
    take()
    for side in ("x", "y", "width", "height"):
        values = [box[side] for box in boxes]
        assert max(values) - min(values) <= 2, side


def test_an_older_answer_never_overtakes(loaded, ask):
    """One answer is held back while three newer requests are made: the last one is what is drawn."""
    screen, held = loaded.show(TIMED), []

    def hold(route):
        if held:
            route.continue_()
        else:
            held.append(route)

    screen.page.route("**/v1/trajectories", hold)
    box = screen.field("/waypoints/1/0").locator("input")
    for value in ("1.1", "1.2", "1.3"):
        box.fill(value)
    before = screen.planned
    held[0].continue_()
    screen.more_than(before).settled()
    screen.page.unroute("**/v1/trajectories")
    assert screen.sent["waypoints"][1][0] == 1.3
    check_drawn(screen, ask)
    # those in between were never asked for
    assert [1.1, 1.3] == screen.page.evaluate("spy.sent.slice(-2).map(({ waypoints }) => waypoints[1][0])")


def test_an_answer_that_keeps_others_waiting_is_given_up(loaded, ask):
    screen, held = loaded.show(TIMED), []
    screen.page.route("**/v1/trajectories", lambda route: route.continue_() if held else held.append(route))
    box = screen.field("/waypoints/1/0").locator("input")
    before = screen.planned
    box.fill("1.1")
    box.fill("1.4")
    screen.more_than(before).settled()
    screen.page.unroute("**/v1/trajectories")
    assert screen.sent["waypoints"][1][0] == 1.4
    check_drawn(screen, ask)


def test_every_example_is_planned(loaded, ask):
    screen = loaded.show(TIMED)
    choice = screen.page.get_by_label("Example")
    cases = ask("/v1/cases")
    assert [*choice.locator("option").all_inner_texts()][1:] == [case["title"] for case in cases]
    for case in cases:
        with screen.planning():
            choice.select_option(case["name"])
        assert choice.input_value() == case["name"]
        assert {**screen.sent, "include": None} == {**case["request"], "include": None}, case["name"]
        assert "✓ holds" in screen.tile("Certificate"), case["name"]
        assert not screen.page.locator("#panel-plan .failure, #panel-plan .broken, #panel-plan .wrong").count()
        rows = np.array(case["request"]["waypoints"])
        assert len(screen.lines()["y"]) == rows.shape[1]
        assert screen.page.get_by_label("The path in the plane").is_visible() == (rows.shape[1] == 2)
        marks = screen.page.get_by_label("The motion over time", exact=True).locator(".handle").count()
        assert marks in (0, rows.size), case["name"]


def test_limits_are_typed_and_slid(loaded, ask):
    screen = loaded.show(FREE)
    row = screen.field("/limits/velocity")
    box, slider = row.get_by_role("textbox"), row.get_by_role("slider")
    for text in ("0.8", "0.8, 2", '{"lower": -1, "upper": [1, 2]}'):
        with screen.planning():
            box.fill(text)
        assert screen.sent["limits"]["velocity"] == json.loads(f"[{text}]" if text == "0.8, 2" else text)
    shapes = screen.page.evaluate("document.querySelector('#time-chart').layout.shapes")
    assert {one[side] for one in shapes if one["yref"] == "y2" for side in ("y0", "y1")} == {-1, 1, 2}
    with screen.planning():
        slider.fill("-0.3")
    slid, factor = screen.sent["limits"]["velocity"], 10**-0.3
    assert [slid["lower"], *slid["upper"]] == pytest.approx([-factor, factor, 2 * factor], rel=1e-2)
    assert json.loads(box.input_value()) == slid
    answer = check_drawn(screen, ask)
    assert answer["certificate"]["holds"]
    screen.show({**FREE, "limits": {"acceleration": 2}})
    assert slider.is_disabled() and box.input_value() == ""
    with screen.planning():
        screen.field("/limits/acceleration").get_by_role("slider").fill("0.5")
    assert screen.sent["limits"] == {"acceleration": pytest.approx(2 * 10**0.5, rel=1e-2)}


def test_waypoints_joints_and_times_come_and_go(loaded, ask, watch):
    watch.refusals = {422}  # what another method does in that time, none may at those times
    screen = loaded.show(FREE)
    steps = {"+ waypoint": (4, 2), "+ joint": (4, 3), "− joint": (4, 2), "remove waypoint 1": (3, 2)}
    for name, shape in steps.items():
        with screen.planning():
            screen.page.get_by_role("button", name=name, exact=True).click()
        assert np.shape(screen.sent["waypoints"]) == shape, name
    known = plan(ask, screen.sent)["waypoint_times"]
    with screen.planning():
        screen.page.get_by_label("at given times").check()
    assert screen.sent["times"] == pytest.approx(known, abs=1e-3)
    with screen.planning():
        screen.page.get_by_label("at given times").uncheck()
    assert "times" not in screen.sent


@pytest.mark.parametrize("quantity", ["velocity", "acceleration", "jerk"])
def test_the_worst_is_marked_where_it_is(loaded, ask, quantity):
    screen = loaded.show(FREE)
    answer = plan(ask, FREE)
    found = [trace for trace in screen.drawn() if trace["name"] == "certified extremum"]
    marks = {trace["axis"]: (trace["x"][0], trace["y"][0]) for trace in found}
    check = next(one for one in answer["certificate"]["checks"] if one["quantity"] == quantity)
    assert marks[AXES[quantity]] == (check["time"], check["value"])
    heads = screen.page.get_by_role("rowheader", name=quantity, exact=True)
    row = screen.page.locator("#panel-plan table.checks tr", has=heads).inner_text()
    assert f"{100 * check['ratio']:.5g} %" in row and "✓" in row


def test_gap_and_certificate_at_a_glance(loaded, ask):
    screen = loaded.show({**TIMED, "limits": {"velocity": 3.5}})
    answer = plan(ask, screen.sent)
    assert f"{answer['duration']:g} s" in screen.tile("Duration") and "times were given" in screen.tile("Duration")
    assert math.isclose(answer["certificate"]["objective"]["gap"], 0, abs_tol=1e-9)
    assert "%" in screen.tile("From optimal") and "squared jerk" in screen.tile("From optimal")
    assert "✓ holds" in screen.tile("Certificate") and " ms" in screen.tile("Computed in")
