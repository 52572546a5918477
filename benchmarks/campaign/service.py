"""A real service to attack: started as a user would start it, its processes found, measured, killed and stopped."""

import http.client
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Self

import psutil

ROOT = Path(__file__).absolute().parents[2]

#: Seconds a service may take to be ready: the kernels may have to be compiled first.
PATIENCE = 300.0

#: Bytes of the log that are kept.
LOG_BYTES = 100_000_000


class Service:
    """``python -m api serve`` on a free port of this machine.

    Parameters
    ----------
    folder : Path
        Where its log goes.
    settings
        ``workers=2`` becomes ``WAYWRIGHT_WORKERS=2``.
    """

    def __init__(self, folder: Path, **settings: object) -> None:
        self.folder = folder
        self.settings = {"workers": 2, "queue": 2, **settings}
        self.port = 0
        self._process: subprocess.Popen[bytes] | None = None
        self.log = folder / "service.log"
        self._read = self._bad = 0

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *error: object) -> None:
        self.stop()

    @property
    def pid(self) -> int:
        """The process id of the service itself."""
        assert self._process is not None
        return self._process.pid

    @property
    def url(self) -> str:
        """Where it is."""
        return f"http://127.0.0.1:{self.port}"

    def start(self) -> None:
        """Start it and wait until it is ready.

        Raises
        ------
        RuntimeError
            It ended, or was not ready in time; the message has the end of its log.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        self._end_leftover()
        environment = dict(os.environ)
        environment |= {f"WAYWRIGHT_{name.upper()}": str(value) for name, value in self.settings.items()}
        for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
            environment.setdefault(name, "1")
        command = [sys.executable, "-m", "api", "serve", "--port", "0"]
        with self.log.open("ab") as log:
            begin = log.tell()
            self._read = min(self._read, begin) or begin  # what an earlier run left is not ours
            # its own session: an interrupt from the keyboard is the campaign's to handle, which then stops it
            self._process = subprocess.Popen(
                command, cwd=ROOT, env=environment, stdout=log, stderr=log, start_new_session=True
            )
        own = psutil.Process(self._process.pid)
        (self.folder / "service.pid").write_text(f"{own.pid} {own.create_time()}", encoding="ascii")
        until = time.monotonic() + PATIENCE
        self.port = 0
        while time.monotonic() < until and self._process.poll() is None:
            said = self.log.read_bytes()[begin:]
            found = re.search(rb"http://127\.0\.0\.1:(\d+)", said)
            if found:
                self.port = int(found[1])
                if self.get("/readyz") == 200:
                    return
            time.sleep(0.1)
        said = self.log.read_bytes()[begin:]
        self.stop()
        raise RuntimeError(f"the service was not ready: {said[-2000:].decode(errors='replace')}")

    def _end_leftover(self) -> None:
        """End the service of a run that was killed, which could not do it itself."""
        left = self.folder / "service.pid"
        if not left.exists():
            return
        pid, created = left.read_text(encoding="ascii").split()
        with suppress(psutil.Error):
            process = psutil.Process(int(pid))
            if abs(process.create_time() - float(created)) < 1.0:
                for each in [*process.children(recursive=True), process]:
                    with suppress(psutil.Error):
                        each.kill()
        left.unlink()

    def get(self, path: str, timeout: float = 10.0) -> int | None:
        """Return the status of a GET; None where nobody answers."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=timeout)
        try:
            connection.request("GET", path)
            return connection.getresponse().status
        except (OSError, http.client.HTTPException):
            return None
        finally:
            connection.close()

    def stop(self) -> None:
        """End it, and whatever it left behind."""
        if self._process is None:
            return
        family = self._family()
        if self._process.poll() is None:
            self._process.terminate()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(15)
        for process in family:
            with suppress(psutil.Error):
                process.kill()
        self._process.wait()
        self._process = None
        (self.folder / "service.pid").unlink(missing_ok=True)

    def restart(self) -> None:
        """Stop it and start another one, on another port."""
        self.stop()
        self.start()

    def terminate(self) -> None:
        """Ask it to end."""
        assert self._process is not None
        self._process.send_signal(signal.SIGTERM)

    def wait(self, timeout: float) -> int | None:
        """Return the exit code; None if it did not end in time."""
        assert self._process is not None
        try:
            return self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            return None

    @property
    def alive(self) -> bool:
        """Whether its process runs."""
        return self._process is not None and self._process.poll() is None

    def _family(self) -> list[psutil.Process]:
        try:
            own = psutil.Process(self.pid)
            return [own, *own.children(recursive=True)]
        except psutil.Error:
            return []

    def solvers(self) -> list[psutil.Process]:
        """Return the solvers that run: the children of the fork server, or where there is none, of the service."""
        found = []
        with suppress(psutil.Error):
            for child in psutil.Process(self.pid).children():
                with suppress(psutil.Error):
                    if any("forkserver" in word for word in child.cmdline()):
                        found += [p for p in child.children() if p.status() != psutil.STATUS_ZOMBIE]
        return found

    def busy_solver(self, patience: float = 2.0, besides: tuple[int, ...] = ()) -> psutil.Process | None:
        """Return a solver that is computing right now; None if none is seen."""
        until = time.monotonic() + patience
        before = {p.pid: spent(p) for p in self.solvers()}
        while time.monotonic() < until:
            time.sleep(0.01)
            for process in self.solvers():
                if process.pid in besides:
                    continue
                now = spent(process)
                if now - before.setdefault(process.pid, now) >= 0.02:
                    return process
        return None

    def settle(self, patience: float = 10.0) -> None:
        """Wait until all solvers are there and none computes: one that has just begun warms up."""
        until = time.monotonic() + patience
        before: dict[int, float] = {}
        while time.monotonic() < until:
            now = {p.pid: spent(p) for p in self.solvers()}
            if len(now) >= int(str(self.settings["workers"])) and now == before:
                return
            before = now
            time.sleep(0.1)

    def memory(self) -> tuple[float, float]:
        """Return the resident memory of the service's own process, and what its solvers have for themselves, MB.

        Solvers are forked: what they share with one another would count again with each new one.
        """
        own = resident(psutil.Process(self.pid))
        return own, sum(private(p) for p in self.solvers())

    def tracebacks(self) -> int:
        """Return how many tracebacks the log had so far: failures that the service had not foreseen.

        They are kept in a file of their own; a log that has grown large is emptied, for a line a request adds up.
        """
        if self.log.exists():
            with self.log.open("rb") as log:
                log.seek(self._read)
                lines = log.readlines()
                self._read = log.tell()
            bad = [line for line in lines if b"Traceback (most recent call last)" in line]
            self._bad += len(bad)
            if bad:
                with (self.folder / "tracebacks.log").open("ab") as kept:
                    kept.writelines(bad)
            if self._read > LOG_BYTES:
                os.truncate(self.log, 0)  # the service appends
                self._read = 0
        return self._bad


def runs(process: psutil.Process) -> bool:
    """Tell whether a process is there, and more than a name in the table."""
    try:
        return bool(process.is_running() and process.status() != psutil.STATUS_ZOMBIE)
    except psutil.Error:
        return False


def spent(process: psutil.Process) -> float:
    """Return the computing time of a process, s; 0 if it is gone."""
    try:
        times = process.cpu_times()
        return float(times.user + times.system)
    except psutil.Error:
        return 0.0


def resident(process: psutil.Process) -> float:
    """Return the resident memory of a process, MB; 0 if it is gone."""
    try:
        return float(process.memory_info().rss) / 1e6
    except psutil.Error:
        return 0.0


def private(process: psutil.Process) -> float:
    """Return the memory that a process shares with no other, MB; 0 if it has gone."""
    try:
        return float(process.memory_full_info().uss) / 1e6
    except psutil.Error:
        return 0.0
