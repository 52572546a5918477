"""Every method has a page in the gallery, every page draws what it says, and docs/gallery.md is fresh."""

import importlib.util
import re
import runpy
import sys
from pathlib import Path

import matplotlib
import pytest
from PIL import Image

from planner import METHODS

matplotlib.use("Agg")

ROOT = Path(__file__).resolve().parent.parent
SPEC = importlib.util.spec_from_file_location("gallery", ROOT / "examples" / "gallery.py")
gallery = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(gallery)
PAGES = gallery.pages()
each_page = pytest.mark.parametrize("page", PAGES, ids=[page.name for page in PAGES])


def test_every_method_has_a_page():
    assert [page.name for page in PAGES][: len(METHODS)] == list(METHODS)
    assert {page.file for page in PAGES} == set((ROOT / "examples").glob("plot_*.py"))


@each_page
def test_pages_have_a_title_and_the_usual_parts(page):
    assert 10 < len(page.title) < 90 and ": " in page.title and "\n\n" in page.text
    for part in ("**The figure.**", "**When to use it.**", "**When not.**"):
        assert page.text.count(part) == 1, part
    assert "\n    " in page.text, "a formula"
    code = page.source.split('"""', 2)[2]
    assert 15 <= sum(bool(line.strip()) for line in code.splitlines()) <= 50


@each_page
def test_figures_are_drawn(page):
    with gallery.drawn(runpy.run_path(str(page.file))["figure"]) as figure:
        figure.draw_without_rendering()  # the layout may warn, too
        assert figure.axes and all(axis.has_data() for axis in figure.axes)
        for axis in figure.axes:
            alike = axis.get_shared_y_axes().get_siblings(axis)
            assert any(a.get_ylabel() or a.get_title() for a in alike), "an axis says what it shows"
        units = [axis.get_xlabel() for axis in figure.axes if axis.get_xlabel()]
        assert units and all(re.search(r"\(.+\)| N$", text) for text in units)
        assert any(axis.get_legend() for axis in figure.axes)
    assert not matplotlib.pyplot.get_fignums()


def test_the_page_is_fresh():
    text = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    assert text == gallery.markdown(PAGES), "run `make gallery`"
    assert set(re.findall(r"\]\((gallery/[^)]+)\)", text)) == {f"gallery/{page.name}.png" for page in PAGES}


def test_there_are_no_other_pictures():
    assert {file.name for file in gallery.PICTURES.iterdir()} == {page.picture.name for page in PAGES}
    assert sum(file.stat().st_size for file in gallery.PICTURES.iterdir()) < 1e6


@each_page
def test_pictures_are_of_todays_source(page):
    with Image.open(page.picture) as picture:
        assert picture.format == "PNG" and picture.size == (720, 450)
        assert picture.text == {"Source": page.digest}, "run `make gallery`"
        assert len(set(picture.convert("L").tobytes())) > 10, "something is drawn"
    assert page.picture.stat().st_size < 60_000


def test_pages_run_as_scripts(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    monkeypatch.setattr(sys, "argv", ["plot_linear.py", str(tmp_path / "linear.png")])
    runpy.run_path(str(ROOT / "examples" / "plot_linear.py"), run_name="__main__")
    sys.modules.pop("gallery", None)
    with Image.open(tmp_path / "linear.png") as picture:
        assert picture.size == (720, 450)
