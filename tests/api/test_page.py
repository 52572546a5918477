"""The page at / as files: what is served and how, and that its modules fit together. tests/page has a browser."""

import re
from importlib import util
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from api.app import create_app
from api.routes import pages
from api.settings import Settings

FILES = {path.name: path.read_text(encoding="utf-8") for path in sorted(pages._OURS.iterdir())}  # of the wheel, there
MODULES = {name: text for name, text in FILES.items() if name.endswith(".js")}
TYPES = {
    "css": "text/css; charset=utf-8",
    "html": "text/html; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "svg": "image/svg+xml",
}
POLICY = "content-security-policy"
ADDRESSES = ("/", *(f"/page/{name}" for name in FILES))
IMPORT = re.compile(r"^import\s+(?:\*\s+as\s+\w+|\{([^}]*)\})\s+from\s+\"([^\"]*)\";", re.MULTILINE)
EXPORT = re.compile(r"^export\s+(?:async\s+)?(?:const|let|class|function\*?)\s+(\w+)", re.MULTILINE)


@pytest.fixture(scope="module")
def client() -> TestClient:
    return TestClient(create_app(Settings()))


def test_every_file_has_its_type(client):
    assert client.get("/").text == FILES["index.html"]
    for name, text in FILES.items():
        answer = client.get(f"/page/{name}")
        assert (answer.status_code, answer.text) == (200, text), name
        assert answer.headers["content-type"] == TYPES[name.rpartition(".")[2]]
        assert answer.headers["x-content-type-options"] == "nosniff"


@pytest.mark.parametrize("address", [*ADDRESSES, "/page/plotly.min.js"])
def test_what_is_held_is_not_sent_again(client, address):
    first = client.get(address)
    assert first.headers["cache-control"] == ("public, max-age=86400" if "plotly" in address else "no-cache")
    for tag in (first.headers["etag"], f'"x", W/{first.headers["etag"]}'):
        again = client.get(address, headers={"If-None-Match": tag})
        assert again.status_code == 304 and not again.content and again.headers["etag"] == first.headers["etag"]
    assert client.get(address, headers={"If-None-Match": '"x"'}).content == first.content


@pytest.mark.parametrize("address", [*ADDRESSES, "/page/plotly.min.js"])
def test_the_browser_is_told_to_ask_this_host_only(client, address):
    rules = {rule.split()[0]: rule.split()[1:] for rule in client.get(address).headers[POLICY].split(";")}
    assert rules["default-src"] == ["'none'"] and rules["script-src"] == rules["connect-src"] == ["'self'"]
    assert rules["frame-ancestors"] == rules["base-uri"] == rules["form-action"] == ["'none'"]
    assert not [source for sources in rules.values() for source in sources if "//" in source or "*" in source]


@pytest.mark.parametrize(
    "name",
    [
        *("", "main", "main.py", "MAIN.JS", "main.js/", "sub/main.js", "plotly.js", "__init__.py", ".", ".."),
        *("%2e%2e", "../app.py", "..%2fapp.py", "%2e%2e%2fapp.py", "..%5capp.py", "main.js%00", "%252e%252e/app.py"),
    ],
)
def test_nothing_else_is_there(client, problem, name):
    # the client resolves dots as browsers do; those that are escaped twice or by %2f get through
    if name in (".", "..", "%2e%2e", "../app.py"):
        answer = client.get(f"/page/x/{name}/y")
    else:
        answer = client.get(f"/page/{name}")
    problem(answer, "not_found")


def test_what_is_sent_along_is_refused(client, problem):
    for address in ("/", "/page/main.js"):
        problem(client.get(f"{address}?x=1"), "invalid_request")
        problem(client.post(address), "method_not_allowed")


def test_plotly_comes_from_its_wheel(client, problem, monkeypatch):
    answer = client.get("/page/plotly.min.js")
    wheel = Path(util.find_spec("plotly").submodule_search_locations[0], "package_data", "plotly.min.js")
    assert answer.content == wheel.read_bytes() and answer.headers["content-type"] == TYPES["js"]
    pages._installed.cache_clear()
    monkeypatch.setattr(util, "find_spec", lambda name: None)
    try:
        assert "waywright[service]" in problem(client.get("/page/plotly.min.js"), "not_found")["detail"]
        assert client.get("/").status_code == client.get("/page/main.js").status_code == 200
    finally:
        pages._installed.cache_clear()


def test_the_page_needs_no_key(problem):
    keyed = TestClient(create_app(Settings(api_keys_hashed=f"ann {'0' * 64}")))
    for address in (*ADDRESSES, "/page/plotly.min.js"):
        assert keyed.get(address).status_code == 200, address
    problem(keyed.get("/page/nothing"), "not_found")
    problem(keyed.get("/v1/cases"), "unauthorized")
    problem(keyed.get("/pages"), "unauthorized")


def test_every_import_is_an_export():
    exported = {name: set(EXPORT.findall(text)) for name, text in MODULES.items()}
    assert sum(map(len, exported.values())) > 20
    for name, text in MODULES.items():
        found = IMPORT.findall(text)
        assert len(found) == len(re.findall(r"^import\b", text, re.MULTILINE)), name
        assert not re.search(r"\bimport\(|^export\s+(?:\{|\*|default)", text, re.MULTILINE), name
        for names, source in found:
            assert source.startswith("./") and source[2:] in MODULES, (name, source)
            wanted = {one.split(" as ")[0].strip() for one in names.split(",") if one.strip()}
            assert wanted <= exported[source[2:]], (name, source, wanted - exported[source[2:]])
            bound = {one.split(" as ")[-1].strip() for one in names.split(",") if one.strip()}
            rest = IMPORT.sub("", text)
            assert not [one for one in bound if not re.search(rf"(?<![\w$]){re.escape(one)}(?![\w$])", rest)], name
    used = {source[2:] for text in MODULES.values() for _, source in IMPORT.findall(text)}
    assert used | {"main.js", "theme.js"} == set(MODULES)


def test_a_tab_is_one_module():
    names = re.search(r"const TABS = \[([^\]]*)\]", MODULES["main.js"])[1].split(",")
    assert len(names) >= 3
    for name in names:
        assert {"id", "title", "mount"} <= set(EXPORT.findall(MODULES[f"{name.strip()}.js"])), name


def test_no_file_names_another_host():
    for name, text in FILES.items():
        text = text.replace('"http://www.w3.org/2000/svg"', "")  # a name, which nobody asks for
        assert not re.findall(r"\w+://|[\"'`(=]\s*//", text), name
        assert not re.findall(r"@import|url\(", text) or not name.endswith(".css"), name


def test_text_never_becomes_markup_or_code():
    markup = r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|createContextualFragment|parseFromString|srcdoc"
    for name, text in MODULES.items():
        assert not re.findall(markup, text), name
        assert not re.findall(r"\beval\b|\bnew Function\b|\bset(?:Timeout|Interval)\(\s*[\"'`]", text), name
    assert not re.findall(r"\son\w+=|<style|style=|<script>|<script(?![^>]*src)", FILES["index.html"])


def test_addresses_are_relative():
    """So that a proxy may serve the page further down."""
    found = re.findall(r'(?:src|href)="([^"]*)"', FILES["index.html"])
    assert len(found) >= 6
    for address in found:
        assert re.match(r"(page/[\w.]+|docs)$", address), address
        assert not address.startswith("page/") or address[5:] in {*FILES, "plotly.min.js"}
    for name, text in MODULES.items():
        assert not re.findall(r"[\"'`]/(?:v1|page|docs|openapi)", text), name


def test_files_stay_short():
    lines = {name: len(text.splitlines()) for name, text in FILES.items()}
    assert max(lines.values()) <= 300, lines
