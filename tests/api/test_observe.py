"""What the service tells about itself: metrics, the log, traces, the lag of its event loop; and what it never tells."""

import asyncio
import io
import json
import logging
import random
import re
import string
import time
from pathlib import Path
from typing import Any

import pytest
from prometheus_client import CollectorRegistry
from prometheus_client.parser import text_string_to_metric_families
from starlette.testclient import TestClient

from api.app import create_app
from api.engine import jobs
from api.engine.engine import Solved
from api.engine.jobs import Failed
from api.observe import logs, telemetry, traces
from api.observe.lag import EVERY, STEP, WINDOW, Lag
from api.observe.metrics import VERBS
from api.observe.middleware import Observe, method_of
from api.schemas import PlanBody
from api.settings import Settings

DOCS = Path(__file__).resolve().parents[2] / "docs"
PLAN = "/v1/trajectories"
QUICK = {"waypoints": [[0, 0], [1, 2], [2, 3]], "times": [0, 1, 2], "method": "linear", "sampling": {"count": 5}}
SLOW = QUICK | {"method": "minimum_jerk"}
TRACE = "0af7651916cd43dd8448eb211c80319c"
PARENT = f"00-{TRACE}-b7ad6b7169203331-01"


def app_with(**given: Any) -> TestClient:
    """The service before its start-up: quick requests are answered, there are no solvers."""
    return TestClient(create_app(Settings(**given)))


def scraped(client: TestClient) -> dict[str, float]:
    """Return the samples of /metrics as ``name{label="value",…}``, labels sorted."""
    found = {}
    for family in text_string_to_metric_families(client.get("/metrics").text):
        for sample in family.samples:
            labels = ",".join(f'{k}="{v}"' for k, v in sorted(sample.labels.items()))
            found[sample.name + (f"{{{labels}}}" if labels else "")] = sample.value
    return found


@pytest.fixture
def lines():
    """The lines of a JSON log, read by calling."""
    stream = io.StringIO()
    undo = logs.configure(Settings(log="json"), stream)
    yield lambda: [json.loads(line) for line in stream.getvalue().splitlines()]
    undo()


# -- metrics -----------------------------------------------------------------------------------------------------------


def test_metrics_count_requests_and_solves():
    client = app_with()
    for _ in range(3):
        assert client.post(PLAN, json=QUICK).status_code == 200
    assert client.post(PLAN, json={"waypoints": []}).status_code == 422
    assert client.get("/v1/methods/linear").status_code == client.get("/openapi.json").status_code == 200
    assert client.head("/v1/methods/linear").status_code == 200
    page = client.get("/metrics")
    assert page.headers["content-type"] == "text/plain; version=0.0.4; charset=utf-8"
    assert "_created" not in page.text
    found = scraped(client)
    assert found['waywright_requests_total{route="/v1/trajectories",status="200",verb="POST"}'] == 3
    assert found['waywright_requests_total{route="/v1/trajectories",status="422",verb="POST"}'] == 1
    assert found['waywright_requests_total{route="/v1/methods/{id}",status="200",verb="GET"}'] == 1
    assert found['waywright_requests_total{route="/openapi.json",status="200",verb="GET"}'] == 1
    assert found['waywright_requests_total{route="/v1/methods/{id}",status="200",verb="HEAD"}'] == 1
    assert found['waywright_request_seconds_count{route="/v1/trajectories"}'] == 4
    assert found['waywright_solve_seconds_count{method="linear",status="solved"}'] == 3
    assert found["waywright_queue_seconds_count"] == 3
    assert found["waywright_in_flight"] == 1  # this one
    assert found["waywright_ready"] == found["waywright_solvers"] == found["waywright_queue_depth"] == 0
    assert found["process_resident_memory_bytes"] > 1e7


def test_two_services_count_for_themselves():
    one, other = app_with(), app_with()
    one.get("/healthz")
    assert 'waywright_requests_total{route="/healthz",status="200",verb="GET"}' in scraped(one)
    assert 'waywright_requests_total{route="/healthz",status="200",verb="GET"}' not in scraped(other)


def test_cardinality_is_bounded():
    client, rng = app_with(queue=0), random.Random(7)  # what would wait for a solver is refused
    scraped(client)

    async def ask(verb: str, path: str, query: str = "", body: Any = None) -> None:
        raw = json.dumps(body).encode()

        messages = [{"type": "http.request", "body": raw, "more_body": False}]

        async def receive() -> Any:
            if not messages:
                await asyncio.Event().wait()  # it stays
            return messages.pop()

        async def send(message: Any) -> None:
            pass

        scope = {
            "type": "http",
            "method": verb,
            "path": path,
            "raw_path": path.encode(),
            "query_string": query.encode(),
        }
        headers = [(b"content-type", b"application/json")]
        await client.app(scope | {"headers": headers, "root_path": "", "http_version": "1.1"}, receive, send)

    async def many(count: int) -> None:
        for _ in range(count):
            word = "".join(rng.choices(string.ascii_letters + string.digits, k=8))
            verb = rng.choice(["GET", "POST", word.upper()])
            place = rng.choice(
                [f"/{word}", f"/v1/methods/{word}", f"/errors/{word}", f"{PLAN}/{word}", "/v1/limits", PLAN]
            )
            await ask(verb, place, rng.choice(["", f"{word}={word}"]), {**QUICK, "method": word})

    asyncio.run(many(300))
    before = set(scraped(client))
    asyncio.run(many(1000))
    found = scraped(client)
    assert set(found) == before and len(before) < 400
    verbs = {re.search('verb="([^"]*)"', name).group(1) for name in before if name.startswith("waywright_requests")}
    assert verbs == {"GET", "POST", "other"} <= {*VERBS, "other"}
    assert sum(v for k, v in found.items() if k.startswith("waywright_requests_total")) == 1302


def test_the_method_of_a_failure_is_an_id_or_nothing():
    failed = Solved(Failed({"type": "/errors/timeout"}), 0.0)
    for asked, label in (("minimum_jerk", "minimum_jerk"), (None, "auto"), ("evil", "")):
        body = PlanBody(waypoints=[[0.0], [1.0]], method=asked)
        assert method_of({"solved": failed, "asked": ("plan", body)}) == label
    assert method_of({"solved": failed, "asked": ("plan", None)}) == method_of({"solved": failed}) == ""
    assert method_of({"solved": failed, "asked": ("retime", None)}) == "retiming"


def test_what_is_shed_is_counted_by_reason(lines):
    client = app_with(turns=0, queue=0)
    assert client.post(PLAN, json=QUICK).status_code == client.post(PLAN, json=SLOW).status_code == 503
    patient = app_with(queue=1)
    assert patient.post(PLAN, json=SLOW | {"timeout": 0.05}).status_code == 503
    assert client.get("/readyz").status_code == 503  # no request was turned away by that
    found, other = scraped(client), scraped(patient)
    assert found['waywright_shed_total{reason="loop_busy"}'] == found['waywright_shed_total{reason="queue_full"}'] == 1
    assert sum(v for k, v in found.items() if k.startswith("waywright_shed_total")) == 2
    assert other['waywright_shed_total{reason="expired"}'] == 1
    assert [line["problem"] for line in lines() if line["status"] == 503] == ["overloaded"] * 3


def test_rate_limits_are_shed_too():
    client = app_with(rate="2/minute")
    assert [client.get("/v1/limits").status_code for _ in range(3)] == [200, 200, 429]
    metrics = client.app.state.service.metrics
    assert metrics.registry.get_sample_value("waywright_shed_total", {"reason": "rate_limited"}) == 1


def test_restarts_are_counted():
    class Dead:
        def discard(self) -> None:
            pass

    client = app_with()
    engine = client.app.state.service.engine

    async def replace() -> None:
        engine._spawn = lambda: None
        for reason in ("crashed", "crashed", "timeout"):
            engine._replace(Dead(), reason)

    asyncio.run(replace())
    found = scraped(client)
    assert found['waywright_worker_restarts_total{reason="crashed"}'] == 2
    assert found['waywright_worker_restarts_total{reason="timeout"}'] == 1
    assert found['waywright_worker_restarts_total{reason="lost"}'] == 0


async def counted(registry: CollectorRegistry, times: int) -> None:
    """Wait until the probe has looked so many times."""
    async with asyncio.timeout(20):
        while registry.get_sample_value("waywright_event_loop_lag_seconds_count") < times:
            await asyncio.sleep(EVERY)


def test_the_lag_probe_notices_a_block():
    registry = CollectorRegistry()
    lag = Lag(registry)

    async def blocked() -> None:
        probe = asyncio.create_task(lag.run())
        await asyncio.sleep(3 * EVERY)
        time.sleep(0.1)
        await counted(registry, 3)
        probe.cancel()

    asyncio.run(blocked())
    assert 0.1 - EVERY - 0.002 <= lag.largest() < 2.0
    quick = registry.get_sample_value("waywright_event_loop_lag_seconds_bucket", {"le": "0.05"})
    assert quick < registry.get_sample_value("waywright_event_loop_lag_seconds_count")


def test_the_largest_lag_is_forgotten_after_a_minute(monkeypatch):
    now = [1000.0]
    monkeypatch.setattr("api.observe.lag.time.monotonic", lambda: now[0])
    lag = Lag(CollectorRegistry())
    lag.saw(0.3)
    for _ in range(4):
        now[0] += STEP
        lag.saw(0.001)
    assert lag.largest() == lag.largest() == 0.3
    now[0] += WINDOW - 3 * STEP
    assert lag.largest() == 0.001
    now[0] += WINDOW
    assert lag.largest() == 0.0


def test_the_probe_runs_with_the_service(monkeypatch):
    client = app_with()
    state = client.app.state.service
    monkeypatch.setattr(state.engine, "start", lambda: None)

    async def lived() -> None:
        async with state.running():
            await counted(state.metrics.registry, 2)

    asyncio.run(lived())


# -- the dashboard and the page ----------------------------------------------------------------------------------------


def exported() -> set[str]:
    """Return the names of the families and samples of a service that has had some requests."""
    client = app_with(turns=0)
    client.post(PLAN, json=QUICK)
    names = set()
    for family in text_string_to_metric_families(client.get("/metrics").text):
        names |= {family.name, *(sample.name for sample in family.samples)}
        names |= {f"{family.name}{end}" for end in ("_bucket", "_count", "_sum") if family.type == "histogram"}
    return names


def test_the_dashboard_names_what_there_is():
    board = json.loads((DOCS / "grafana.json").read_text())
    names, used = exported(), set()
    sources = {v["name"] for v in board["templating"]["list"] if v["type"] == "datasource"}
    assert sources == {"datasource"} and board["schemaVersion"] >= 39 and board["uid"]
    assert len({panel["id"] for panel in board["panels"]}) == len(board["panels"])
    for panel in board["panels"]:
        assert panel["datasource"]["uid"] == "${datasource}" and panel["title"] and panel["targets"]
        for target in panel["targets"]:
            used |= set(re.findall(r"\b((?:waywright|process|python)_\w+)", target["expr"]))
            assert target["expr"].count("(") == target["expr"].count(")") and "job=~" in target["expr"]
    assert used <= names, used - names
    families = {re.sub("_(bucket|count|sum)$", "", name) for name in used if name.startswith("waywright_")}
    assert families == {name for name, _ in described()}, "each metric has a panel"


def described() -> list[tuple[str, set[str]]]:
    """Return the metrics and labels in the page's table."""
    section = re.split("^## ", (DOCS / "service.md").read_text(encoding="utf-8"), flags=re.M)
    (text,) = [part for part in section if part.startswith("Metrics and logs")]
    rows = re.findall(r"^\| `(waywright_\w+)(?:\{([\w,]+)\})?` \|", text, re.M)
    return [(name, set(filter(None, labels.split(",")))) for name, labels in rows]


def test_the_page_describes_every_metric():
    client = app_with(turns=0)
    client.post(PLAN, json=QUICK)
    service = client.app.state.service
    service.metrics.solved("linear", "solved", 0.1, 0.1)
    found: dict[str, set[str]] = {}
    for family in text_string_to_metric_families(client.get("/metrics").text):
        if family.name.startswith("waywright_"):
            name = family.name + ("_total" if family.type == "counter" else "")
            found[name] = {label for sample in family.samples for label in sample.labels} - {"le"}
            assert family.documentation
    assert dict(described()) == found


# -- the log -----------------------------------------------------------------------------------------------------------


def test_a_line_per_request(lines):
    client = app_with()
    answer = client.post(PLAN, json=QUICK, headers={"x-request-id": "job 7", "traceparent": PARENT})
    client.get("/nowhere/at/all")
    solved, lost = lines()
    assert list(solved)[:3] == ["timestamp", "level", "event"] and solved["event"] == "request"
    expected = {"level": "info", "request_id": "job 7", "trace_id": TRACE, "route": PLAN, "verb": "POST", "status": 200}
    expected |= {"method": "linear", "n": 3, "dof": 2, "bytes": len(answer.content)}
    assert {k: solved[k] for k in expected} == expected
    assert 0 <= solved["queue_ms"] and 0 < solved["solve_ms"] < solved["total_ms"]
    assert (lost["route"], lost["status"], lost["problem"]) == ("none", 404, "not_found")
    assert not {"trace_id", "method", "key", "gone", "solve_ms"} & set(lost)


def test_nothing_that_a_client_wrote_is_logged_or_counted(lines, tmp_path):
    from api.keys import new_key

    key, row = new_key("cell-4")
    file = tmp_path / "keys"
    file.write_text(f"{row}\n")
    client = app_with(api_keys=str(file), queue=0)
    secret, sent = "hunter2", {"x-api-key": key, "authorization": "Bearer hunter2", "cookie": "a=hunter2"}
    names = {"joint_names": [f"{secret}a", f"{secret}b"]}
    assert client.post(PLAN, json=QUICK | names, headers=sent).status_code == 200
    client.post(PLAN, json=QUICK | {secret: 1}, headers=sent)
    client.post(PLAN, json=QUICK | {"method": secret}, headers=sent)
    client.post(PLAN, json=SLOW | {"options": {"backend": secret}}, headers=sent)
    client.post(PLAN, content=secret.encode(), headers=sent)
    client.post(f"{PLAN}?shape={secret}&{secret}={secret}", json=QUICK, headers=sent)
    client.request(secret.upper(), f"/{secret}", headers=sent)
    client.get("/v1/limits", headers={"x-api-key": secret})
    client.get("/v1/limits", headers=sent | {"user-agent": secret, "referer": secret, "traceparent": secret})
    said = lines()
    text = json.dumps(said) + client.get("/metrics", headers=sent).text
    assert secret not in text.lower() and key not in text and row.split()[-1] not in text
    assert len(said) == 9
    assert [line.get("key") for line in said] == ["cell-4"] * 7 + [None, "cell-4"]
    assert said[7]["problem"] == "unauthorized"


def test_a_failure_leaves_its_trace_in_the_log(lines, monkeypatch):
    def broken(body: Any, job: Any) -> Any:
        raise RuntimeError("the bug")

    monkeypatch.setitem(jobs.KINDS, "plan", jobs.Kind(PlanBody, broken))
    client = app_with()
    answer = client.post(PLAN, json=QUICK, headers={"x-request-id": "seven"})
    assert answer.status_code == 500 and "the bug" not in answer.text
    trail, line = lines()
    assert trail["level"] == line["level"] == "error" and trail["request_id"] == line["request_id"] == "seven"
    assert "RuntimeError: the bug" in trail["trace"] and "broken" in trail["trace"]
    assert (line["problem"], line["method"], line["n"], line["dof"]) == ("internal", "linear", 3, 2)
    assert scraped(client)['waywright_solve_seconds_count{method="linear",status="internal"}'] == 1


def test_the_standard_librarys_loggers_go_the_same_way(lines):
    logging.getLogger("uvicorn.error").setLevel(logging.NOTSET)  # a server of another test may have raised it
    logging.getLogger("uvicorn.error").warning("odd %s", "thing")
    logging.getLogger("uvicorn.access").error("GET /?key=1")
    logging.getLogger("waywright.api").info("hello")
    try:
        raise ValueError("inner")
    except ValueError:
        logging.getLogger("waywright.api").exception("outer")
    odd, hello, outer = lines()
    assert (odd["level"], odd["event"], odd["logger"]) == ("warning", "odd thing", "uvicorn.error")
    assert (hello["level"], hello["event"]) == ("info", "hello")
    assert outer["event"] == "outer" and "ValueError: inner" in outer["exception"]


@pytest.mark.parametrize("mode", ["console", "off", "auto", "json"])
def test_the_ways_to_log(mode):
    stream = io.StringIO()
    before = (list(logging.root.handlers), logging.root.level, logging.getLogger("waywright").level)
    with logs.configured(Settings(log=mode), stream):
        app_with().get("/v1/limits")
        logging.getLogger("waywright.api").warning("careful")
    text = stream.getvalue()
    assert (list(logging.root.handlers), logging.root.level, logging.getLogger("waywright").level) == before
    if mode == "off":
        assert text == ""
    elif mode == "console":
        assert "route=/v1/limits" in text and "careful" in text and len(text.splitlines()) == 2 and "\x1b" not in text
    else:
        assert [json.loads(line)["event"] for line in text.splitlines()] == ["request", "careful"]


def test_as_a_library_nothing_is_set_up(capfd):
    handlers = list(logging.root.handlers)
    app_with().post(PLAN, json=QUICK)
    assert list(logging.root.handlers) == handlers and not logs.is_on()
    assert capfd.readouterr() == ("", "")


def test_a_log_that_nobody_reads_fails_no_request():
    stream = io.StringIO()
    with logs.configured(Settings(log="json"), stream):
        stream.close()
        assert app_with().get("/v1/limits").status_code == 200


def test_a_client_that_goes_away(lines):
    client = app_with(queue=1)
    body = json.dumps(SLOW).encode()
    messages = [{"type": "http.request", "body": body, "more_body": False}, {"type": "http.disconnect"}]
    sent: list[Any] = []

    async def receive() -> Any:
        await asyncio.sleep(0.02)
        return messages.pop(0)

    async def send(message: Any) -> None:
        sent.append(message)

    headers = [(b"content-type", b"application/json")]
    scope = {"type": "http", "method": "POST", "path": PLAN, "raw_path": PLAN.encode(), "query_string": b""}
    asyncio.run(client.app(scope | {"headers": headers, "root_path": "", "http_version": "1.1"}, receive, send))
    (line,) = lines()
    assert sent == [] and (line["status"], line["gone"], line["bytes"]) == (499, True, 0)
    assert scraped(client)['waywright_requests_total{route="/v1/trajectories",status="499",verb="POST"}'] == 1


def test_the_middleware_is_cheap():
    metrics = app_with().app.state.service.metrics

    async def app(scope: Any, receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    async def nothing(*_: Any) -> Any:
        pass

    async def spent(asked: Any) -> float:
        began = time.process_time()
        for _ in range(2000):
            await asked({"type": "http", "method": "GET", "path": "/", "headers": []}, nothing, nothing)
        return (time.process_time() - began) / 2000

    extra = min(asyncio.run(spent(Observe(app, metrics))) for _ in range(3)) - asyncio.run(spent(app))
    assert extra < 100e-6  # some 8 us on a machine that does nothing else


def test_server_timing_adds_up(lines):
    answer = app_with().post(PLAN, json=QUICK)
    entries = dict(entry.split(";dur=") for entry in answer.headers["server-timing"].split(", "))
    assert sum(map(float, entries.values())) <= lines()[0]["total_ms"]


# -- traces ------------------------------------------------------------------------------------------------------------

SPAN = "b7ad6b7169203331"


@pytest.mark.parametrize(
    "value, flags",
    [
        (PARENT, 1),
        (f"00-{TRACE}-{SPAN}-00", 0),
        (f"00-{TRACE}-{SPAN}-ff", 3),  # flags that nobody knows are dropped
        (f" {PARENT}\t", 1),
        (f"01-{TRACE}-{SPAN}-01", 1),  # of a later version, what is known
        (f"cc-{TRACE}-{SPAN}-01-what-the-future-holds", 1),
        (f"cc-{TRACE}-{SPAN}-01-", 1),
        (f"00-{TRACE}-{SPAN}-01-", None),
        (f"00-{TRACE}-{SPAN}-01-more", None),
        (f"cc-{TRACE}-{SPAN}-01.more", None),
        (f"ff-{TRACE}-{SPAN}-01", None),
        (f"00-{'0' * 32}-{SPAN}-01", None),
        (f"00-{TRACE}-{'0' * 16}-01", None),
        (PARENT.upper(), None),
        (PARENT.replace("-", "_"), None),
        (f"0-{TRACE}-{SPAN}-01", None),
        (f"00-{TRACE[1:]}-{SPAN}-01", None),
        (f"00-{TRACE}-{SPAN}-1", None),
        (f"00-{TRACE}-{SPAN}-0x", None),
        (f"00-{TRACE}-{SPAN}", None),
        (f"{PARENT}\n", None),
        ("", None),
    ],
)
def test_traceparent_is_read_strictly(value, flags):
    found = traces.parse(value.encode())
    assert (found and found.flags) == flags
    assert found is None or (found.trace_id, found.parent_id) == (TRACE, SPAN)


def test_several_traceparents_are_none():
    header = (b"traceparent", PARENT.encode())
    assert traces.incoming([header]) is not None
    assert traces.incoming([header, header]) is None and traces.incoming([]) is None


def test_a_trace_is_answered():
    client = app_with()
    answers = [client.get(path, headers={"traceparent": PARENT}) for path in ("/healthz", "/nowhere")]
    spans = set()
    for answer in answers:
        version, trace, span, flags = answer.headers["traceresponse"].split("-")
        assert (version, trace, flags) == ("00", TRACE, "01") and re.fullmatch("[0-9a-f]{16}", span)
        spans.add(span)
    assert len(spans) == 2 and SPAN not in spans
    assert "traceresponse" not in client.get("/healthz").headers
    assert "traceresponse" not in client.get("/healthz", headers={"traceparent": f"ff{PARENT[2:]}"}).headers


def test_spans(monkeypatch, lines):
    memory = pytest.importorskip("opentelemetry.sdk.trace.export.in_memory_span_exporter").InMemorySpanExporter()
    monkeypatch.setenv("OTEL_EXPORTER_OTLP_ENDPOINT", "http://127.0.0.1:9")
    monkeypatch.setattr(telemetry, "make_exporter", lambda environment: memory)
    client = app_with()
    answer = client.post(PLAN, json=QUICK, headers={"traceparent": PARENT, "x-request-id": "seven"})
    client.get("/v1/limits?secret=hunter2")
    provider = client.app._telemetry["tracer_provider"]
    provider.force_flush()
    plan, limits = memory.get_finished_spans()
    provider.shutdown()
    assert plan.name == f"POST {PLAN}" and f"{plan.parent.span_id:016x}" == SPAN
    assert answer.headers["traceresponse"] == f"00-{TRACE}-{plan.context.span_id:016x}-01"
    said = dict(plan.attributes)
    expected = {"waywright.method": "linear", "waywright.n": 3, "waywright.dof": 2, "waywright.request_id": "seven"}
    assert {k: said[k] for k in expected} == expected
    assert said["waywright.queue_seconds"] >= 0 and said["waywright.solve_seconds"] > 0
    assert limits.attributes["waywright.problem"] == "invalid_request"
    assert "hunter2" not in str(dict(limits.attributes))
    assert provider.resource.attributes["service.name"] == "waywright"
    assert [line["trace_id"] for line in lines()] == [TRACE, f"{limits.context.trace_id:032x}"]


@pytest.mark.parametrize(
    "environment, on",
    [
        ({}, False),
        ({"OTEL_EXPORTER_OTLP_ENDPOINT": "http://x"}, True),
        ({"OTEL_EXPORTER_OTLP_TRACES_ENDPOINT": "http://x"}, True),
        ({"OTEL_TRACES_EXPORTER": "otlp"}, True),
        ({"OTEL_TRACES_EXPORTER": "none", "OTEL_EXPORTER_OTLP_ENDPOINT": "http://x"}, False),
        ({"OTEL_SDK_DISABLED": "true", "OTEL_EXPORTER_OTLP_ENDPOINT": "http://x"}, False),
    ],
)
def test_spans_are_made_where_asked(environment, on, monkeypatch, caplog):
    pytest.importorskip("opentelemetry.sdk")
    assert telemetry.asked(environment) is on
    found = telemetry.importlib.util.find_spec
    monkeypatch.setattr(telemetry.importlib.util, "find_spec", lambda n: None if n.endswith("sdk") else found(n))
    assert not telemetry.config(environment)["tracing"]
    assert ("not installed" in caplog.text) is on


def test_other_exporters_are_told_off(caplog):
    assert telemetry.make_exporter({"OTEL_TRACES_EXPORTER": "zipkin"}) is None and "zipkin" not in caplog.text
    assert "OTEL_TRACES_EXPORTER" in caplog.text
