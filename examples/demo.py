"""A pick and place of a UR5e, planned by every method over HTTP: three tables and a figure (run it with ``make demo``).

It starts the service on a free port, sends ``pick_and_place.json`` through the Python client, and stops the service
again, whatever happens. The exit code is 0 only if every answer is certified.
"""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from api import Client

HERE = Path(__file__).parent
BUILD = HERE.parent / "build"
PATIENCE = 180.0  # s; kernels that make demo has not compiled before are compiled first

QUANTITIES = ("velocity", "acceleration", "jerk")
UNITS = {"position": "rad", "velocity": "rad/s", "acceleration": "rad/s²", "jerk": "rad/s³"}

#: The columns of the figure: from which comparison, which method, and what it was asked to keep.
DRAWN = (
    (0, "minimum_jerk", "at given times"),
    (1, "toppra", "velocity and acceleration limits"),
    (2, "ruckig", "velocity, acceleration and jerk limits"),
)

Row = Mapping[str, Any]


def main() -> int:
    """Compare the methods three times, print the tables, draw the figure."""
    sys.stdout.reconfigure(encoding="utf-8", line_buffering=True)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that the service is stopped then, too
    task = json.loads((HERE / "pick_and_place.json").read_text(encoding="utf-8"))
    limits = task["limits"]
    asked = {k: task[k] for k in ("waypoints", "joint_names")}
    comparisons = [
        ("At given times, without limits: what would the motion ask of the robot?", {"times": task["times"]}),
        (
            "As fast as possible under velocity and acceleration limits",
            {"limits": {k: limits[k] for k in ("velocity", "acceleration")}},
        ),
        ("As fast as possible under velocity, acceleration and jerk limits", {"limits": limits}),
    ]
    print(f"A UR5e picks and places: {len(task['waypoints'])} waypoints, {len(task['joint_names'])} joints.")
    print("Each joint's limits: " + ", ".join(f"{q} {limits[q]:g} {UNITS[q]}" for q in QUANTITIES) + ".\n")
    tables: list[Sequence[Row]] = []
    with service() as url, Client(url, timeout=PATIENCE) as client:
        for number, (title, given) in enumerate(comparisons, 1):
            rows = client.compare(**asked, **given, methods="all", include=["samples"], sampling={"count": 1000})
            print(f"{number}. {title}\n\n{table(rows, limits)}\n")
            tables.append(rows)
    print("velocity, acceleration, jerk: the largest value of any joint, divided by its limit. squared jerk: its")
    print("integral over the motion, summed over the joints (rad²/s⁵). ms: computing, checks included.\n")
    figure = BUILD / "demo.png"
    draw([(row(tables[i], method), kept) for i, method, kept in DRAWN], task["joint_names"], limits, figure)
    print(
        f"The motions of {', '.join(method for _, method, _ in DRAWN)} are drawn in {figure.relative_to(HERE.parent)}"
    )
    wrong = [r["method"] for rows in tables for r in rows if r["ok"] and not r["certificate"]["holds"]]
    if wrong:
        print(f"Not certified: {', '.join(wrong)}", file=sys.stderr)
    return 1 if wrong else 0


@contextmanager
def service() -> Iterator[str]:
    """Run the service on a free port of this machine; its address is yielded once it is ready."""
    os.environ["no_proxy"] = os.environ["NO_PROXY"] = "127.0.0.1"  # a proxy of the user's could not reach it
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    BUILD.mkdir(exist_ok=True)
    log = BUILD / "demo-service.log"
    command = [sys.executable, "-m", "api", "serve", "--host", "127.0.0.1", "--port", str(port)]
    with log.open("w", encoding="utf-8") as output:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT)
        try:
            url = f"http://127.0.0.1:{port}"
            wait_until_ready(url, process, log)
            yield url
        finally:
            process.terminate()
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def wait_until_ready(url: str, process: "subprocess.Popen[bytes]", log: Path) -> None:
    """Return once /readyz says yes; exit with the service's own words if it ends or takes too long."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline and process.poll() is None:
        try:
            with urllib.request.urlopen(f"{url}/readyz", timeout=5):
                return
        except OSError:  # not listening yet, or 503: not ready yet
            time.sleep(0.1)
    tail = log.read_text(encoding="utf-8", errors="replace").splitlines()[-20:]
    sys.exit("\n".join(["The service did not become ready. Its last words:", *tail]))


def row(rows: Sequence[Row], method: str) -> Row:
    """Return the row of one method."""
    return next(r for r in rows if r["method"] == method)


def table(rows: Sequence[Row], limits: Mapping[str, float]) -> str:
    """Return a comparison as text: a line a method, with its figures or the reason why it refuses."""
    heads = ("method", "duration s", *QUANTITIES, "squared jerk", "ms", "certified")
    form = "{:<22}  {:>10}  {:>8}  {:>12}  {:>8}  {:>12}  {:>8}  {:>9}".format
    lines = [form(*heads), form(*("-" * n for n in (22, 10, 8, 12, 8, 12, 8, 9)))]
    for r in rows:
        if not r["ok"]:
            lines.append(f"{r['method']:<22}  refuses: {first_sentence(r['error']['detail'])}")
            continue
        peaks = (ratio(r["peaks"][q], limits[q]) for q in QUANTITIES)
        cost = r["cost"]["squared_jerk"]
        squared = "∞" if cost is None else f"{cost:,.0f}"
        verdict = "yes" if r["certificate"]["holds"] else "NO"
        lines.append(form(r["method"], f"{r['duration']:.3f}", *peaks, squared, f"{r['compute_ms']:.1f}", verdict))
    return "\n".join(lines)


def ratio(peaks: Sequence[float | None], limit: float) -> str:
    """Return the largest peak of any joint divided by the limit; null stands for a jump of the derivative below."""
    finite = [p for p in peaks if p is not None]
    return f"{max(finite) / limit:.3f}" if len(finite) == len(peaks) else "∞"


def first_sentence(text: str, longest: int = 100) -> str:
    """Return the text up to its first full stop or semicolon, on one line."""
    line = re.split(r"[.;](?: |$)", " ".join(text.split()))[0]
    return line if len(line) <= longest else line[: longest - 1].rsplit(" ", 1)[0] + " …"


def draw(columns: Sequence[tuple[Row, str]], joints: Sequence[str], limits: Mapping[str, float], file: Path) -> None:
    """Draw position, velocity, acceleration and jerk over time, a column a method; limits are dashed."""
    import matplotlib

    matplotlib.use("Agg")  # no display is needed
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(len(UNITS), len(columns), figsize=(13, 11), sharex="col", sharey="row", squeeze=False)
    for column, (found, kept) in enumerate(columns):
        duration = f"{found['duration']:.3f} s" if found["ok"] else "refuses"
        axes[0][column].set_title(f"{found['method']}, {duration}\n{kept}")
        axes[-1][column].set_xlabel("time (s)")
        for line, quantity in enumerate(UNITS):
            axis = axes[line][column]
            if found["ok"]:
                axis.plot(found["samples"].time, getattr(found["samples"], quantity), linewidth=1.2)
                if None in found["peaks"].get(quantity, ()):
                    words = "unbounded where the acceleration jumps" if quantity == "jerk" else "unbounded at jumps"
                    axis.text(
                        0.5, 0.91, words, transform=axis.transAxes, ha="center", va="center", backgroundcolor="white"
                    )
            if quantity in limits:
                for side in (-limits[quantity], limits[quantity]):
                    axis.axhline(side, color="black", linestyle="--", linewidth=0.8)
                axis.set_ylim(-1.6 * limits[quantity], 1.6 * limits[quantity])
            axis.grid(alpha=0.3)
            axis.margins(x=0)
    for line, quantity in enumerate(UNITS):
        axes[line][0].set_ylabel(f"{quantity} ({UNITS[quantity]})")
    names = [name.removesuffix("_joint").replace("_", " ") for name in joints]
    handles = [*axes[0][0].lines, axes[1][0].lines[-1]]
    figure.legend(handles, [*names, "limit"], loc="lower center", ncols=len(handles), frameon=False)
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    figure.savefig(file, dpi=110)


if __name__ == "__main__":
    sys.exit(main())
