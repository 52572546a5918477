"""Pasted text: what is read from it, what is wrong with it and where, how much of it is drawn."""

import json

import pytest

pytestmark = pytest.mark.slow

TIMED = {"waypoints": [[0, 0], [1, 2], [2, 3]], "times": [0, 1, 2]}
FREE = {"waypoints": [[0, 0], [1, 2], [2, 0.5]], "limits": {"velocity": 1, "acceleration": 2, "jerk": 10}}
ROS = {
    "header": {"frame_id": ""},
    "joint_names": ["a", "b"],
    "points": [
        {"positions": [0.0, 1.0], "time_from_start": {"sec": 0, "nanosec": 0}},
        {"positions": [0.5, 2.0], "time_from_start": {"sec": 0, "nanosec": 500000000}},
    ],
}


def paste(screen, text):
    area = screen.page.get_by_label("waypoints as text")
    if not area.is_visible():
        screen.page.get_by_text("Paste or edit as text").click()
    area.fill(text)
    screen.page.get_by_role("button", name="Take these waypoints").click()


@pytest.mark.parametrize(
    "text, wanted",
    [
        ("time,position_1,position_2\n0,0,0\n1,1,2\n", {"waypoints": [[0, 0], [1, 2]], "times": [0, 1]}),
        ("t;x;y\r\n0;0;0\r\n1;1;2\r\n", {"waypoints": [[0, 0], [1, 2]], "times": [0, 1]}),
        ("0,0\n1 2\n\n# a remark\n3\t1", {"waypoints": [[0, 0], [1, 2], [3, 1]]}),
        ("1e-3,-2\n1e0,2E-1", {"waypoints": [[0.001, -2], [1, 0.2]]}),
        (json.dumps(ROS), {"waypoints": [[0, 1], [0.5, 2]], "times": [0, 0.5], "joint_names": ["a", "b"]}),
        ("[[0, 0], [1, 2], [3, 1]]", {"waypoints": [[0, 0], [1, 2], [3, 1]]}),
    ],
)
def test_waypoints_are_pasted(loaded, text, wanted):
    screen = loaded.show(FREE if "times" not in wanted else TIMED)
    with screen.planning():
        paste(screen, text)
    taken = {name: value for name, value in screen.sent.items() if name in ("waypoints", "times", "joint_names")}
    assert taken == wanted
    assert "✓ holds" in screen.tile("Certificate")


def test_a_whole_request_is_pasted(loaded, ask):
    screen = loaded.show(TIMED)
    for case in ask("/v1/cases")[:4]:
        with screen.planning():
            paste(screen, json.dumps(case["request"]))
        assert {**screen.sent, "include": case["request"].get("include")} == {"include": None, **case["request"]}
    screen.page.get_by_text("The request as JSON").click()
    area = screen.page.get_by_label("the request as JSON")
    assert json.loads(area.input_value()) == case["request"]
    area.fill(json.dumps(FREE))
    with screen.planning():
        screen.page.get_by_role("button", name="Plan this").click()
    assert screen.sent["limits"] == FREE["limits"]


@pytest.mark.parametrize(
    "text, reason",
    [
        ("0,0\n1,2\n3,x", "line 3"),
        ("time,a\n0,0\n1,2,3", "line 3"),
        ("# from the log\n0,0\n\n1,2\n1,y", "line 5"),
        ("time,a\n", "no numbers"),
        ("", "nothing"),
        ("1,2", "two rows"),
        ('{"waypoints": [[0], [1]', "JSON"),
        ('{"points": []}', ""),
        ('{"points": [{"velocities": [1]}]}', "positions"),
        ('{"breaks": [0, 1], "coefficients": [[[0]]]}', "Certify"),
        ('{"waypoints": [[0], ["x"]]}', "numbers"),
        ("[[1, 2], [3]]", "as many"),
        ('{"what": 1}', "none of"),
        ("null", ""),
        ("joint_names:\n- base\npoints: []", "YAML, which is not read"),
        ("---\nwaypoints: [[0], [1]]", "YAML, which is not read"),
        ("waypoints: [[0], [1]]", "YAML, which is not read"),
    ],
)
def test_bad_text_says_where(loaded, text, reason):
    screen = loaded.show(TIMED)
    before = screen.planned
    paste(screen, text)
    wrong = screen.field("/text").locator(".wrong")
    assert reason in wrong.inner_text() and "undefined" not in wrong.inner_text()
    assert screen.page.get_by_label("waypoints as text").get_attribute("aria-invalid") == "true"
    assert screen.planned == before


PLACES = [
    ("# a\ntime,a\n0,0\n\n1,2", ["time", "1"], "line 5", "1,2"),
    ("[[0], [1,\n 2]]", ["position", "1", "1"], "position 1, 1 (line 2)", "2"),
    (
        '{"samples": {"time": [0], "position": [["]", 1], {"a": [3]}]}}',
        ["position", "1", "a"],
        "position 1, a (line 1)",
        "[3]",
    ),
    ('{"position": [[0]], "time": [0.5,\n-1e3]}', ["time", "1"], "time 1 (line 2)", "-1e3"),
    (
        '{"points": [{"positions": [1]},\n{"positions": [2]}]}',
        ["velocity", "1", "0"],
        "point 1, 0 (line 2)",
        '{"positions": [2]}',
    ),
    (json.dumps({"trajectory": ROS}, indent=1), ["position", "1", "1"], "point 1, 1 (line 24)", "2.0"),
    ('{"polynomial": {"breaks": [0, 1], "coefficients": []}}', ["breaks", "1"], "breaks 1 (line 1)", "1"),
    ("0,1\n2,3", ["position"], None, None),
]


@pytest.mark.parametrize("text, parts, told, selected", PLACES)
def test_where_in_a_text_something_stands(loaded, text, parts, told, selected):
    code = """async ([text, parts]) => {
      const { parsed } = await import(new URL("page/parse.js", document.baseURI));
      const place = parsed(text).place(parts);
      return place && [place.told, text.slice(place.from, place.to)];
    }"""
    assert loaded.page.evaluate(code, [text, parts]) == (told and [told, selected])


# What is drawn.


def test_thinning_keeps_each_extremum(loaded):
    code = """async ([count, most]) => {
      const { thinned } = await import(new URL("page/motion.js", document.baseURI));
      const time = Array.from({ length: count }, (_, i) => (i < count / 2 ? i / 1000 : i / 10));
      const values = time.map((_, i) => Math.sin(i * i));
      const kept = thinned(time, values, most);
      const spans = new Map();
      const last = count - 1;
      for (const [among, list] of [["all", [...time.keys()]], ["kept", kept]]) {
        for (const i of list) {
          const span = i === last ? most : Math.floor((most / 2) * (time[i] - time[0]) / (time[last] - time[0]));
          const own = spans.get(span) ?? spans.set(span, { all: [], kept: [] }).get(span);
          own[among].push(values[i]);
        }
      }
      const ends = (list) => [Math.min(...list), Math.max(...list)];
      return [kept, [...spans.values()].every(({ all, kept: some }) => String(ends(all)) === String(ends(some)))];
    }"""
    for count in (2, 20, 21, 22, 1000):
        kept, all_there = loaded.page.evaluate(code, [count, 20])
        assert kept == sorted(set(kept)) and kept[0] == 0 and kept[-1] == count - 1 and all_there
        assert kept == list(range(count)) if count <= 20 else len(kept) <= 22
