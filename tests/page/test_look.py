"""What the page looks like and how it is used: themes, widths, names, the keyboard, keys; and nothing jumps."""

import re
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
TIMED = {"waypoints": [[0, 0], [1, 2], [2, 3]], "times": [0, 1, 2]}
TIGHT = {"waypoints": [[0, 0], [1, 2]], "times": [0, 1], "limits": {"velocity": 0.5}}
pytestmark = pytest.mark.usefixtures("keyed")  # it warms up while the other tests run
TABS = {"plan": "Plan", "compare": "Compare", "judge": "Certify"}

#: Text, its colour and what it stands on, blended; the least contrast of WCAG 2 for text is 4.5.
CONTRAST = """() => {
  const parse = (text) => (text.match(/[\\d.]+/g) ?? []).map(Number);
  const over = (top, ground) => { const a = top[3] ?? 1; return ground.map((one, k) => a * top[k] + (1 - a) * one); };
  const linear = (one) => (one / 255 <= 0.04045 ? one / 255 / 12.92 : ((one / 255 + 0.055) / 1.055) ** 2.4);
  const light = ([r, g, b]) => 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
  const ground = (node) => {
    if (!node) return [255, 255, 255];
    const own = parse(getComputedStyle(node).backgroundColor);
    return own[3] === 0 ? ground(node.parentElement) : over(own, own[3] < 1 ? ground(node.parentElement) : [0, 0, 0]);
  };
  const opacity = (node) => (node ? Number(getComputedStyle(node).opacity) * opacity(node.parentElement) : 1);
  const LEFT_OUT = "svg, .say, .refused .figures, noscript, :disabled";
  const found = [];
  for (const node of document.querySelectorAll("body *")) {
    const own = [...node.childNodes].some((one) => one.nodeType === 3 && one.data.trim());
    if (!(own || node.matches("input, select")) || node.closest(LEFT_OUT) || !node.checkVisibility()) continue;
    const behind = ground(node);
    const colour = parse(getComputedStyle(node).color);
    const text = over([...colour.slice(0, 3), (colour[3] ?? 1) * opacity(node)], behind);
    const [a, b] = [light(text), light(behind)].sort((one, other) => other - one);
    found.push([(a + 0.05) / (b + 0.05), node.tagName, node.className, node.textContent.trim().slice(0, 40)]);
  }
  return found;
}"""

NO_WIDER = "() => document.documentElement.scrollWidth <= document.documentElement.clientWidth"

#: Controls that stick out at a side, and are in nothing that scrolls.
OUTSIDE = """() => [...document.querySelectorAll("a, button, input, select, textarea, h2, p")].filter((node) => {
  if (!node.checkVisibility() || node.closest(".scroll, .say, .handles, .js-plotly-plot")) return false;
  const { left, right } = node.getBoundingClientRect();
  return left < -0.5 || right > document.documentElement.clientWidth + 0.5;
}).map((node) => node.outerHTML.slice(0, 120))"""

UNLABELLED = """() => [...document.querySelectorAll("input, select, textarea")].filter((one) => (
  one.checkVisibility() && !one.labels.length && !one.ariaLabel)).map((one) => one.outerHTML)"""

ROLES = {"button", "textbox", "spinbutton", "combobox", "checkbox", "slider", "tab", "tabpanel", "link", "listbox"}


def switch(screen, tab):
    screen.page.get_by_role("tab", name=re.compile(TABS[tab])).click()
    counted = {"compare": "[data-compared]", "judge": "[data-judged]"}.get(tab, "")
    screen.page.wait_for_selector(f"#panel-{tab}{counted}:not([hidden])")


@pytest.fixture(scope="module")
def everything(loaded):
    """The page with every tab shown once."""
    for tab in (*TABS, "plan"):
        switch(loaded, tab)
    return loaded


def test_it_loads_without_a_word_and_plans_at_once(fresh):
    screen = fresh().load()
    assert screen.planned == 1 == screen.page.evaluate("spy.sent.length")
    assert screen.page.title() and screen.page.locator("h1").inner_text().strip() == "Waywright"
    rows = screen.sent["waypoints"]
    over_time = screen.page.get_by_label("The motion over time", exact=True)
    assert over_time.locator(".handle").count() == sum(map(len, rows))
    assert screen.page.get_by_label("The path in the plane").locator(".handle").count() == len(rows)
    assert "✓ holds" in screen.tile("Certificate")
    assert screen.page.evaluate("spy.jumps") < 0.1
    screen.page.wait_for_function("() => performance.getEntriesByName('replan').length === 1")
    # the README's picture is made from this one
    picture = ROOT / "build" / "page.png"
    picture.parent.mkdir(exist_ok=True)
    screen.page.screenshot(path=picture)
    assert picture.stat().st_size > 50_000


#: The lines of a sketch, by axis: the heights of their points in pixels.
SKETCHED = """() => {
  const heights = (line) => line.getAttribute("d").slice(1).split("L").map((place) => Number(place.split(",")[1]));
  const lines = (axis) => [...axis.querySelectorAll("path[stroke-width='1.8']")];
  return [...document.querySelectorAll("#time-chart > svg > svg")].map((axis) => lines(axis).map(heights));
}"""


def test_a_plan_is_seen_before_plotly_is_there(fresh, ask):
    screen, held = fresh(), []
    screen.page.route("**/plotly.min.js", lambda route: held.append(route))
    screen.page.goto(f"{screen.address}/")
    screen.page.wait_for_selector("#time-chart > svg")
    samples = ask("/v1/trajectories", screen.sent)["samples"]
    drawn = screen.page.evaluate(SKETCHED)
    assert len(drawn) == 4
    for name, lines in zip(["position", "velocity", "acceleration", "jerk"], drawn, strict=True):
        rows = np.array(samples[name])
        slope, offset = np.polyfit(rows.ravel(), np.column_stack(lines).ravel(), 1)
        assert slope < 0  # up is less
        np.testing.assert_allclose(np.column_stack(lines), offset + slope * rows, atol=0.02)
    assert "✓ holds" in screen.tile("Certificate") and screen.page.locator("#plane-chart > svg path").count()
    for route in held:
        route.continue_()
    screen.page.wait_for_selector(".handle")
    assert not screen.page.locator(".chart > svg").count()


def test_without_plotly_a_plan_is_still_seen(fresh, watch):
    watch.refusals = {404}
    screen = fresh()
    screen.page.route("**/plotly.min.js", lambda route: route.fulfill(status=404))
    screen.load()
    assert screen.page.locator("#time-chart > svg path").count() > 8
    screen.page.get_by_role("status").get_by_text("waywright[service]").wait_for()
    before = screen.page.evaluate(SKETCHED)
    with screen.planning():
        screen.field("/limits/velocity").locator("input[type=text]").fill("0.5")
    assert screen.page.evaluate(SKETCHED) != before


@pytest.mark.slow
@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("tab", TABS)
def test_text_stands_out(everything, watch, theme, tab):
    watch.refusals = {422}
    screen = everything
    if tab == "plan":
        screen.show({**TIGHT, "method": "minimum_jerk"})  # with an error and its marks
        screen.page.locator("#panel-plan details").evaluate_all("all => all.forEach((one) => { one.open = true; })")
    switch(screen, tab)
    if screen.page.evaluate("document.documentElement.dataset.theme") != theme:
        screen.page.get_by_role("button", name="Switch between dark and light").click()
    found = screen.page.evaluate(CONTRAST)
    assert len(found) > 30
    assert not [row for row in found if row[0] < 4.5]
    dark = screen.page.evaluate("getComputedStyle(document.body).backgroundColor").startswith("rgb(1")
    assert dark == (theme == "dark")
    screen.show(TIMED, tab)
    switch(screen, "plan")


def test_the_theme_is_the_users_and_stays(fresh):
    screen = fresh(color_scheme="dark").load()
    drawn = "document.querySelector('#time-chart').layout.paper_bgcolor"
    theme = lambda: screen.page.evaluate("document.documentElement.dataset.theme")  # noqa: E731
    paper = lambda: screen.page.evaluate(drawn)  # noqa: E731
    assert theme() == "dark"
    dark = paper()
    screen.page.get_by_role("button", name="Switch between dark and light").click()
    screen.page.wait_for_function(f"dark => {drawn} !== dark", arg=dark)
    screen.page.reload()
    screen.settled()
    assert theme() == "light" and paper() != dark


@pytest.mark.slow
@pytest.mark.parametrize("width", [360, 768, 1440])
def test_nothing_sticks_out(everything, watch, width):
    watch.refusals = {422}
    screen, page = everything, everything.page
    page.set_viewport_size({"width": width, "height": 800})
    try:
        for given in (TIMED, TIGHT):
            screen.show(given)
            for tab in TABS:
                switch(screen, tab)
                page.locator(f"#panel-{tab} details").evaluate_all("all => all.forEach((one) => { one.open = true; })")
                page.wait_for_function(
                    "() => document.documentElement.scrollWidth <= document.documentElement.clientWidth"
                )
                assert not page.evaluate(OUTSIDE), tab
            switch(screen, "plan")
        chart = page.locator("#time-chart").bounding_box()
        assert chart["width"] > 0.8 * width if width < 800 else chart["width"] > 400
        screen.show(TIMED)
        # the handles lie on their points at every width
        screen.page.wait_for_function(ON_POINTS)
    finally:
        page.set_viewport_size({"width": 1440, "height": 1000})
        screen.show(TIMED)


ON_POINTS = """() => {
  const chart = document.querySelector("#time-chart");
  const { xaxis, yaxis } = chart._fullLayout;
  const frame = chart.getBoundingClientRect();
  return [...chart.parentElement.querySelectorAll(".handle")].every((node) => {
    const box = node.getBoundingClientRect();
    const [x, y] = [xaxis._offset + xaxis.d2p(node.point.x), yaxis._offset + yaxis.d2p(node.point.y)];
    return Math.hypot(box.x + box.width / 2 - frame.x - x, box.y + box.height / 2 - frame.y - y) < 1.5;
  });
}"""


def test_every_control_has_a_name(everything):
    screen = everything.show(TIMED)
    client = screen.page.context.new_cdp_session(screen.page)
    for tab in TABS:
        switch(screen, tab)
        screen.page.locator(f"#panel-{tab} details").evaluate_all("all => all.forEach((one) => { one.open = true; })")
        nodes = [node for node in client.send("Accessibility.getFullAXTree")["nodes"] if not node["ignored"]]
        controls = [node for node in nodes if node["role"]["value"] in ROLES]
        assert len(controls) > 20
        nameless = [node["role"]["value"] for node in controls if not node.get("name", {}).get("value", "").strip()]
        assert not nameless, tab
        # and none is named by what stands in it only
        assert not screen.page.evaluate(UNLABELLED)
    ids = screen.page.evaluate("[...document.querySelectorAll('[id]')].map((one) => one.id)")
    assert len(ids) == len(set(ids))
    switch(screen, "plan")


def tab_to(page, reached):
    for _ in range(150):
        if page.evaluate(f"(() => {{ const at = document.activeElement; return {reached}; }})()"):
            return
        page.keyboard.press("Tab")
    raise AssertionError(f"Tab never comes to: {reached}")


def test_the_keyboard_does_it_all(loaded, watch):
    watch.refusals = {422}  # the next method in the list does not take the example
    screen = loaded.show(TIMED)
    page = screen.page
    tab_to(page, "at.getAttribute('role') === 'tab'")
    page.keyboard.press("ArrowRight")
    page.wait_for_selector("#panel-compare[data-compared]:not([hidden])")
    assert page.evaluate("document.activeElement.getAttribute('aria-selected')") == "true"
    page.keyboard.press("ArrowLeft")
    page.wait_for_selector("#panel-plan:not([hidden])")
    # the example, then the method
    tab_to(page, "at.closest('[data-at=\"/example\"]')")
    with screen.planning():
        page.keyboard.press("Home")
        page.keyboard.press("ArrowDown")
    first = screen.sent
    tab_to(page, "at.closest('[data-at=\"/method\"]')")
    before = page.get_by_label("method", exact=True).input_value()
    with screen.planning():
        page.keyboard.press("ArrowDown")
    assert page.evaluate("Boolean(document.activeElement.closest('[data-at=\"/method\"]'))"), "the focus was lost"
    assert page.get_by_label("method", exact=True).input_value() != before
    with screen.planning():
        page.keyboard.press("ArrowUp")
    assert screen.sent == first
    # a waypoint by its handle
    tab_to(page, "at.classList.contains('handle')")
    page.keyboard.press("PageDown")
    page.keyboard.press("PageDown")
    label = page.evaluate("document.activeElement.ariaLabel")
    i, d = map(int, re.match(r"waypoint (\d+), joint (\d+)", label).groups())
    with screen.planning():
        page.keyboard.press("ArrowUp")
    small = screen.sent["waypoints"][i][d] - first["waypoints"][i][d]
    with screen.planning():
        page.keyboard.press("Shift+ArrowDown")
    assert 0 < small < -(screen.sent["waypoints"][i][d] - first["waypoints"][i][d])
    assert page.evaluate("document.activeElement.ariaLabel") != label
    # a waypoint is added, by Enter
    tab_to(page, "at.textContent === '+ waypoint'")
    with screen.planning():
        page.keyboard.press("Enter")
    assert len(screen.sent["waypoints"]) == len(first["waypoints"]) + 1


def test_a_service_with_keys_is_asked_with_one(fresh, watch, keyed):
    watch.refusals = {401, 503}  # without a key; and while it warms up
    address, good = keyed
    watch.hosts.append(address)
    screen = fresh(address=address)
    page = screen.page
    page.goto(address)
    field = page.get_by_role("dialog").get_by_label(re.compile("API key"))
    for key in ("wrong", good):
        field.fill(key)
        with page.expect_navigation():
            page.get_by_role("dialog").get_by_role("button").click()
    page.wait_for_selector("#panel-plan .tile.good", timeout=120_000)
    watch.refusals = set()
    with screen.planning():
        screen.field("/limits/velocity").get_by_role("textbox").fill("0.9")
    assert "✓ holds" in screen.tile("Certificate") and not page.get_by_role("dialog").count()
    # another one can be given, and it is not in the address
    assert page.get_by_role("button", name="API key", exact=True).is_visible()
    assert good not in page.evaluate("location.href")
