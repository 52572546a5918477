"""Keys, rates and origins: who is served, and what everybody else is told."""

import asyncio
import hashlib
import hmac
import re
import time
from dataclasses import fields
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from api import keys as keys_module
from api.__main__ import main
from api.access import is_open, trusted
from api.app import create_app
from api.keys import Keys, new_key
from api.rates import Rate, _Counters, caller_of
from api.settings import Caps, Settings

PLAN = {"waypoints": [[0], [1]], "times": [0, 1]}


def line(name: str, key: str) -> str:
    return f"{name} {hashlib.sha256(key.encode()).hexdigest()}"


def client(**settings) -> TestClient:
    return TestClient(create_app(Settings(**settings)))


@pytest.fixture(scope="module")
def keyed() -> TestClient:
    return client(api_keys_hashed=f"{line('ann', 'ann-key')},{line('bob', 'bob-key')}")


@pytest.mark.parametrize("path", ["/v1/limits", "/v1/methods", "/v1/methods/linear", "/metrics", "/nowhere", "/docsx"])
@pytest.mark.parametrize("key", [None, "", "x", "ann-ke", "ann-key x", "Ann-key", "é", "x" * 5000])
def test_without_a_good_key_there_is_no_answer(keyed, problem, path, key):
    headers = {} if key is None else {"X-API-Key": key.encode("latin-1")}
    response = keyed.get(path, headers=headers)
    document = problem(response, "unauthorized")
    assert "WWW-Authenticate" in response.headers
    assert ("missing" in document["detail"]) == (key is None)


@pytest.mark.parametrize("path", ["/healthz", "/readyz", "/openapi.json", "/docs", "/favicon.ico", "/errors/timeout"])
def test_open_paths_need_none(keyed, path):
    assert keyed.get(path).status_code in (200, 503)


def test_no_path_is_open_by_how_it_is_written():
    for path in ("//healthz", "/healthz/", "/HEALTHZ", "/v1/../healthz", "/errors", "/metrics", "/docs/../v1/limits"):
        assert not is_open(path) or path == "/docs/../v1/limits"  # which the router knows nothing of


def test_a_good_key_is_admitted(keyed):
    for key in ("ann-key", "bob-key"):
        assert keyed.get("/v1/limits", headers={"X-API-Key": key}).status_code == 200
    twice = [("X-API-Key", "ann-key"), ("X-API-Key", "ann-key")]
    assert keyed.get("/v1/limits", headers=twice).status_code == 401


def test_a_refused_body_is_heard_out(keyed, problem):
    chunks = (b" " * 65536 for _ in range(32))
    problem(keyed.post("/v1/trajectories", content=chunks), "unauthorized")


def test_all_entries_are_compared(monkeypatch):
    seen = []

    class Watched:
        @staticmethod
        def compare_digest(a, b):
            seen.append(a)
            return hmac.compare_digest(a, b)

    monkeypatch.setattr(keys_module, "hmac", Watched)
    keys = Keys((name, hashlib.sha256(name.encode()).hexdigest()) for name in "abcdef")
    assert keys.owner(b"a") == "a"
    assert len(seen) == 6
    assert keys.owner(b"z") is None
    assert len(seen) == 12


def test_the_keys_file(tmp_path):
    file = tmp_path / "keys"
    file.write_text(f"# ours\n\n{line('ann', 'k')}  # the first\n  {line('bob', 'l').upper().replace('BOB', 'bob')}\n")
    keys = Keys.read(str(file), "")
    assert keys is not None and len(keys) == 2
    assert keys.owner(b"k") == "ann" and keys.owner(b"l") == "bob" and keys.owner(b"m") is None
    both = Keys.read(str(file), line("cyd", "m"))
    assert both is not None and both.owner(b"m") == "cyd" and both.owner(b"k") == "ann"
    assert Keys.read("", " ") is None


@pytest.mark.parametrize(
    "text, said",
    [
        ("ann secret-in-clear", "line 2"),
        (f"{line('ann', 'k')} more", "line 2"),
        (line("ann", "k")[:-1], "line 2"),
        (line("a/b", "k"), "line 2"),
        (f"{line('ann', 'k')}\n{line('ann', 'l')}", "line 3"),
        (f"{line('ann', 'k')}\n{line('bob', 'k')}", "line 3"),
        ("# nothing else", "has no key"),
    ],
)
def test_a_wrong_keys_file_is_refused_at_start(tmp_path, text, said):
    file = tmp_path / "keys"
    file.write_text(f"# keys\n{text}\n")
    with pytest.raises(ValueError, match=said) as error:
        create_app(Settings(api_keys=str(file)))
    assert "secret" not in str(error.value)


def test_a_missing_keys_file_is_refused_at_start(tmp_path):
    with pytest.raises(ValueError, match="No such file"):
        create_app(Settings(api_keys=str(tmp_path / "none")))
    with pytest.raises(ValueError, match="entry 2"):
        create_app(Settings(api_keys_hashed=f"{line('ann', 'k')},x"))


def test_the_file_is_read_at_start_only(tmp_path):
    file = tmp_path / "keys"
    file.write_text(line("ann", "k"))
    service = client(api_keys=str(file))
    file.write_text(line("bob", "l"))
    assert service.get("/v1/limits", headers={"X-API-Key": "k"}).status_code == 200
    assert service.get("/v1/limits", headers={"X-API-Key": "l"}).status_code == 401


def test_a_key_is_made(capsys):
    assert main(["key", "ann"]) == 0
    out = capsys.readouterr().out
    key = re.search(r": (\S{43})\n", out)[1]
    entry = re.search(r"file: (.*)\n", out)[1]
    assert Keys.read("", entry).owner(key.encode()) == "ann"
    assert new_key("ann")[0] != key
    assert main(["key", "two words"]) == 2
    capsys.readouterr()


def test_the_document_tells_of_keys(keyed):
    document = keyed.get("/openapi.json").json()
    scheme = document["components"]["securitySchemes"]["key"]
    assert (scheme["type"], scheme["in"], scheme["name"]) == ("apiKey", "header", "X-API-Key")
    for path, operations in document["paths"].items():
        for operation in operations.values():
            assert ("security" in operation) == (not is_open(path.replace("{code}", "x")))
            assert ("401" in operation["responses"]) == ("security" in operation)
    assert "securitySchemes" not in client().get("/openapi.json").json()["components"]


def standing(response):
    policy = re.fullmatch(r'"default";q=(\d+);w=(\d+)', response.headers["ratelimit-policy"])
    left = re.fullmatch(r'"default";r=(\d+);t=(\d+)', response.headers["ratelimit"])
    return [int(n) for n in (*policy.groups(), *left.groups())]


def test_a_rate_bites(problem):
    service = client(rate="5/minute")
    for i in range(5):
        response = service.get("/v1/limits")
        assert response.status_code == 200
        quota, window, left, until = standing(response)
        assert (quota, window, left) == (5, 60, 4 - i) and 1 <= until <= 60
        assert "retry-after" not in response.headers
    for path in ("/v1/limits", "/nowhere", "/docs", "/openapi.json"):
        response = service.get(path)
        problem(response, "rate_limited")
        assert standing(response)[2] == 0 and 1 <= int(response.headers["retry-after"]) <= 60
    response = service.post("/v1/trajectories", json=PLAN)
    problem(response, "rate_limited")
    for path in ("/healthz", "/readyz"):
        response = service.get(path)
        assert response.status_code in (200, 503) and "ratelimit" not in response.headers


def test_a_rate_lets_in_again(problem):
    service = client(rate="2/second")
    codes = [service.get("/v1/limits").status_code for _ in range(6)]
    assert codes[:2] == [200, 200] and 429 in codes
    time.sleep(2)
    assert service.get("/v1/limits").status_code == 200


def test_each_key_has_a_rate_of_its_own(problem):
    service = client(rate="3/minute", api_keys_hashed=f"{line('ann', 'k')},{line('bob', 'l')}")
    for key in ("k", "l"):
        codes = [service.get("/v1/limits", headers={"X-API-Key": key}).status_code for _ in range(4)]
        assert codes == [200, 200, 200, 429]
    codes = [service.get("/v1/limits", headers={"X-API-Key": f"guess{i}"}).status_code for i in range(4)]
    assert codes == [401, 401, 401, 429]  # who has no key counts by address, whatever it guesses


def test_there_is_no_rate_unless_one_is_set():
    assert "ratelimit" not in client().get("/v1/limits").headers


@pytest.mark.parametrize("text", ["many", "600", "600/fortnight", "0/minute", "-1/minute"])
def test_a_wrong_rate_is_refused_at_start(text):
    with pytest.raises(ValueError, match="WAYWRIGHT_RATE"):
        create_app(Settings(rate=text))


def test_counters_are_forgotten(monkeypatch):
    async def run():
        rate = Rate("2/second")
        for i in range(1000):
            await rate.take(f"address {i}")
        held = len(rate._counters.storage)
        rate._counters._sweep_at = 0.0
        future = time.time() + 10
        monkeypatch.setattr(time, "time", lambda: future)
        await rate.take("one more")
        return held, len(rate._counters.storage), len(rate._counters.expirations)

    assert asyncio.run(run()) == (1000, 1, 1)


def test_counting_starts_no_task_and_no_thread():
    """The library's own store sweeps at each request; ours takes the place of the method that starts that."""

    async def run():
        before = len(asyncio.all_tasks())
        counters = _Counters()
        for i in range(10):
            await counters.incr(f"{i}", 10)
        return len(asyncio.all_tasks()) - before, counters.timer, await counters.get("3")

    assert asyncio.run(run()) == (0, None, 1)


def test_addresses():
    assert caller_of(("192.0.2.7", 1)) == "address 192.0.2.7"
    assert caller_of(("::ffff:192.0.2.7", 1)) == "address 192.0.2.7"
    assert caller_of(("2001:db8::1", 1)) == caller_of(("2001:db8::ffff:0:1", 9)) != caller_of(("2001:db8:0:1::1", 1))
    assert caller_of(("fe80::1%eth0", 1)) == caller_of(("fe80::2", 1))
    assert caller_of(None) == "address unknown" and caller_of(("testclient", 1)) == "address testclient"


def test_proxies():
    assert trusted("") == [] and trusted("10.0.0.1, 10.1.0.0/16") == ["10.0.0.1", "10.1.0.0/16"]
    for text in ("*", "localhost", "10.0.0.1/8"):
        with pytest.raises(ValueError, match="WAYWRIGHT_PROXIES"):
            create_app(Settings(proxies=text))


ORIGIN = {"Origin": "https://robots.example.org"}
PREFLIGHT = ORIGIN | {"Access-Control-Request-Method": "POST", "Access-Control-Request-Headers": "x-api-key"}


def test_no_other_origin_unless_it_is_named():
    response = client().get("/v1/limits", headers=ORIGIN)
    assert not [name for name in response.headers if name.startswith("access-control")]
    assert client().options("/v1/trajectories", headers=PREFLIGHT).status_code == 405


def test_named_origins_may_call():
    service = client(
        cors="https://robots.example.org http://localhost:3000", api_keys_hashed=line("a", "k"), rate="9/minute"
    )
    preflight = service.options("/v1/trajectories", headers=PREFLIGHT)
    assert preflight.status_code == 200 and preflight.headers["access-control-allow-origin"] == ORIGIN["Origin"]
    assert "X-API-Key" in preflight.headers["access-control-allow-headers"] and "x-request-id" in preflight.headers
    refused = service.get("/v1/limits", headers=ORIGIN)
    assert refused.status_code == 401 and refused.headers["access-control-allow-origin"] == ORIGIN["Origin"]
    exposed = set(refused.headers["access-control-expose-headers"].split(", "))
    assert exposed == {"X-Request-ID", "Server-Timing", "RateLimit", "RateLimit-Policy", "Retry-After"}
    assert "access-control-allow-credentials" not in refused.headers
    stranger = service.get("/v1/limits", headers={"Origin": "https://evil.example", "X-API-Key": "k"})
    assert "access-control-allow-origin" not in stranger.headers


def test_any_origin_only_where_it_is_spelled_out():
    response = client(cors="*").get("/v1/limits", headers=ORIGIN)
    assert response.headers["access-control-allow-origin"] == "*"
    for text in ("* https://a.example", "robots.example.org", "https://a.example/path", "null", "https://*.a.example"):
        with pytest.raises(ValueError, match="WAYWRIGHT_CORS"):
            create_app(Settings(cors=text))


def test_nothing_new_while_the_service_stops(problem):
    service = client()
    service.app.state.service.draining = True
    response = service.post("/v1/trajectories", json=PLAN)
    assert problem(response, "overloaded")["detail"] == "the service is stopping"
    assert response.headers["connection"] == "close" and response.headers["retry-after"] == "1"
    problem(service.get("/readyz"), "overloaded")
    assert service.get("/v1/limits").status_code == 200


def test_the_page_for_operators_has_every_setting():
    text = (Path(__file__).parents[2] / "docs" / "service.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `WAYWRIGHT_(\w+)` \| ([^|]+) \|", text, re.M))
    known = [*fields(Settings), *fields(Caps)]
    assert sorted(rows) == sorted(f.name.upper() for f in known if f.name != "caps")
    for f in known:
        if isinstance(f.default, (int, float)):
            assert float(rows[f.name.upper()]) == f.default
        elif isinstance(f.default, str):
            assert rows[f.name.upper()].strip("` ") == (f.default or "none")


@pytest.mark.parametrize(
    "settings",
    [{"rate": "10/minute;5/second"}, {"api_keys_hashed": ","}, {"api_keys_hashed": " # nothing,"}],
)
def test_what_would_be_half_read_is_refused(settings):
    with pytest.raises(ValueError, match="WAYWRIGHT_"):
        create_app(Settings(**settings))


def test_caps_are_no_setting_of_their_own():
    with pytest.raises(ValueError, match="WAYWRIGHT_CAPS"):
        Settings.from_environment({"WAYWRIGHT_CAPS": "3"})
