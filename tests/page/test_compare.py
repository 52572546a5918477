"""The tab that compares: rows and curves of the ticked methods, sorted by any column; a refusal is a row."""

import json
from itertools import combinations

import numpy as np
import pytest

pytestmark = pytest.mark.slow

FREE = {"waypoints": [[0, 0], [1, 2], [2, 0.5]], "limits": {"velocity": 1, "acceleration": 2, "jerk": 10}}
TIMED = {"waypoints": [[0, 0], [1, 2], [2, 3]], "times": [0, 1, 2], "limits": {"velocity": 4}}
THREE = ["ruckig", "time_scaled", "time_optimal_waypoints"]
LINES = """() => document.querySelector("#compare-time-chart").data
  .filter(({ mode, y }) => mode === "lines" && y.length > 1)
  .map(({ name, yaxis, x, y }) => [name, yaxis ?? "y", Array.from(x), Array.from(y)])"""

SIDES = (("x", "width"), ("y", "height"))


def compared(screen):
    return int(screen.page.get_attribute("#panel-compare", "data-compared") or 0)


def comparing(screen, do):
    """Do something, and wait until the comparison that it asks for is drawn."""
    before = compared(screen)
    do()
    screen.page.wait_for_function("n => document.querySelector('#panel-compare').dataset.compared > n", arg=before)
    screen.page.wait_for_selector("#panel-compare .comparison:not([aria-busy])")


def compare(screen, request, **given):
    """Show a request by these methods, with nothing left of what was chosen before."""
    screen.show(tab="compare", compare={"methods": []})
    screen.show(request)
    comparing(screen, lambda: screen.show(tab="compare", compare={"methods": THREE, **given}))
    return screen


def rows(screen):
    """The table by its rows: the method, and the texts of the other cells."""
    cells = "all => all.map((row) => [...row.cells].map((cell) => cell.innerText.trim()))"
    return [(row[0], row[1:-1]) for row in screen.page.locator("#panel-compare tbody tr").evaluate_all(cells)]


@pytest.fixture(scope="module")
def titles(ask):
    return {row["id"]: row["title"] for row in ask("/v1/methods")}


@pytest.fixture
def three(loaded):
    return compare(loaded, FREE)


def test_three_methods_are_ticked(loaded, titles, ask):
    screen = compare(loaded, FREE, methods=["ruckig"])
    for method in ("time_scaled", "time_optimal_waypoints"):
        comparing(screen, lambda name=titles[method]: screen.page.get_by_label(name).check())
    assert sorted(row[0] for row in rows(screen)) == sorted(titles[one] for one in THREE)
    answer = ask("/v1/comparisons", {**FREE, "methods": THREE, "include": ["samples"]})
    curves = screen.page.evaluate(LINES)
    assert len(curves) == 3 * 4
    for row in answer["rows"]:
        mine = {axis: (x, y) for name, axis, x, y in curves if name == titles[row["method"]]}
        for axis, name in zip(("y", "y2", "y3", "y4"), ("position", "velocity", "acceleration", "jerk"), strict=True):
            np.testing.assert_allclose(mine[axis][0], row["samples"]["time"], rtol=1e-12)
            np.testing.assert_allclose(mine[axis][1], np.array(row["samples"][name])[:, 0], rtol=1e-9, atol=1e-9)
        cells = next(cells for name, cells in rows(screen) if name == titles[row["method"]])
        assert cells[0] == f"{row['duration']:.5g}"
        assert "✓" in cells[-1]
    points = screen.page.evaluate("document.querySelector('#against-chart').data.map(({ x, y }) => [x[0], y[0]])")
    wanted = [[row["duration"], row["cost"]["squared_jerk"]] for row in answer["rows"]]
    assert np.allclose(sorted(points), sorted(wanted), rtol=1e-9)


def test_another_joint_is_drawn(three, ask):
    three.page.locator("#panel-compare").get_by_label("joint", exact=True).select_option("1")
    last = [row[-1][-1] for row in three.page.evaluate(LINES) if row[1] == "y"]
    assert last == pytest.approx([0.5] * 3)


def number(text):
    return float(text.replace("≤", "").split()[0]) if text[:1] in "≤-0123456789" else text


def test_every_column_sorts(three):
    heads = three.page.locator("#panel-compare th[scope=col]")
    names = [name for name in heads.all_inner_texts() if name.strip()]
    assert len(names) >= 9
    first = rows(three)
    for column in range(len(names)):
        orders = []
        for direction in ("ascending", "descending"):
            heads.nth(column).get_by_role("button").click()
            assert heads.nth(column).get_attribute("aria-sort") == direction
            assert three.page.locator("#panel-compare [aria-sort]").count() == 1
            found = rows(three)
            assert sorted(found) == sorted(first)
            texts = [name if column == 0 else cells[column - 1] for name, cells in found]
            values = [number(text) for text in texts if text != "–"]
            if "unbounded" not in values:
                assert values == sorted(values, reverse=direction == "descending"), names[column]
            assert texts[len(values) :] == ["–"] * (len(texts) - len(values))
            orders.append([name for name, _ in found])
        assert three.page.evaluate("document.activeElement.closest('th') !== null"), "the focus was lost"
    assert orders  # the last column was sorted both ways
    heads.nth(1).get_by_role("button").click()
    up = [name for name, _ in rows(three)]
    heads.nth(1).get_by_role("button").click()
    assert [name for name, _ in rows(three)] == up[::-1]


def test_a_refusal_is_a_row_with_its_reason(loaded, titles, ask):
    methods = ["linear", "ruckig", "toppra"]
    screen = compare(loaded, FREE, methods=methods, sort={"column": "duration"})
    answer = {row["method"]: row for row in ask("/v1/comparisons", {**FREE, "methods": methods})["rows"]}
    refused = [one for one, row in answer.items() if not row["ok"]]
    assert refused
    shown = dict(rows(screen))
    for one in refused:
        assert shown[titles[one]] == [answer[one]["error"]["detail"]]
    assert [name for name, _ in rows(screen)][-len(refused) :] == [titles[one] for one in answer if one in refused]
    curves = {name for name, *_ in screen.page.evaluate(LINES)}
    assert curves == {titles[one] for one, row in answer.items() if row["ok"]}


def test_plan_with_one(three, titles):
    with three.planning():
        three.page.get_by_role("button", name=f"Plan with {titles['time_scaled']}").click()
    assert three.page.get_by_role("tab", selected=True).inner_text() == "Plan"
    assert {**three.sent, "include": None} == {**FREE, "method": "time_scaled", "include": None}
    assert three.page.get_by_label("method", exact=True).input_value() == "time_scaled"
    assert "time_scaled" in three.tile("Duration")


@pytest.mark.parametrize("given", [FREE, TIMED], ids=["free", "timed"])
def test_what_fits_is_ticked_at_first(loaded, given):
    screen = loaded.show(tab="compare", compare={"methods": []}).show(given)
    comparing(screen, lambda: screen.show(tab="compare", compare={"joint": 0}))
    found = rows(screen)
    assert len(found) >= 2 and not [name for name, cells in found if "✓" not in cells[-1]]


def test_all_of_them(loaded, ask):
    screen = compare(loaded, FREE)
    every = screen.page.locator("#panel-compare").get_by_role("button", name="All", exact=True)
    comparing(screen, every.click)
    assert len(rows(screen)) == len(ask("/v1/methods"))
    # in the picture no name lies over another, or sticks out
    picture = screen.page.locator("#against-chart")
    frame, names = picture.bounding_box(), picture.locator(".textpoint")
    boxes = [name.bounding_box() for name in names.all()]
    assert len(boxes) >= 4
    assert all(frame["x"] <= one["x"] and one["x"] + one["width"] <= frame["x"] + frame["width"] for one in boxes)
    for one, other in combinations(boxes, 2):
        apart = [abs(one[at] - other[at]) - (one if one[at] < other[at] else other)[size] for at, size in SIDES]
        assert max(apart) > -4, (one, other)
    none = screen.page.locator("#panel-compare input[type=checkbox]:checked")
    while none.count():
        none.first.uncheck()
    assert "No method is ticked" in screen.page.locator("#panel-compare").inner_text()


def test_a_link_brings_the_comparison_back(three, fresh):
    three.page.locator("#panel-compare th[scope=col]").nth(1).get_by_role("button").click()
    three.page.wait_for_function("() => location.hash.includes('sort')")
    other = fresh()
    other.page.goto(f"{three.address}/{three.page.evaluate('location.hash')}")
    other.page.wait_for_selector("#panel-compare[data-compared]")
    masked = lambda screen: [(name, cells[:-2]) for name, cells in rows(screen)]  # noqa: E731 - not the milliseconds
    assert masked(other) == masked(three)
    assert other.page.evaluate(LINES) == three.page.evaluate(LINES)


NONSENSE = [{"methods": 7}, {"methods": ["x", None]}, {"sort": 3}, {"sort": {"column": "x"}}, {"joint": "x"}]


@pytest.mark.parametrize("given", NONSENSE, ids=json.dumps)
def test_a_link_to_nonsense_still_compares(loaded, given):
    screen = compare(loaded, FREE)
    screen.show(tab="plan")
    screen.show(tab="compare", compare=given)
    screen.page.wait_for_selector("#panel-compare .comparison:not([aria-busy])")
    screen.show(tab="plan", compare={"methods": THREE})
    other = {**FREE, "waypoints": [[0, 0], [1, 1.25]]}
    comparing(screen, lambda: screen.show(other, "compare", compare={"methods": THREE}))
    assert len(rows(screen)) == 3
