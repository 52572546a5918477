"""The page /docs: everything it needs comes from this host."""

import re
from importlib import util

import pytest
from starlette.testclient import TestClient

from api.app import create_app
from api.routes import pages
from api.settings import Settings


@pytest.fixture(scope="module")
def client() -> TestClient:
    return TestClient(create_app(Settings()))


def policy(response):
    return {rule.split()[0]: rule.split()[1:] for rule in response.headers["content-security-policy"].split(";")}


def test_the_page_and_its_files(client):
    page = client.get("/docs")
    assert page.status_code == 200 and page.headers["content-type"].startswith("text/html")
    wanted = re.findall(r'(?:src|href)="([^"]*)"', page.text)
    assert len(wanted) == 4 and not [address for address in wanted if ":" in address or address.startswith("/")]
    for address in wanted:
        file = client.get(f"/{address}")
        assert file.status_code == 200 and len(file.content) > 100, address
        assert file.headers["x-content-type-options"] == "nosniff" and "request_id" not in file.text[:200]
    assert "SwaggerUIBundle" in client.get("/docs/swagger-ui-bundle.js").text[:1_600_000]
    assert client.get("/docs/swagger-ui.css").headers["content-type"].startswith("text/css")
    assert client.get("/favicon.ico").headers["content-type"] == "image/svg+xml"


def test_no_request_leaves_the_host(client):
    for path in ("/docs", "/docs/start.js", "/docs/swagger-ui-bundle.js", "/docs/swagger-ui.css", "/favicon.ico"):
        rules = policy(client.get(path))
        assert rules["default-src"] == ["'none'"] and rules["script-src"] == ["'self'"]
        assert rules["connect-src"] == ["'self'"] and rules["frame-ancestors"] == ["'none'"]
        assert not [source for sources in rules.values() for source in sources if "//" in source or source == "*"]
        assert "'unsafe-inline'" not in rules["script-src"]
    assert "http" not in client.get("/docs").text and "http" not in client.get("/docs/start.js").text
    assert "validatorUrl: null" in client.get("/docs/start.js").text
    assert not re.findall(r"url\(\s*['\"]?(?!data:|#|['\"]?data:)", client.get("/docs/swagger-ui.css").text)


def test_the_page_shows_our_document(client):
    assert 'url: "openapi.json"' in client.get("/docs/start.js").text
    document = client.get("/openapi.json").json()
    for path, operations in document["paths"].items():
        if "post" in operations:
            assert operations["post"]["requestBody"]["content"]["application/json"]["example"], path
    assert not [path for path in document["paths"] if "docs" in path or "favicon" in path]


def test_files_are_cached(client):
    for path, lifetime in (("/docs", "no-cache"), ("/docs/swagger-ui.css", "public, max-age=86400")):
        first = client.get(path)
        assert first.headers["cache-control"] == lifetime
        again = client.get(path, headers={"If-None-Match": f'"x", W/{first.headers["etag"]}'})
        assert again.status_code == 304 and not again.content and again.headers["etag"] == first.headers["etag"]
        assert client.get(path, headers={"If-None-Match": '"x"'}).status_code == 200


@pytest.mark.parametrize(
    "path",
    ["/docs/", "/docs/favicon.png", "/docs/redoc.standalone.js", "/docs/..%2fcore.py", "/docs/%2e%2e/x", "/docs/x"],
)
def test_nothing_else_is_there(client, problem, path):
    problem(client.get(path), "not_found")
    problem(client.get("/docs?x=1"), "invalid_request")
    problem(client.post("/docs"), "method_not_allowed")


def test_without_the_wheel(client, problem, monkeypatch):
    pages._installed.cache_clear()
    monkeypatch.setattr(util, "find_spec", lambda name: None)
    try:
        for path in ("/docs", "/docs/start.js", "/docs/swagger-ui.css"):
            assert "waywright[service]" in problem(client.get(path), "not_found")["detail"]
    finally:
        pages._installed.cache_clear()
    assert client.get("/favicon.ico").status_code == 200
