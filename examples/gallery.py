"""The gallery: ``make gallery`` draws every page's figure and writes ``docs/gallery.md``.

A page is a file ``plot_<name>.py``: its docstring is the text (the first line is the title), its function ``figure``
draws the picture, and run as a script it shows the figure or saves it under the file name given.
"""

import ast
import hashlib
import io
import runpy
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import matplotlib
import matplotlib.pyplot as plt
from matplotlib.figure import Figure
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from planner import METHODS

HERE = Path(__file__).resolve().parent
DOCS = HERE.parent / "docs"
PICTURES = DOCS / "gallery"
FAMILIES = {
    "interpolation": "Interpolation",
    "smoothing": "Smoothing",
    "time_optimal": "Fast motion under limits",
    "more": "Beyond single methods",
}

#: What all figures share; the colours are those of M. Okabe and K. Ito, which the colour-blind can tell apart.
STYLE = {
    "axes.grid": True,
    "axes.prop_cycle": matplotlib.cycler(
        color=["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"]
    ),
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 10,
    "figure.constrained_layout.use": True,
    "figure.figsize": (8, 5),
    "font.size": 9,
    "grid.alpha": 0.3,
    "legend.fontsize": 8,
    "lines.linewidth": 1.5,
    "savefig.dpi": 90,
}

HEAD = """# Gallery

One page for every method, and some beyond: a derivation, a picture, when to use it and when not. Each is a short
program: run `python examples/plot_<name>.py` to see its figure, or add a file name to save it. What each method takes
and honours is in [methods.md](methods.md). Made from `examples/plot_*.py` by `make gallery`.
"""


class Page(NamedTuple):
    """One page: its name (a method's id, or another), its family, source, title and text."""

    name: str
    family: str
    source: str
    title: str
    text: str

    @property
    def file(self) -> Path:
        """The page's program."""
        return HERE / f"plot_{self.name}.py"

    @property
    def picture(self) -> Path:
        """Where its figure is kept."""
        return PICTURES / f"{self.name}.png"

    @property
    def digest(self) -> str:
        """A number of the source that the picture carries, so that a stale one is found."""
        return hashlib.sha256(self.source.encode()).hexdigest()[:16]


def pages() -> list[Page]:
    """Return the pages in the catalogue's order, then those that are of no single method."""
    found = {file.stem.removeprefix("plot_"): file for file in sorted(HERE.glob("plot_*.py"))}
    read = []
    for name in [*(m for m in METHODS if m in found), *(n for n in found if n not in METHODS)]:
        source = found[name].read_text(encoding="utf-8")
        title, _, text = (ast.get_docstring(ast.parse(source)) or "").partition("\n")
        family = METHODS[name].family if name in METHODS else "more"
        read.append(Page(name, family, source, title.removesuffix("."), text.strip()))
    return read


@contextmanager
def drawn(figure: Callable[[], Figure]) -> Iterator[Figure]:
    """Draw a page's figure in the common style, whatever the user's own is, and close it afterwards."""
    with plt.style.context(["default", STYLE]):
        made = figure()
        try:
            yield made
        finally:
            plt.close(made)


def show(figure: Callable[[], Figure]) -> None:
    """Show a page's figure, or save it under the file name that the command line gives."""
    with drawn(figure) as made:
        if len(sys.argv) > 1:
            made.savefig(sys.argv[1])
        else:
            plt.show()


def render(page: Page) -> bytes:
    """Return a page's picture as PNG: few colours and no date, so that drawing it again gives the same bytes."""
    raw, small, tag = io.BytesIO(), io.BytesIO(), PngInfo()
    with drawn(runpy.run_path(str(page.file))["figure"]) as figure:
        figure.savefig(raw, format="png", metadata={"Software": None})
    tag.add_text("Source", page.digest)
    few = Image.open(raw).convert("RGB").quantize(255, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    few.save(small, format="PNG", optimize=True, pnginfo=tag)
    return small.getvalue()


def markdown(read: list[Page]) -> str:
    """Return the text of ``docs/gallery.md``."""
    lines = [HEAD]
    for family, heading in FAMILIES.items():
        lines += [f"**{heading}**\n"]
        lines += [f"- [{page.title}](#{page.name})" for page in read if page.family == family]
        lines += [""]
    for page in read:
        links = [f"[examples/plot_{page.name}.py](../examples/plot_{page.name}.py)"]
        if page.name in METHODS:
            links.append(f"[`{page.name}` in the catalogue](methods.md#{page.name})")
        lines += [f'## <a id="{page.name}"></a>{page.title}\n', page.text + "\n"]
        lines += [f"![{page.title}](gallery/{page.name}.png)\n", f"Source: {', '.join(links)}\n"]
    return "\n".join(lines)


def main() -> None:
    """Draw every picture, write the page, and remove pictures that belong to no page."""
    matplotlib.use("Agg")  # no display is needed
    read = pages()
    PICTURES.mkdir(parents=True, exist_ok=True)
    for file in set(PICTURES.iterdir()) - {page.picture for page in read}:
        file.unlink()
    for page in read:
        page.picture.write_bytes(render(page))
        print(f"{page.picture.relative_to(DOCS.parent)}: {page.picture.stat().st_size / 1000:.1f} kB")
    (DOCS / "gallery.md").write_text(markdown(read), encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
