"""Bodies made to hurt: each is refused at once, in few words, and leaves no memory behind."""

import asyncio
import gzip
import json
import time
from statistics import median

from .bodies import QUICK
from .service import Service
from .state import State
from .verdict import Verdict
from .wire import Ask, Connection, Reply, ask, http

TITLE = "Hostile bodies"
UNIT = "rounds of the table"
SIZES = {"ci": 5, "campaign": 200}

PLAN = "/v1/trajectories"
MIB = 2**20

#: Goals: seconds to the answer, MB that the service and its solvers may grow, bytes of an answer.
SECONDS, GROWTH, BYTES = 0.1, 50.0, 8_000


def _with(text: str) -> bytes:
    """Return a right body with one coordinate replaced by a text."""
    return json.dumps(QUICK).replace("0.7", text, 1).encode()


def _plan(**changes: object) -> bytes:
    return json.dumps({**QUICK, **changes}).encode()


def _msgpack(body: bytes) -> bytes:
    return http("POST", PLAN, body, {"Content-Type": "application/msgpack"})


def _length(value: str, body: bytes = b"{}") -> bytes:
    return http("POST", PLAN, body, {"Content-Length": value})


def table() -> dict[str, tuple[Ask, tuple[int, ...]]]:
    """Return the requests by name, and the statuses that are right; 0 stands for a connection that is closed."""
    bad = {
        "NaN": _with("NaN"),
        "Infinity": _with("Infinity"),
        "-Infinity": _with("-Infinity"),
        "1e999": _with("1e999"),
        "1e308": _with("1e308"),
        "integer of 5,000 digits": _with("1" + "0" * 5000),
        "lone surrogate": _with('"\\ud800"'),
        "key a lone surrogate": b'{"\\ud800": 1}',
        "not UTF-8": _with('"\xff\xfe"').decode().encode("latin-1"),
        "100,000 brackets": b"[" * 100_000,
        "100,000 brackets, closed": b"[" * 100_000 + b"]" * 100_000,
        "100,000 objects": b'{"options":' * 100_000,
        "a key twice": b'{"waypoints": [[0], [1]], "waypoints": [[0], [2]]}',
        "130,000 keys": json.dumps({f"key{i}": i for i in range(130_000)}).encode(),
        "130,000 keys in options": _plan(options={f"key{i}": i for i in range(130_000)}),
        "64,000 bad numbers": _plan(waypoints=[["x"] * 64] * 1000),
        "a million waypoints": b'{"waypoints":[' + b"[0]," * 999_999 + b"[1]]}",
        "a text of 4 MiB": _plan(method="x" * (4 * MIB)),
        "an id of 4 MiB as a key": _plan(**{"x" * (4 * MIB): 1}),
        "dt = 1e-12": _plan(sampling={"dt": 1e-12}),
        "10^9 samples": _plan(sampling={"count": 10**9}),
        "rate x duration over the cap": _plan(times=[0, 1e4, 2e4, 3e4], sampling={"dt": 1e-3}),
        "dt = 1e-12, timing chosen": json.dumps(
            {
                "waypoints": [[0], [1]],
                "limits": {"velocity": 1, "acceleration": 1},
                "method": "trapezoidal",
                "sampling": {"dt": 1e-12},
            }
        ).encode(),
    }
    rows = {name: (Ask(http("POST", PLAN, body), path=PLAN), (400, 404, 413, 422)) for name, body in bad.items()}
    for name, text in (("-0.0", "-0.0"), ("1e-320", "1e-320")):
        rows[name] = (Ask(http("POST", PLAN, _with(text)), path=PLAN), (200, 422))
    large = b" " * (8 * MIB + 1)
    framed = {
        "8 MiB + 1 by Content-Length": (http("POST", PLAN, large), (413,)),
        "8 MiB + 1 in chunks": (http("POST", PLAN, large, chunked=65_536), (413,)),
        "gzip": (http("POST", PLAN, gzip.compress(_plan()), {"Content-Encoding": "gzip"}), (415,)),
        "gzip bomb": (http("POST", PLAN, gzip.compress(b" " * (64 * MIB)), {"Content-Encoding": "gzip"}), (415,)),
        "msgpack: list of 2^32 - 1": (_msgpack(b"\xdd\xff\xff\xff\xff"), (415, 422)),
        "msgpack: map of 2^32 - 1": (_msgpack(b"\xdf\xff\xff\xff\xff"), (415, 422)),
        "msgpack: text of 2^32 - 1": (_msgpack(b"\xdb\xff\xff\xff\xff"), (415, 422)),
        "msgpack: 100,000 lists": (_msgpack(b"\x91" * 100_000), (415, 422)),
        "msgpack: 7 million nils": (_msgpack(b"\xdd\x00\x6a\xcf\xc0" + b"\xc0" * 7_000_000), (415, 422)),
        "msgpack: extension": (_msgpack(b"\xc7\x05\x01hello"), (415, 422)),
        "msgpack: NaN": (_msgpack(b"\x81\xa5times\x91\xcb\x7f\xf8" + b"\x00" * 6), (415, 422)),
        "Content-Length too small": (_length("1", _plan()), (400, 422)),
        "Content-Length of 8 TB": (_length(str(2**43)), (0, 400, 413)),
        "negative Content-Length": (_length("-1"), (0, 400)),
        "Content-Length no number": (_length("0x10"), (0, 400)),
        "two Content-Lengths": (
            http("POST", PLAN, b"{}").replace(b"\r\n\r\n", b"\r\nContent-Length: 5\r\n\r\n", 1),
            (0, 400),
        ),
        "Content-Length and chunked": (
            http("POST", PLAN, b"{}", {"Content-Length": "2"}, chunked=2),
            (0, 400),
        ),
        "bad chunk": (
            http("POST", PLAN, b"{}", chunked=2).replace(b"\r\n\r\n2\r\n", b"\r\n\r\nzz\r\n", 1),
            (0, 400, 408, 422),
        ),
        "head of 1 MiB": (http("GET", "/healthz", headers={"X-Filler": "x" * MIB}), (0, 400, 431, 200)),
        "path of 60,000": (http("GET", "/" + "x" * 60_000), (0, 400, 404, 414)),
        "20,000 headers": (
            http("GET", "/healthz", headers={f"X-{i}": "1" for i in range(20_000)}),
            (0, 200, 400, 431),
        ),
        "no HTTP": (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(200), (0, 400)),
    }
    broken = {name for name, (_, statuses) in framed.items() if 0 in statuses}
    broken |= {"Content-Length too small"}
    for name, (raw, statuses) in framed.items():
        verb = "GET" if raw.startswith(b"GET") else "POST"
        rows[name] = (Ask(raw, verb, PLAN if verb == "POST" else "/healthz", intact=name not in broken), statuses)
    return rows


def run(service: Service, size: int, seed: int, state: State) -> None:
    """Send the table, round after round."""
    asyncio.run(_run(service, size, state))
    worst = {name: median(seconds) for name, seconds in state.data["seconds"].items()}
    late = {name: s for name, s in worst.items() if s >= SECONDS}
    slowest = max(worst, key=lambda name: worst[name])
    state.figure("requests in the table", len(worst))
    state.figure("slowest answer, median", worst[slowest], "s", SECONDS)
    state.figure("it is that of", slowest)
    state.figure("over it", ", ".join(f"{name}: {1e3 * s:.0f} ms" for name, s in sorted(late.items())) or "none")
    state.figure("memory grew at most by", state.data["growth"], "MB", GROWTH)
    state.figure("and after the last round by", state.data["kept"], "MB")
    state.figure("most of it after", state.data.get("after", "nothing"))
    state.figure("of it the service's own process", state.data.get("own", 0), "MB")
    state.figure("longest refusal", state.data["longest"], "bytes", BYTES)
    state.save()


async def _run(service: Service, size: int, state: State) -> None:
    from .fuzz import document

    verdict, rows = Verdict(await document(service)), table()
    seconds: dict[str, list[float]] = state.data.setdefault("seconds", {})
    for key in ("growth", "kept", "longest"):
        state.data.setdefault(key, 0)
    await _healthy(service)
    before = service.memory()
    while state.done < size:
        for name, (asked, right) in rows.items():
            reply = await _answer(service, asked)
            faults = verdict.faults(asked, reply)
            status = 0 if reply.broken in ("closed", "reset") else reply.status
            if status not in right:
                faults.append(f"status {status} {reply.broken}, not one of {right}: {reply.body[:200]!r}")
            seconds.setdefault(name, []).append(round(reply.seconds, 5))
            if reply.status >= 400:
                state.data["longest"] = max(state.data["longest"], len(reply.body))
            for fault in faults:
                state.fail(f"{name}: {fault}", asked.raw if len(asked.raw) < MIB else None)
            grown = sum(service.memory()) - sum(before)
            if grown > state.data["growth"]:
                state.data["growth"], state.data["after"] = round(grown, 1), name
        await _healthy(service)
        now = service.memory()
        state.data["kept"], state.data["own"] = round(sum(now) - sum(before), 1), round(now[0] - before[0], 1)
        state.done += 1
        state.save()


async def _answer(service: Service, asked: Ask) -> Reply:
    """Return the answer; a request that announces more than it sends gets what comes within two seconds."""
    waits = not asked.intact
    reply = await ask(service.port, asked.raw, patience=15.0, end=waits)
    return reply


async def _healthy(service: Service, count: int = 20) -> None:
    connection, raw = Connection(service.port), http("POST", PLAN, _plan())
    for _ in range(count):
        reply = await connection.ask(raw)
        assert reply.status == 200, f"a right request got {reply.status} {reply.broken}"
    connection.close()
    time.sleep(0.1)
