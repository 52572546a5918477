"""Rate limits per caller, and the headers that tell them (IETF draft ratelimit-headers)."""

import ipaddress
import math
import time
from dataclasses import dataclass

import limits
from limits.aio.storage import MemoryStorage
from limits.aio.strategies import SlidingWindowCounterRateLimiter

#: Seconds between looks for counters that have run out.
SWEEP = 1.0


class _Counters(MemoryStorage):
    """The library's store in memory, but it looks through its counters once a second, not at each request.

    There may be as many counters as a stranger has addresses. Nothing here waits, so no lock is needed.
    """

    def __init__(self) -> None:
        super().__init__()
        self._sweep_at = 0.0

    async def incr(self, key: str, expiry: float, amount: int = 1) -> int:
        """Count; the counter lives for ``expiry`` s from its first."""
        now = time.time()
        if now >= self._sweep_at:
            self._sweep_at = now + SWEEP
            for old in [name for name, until in self.expirations.items() if until <= now]:
                self.storage.pop(old, None)
                self.expirations.pop(old, None)
        if await self.get(key) == 0:
            self.expirations[key] = now + expiry
        self.storage[key] += amount
        return int(self.storage[key])


@dataclass(frozen=True)
class Standing:
    """Where a caller stands after a request: whether it was admitted, what is left, and s until there is more."""

    admitted: bool
    headers: dict[str, str]


class Rate:
    """So many requests in so much time for each caller, over a sliding window.

    Parameters
    ----------
    text : str
        Such as ``600/minute`` or ``20 per 10 seconds``.

    Raises
    ------
    ValueError
        It is not a rate.
    """

    def __init__(self, text: str) -> None:
        try:
            (self._item,) = limits.parse_many(text)  # of several, parse would take the first
        except ValueError:
            raise ValueError(f"WAYWRIGHT_RATE must be like 600/minute or 20/10 seconds, not {text!r}") from None
        if self._item.amount < 1 or self._item.get_expiry() < 1:
            raise ValueError(f"WAYWRIGHT_RATE must admit at least one request in at least a second, not {text!r}")
        self._counters = _Counters()
        self._limiter = SlidingWindowCounterRateLimiter(self._counters)
        self._policy = f'"default";q={self._item.amount};w={self._item.get_expiry()}'

    async def take(self, caller: str) -> Standing:
        """Count a request of a caller."""
        admitted = await self._limiter.hit(self._item, caller)
        stats = await self._limiter.get_window_stats(self._item, caller)
        wait = max(1, math.ceil(stats.reset_time - time.time()))
        left = stats.remaining if admitted else 0
        headers = {"RateLimit-Policy": self._policy, "RateLimit": f'"default";r={left};t={wait}'}
        return Standing(admitted, headers if admitted else {**headers, "Retry-After": str(wait)})


def caller_of(client: tuple[str, int] | None) -> str:
    """Return the name that a client without a key counts under: its address, of IPv6 the network it can choose from."""
    host = client[0] if client else "unknown"
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return f"address {host[:100]}"
    if address.version == 6:
        if address.ipv4_mapped is not None:
            return f"address {address.ipv4_mapped}"
        return f"address {ipaddress.ip_network((int(address), 64), strict=False)}"
    return f"address {address}"
