"""What is taken away and comes back: links that hold the state, commands for shell and Python, files."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
TIMED = {"waypoints": [[0, 0], [1, 2], [2, 3]], "times": [0, 1, 2]}
AWKWARD = {
    "waypoints": [[0, 0], [1, 2], [2, 0.5]],
    "limits": {"velocity": [1, None], "acceleration": {"lower": -2, "upper": [2, 3]}},
    "segment_limits": [None, {"velocity": 0.5}],
    "joint_names": ['o\'brien & "co"', "größe #1 %41+$(x)`y`\\"],
    "method": "time_optimal_path",
    "options": {"path": {"kind": "cubic_spline", "boundary": "natural"}},
}


def drawing(screen):
    return [{name: trace[name] for name in ("axis", "x", "y")} for trace in screen.drawn()]


def address(screen, text):
    """The address, once it holds a text."""
    held = "text => decodeURIComponent(location.hash).includes(text)"
    screen.page.wait_for_function(held, arg=text)
    return screen.page.evaluate("location.hash")


def test_a_link_brings_everything_back(loaded, fresh):
    screen = loaded.show(AWKWARD)
    with screen.planning():
        screen.field("/waypoints/1/1").locator("input").fill("1.75")
    link = address(screen, "1.75")
    other = fresh().load(link)
    assert other.sent == screen.sent and other.sent["waypoints"][1][1] == 1.75
    assert drawing(other) == drawing(screen)
    assert address(other, "1.75") == link
    # and again, by a click in a page that is open
    assert other.show(TIMED).sent["waypoints"] == TIMED["waypoints"]
    with other.planning():
        other.page.evaluate("link => { location.hash = link; }", link)
    assert drawing(other) == drawing(screen)


BROKEN = [
    "#tab=nothing&request=%7B%22waypoints%22%3A%5B%5B0",
    "#request={}",
    "#tab=plan&request=[]",
    "#tab=plan&request=null&compare=7&judge=x",
    "#request=" + json.dumps({"waypoints": [[0], ["x"]]}),
    "#request=" + json.dumps({"waypoints": [[0], [1, 2]]}),
    "#request=" + json.dumps({"waypoints": [[0], [1]], "times": 7}),
    "#request=" + json.dumps({"waypoints": [[0], [1]], "limits": 7}),
    "#%%%&=&&%ff",
    "#tab=__proto__",
    "#tab=constructor&request=%00",
]


def test_a_broken_link_still_gives_a_page(fresh):
    screen = fresh().load(BROKEN[0])
    assert screen.page.get_by_role("tab", selected=True).inner_text() == "Plan"
    assert "✓ holds" in screen.tile("Certificate") and screen.page.locator(".handle").count()


def test_a_broken_link_changes_nothing_in_an_open_page(loaded):
    screen = loaded.show(TIMED)
    for broken in BROKEN:
        screen.page.evaluate("link => { location.hash = link; }", broken)
        screen.page.evaluate("new Promise((done) => setTimeout(done))")
        assert screen.page.get_by_role("tab", selected=True).inner_text() == "Plan", broken
        assert screen.settled().sent["waypoints"] == TIMED["waypoints"], broken
    with screen.planning():
        screen.field("/waypoints/1/1").locator("input").fill("1.5")
    assert "✓ holds" in screen.tile("Certificate")


@pytest.mark.parametrize(
    "more",
    [
        {"limits": {"velocity": "fast"}},
        {"limits": {"velocity": [None, {}]}},
        {"limits": {"position": 3}},
        {"limits": {"what": 1}},
        {"options": {"order": "x", "ends": 7, "sub_segments": {}}, "method": "minimum_jerk"},
        {"method": "nothing"},
        {"method": {"a": 1}},
        {"duration": {"min": "x"}},
        {"segment_limits": [1, 2, 3]},
        {"segment_limits": [None]},
        {"sampling": 3},
        {"include": "samples"},
        {"include": 7},
        {"times": None},
        {"start": [], "end": 0, "wrap": "x", "timeout": "y"},
        {"joint_names": [1, None]},
        {"unheard_of": True},
    ],
    ids=json.dumps,
)
def test_a_link_to_nonsense_is_refused_by_the_service(loaded, watch, more):
    watch.refusals = {404, 422}
    screen = loaded.show({**TIMED, **more})
    if more != {"times": None}:
        assert screen.page.locator("#panel-plan .failure").is_visible()
    screen.show(TIMED)
    assert "✓ holds" in screen.tile("Certificate")


def test_what_is_too_long_for_an_address(loaded):
    screen = loaded.show(TIMED)
    rows = [[k / 2000, round(float(np.sin(k / 100)), 12)] for k in range(2000)]
    long = {"waypoints": rows, "times": list(range(2000)), "method": "linear"}
    screen.page.get_by_text("The request as JSON").click()
    screen.page.get_by_label("the request as JSON").fill(json.dumps(long))
    with screen.planning():
        screen.page.get_by_role("button", name="Plan this").click()
    screen.page.wait_for_function("() => location.hash === '#tab=plan'")
    screen.page.get_by_role("button", name="Copy the link").click()
    screen.page.get_by_role("status").get_by_text("Too many").wait_for()
    assert screen.sent["waypoints"] == rows
    screen.show(TIMED)
    address(screen, "waypoints")


def copied(screen, name):
    screen.page.evaluate("navigator.clipboard.writeText('')")
    screen.page.get_by_role("button", name=name).click()
    screen.page.wait_for_function("() => navigator.clipboard.readText()")
    return screen.page.evaluate("navigator.clipboard.readText()")


@pytest.mark.parametrize("given", [TIMED, AWKWARD], ids=["timed", "awkward"])
def test_the_commands_do_the_same(loaded, ask, given):
    screen = loaded.show(given)
    duration = ask("/v1/trajectories", given)["duration"]
    assert f"{duration:.5g} s" in screen.tile("Duration")
    shell = subprocess.run(["sh", "-c", copied(screen, "Copy as curl")], capture_output=True, text=True, check=True)
    assert json.loads(shell.stdout)["duration"] == duration
    script = copied(screen, "Copy as Python")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NO_PROXY": "127.0.0.1"}
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=environment)
    assert run.returncode == 0, run.stderr
    assert run.stdout.split() == [repr(duration), "True"]


def test_a_key_is_read_from_the_environment(loaded, keyed):
    """Where the service wants a key the commands send one, and do not hold it."""
    screen, (address, key) = loaded.show(TIMED), keyed
    bare = [copied(screen, "Copy as curl"), copied(screen, "Copy as Python")]
    assert not [text for text in bare if "KEY" in text.upper()]
    screen.page.evaluate("key => sessionStorage.setItem('waywright.key', key)", key)
    curl, script = [
        copied(screen, name).replace(screen.address, address) for name in ("Copy as curl", "Copy as Python")
    ]
    screen.page.evaluate("sessionStorage.removeItem('waywright.key')")
    assert key not in curl + script
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NO_PROXY": "127.0.0.1", "WAYWRIGHT_KEY": key}
    # it waits while the service warms up
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=environment)
    assert run.returncode == 0, run.stderr
    shell = subprocess.run(["sh", "-c", curl], capture_output=True, text=True, check=True, env=environment)
    assert json.loads(shell.stdout)["duration"] == 2


def test_the_link_is_the_address(loaded):
    screen = loaded.show(AWKWARD)
    link = copied(screen, "Copy the link")
    assert link.startswith(f"{screen.address}/#") and "brien" in link
    screen.page.wait_for_function("link => location.href === link", arg=link)  # which is written soon after a change


def test_without_a_clipboard_the_text_is_shown(loaded):
    screen = loaded.show(TIMED)
    screen.page.evaluate("Object.defineProperty(navigator, 'clipboard', { value: undefined, configurable: true })")
    screen.page.get_by_role("button", name="Copy as curl").click()
    assert screen.page.get_by_role("dialog").get_by_role("textbox", name="curl").input_value().startswith("curl ")
    screen.page.keyboard.press("Escape")
    screen.page.get_by_role("dialog").wait_for(state="detached")
    screen.page.evaluate("delete navigator.clipboard")


def downloaded(screen, name, folder):
    with screen.page.expect_download() as found:
        screen.page.get_by_role("button", name=name, exact=True).click()
    path = folder / found.value.suggested_filename
    found.value.save_as(path)
    return path


def test_the_answer_is_saved(loaded, ask, tmp_path):
    request = {**TIMED, "joint_names": ["base", "arm"], "sampling": {"dt": 0.1}}
    screen = loaded.show(request)
    samples = ask("/v1/trajectories", request)["samples"]
    table = downloaded(screen, "CSV", tmp_path)
    assert table.name == "trajectory.csv"
    head, *rows = table.read_text().splitlines()
    assert head.split(",")[0] == "time" and len(head.split(",")) == 9
    numbers = np.array([[float(word) for word in row.split(",")] for row in rows])
    np.testing.assert_array_equal(numbers[:, :3], np.column_stack([samples["time"], samples["position"]]))
    message = json.loads(downloaded(screen, "ROS 2", tmp_path).read_text())
    assert message["joint_names"] == ["base", "arm"]
    assert [point["positions"] for point in message["points"]] == samples["position"]
    with np.load(downloaded(screen, "npz", tmp_path)) as arrays:
        np.testing.assert_array_equal(arrays["position"], samples["position"])
    assert json.loads(downloaded(screen, "JSON", tmp_path).read_text())["samples"] == samples
    # as finely as is asked for
    screen.page.get_by_label("sample every").fill("0.05")
    assert len(downloaded(screen, "CSV", tmp_path).read_text().splitlines()) == 42
    screen.page.get_by_label("sample every").fill("")
    picture = downloaded(screen, "PNG", tmp_path)
    assert picture.read_bytes().startswith(b"\x89PNG") and picture.stat().st_size > 20_000


def test_a_refused_answer_is_no_file(loaded, watch):
    watch.refusals = {422}
    screen = loaded.show({**TIMED, "limits": {"velocity": 0.1}})
    screen.page.get_by_role("button", name="CSV", exact=True).click()
    screen.page.get_by_role("status").get_by_text("joint").wait_for()
