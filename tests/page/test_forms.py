"""The request as a form: options out of the catalogue, errors at their fields and what mends them."""

import json
import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

TIMED = {"waypoints": [[0, 0], [1, 2], [2, 3]], "times": [0, 1, 2]}
FREE = {"waypoints": [[0, 0], [1, 2], [2, 0.5]], "limits": {"velocity": 1, "acceleration": 2, "jerk": 10}}
TIGHT = {"waypoints": [[0], [1]], "times": [0, 1], "limits": {"velocity": 0.5}, "joint_names": ["elbow"]}
SHOWN = """(prefix) => [...document.querySelectorAll(`#panel-plan .field[data-at^="${prefix}"]`)].map((row) => [
  row.dataset.at, row.querySelector("label").textContent, row.querySelector("small")?.textContent ?? null])"""


def followed(schema, defs):
    return {**defs[schema["$ref"].split("/")[-1]], **schema} if "$ref" in schema else schema


def kinds_of(schema, defs):
    several = schema.get("anyOf") or schema.get("oneOf")
    if not several:
        return [] if schema.get("type") == "null" else [schema]
    return [kind for one in several for kind in kinds_of(followed(one, defs), defs)]


def expected(schema, at, defs, chosen=None):
    """Return the fields that a schema comes to, as pointer, unit and description; and where a kind can be chosen."""
    fields = []
    for name, given in schema.get("properties", {}).items():
        own = followed(given, defs)
        kinds = kinds_of(own, defs)
        named = {kind["properties"]["kind"]["const"]: kind for kind in kinds if "kind" in kind.get("properties", {})}
        if named:
            fields.append((f"{at}/{name}/kind", None, own.get("description")))
            parts = named[chosen]["properties"] if chosen in named else {}
            rest = {key: one for key, one in parts.items() if key != "kind"}
            fields += expected({"properties": rest}, f"{at}/{name}", defs)
        elif len(kinds) == 1 and "properties" in kinds[0]:
            fields += expected(kinds[0], f"{at}/{name}", defs)
        else:
            fields.append((f"{at}/{name}", own.get("unit"), own.get("description")))
    return fields


def check_fields(screen, wanted):
    shown = screen.page.evaluate(SHOWN, "/options/")
    assert [row[0] for row in shown] == [row[0] for row in wanted]
    for (pointer, label, about), (_, unit, description) in zip(shown, wanted, strict=True):
        assert pointer.split("/")[-1].replace("_", " ") in label
        assert about == description, pointer
        assert unit is None or label.endswith(f" {unit}"), pointer


def choose(screen, method):
    with screen.planning():
        screen.page.get_by_label("method", exact=True).select_option(method)


def test_every_method_has_the_options_of_its_schema(loaded, ask, watch):
    watch.refusals = {422}  # not every method takes these waypoints
    screen = loaded.show(TIMED)
    methods = ask("/v1/methods")
    assert len(methods) > 15
    for row in methods:
        choose(screen, row["id"])
        assert screen.sent["method"] == row["id"] and "options" not in screen.sent
        check_fields(screen, expected(row["options"], "/options", row["options"].get("$defs", {})))
        text = screen.page.locator("#panel-plan .editor").text_content()
        for part in (row["summary"], row["formula"], row["reference"]["title"]):
            assert part in text, row["id"]
    choose(screen, "auto")
    assert not screen.page.evaluate(SHOWN, "/options/") and "method" not in screen.sent


def test_every_kind_of_path_has_its_own_options(loaded, ask, watch):
    watch.refusals = {422}
    screen = loaded.show({"waypoints": [[0, 0], [1, 2], [2, 0.5], [3, 1]], "limits": {"acceleration": 2}})
    choose(screen, "time_optimal_path")
    schema = ask("/v1/methods/time_optimal_path")["options"]
    kind = screen.field("/options/path/kind").locator("select")
    ids = [value for value in kind.locator("option").evaluate_all("all => all.map((one) => one.value)") if value]
    assert len(ids) > 5
    for one in ids:
        with screen.planning():
            kind.select_option(one)
        assert screen.sent["options"] == {"path": {"kind": one}}
        check_fields(screen, expected(schema, "/options", schema["$defs"], one))


MADE_UP = {
    "$defs": {
        "Soft": {"type": "object", "properties": {"kind": {"const": "soft"}, "give": {"type": "number", "unit": "mm"}}},
        "Hard": {"type": "object", "properties": {"kind": {"const": "hard"}}},
        "Inner": {"type": "object", "properties": {"depth": {"type": "integer", "default": 2, "description": "deep"}}},
    },
    "type": "object",
    "properties": {
        "stiffness": {"type": "number", "default": 3, "unit": "N/m", "description": "of the <b>spring</b>"},
        "shape": {"enum": ["round", "square"], "default": "round"},
        "quiet": {"type": "boolean", "default": True},
        "gains": {"anyOf": [{"type": "array", "items": {"type": "number"}}, {"type": "null"}], "default": None},
        "wall": {"anyOf": [{"$ref": "#/$defs/Soft"}, {"$ref": "#/$defs/Hard"}], "description": "what it hits"},
        "inner": {"anyOf": [{"$ref": "#/$defs/Inner"}, {"type": "null"}]},
    },
}


def test_a_new_method_appears_by_itself(fresh, ask, watch):
    watch.refusals = {404}
    screen = fresh()
    row = {**ask("/v1/methods/linear"), "id": "made_up", "title": "Made up", "family": "magic", "options": MADE_UP}
    answer = json.dumps([*ask("/v1/methods"), row])
    screen.page.route("**/v1/methods", lambda route: route.fulfill(content_type="application/json", body=answer))
    screen.load()
    choose(screen, "made_up")
    check_fields(screen, expected(MADE_UP, "/options", MADE_UP["$defs"]))
    field = lambda name: screen.field(f"/options/{name}").locator("input, select")  # noqa: E731
    with screen.planning():
        field("wall/kind").select_option("soft")
    check_fields(screen, expected(MADE_UP, "/options", MADE_UP["$defs"], "soft"))
    steps = (
        (lambda: field("stiffness").fill("4.5"), {"stiffness": 4.5}),
        (lambda: field("shape").select_option(label="square"), {"shape": "square"}),
        (lambda: field("quiet").uncheck(), {"quiet": False}),
        (lambda: (field("gains").fill("1, 2.5"), field("gains").blur()), {"gains": [1, 2.5]}),
        (lambda: field("wall/give").fill("0.5"), {"wall": {"kind": "soft", "give": 0.5}}),
        (lambda: field("inner/depth").fill("7"), {"inner": {"depth": 7}}),
    )
    options = {"wall": {"kind": "soft"}}
    for do, more in steps:
        with screen.planning():
            do()
        options |= more
        assert screen.sent["options"] == options
    with screen.planning():
        field("stiffness").fill("")
    assert "stiffness" not in screen.sent["options"]
    # the service knows no such method: it says so, at the choice
    assert "made_up" in screen.field("/method").locator(".wrong").inner_text()


def test_the_rest_of_the_request_comes_from_the_schema_too(loaded, ask):
    screen = loaded.show(TIMED)
    schemas = ask("/openapi.json")["components"]["schemas"]
    left_out = {"waypoints", "times", "method", "options", "limits", "robot"}
    shown = screen.page.locator("#panel-plan [data-at]").evaluate_all("all => all.map((one) => one.dataset.at)")
    assert set(schemas["PlanBody"]["properties"]) - left_out <= {pointer.split("/")[1] for pointer in shown}
    screen.page.get_by_text("Times, states, tolerances, sampling").click()
    with screen.planning():
        box = screen.field("/joint_names").locator("input")
        box.fill("base, arm")
        box.blur()
    assert screen.sent["joint_names"] == ["base", "arm"]


# Errors.


@pytest.mark.parametrize(
    "given, pointer, reason",
    [
        ({**FREE, "limits": {**FREE["limits"], "velocity": -1}}, "/limits/velocity", "lower < 0 < upper"),
        ({**TIMED, "times": [0, 2, 1]}, "/times/2", "must increase"),
        ({**TIMED, "method": "minimum_jerk", "options": {"order": 7}}, "/options/order", "2, 3 or 4"),
        ({**TIMED, "timeout": -1}, "/timeout", "greater than"),
        ({**TIMED, "sampling": {"dt": -1}}, "/sampling", "> 0"),
    ],
)
def test_a_wrong_value_is_marked(loaded, watch, given, pointer, reason):
    watch.refusals = {422}
    screen = loaded.show(given)
    row = screen.field(pointer)
    assert reason in row.locator(".wrong").first.inner_text()
    marked = screen.page.locator("#panel-plan [aria-invalid=true]")
    assert marked.count() == row.locator("[aria-invalid=true]").count() > 0
    assert marked.first.is_visible()
    screen.show(TIMED)
    assert not screen.page.locator("#panel-plan .wrong, #panel-plan [aria-invalid], #panel-plan .failure").count()


def test_a_reason_is_linked_to_its_field_and_told_once(loaded, watch):
    watch.refusals = {422}
    screen = loaded.show({**FREE, "limits": {"velocity": [-1, -2], "acceleration": -2}})
    for name in ("velocity", "acceleration"):
        row = screen.field(f"/limits/{name}")
        box, reason = row.get_by_role("textbox"), row.locator(".wrong").first
        assert reason.get_attribute("id") in box.get_attribute("aria-describedby").split()
        told = box.get_attribute("aria-errormessage")
        assert row.locator(f"#{told}.wrong").is_visible()
    assert screen.page.locator("[role=alert]").evaluate_all("all => all.map((one) => one.className)") == ["failure"]
    watch.refusals = set()
    screen.show(FREE)
    assert not screen.page.locator("[role=alert], [aria-errormessage]").count()
    lost = """() => [...document.querySelectorAll("[aria-describedby]")]
      .flatMap((one) => one.getAttribute("aria-describedby").split(" ")).filter((id) => !document.getElementById(id))"""
    assert screen.page.evaluate(lost) == []


def test_a_description_stays_when_a_reason_goes(loaded):
    screen = loaded.show(TIMED)
    box = screen.field("/tube").locator("input")
    if not box.is_visible():
        screen.page.get_by_text("Times, states, tolerances, sampling").click()
    before = box.get_attribute("aria-describedby")
    box.fill("{")
    box.blur()
    described = box.get_attribute("aria-describedby").split()
    assert described[0] == before and described[1] == box.get_attribute("aria-errormessage")
    box.fill("")
    box.blur()
    assert box.get_attribute("aria-describedby") == before and box.get_attribute("aria-errormessage") is None


def test_what_is_no_number_is_marked(loaded):
    screen = loaded.show(FREE)
    row = screen.field("/limits/velocity")
    box, before = row.get_by_role("textbox"), screen.planned
    box.fill("fast")
    assert box.evaluate("one => one.matches(':invalid') || one.getAttribute('aria-invalid') === 'true'")
    assert box.get_attribute("aria-invalid") == "true" and "number" in row.locator(".wrong").inner_text()
    assert screen.planned == before
    with screen.planning():
        box.fill("0.9")
    assert box.get_attribute("aria-invalid") is None and not row.locator(".wrong").count()


def test_what_takes_too_long_says_which_joint_and_how_long_it_needs(loaded, watch):
    watch.refusals = {422}
    screen = loaded.show(TIGHT)
    told = screen.page.locator("#panel-plan .failure")
    assert "joint 0" in told.inner_text() or "elbow" in told.inner_text()
    assert screen.field("/limits/velocity").locator("[aria-invalid=true]").count()
    offered = told.get_by_role("button", name=re.compile(r"^Use [\d.]+ s$"))
    seconds = float(offered.inner_text().split()[1])
    watch.refusals = set()
    with screen.planning():
        offered.click()
    assert screen.sent["times"] == [0, pytest.approx(seconds, rel=1e-3)]
    assert "✓ holds" in screen.tile("Certificate") and not told.count()
    assert not screen.page.locator("#panel-plan [aria-invalid]").count()


@pytest.mark.parametrize(
    "given, button",
    [
        (TIGHT, r"Allow velocity [\d.]+ of elbow"),
        ({**FREE, "duration": {"max": 1}}, r"Use [\d.]+ s"),
        ({**FREE, "limits": {**FREE["limits"], "position": {"upper": [1.5, 5]}}}, r"Allow position [\d.]+ of joint 0"),
        ({**FREE, "segment_durations": [{"max": 0.2}, None], "method": "ruckig"}, r"Give segment 0 [\d.]+ s"),
        ({**FREE, "segment_durations": [{"min": 1, "max": 1}, None], "method": "ruckig"}, r"Give segment 0 [\d.]+ s"),
        ({**TIMED, "method": "quintic_spline", "waypoint_tolerance": 0.1}, "Use minimum_jerk"),
        ({**TIMED, "method": "quintic_spline", "waypoint_tolerance": 0.1}, "Leave out waypoint_tolerance"),
        ({**TIMED, "method": "linear", "limits": {"velocity": 3, "jerk": 60}}, "Leave out jerk, velocity"),
    ],
)
def test_what_mends_a_refusal_is_a_button(loaded, watch, given, button):
    watch.refusals = {422}
    screen = loaded.show(given)
    offered = screen.page.locator("#panel-plan .failure").get_by_role("button", name=re.compile(f"^{button}$"))
    watch.refusals = set()
    with screen.planning():
        offered.click()
    assert "✓ holds" in screen.tile("Certificate")
    assert screen.sent["waypoints"] == given["waypoints"]


PARTS = {"segment_limits": [None, {"velocity": 0.5}], "waypoint_states": [None, None, None], "start": {}, "tube": 2}


@pytest.mark.parametrize(
    "name, gone",
    [
        ("+ waypoint", "segment_limits, waypoint_states"),
        ("remove waypoint 1", "segment_limits, waypoint_states"),
        ("+ joint", "segment_limits, waypoint_states, start, tube"),
    ],
)
def test_what_no_longer_fits_is_told(loaded, watch, name, gone):
    watch.refusals = {422}  # no method takes all of these parts
    screen = loaded.show({**FREE, **PARTS})
    screen.page.evaluate("document.querySelector('#say').textContent = ''")
    with screen.planning():
        screen.page.get_by_role("button", name=name, exact=True).click()
    assert screen.page.get_by_role("status").inner_text() == f"left out, since it no longer fits: {gone}"
    assert not set(gone.split(", ")) & set(screen.sent)


def test_what_fits_goes_without_a_word(loaded):
    screen = loaded.show({**FREE, "sampling": {"dt": 0.1}})
    screen.page.evaluate("document.querySelector('#say').textContent = ''")
    with screen.planning():
        screen.page.get_by_role("button", name="+ waypoint", exact=True).click()
    assert screen.page.get_by_role("status").inner_text() == "" and screen.sent["sampling"] == {"dt": 0.1}


def test_units_are_stated_once():
    text = "".join(path.read_text() for path in (Path(__file__).parents[2] / "api" / "page").glob("*.js"))
    assert [text.count(f'"{unit}"') for unit in ("unit/s²", "unit/s³")] == [1, 1]
