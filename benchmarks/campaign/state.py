"""How far a campaign ran: kept in a file that is replaced as a whole, so that a killed run goes on where it was."""

import hashlib
import json
import os
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Self

#: Failures that are told in full; further ones are counted only.
SHOWN = 50


@dataclass
class Figure:
    """Something measured; ``met`` tells whether the goal was, None where there is none; ``most`` is its number."""

    value: float | int | str | None
    unit: str = ""
    goal: str = ""
    met: bool | None = None
    most: float | None = None


@dataclass
class State:
    """The progress of one campaign of one size and seed.

    ``data`` is the campaign's own, for what it has to remember from chunk to chunk; all of it must have a JSON form.
    """

    name: str
    size: int
    seed: int
    folder: Path
    done: int = 0
    seconds: float = 0.0
    failed: int = 0
    figures: dict[str, Figure] = field(default_factory=dict)
    failures: list[dict[str, Any]] = field(default_factory=list)
    data: dict[str, Any] = field(default_factory=dict)
    load: list[float] = field(default_factory=list)
    _since: float = field(default_factory=time.monotonic)

    @classmethod
    def open(cls, name: str, size: int, seed: int, folder: Path, fresh: bool = False) -> Self:
        """Return the state that a run of the same size and seed left, else a new one."""
        state = cls(name, size, seed, folder)
        if not fresh and state.path.exists():
            kept = json.loads(state.path.read_text(encoding="utf-8"))
            if (kept["size"], kept["seed"]) == (size, seed):
                for key in ("done", "seconds", "failed", "failures", "data", "load"):
                    setattr(state, key, kept[key])
                state.figures = {key: Figure(**value) for key, value in kept["figures"].items()}
        return state

    @property
    def path(self) -> Path:
        """The file."""
        return self.folder / f"{self.name}.json"

    @property
    def complete(self) -> bool:
        """Whether it ran as far as was asked."""
        return self.done >= self.size

    def save(self) -> None:
        """Write the file: the old or the new one is there at any time, whole."""
        now = time.monotonic()
        self.seconds, self._since = self.seconds + now - self._since, now
        self.load = [min([*self.load[:1], os.getloadavg()[0]]), max([*self.load[1:], os.getloadavg()[0]])]
        tree = {key: value for key, value in asdict(self).items() if key not in ("folder", "_since")}
        self.folder.mkdir(parents=True, exist_ok=True)
        beside = self.path.with_suffix(".json.new")
        beside.write_text(json.dumps(tree, indent=1, default=str), encoding="utf-8")
        os.replace(beside, self.path)

    def figure(
        self, name: str, value: Any, unit: str = "", most: float | None = None, goal: str = "", met: bool | None = None
    ) -> None:
        """Note a figure; it is good below ``most``, or where ``met`` says so."""
        if most is not None:
            goal, met = f"< {most:g}", value is not None and value < most
        self.figures[name] = Figure(value, unit, goal, met, most)

    def fail(self, what: str, raw: bytes | None = None, **more: Any) -> None:
        """Note a failure, and keep the bytes that caused it."""
        self.failed += 1
        if len(self.failures) >= SHOWN:
            return
        told: dict[str, Any] = {"what": what[:500], **more}
        if raw is not None:
            kept = self.folder / "failures" / f"{self.name}-{hashlib.sha256(raw).hexdigest()[:12]}.http"
            kept.parent.mkdir(parents=True, exist_ok=True)
            kept.write_bytes(raw)
            told["replay"] = str(kept)
        self.failures.append(told)

    @property
    def good(self) -> bool:
        """Whether it is complete, nothing failed, and every goal was met."""
        return self.complete and not self.failed and all(f.met is not False for f in self.figures.values())
