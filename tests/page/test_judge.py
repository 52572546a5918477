"""The tab that judges: where a pasted trajectory breaks its limits, and the same path timed so that it holds."""

import json

import numpy as np
import pytest

pytestmark = pytest.mark.slow

LIMITS = {"velocity": 1, "acceleration": 2}
#: Two joints, a quarter of a sine; too fast for the first one.
TIME = np.linspace(0, 1, 41)
POSITION = np.column_stack([2 * np.sin(np.pi / 2 * TIME), 0.5 * TIME])
CSV = "time,position_1,position_2\n" + "\n".join(f"{t},{a},{b}" for t, (a, b) in zip(TIME, POSITION, strict=True))
SLOW = "time,position_1,position_2\n" + "\n".join(f"{9 * t},{a},{b}" for t, (a, b) in zip(TIME, POSITION, strict=True))
ROS = {
    "joint_names": ["base", "arm"],
    "points": [
        {"positions": list(row), "time_from_start": {"sec": int(t), "nanosec": round((t % 1) * 1e9)}}
        for t, row in zip(TIME.tolist(), POSITION.tolist(), strict=True)
    ],
}
#: q(t) = 3 t^2 - 2 t^3 on one second.
POLYNOMIAL = {"breaks": [0, 1], "coefficients": [[[0]], [[0]], [[3]], [[-2]]]}


def judged(screen, given):
    """Judge by a link; wait for the certificate, and for the retimed one where there is to be one."""
    screen.show(tab="plan")
    screen.show(tab="judge", judge=given)
    panel = screen.page.locator("#panel-judge")
    panel.locator(".tile").get_by_text("Certificate", exact=True).wait_for()
    if given.get("retime", True):
        panel.locator(".tile", has_text="Retimed").get_by_text("certificate holds").wait_for()
    return screen


def tile(screen, label):
    return screen.page.locator("#panel-judge .tile", has=screen.page.get_by_text(label, exact=True)).inner_text()


def curves(screen, axis="y"):
    code = """() => document.querySelector("#judge-chart").data.filter(({ mode }) => mode === "lines")
      .map(({ name, yaxis, x, y }) => [name, yaxis ?? "y", Array.from(x), Array.from(y)])"""
    return {name: (x, y) for name, own, x, y in screen.page.evaluate(code) if own == axis}


def table(screen, heading):
    part = screen.page.locator("#panel-judge .verdict", has=screen.page.get_by_role("heading", name=heading))
    cells = "all => all.map((row) => [row.className, ...[...row.cells].map((cell) => cell.innerText.trim())])"
    return {row[1]: row for row in part.locator("tbody tr").evaluate_all(cells)}


def test_the_broken_limit_is_told_and_marked(loaded, ask):
    screen = judged(loaded, {"text": CSV, "limits": LIMITS})
    samples = {"time": TIME.tolist(), "position": POSITION.tolist()}
    certificate = ask("/v1/certificates", {"trajectory": {"samples": samples}, "limits": LIMITS})["certificate"]
    assert not certificate["holds"] and "✗ broken" in tile(screen, "Certificate")
    drawn = screen.page.evaluate("document.querySelector('#judge-chart').data")
    for check in certificate["checks"]:
        row = table(screen, "As given")[check["quantity"]]
        assert (row[0] == "broken") == (not check["holds"])
        assert row[2] == f"joint {check['joint']}" and ("✗" in row[-1]) == (not check["holds"])
        axis = {"velocity": "y2", "acceleration": "y3"}[check["quantity"]]
        marks = [one for one in drawn if one["yaxis"] == axis and one["mode"] == "markers"]
        assert [(mark["x"][0], mark["y"][0]) for mark in marks] == [(check["time"], check["value"])]
    np.testing.assert_allclose(curves(screen)["joint 0"], [TIME, POSITION[:, 0]])


def test_the_retimed_one_lies_over_it_and_holds(loaded, ask):
    screen = judged(loaded, {"text": CSV, "limits": LIMITS})
    samples = {"time": TIME.tolist(), "position": POSITION.tolist()}
    answer = ask("/v1/retimings", {"trajectory": {"samples": samples}, "limits": LIMITS})
    assert answer["certificate"]["holds"] and f"{answer['duration']:.5g} s" in tile(screen, "Retimed")
    x, y = curves(screen)["joint 0, retimed"]
    np.testing.assert_allclose(x, answer["samples"]["time"], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(y, np.array(answer["samples"]["position"])[:, 0], rtol=1e-9)
    rows = table(screen, "Retimed")
    assert set(rows) >= set(LIMITS) and not [row for row in rows.values() if row[0] == "broken"]


def test_a_slow_one_holds(loaded):
    screen = judged(loaded, {"text": SLOW, "limits": LIMITS, "retime": False})
    assert "✓ holds" in tile(screen, "Certificate") and "–" in tile(screen, "Retimed")
    assert not screen.page.locator("#panel-judge .broken").count()
    assert set(curves(screen)) == {"joint 0", "joint 1"}


@pytest.mark.parametrize("form", ["ros", "polynomial", "samples"])
def test_other_forms_are_read(loaded, form):
    texts = {"ros": ROS, "polynomial": POLYNOMIAL, "samples": {"time": TIME.tolist(), "position": POSITION.tolist()}}
    screen = judged(loaded, {"text": json.dumps(texts[form]), "limits": LIMITS})
    assert "✗ broken" in tile(screen, "Certificate")
    drawn = curves(screen)
    if form == "ros":
        assert {"base", "arm", "base, retimed"} <= set(drawn) and table(screen, "As given")["velocity"][2] == "base"
    if form == "polynomial":
        x, y = map(np.array, drawn["joint 0"])
        np.testing.assert_allclose(y, 3 * x**2 - 2 * x**3, atol=1e-12)
        assert "polynomial" in tile(screen, "As given")


def test_units_in_a_header_are_no_part_of_the_names(loaded):
    text = "time [s];position_1 [rad];velocity_1 (rad/s)\n0;0;0\n1;0.1;0.2\n2;0.4;0.4\n3;0.5;0"
    screen = judged(loaded, {"text": text, "limits": LIMITS, "retime": False})
    assert set(curves(screen)) == {"joint 0"} and curves(screen, "y2")["joint 0"][1] == [0, 0.2, 0.4, 0]


def test_it_is_typed_into_the_page(loaded):
    screen = judged(loaded, {"text": SLOW, "limits": LIMITS, "retime": False})
    panel = screen.page.locator("#panel-judge")
    box = panel.locator("textarea")
    assert box.input_value() == SLOW
    box.fill(CSV)
    panel.locator(".tile.bad").wait_for()
    panel.locator('[data-at="/limits/velocity"] input').first.fill("9")
    panel.locator('[data-at="/limits/velocity"] input').first.blur()
    panel.locator('[data-at="/limits/acceleration"] input').first.fill("50")
    panel.locator('[data-at="/limits/acceleration"] input').first.blur()
    panel.locator(".tile.good").get_by_text("Certificate", exact=True).wait_for()
    panel.get_by_label("retime: the same path").check()
    panel.get_by_text("certificate holds").wait_for()
    seconds = float(tile(screen, "Retimed").split()[1])
    assert seconds < 1  # it may be faster


def test_the_example(loaded):
    screen = judged(loaded, {"text": SLOW, "limits": LIMITS, "retime": False})
    screen.page.locator("#panel-judge").get_by_role("button", name="Example").click()
    screen.page.locator("#panel-judge").get_by_text("certificate holds").wait_for()
    assert "✗ broken" in tile(screen, "Certificate")


@pytest.mark.parametrize(
    "text, reason",
    [
        ("time,a\n0,0\n1,x", "line 3"),
        ("time,a\n0,0\n1,1,1", "line 3"),
        ("# log\n0,nan\n1,1", "line 2: “nan” is not a number"),
        ("0,0\n1,1", "time"),
        ('{"waypoints": [[0], [1]]}', "Plan"),
        ('{"points": [', "JSON"),
        ("null", ""),
        ('{"points": [{"positions": null}]}', "positions"),
    ],
)
def test_what_cannot_be_read_says_why(loaded, text, reason):
    screen = judged(loaded, {"text": SLOW, "limits": LIMITS, "retime": False})
    box = screen.page.locator("#panel-judge textarea")
    box.fill(text)
    wrong = screen.page.locator('#panel-judge [data-at="/trajectory"] .wrong')
    assert reason in wrong.inner_text() and "undefined" not in wrong.inner_text()
    assert box.get_attribute("aria-invalid") == "true"
    box.fill(CSV)
    screen.page.locator("#panel-judge .tile.bad").wait_for()
    assert not wrong.count() and box.get_attribute("aria-invalid") is None


@pytest.mark.parametrize(
    "text",
    [
        "time,a\n0,0\n0,1\n1,2",
        '{"time": [0, 1], "position": [[0], [1, 2]]}',
        '{"time": [0, 1], "position": [[0]]}',
        '{"time": [0, "x"], "position": [[0], [1]]}',
        '{"time": 7, "position": 7}',
        '{"polynomial": {}}',
        '{"polynomial": 7}',
        '{"polynomial": {"breaks": [0, 1], "coefficients": 7}}',
        '{"polynomial": {"breaks": [1, 0], "coefficients": [[[0]]]}}',
        '{"polynomial": {"breaks": [0, 1], "coefficients": [[[0]]], "weights": 7}}',
        '{"samples": 7}',
        '{"samples": {"time": [0, 1]}}',
        '{"points": [7]}',
    ],
)
def test_what_is_no_trajectory_is_refused(loaded, watch, text):
    screen = judged(loaded, {"text": SLOW, "limits": LIMITS, "retime": False})
    watch.refusals = {422}
    screen.page.locator("#panel-judge textarea").fill(text)
    screen.page.locator("#panel-judge .refused").wait_for()
    assert screen.page.locator("#panel-judge .top-line").inner_text().strip()
    watch.refusals = {422}
    screen.page.locator("#panel-judge textarea").fill(CSV)
    screen.page.locator("#panel-judge .tile.bad").wait_for()


REPEATED = "# from the log\n" + CSV.replace("\n0.5,", "\n0.475,")
POINTS = list(enumerate(ROS["points"]))
TURNED = {**ROS, "points": [ROS["points"][k] for k in (0, 1, 3, 2, 4)]}
UNTIMED = {**ROS, "points": [{k: v for k, v in p.items() if k != "time_from_start" or i != 1} for i, p in POINTS]}
ROWS = json.dumps({"time": [0, 1, 2], "position": [[0], [1, 7], [2]]})


@pytest.mark.parametrize(
    "text, told, selected",
    [
        (REPEATED, "line 23: must increase", REPEATED.split("\n")[22]),
        (REPEATED.replace("\n", "\r\n"), "line 23: must increase", REPEATED.split("\n")[22]),
        (json.dumps(TURNED, indent=1), "point 3 (line 42): must increase", '{\n "sec": 0,\n "nanosec": 50000000\n}'),
        (json.dumps({"trajectory": {"samples": json.loads(ROWS)}}), "position 1 (line 1): has 2 entries", "[1, 7]"),
        (
            CSV.replace("\n0.5,", "\nhalf,"),
            "line 22: “half” is not a number",
            CSV.split("\n")[21].replace("0.5", "half", 1),
        ),
        ('{"time": [0, 1],\n"position": [[0] [1]]}', "JSON", "["),
        ('{"time": [0, 1, 2],\n"position": [[0],\n[NaN],\n[2]\n]\n}', "JSON", "NaN"),
        ('{"time": [0, 1],\n"position": [[0], [1],\n]\n}', "JSON", "]"),
        (json.dumps(UNTIMED, indent=1), "point 1 (line ", json.dumps(UNTIMED["points"][1], indent=1)),
        ("header:\n  frame_id: base\npoints: []", "YAML", "header:"),
    ],
    ids=["csv", "crlf", "ros", "samples", "no number", "no JSON", "NaN", "comma", "no time", "YAML"],
)
def test_what_is_wrong_is_told_with_its_line_and_shown(loaded, watch, text, told, selected):
    screen = judged(loaded, {"text": SLOW, "limits": LIMITS, "retime": False})
    watch.refusals = {422}
    screen.show(tab="judge", judge={"text": text, "limits": LIMITS})
    row = screen.page.locator('#panel-judge [data-at="/trajectory"]')
    row.locator(".wrong").get_by_text(told).wait_for()
    assert told in screen.page.locator("#panel-judge .failure").inner_text()
    box = row.locator("textarea")
    assert box.get_attribute("aria-invalid") == "true"
    assert not box.evaluate("box => box === document.activeElement"), "the focus was stolen"
    row.get_by_role("button", name="Show line").click()
    chosen, top, height = box.evaluate("""box => {
      const lines = box.value.slice(0, box.selectionStart).split("\\n").length - 1;
      const top = lines * parseFloat(getComputedStyle(box).lineHeight) - box.scrollTop;
      return [box.value.slice(box.selectionStart, box.selectionEnd), top, box.clientHeight];
    }""")
    assert " ".join(chosen.split()) == " ".join(selected.split()) and 0 <= top <= height


def test_a_path_that_stands_still(loaded):
    screen = judged(loaded, {"text": "time,a\n0,1\n1,1\n2,1", "limits": LIMITS})
    assert "nothing moves" in tile(screen, "Retimed") and "times as long" not in tile(screen, "Retimed")


@pytest.mark.parametrize("names", [["base"], ["base", "arm", "tool"], ["base", 7]])
def test_names_that_do_not_fit_are_told_and_not_used(loaded, names):
    screen = judged(loaded, {"text": json.dumps({**ROS, "joint_names": names}), "limits": LIMITS})
    assert "joint_names" in tile(screen, "As given")
    assert set(curves(screen)) == {f"joint {d}{more}" for d in (0, 1) for more in ("", ", retimed")}


def test_many_samples_are_drawn_sparser_and_before_the_retiming_is_there(fresh):
    """All but the retiming is seen while that takes its time; of 10,000 samples no peak is lost."""
    time = np.linspace(0, 10, 10_000).round(6)
    rows = np.sin(np.outer(time, 1 + np.arange(6))).round(6)
    rows[4321, 2] = 1.5
    lines = [",".join(map(str, row)) for row in np.column_stack([time, rows]).tolist()]
    screen = judged(fresh().load(), {"text": SLOW, "limits": LIMITS, "retime": False})
    screen.page.evaluate("""() => {
      const real = window.fetch;
      const isHeld = (path) => String(path).endsWith("v1/retimings");
      window.fetch = (path, given) => (isHeld(path) ? new Promise(() => {}) : real(path, given));
    }""")
    screen.page.get_by_label("retime: the same path").check()
    text = "\n".join(["time," + ",".join(f"q{d}" for d in range(6)), *lines])
    file = {"name": "log.csv", "mimeType": "text/csv", "buffer": text.encode()}
    screen.page.locator("#panel-judge input[type=file]").set_input_files(file)
    screen.page.wait_for_function("() => document.querySelector('#judge-chart').data?.[0].x.length > 1000")
    assert "10000 samples" in tile(screen, "As given") and "✗ broken" in tile(screen, "Certificate")
    assert "computing" in tile(screen, "Retimed")
    for d in range(6):
        x, y = curves(screen)[f"joint {d}"]
        assert len(x) <= 2002 and (x[0], x[-1], min(y), max(y)) == (0, 10, rows[:, d].min(), rows[:, d].max())
    assert all(len(x) <= 2002 for axis in ("y2", "y3", "y4") for x, _ in curves(screen, axis).values())


def test_a_long_text_is_pasted(loaded):
    screen = judged(loaded, {"text": SLOW, "limits": LIMITS, "retime": False})
    text = "time,a\n" + "\n".join(f"{k / 1000},{k / 7}" for k in range(3000))
    screen.page.locator("#panel-judge textarea").evaluate(
        """(box, text) => {
          const clipboardData = new DataTransfer();
          clipboardData.setData("text/plain", text);
          box.select();
          box.dispatchEvent(new ClipboardEvent("paste", { clipboardData, bubbles: true, cancelable: true }));
        }""",
        text,
    )
    screen.page.locator("#panel-judge .tile", has_text="3000 samples").wait_for()
    assert screen.page.locator("#panel-judge textarea").input_value() == text


def test_a_file_is_taken(loaded):
    screen = judged(loaded, {"text": SLOW, "limits": LIMITS, "retime": False})
    chosen = screen.page.locator("#panel-judge input[type=file]")
    chosen.set_input_files({"name": "log.csv", "mimeType": "text/csv", "buffer": CSV.encode()})
    screen.page.locator("#panel-judge .tile.bad").wait_for()
    assert screen.page.locator("#panel-judge textarea").input_value() == CSV


def test_the_retimed_one_is_saved(loaded, tmp_path):
    screen = judged(loaded, {"text": json.dumps(ROS), "limits": LIMITS})
    with screen.page.expect_download() as found:
        screen.page.get_by_role("button", name="Retimed as ROS 2").click()
    found.value.save_as(tmp_path / "retimed.json")
    message = json.loads((tmp_path / "retimed.json").read_text())
    assert message["joint_names"] == ["base", "arm"]
    np.testing.assert_allclose(message["points"][-1]["positions"], POSITION[-1], atol=1e-9)
    assert message["points"][-1]["time_from_start"]["sec"] >= 1


def test_a_link_brings_it_back(loaded, fresh):
    screen = judged(loaded, {"text": CSV, "limits": LIMITS})
    screen.page.wait_for_function("() => decodeURIComponent(location.hash).includes('velocity')")
    other = fresh()
    other.page.goto(f"{screen.address}/{screen.page.evaluate('location.hash')}")
    other.page.wait_for_function("() => document.querySelector('#panel-judge')?.dataset.judged >= 2")  # and is drawn
    assert curves(other) == curves(screen)
