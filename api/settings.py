"""The service's caps. The environment can lower them, never raise them."""

import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

#: Bytes of a body over its cap that are read and dropped, so that the client hears the answer.
DRAIN_BYTES = 64 * 2**20


@dataclass(frozen=True)
class Caps:
    """What one request may cost: bytes of the body, waypoints, joints, samples x joints, seconds."""

    body_bytes: int = 8 * 2**20
    waypoints: int = 10_000
    joints: int = 64
    samples: int = 2_000_000
    timeout: float = 60.0

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] | None = None) -> "Caps":
        """Read ``WAYWRIGHT_BODY_BYTES``, ``WAYWRIGHT_WAYPOINTS``, … where they are set.

        Raises
        ------
        ValueError
            A value is not a number or is above the built-in cap.
        """
        environment = os.environ if environment is None else environment
        chosen: dict[str, Any] = {}
        for f in fields(cls):
            name = f"WAYWRIGHT_{f.name.upper()}"
            text = environment.get(name)
            if text is None:
                continue
            most = f.default
            assert isinstance(most, (int, float))
            try:
                value = type(most)(text)
            except ValueError:
                raise ValueError(f"{name} must be a number, not {text!r}") from None
            if not 0 < value <= most:
                raise ValueError(f"{name} must be above 0 and at most {most:,}: caps can only be lowered")
            chosen[f.name] = value
        return cls(**chosen)

    def listed(self) -> dict[str, float]:
        """Return the caps as ``GET /v1/limits`` lists them."""
        return asdict(self)


#: For the command line, where the machine is the caller's own: no caps but that on samples, which a typing error in
#: ``dt`` would fill the memory with.
LOCAL = Caps(body_bytes=2**62, waypoints=2**62, joints=2**62, timeout=1e9)
