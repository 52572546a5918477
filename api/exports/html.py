"""A page to look at in a browser without a network: the Plotly figure, and the Plotly library itself."""

import html
from collections.abc import Iterator

from ..draft import Draft
from ..formats import plotly

_HEAD = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>{title}</title>
<script>"""

_BODY = """</script>
</head>
<body style="margin: 0">
<div id="figure" style="height: 100vh"></div>
<script type="application/json" id="data">"""

_TAIL = """</script>
<script>
const figure = JSON.parse(document.getElementById("data").textContent);
Plotly.newPlot("figure", figure.data, figure.layout, {responsive: true});
</script>
</body>
</html>
"""


def write(draft: Draft) -> Iterator[bytes]:
    """Write the page; some 5 MB of it are the library."""
    from plotly.offline import get_plotlyjs

    title = html.escape(f"{draft.tree['method']}, {draft.tree['duration']:.4g} s")
    yield _HEAD.format(title=title).encode()
    yield get_plotlyjs().encode()
    yield _BODY.encode()
    for piece in plotly.write(draft):
        yield piece.replace(b"<", b"\\u003c")  # a joint's name must not end the script
    yield _TAIL.encode()
