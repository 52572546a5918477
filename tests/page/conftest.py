"""A service of its own and a browser; a page that complains, or asks another host, fails the test that opened it."""

import hashlib
import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote

import httpx2
import pytest

ROOT = Path(__file__).parents[2]
FLAGS = ["--no-sandbox", "--disable-background-networking", "--disable-component-update", "--no-first-run"]

VIEW = {"viewport": {"width": 1440, "height": 1000}}

#: Runs before the page does: what it asks to be planned, and how far its layout jumps.
SPY = """(() => {
  const real = window.fetch;
  window.spy = { sent: [], broken: 0, jumps: 0 };
  window.fetch = (path, given) => {
    const answer = real(path, given);
    if (String(path).endsWith("v1/trajectories") && given?.signal) {
      spy.sent.push(JSON.parse(given.body));
      answer.catch(() => (spy.broken += 1));
    }
    return answer;
  };
  const jumped = (list) => list.getEntries().forEach((one) => (spy.jumps += one.hadRecentInput ? 0 : one.value));
  new PerformanceObserver(jumped).observe({ type: "layout-shift", buffered: true });
})()"""

#: All that was sent is drawn, and nothing is on its way.
QUIET = """() => {
  const planned = Number(document.querySelector("#panel-plan")?.dataset.planned ?? 0);
  return planned > 0 && planned >= spy.sent.length - spy.broken;
}"""

DRAWN = """() => document.querySelector("#time-chart").data.map(({ name, mode, yaxis, x, y }) => (
  { name, mode, axis: yaxis ?? "y", x: Array.from(x), y: Array.from(y) }))"""


def sought() -> tuple[str | None, str]:
    """Return the browser's path, or why there is none."""
    if importlib.util.find_spec("playwright") is None:
        return None, "the page's tests need playwright (pip install -e '.[dev]')"
    chosen = os.environ.get("WAYWRIGHT_BROWSER")
    names = [chosen] if chosen else ["chromium", "chromium-browser", "google-chrome"]
    why = f"WAYWRIGHT_BROWSER={chosen} is no program" if chosen else "there is no browser"
    return next(filter(None, map(shutil.which, names)), None), f"the page's tests: {why} (apt-get install chromium)"


def pytest_runtest_setup() -> None:
    """Skip the whole folder where there is no browser; here, so that it is one line and not one for each test."""
    found, why = sought()
    if found is None:
        pytest.skip(why)


@pytest.fixture(scope="session")
def program() -> str:
    return sought()[0]


@contextmanager
def serving(**settings: str) -> Iterator[str]:
    """Start a service; its address, as soon as it listens."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("WAYWRIGHT_")}
    environment |= {"WAYWRIGHT_LOG": "off"} | {f"WAYWRIGHT_{name.upper()}": value for name, value in settings.items()}
    command = [sys.executable, "-m", "api", "serve", "--port", "0"]
    process = subprocess.Popen(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True)
    try:
        yield re.search(r"http://[\w.:]+", process.stdout.readline())[0]
    finally:
        process.terminate()
        try:
            process.wait(30)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()


def until_ready(address: str) -> None:
    deadline = time.monotonic() + 600  # kernels may have to be compiled
    while time.monotonic() < deadline:
        try:
            if httpx2.get(f"{address}/readyz", trust_env=False).status_code == 200:
                return
        except httpx2.TransportError:
            pass
        time.sleep(0.1)
    raise AssertionError("not ready in time")


@pytest.fixture(scope="session")
def service(program) -> Iterator[str]:
    """The address of a service that is ready."""
    with serving() as address:
        until_ready(address)
        yield address


@pytest.fixture(scope="session")
def keyed(service) -> Iterator[tuple[str, str]]:
    """The address of a service that wants a key, and a key. It may still warm up."""
    key = "key-of-ann"
    with serving(api_keys_hashed=f"ann {hashlib.sha256(key.encode()).hexdigest()}", workers="1") as address:
        yield address, key


@pytest.fixture(scope="session")
def ask(service) -> Iterator[Callable[..., Any]]:
    """Ask the service without the page."""
    with httpx2.Client(base_url=service, timeout=60, trust_env=False) as client:

        def asked(path: str, body: object = None) -> Any:
            answer = client.get(path) if body is None else client.post(path, json=body)
            assert answer.status_code == 200, answer.text[:500]
            return answer.json()

        yield asked


@pytest.fixture(scope="module")
def browser(program) -> Iterator[Any]:
    """A browser for each module: while playwright runs, no other loop of events could in this thread."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        running = play.chromium.launch(executable_path=program, args=FLAGS)
        yield running
        running.close()


class Watch:
    """What pages complain about; answers that a test expects to be refused are no complaint."""

    def __init__(self, hosts: list[str]) -> None:
        self.hosts, self.refusals, self.said = hosts, set(), []

    def over(self, page: Any) -> None:
        page.on("console", lambda message: self.note(message.type, message.text))
        page.on("pageerror", lambda error: self.said.append(f"thrown: {error}"))
        page.on("request", self.asked)

    def note(self, kind: str, text: str) -> None:
        status = re.match(r"Failed to load resource: the server responded with a status of (\d+)", text)
        if kind in ("error", "warning") and not (status and int(status[1]) in self.refusals):
            self.said.append(f"{kind}: {text}")

    def asked(self, request: Any) -> None:
        if not request.url.startswith((*self.hosts, "data:", f"blob:{self.hosts[0]}")):
            self.said.append(f"another host was asked: {request.url[:200]}")


class Screen:
    """The page as somebody sees it, and what it asked of the service."""

    def __init__(self, page: Any, address: str) -> None:
        self.page, self.address = page, address

    def load(self, part: str = "") -> "Screen":
        self.page.goto(f"{self.address}/{part}")
        self.page.wait_for_selector("#panel-plan[data-planned]", state="attached")
        self.page.wait_for_function("() => document.documentElement.dataset.ready")
        return self.settled()

    def more_than(self, plans: int) -> "Screen":
        """Wait until more plans than so many were drawn."""
        self.page.wait_for_function("n => document.querySelector('#panel-plan').dataset.planned > n", arg=plans)
        return self

    def settled(self) -> "Screen":
        """Wait until all that was asked is drawn."""
        self.page.wait_for_function(QUIET, timeout=60_000)
        return self

    @contextmanager
    def planning(self) -> Iterator[None]:
        """Wait until what is done inside is planned and drawn."""
        before = self.planned
        yield
        self.more_than(before).settled()

    def show(self, request: dict | None = None, tab: str = "plan", **more: Any) -> "Screen":
        """Follow a link, as if it were clicked; even the present one, which is no news to a browser otherwise."""
        follow = "part => { history.replaceState(null, '', '#'); location.hash = part; }"
        if request is None:
            self.page.evaluate(follow, part(tab=tab, **more))
            self.page.wait_for_selector(f"#panel-{tab}", state="visible")
            return self
        self.page.evaluate("document.activeElement?.blur()")
        with self.planning():
            self.page.evaluate(follow, part(request, tab, **more))
        return self

    @property
    def planned(self) -> int:
        return int(self.page.get_attribute("#panel-plan", "data-planned") or 0)

    @property
    def sent(self) -> dict:
        """The last request, as the user made it."""
        return self.page.evaluate("spy.sent.at(-1)")

    def drawn(self) -> list[dict]:
        return self.page.evaluate(DRAWN)

    def lines(self) -> dict[str, list[list[list[float]]]]:
        """What is drawn over time: by the axis, a pair of lists for each joint."""
        found: dict[str, list] = {}
        for trace in self.drawn():
            if trace["mode"] == "lines":
                found.setdefault(trace["axis"], []).append([trace["x"], trace["y"]])
        return found

    def handle(self, label: str) -> Any:
        figure = "The motion over time" if "," in label else "The path in the plane"
        pattern = re.compile(f"^{re.escape(label)}:")
        return self.page.get_by_label(figure, exact=True).get_by_role("button", name=pattern)

    def tile(self, label: str) -> str:
        return self.page.locator("#panel-plan .tile", has=self.page.get_by_text(label, exact=True)).inner_text()

    def field(self, pointer: str) -> Any:
        return self.page.locator(f'#panel-plan [data-at="{pointer}"]')


def part(request: dict | None = None, tab: str = "plan", **more: Any) -> str:
    """Return the part of an address that holds a state."""
    pieces = [("tab", tab)] + ([("request", json.dumps(request))] if request else [])
    pieces += [(name, json.dumps(value)) for name, value in more.items()]
    return "#" + "&".join(f"{name}={quote(value)}" for name, value in pieces)


@pytest.fixture(scope="module")
def watch(service) -> Watch:
    return Watch([service])


@pytest.fixture(autouse=True)
def nothing_wrong(request) -> Iterator[None]:
    """After each test: no error, no warning, nothing from elsewhere."""
    if "browser" not in request.fixturenames:
        yield
        return
    watch = request.getfixturevalue("watch")
    watch.refusals, watch.said = set(), []
    yield
    for context in request.getfixturevalue("browser").contexts:
        for page in context.pages:
            page.evaluate("1")
    assert not watch.said


@pytest.fixture(scope="module")
def opening(service, browser, watch) -> Callable[..., Screen]:
    """Open a page in a context of its own; it is not loaded yet."""

    def opened(address: str = service, **given: Any) -> Screen:
        context = browser.new_context(**VIEW | given)
        context.grant_permissions(["clipboard-read", "clipboard-write"])
        context.set_default_timeout(30_000)
        context.add_init_script(SPY)
        page = context.new_page()
        watch.over(page)
        return Screen(page, address)

    return opened


@pytest.fixture
def fresh(opening) -> Iterator[Callable[..., Screen]]:
    """Open pages for this test alone."""
    screens: list[Screen] = []

    def opened(*given: Any, **more: Any) -> Screen:
        screens.append(opening(*given, **more))
        return screens[-1]

    yield opened
    for screen in screens:
        screen.page.evaluate("1")  # what it said before is here by now
        screen.page.context.close()


@pytest.fixture(scope="module")
def loaded(opening) -> Screen:
    """One loaded page for a module: a test begins with ``show``."""
    return opening().load()
