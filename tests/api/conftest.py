import json
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from starlette.testclient import TestClient

from api.app import create_app
from api.errors import KINDS, LARGEST


@pytest.fixture(scope="session")
def service() -> Iterator[TestClient]:
    """The service without a socket, once its kernels are compiled; what it does not catch is raised."""
    with TestClient(create_app()) as client:
        for _ in range(6000):
            if client.get("/readyz").status_code == 200:
                break
            time.sleep(0.1)
        yield client


@pytest.fixture(scope="session")
def problem() -> Callable[..., dict[str, Any]]:
    """Check a response to be a proper problem document and return it."""

    def check(response: Any, code: str | None = None) -> dict[str, Any]:
        assert response.headers["content-type"] == "application/problem+json"
        assert len(response.content) < LARGEST
        document: dict[str, Any] = json.loads(response.content, parse_constant=lambda name: pytest.fail(name))
        assert document["status"] == response.status_code
        assert document["request_id"] == response.headers["x-request-id"]
        kind = document["type"].removeprefix("/errors/")
        assert KINDS[kind].status == response.status_code
        assert document["title"] == KINDS[kind].title
        assert document["detail"]
        if code is not None:
            assert kind == code, document
        return document

    return check
