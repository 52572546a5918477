"""The Python client, synchronous and asynchronous; imports no web framework."""

import asyncio
import time
from collections.abc import Sequence
from types import TracebackType
from typing import Any, Self, TypedDict, Unpack

import httpx2

from . import wire
from .result import Result


class Given(TypedDict, total=False):
    """What a plan or a comparison may ask for besides waypoints; see the HTTP contract, section 2."""

    times: Any
    limits: Any
    segment_limits: Any
    segment_durations: Any
    duration: Any
    start: Any
    end: Any
    waypoint_states: Any
    waypoint_tolerance: Any
    tube: Any
    wrap: Any
    robot: Any
    joint_names: Any
    sampling: Any
    timeout: float | None


class Timing(TypedDict, total=False):
    """What a retiming may ask for besides a trajectory and its limits; see the HTTP contract, section 6."""

    duration: Any
    joint_names: Any
    sampling: Any
    timeout: float | None


def _headers(api_key: str | None) -> dict[str, str]:
    headers = {"Accept": "application/json, application/problem+json", "User-Agent": "waywright"}
    return headers if api_key is None else {**headers, "X-API-Key": api_key}


class Client:
    """A connection to the service.

    Parameters
    ----------
    url : str
        Where the service is, say ``http://127.0.0.1:8000``.
    api_key : str
        Sent as ``X-API-Key``.
    timeout : float
        Seconds for one call, waits before retries included. Answers 429 and 503 are tried again, as ``Retry-After``
        says, as long as that time lasts.

    Every call raises the library's own errors (``planner.PlannerError`` and its kinds), rebuilt from the service's
    answer, and ``httpx2.TransportError`` where there was none. NumPy arrays are taken wherever lists are.
    """

    def __init__(self, url: str, api_key: str | None = None, timeout: float = 60.0) -> None:
        self.timeout = timeout
        self._http = httpx2.Client(base_url=url, headers=_headers(api_key))

    def plan(
        self,
        waypoints: Any,
        *,
        method: str = "auto",
        options: Any = None,
        include: Sequence[str] = ("samples",),
        **given: Unpack[Given],
    ) -> Result:
        """Plan a certified trajectory.

        Parameters
        ----------
        waypoints : (N, D)
        method, options
            An id of the catalogue, or ``auto``, and its options.
        include
            Of ``samples``, ``polynomial`` and ``bound``.
        **given
            ``times`` (N,) s, ``limits``, ``sampling`` and the other fields of the HTTP contract, section 2.
        """
        asked = {**given, "method": method, "options": options}
        return Result.of(self._call(wire.plan_call(waypoints, asked, include)))

    def compare(
        self,
        waypoints: Any,
        methods: Any = "all",
        *,
        include: Sequence[str] = (),
        **given: Unpack[Given],
    ) -> list[dict[str, Any]]:
        """Return one row per method (``all``, or ids or pairs (id, options)); a row that refuses has an ``error``.

        Rows hold ``samples`` and ``polynomial`` only where ``include`` asks for them.
        """
        return wire.read_rows(self._call(wire.compare_call(waypoints, methods, given, include)))

    def certify(
        self,
        trajectory: Any,
        *,
        limits: Any = None,
        waypoints: Any = None,
        times: Any = None,
        start: Any = None,
        end: Any = None,
    ) -> dict[str, Any]:
        """Return the certificate of a ``Trajectory``, ``Samples``, ``Result`` or the contract's object."""
        given = {"limits": limits, "waypoints": waypoints, "times": times, "start": start, "end": end}
        certificate: dict[str, Any] = self._call(wire.certify_call(trajectory, given))["certificate"]
        return certificate

    def retime(
        self,
        trajectory: Any,
        *,
        limits: Any,
        tolerance: float | None = None,
        include: Sequence[str] = ("samples",),
        **given: Unpack[Timing],
    ) -> Result:
        """Return the same path, run through as fast as the limits allow.

        Parameters
        ----------
        trajectory
            A ``Trajectory``, ``Samples``, ``Result`` or the contract's object, a ROS 2 JointTrajectory among them.
        tolerance : float
            How far the path may be from samples, in every joint, to be smoother.
        **given
            ``duration``, ``joint_names``, ``sampling`` and ``timeout`` s, as for a plan.
        """
        asked = {**given, "limits": limits, "tolerance": tolerance}
        return Result.of(self._call(wire.retime_call(trajectory, asked, include)))

    def methods(self, id: str | None = None) -> Any:
        """Return the catalogue, or the row of one method."""
        return self._call(wire.methods_call(id))

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _call(self, call: wire.Call) -> Any:
        deadline = time.monotonic() + self.timeout
        attempt = 0
        while True:
            remaining = max(deadline - time.monotonic(), 0.001)
            answer = self._http.request(
                call.verb, call.path, content=call.body, headers=call.headers, timeout=remaining
            )
            remaining = deadline - time.monotonic()
            wait = wire.wait_before_retry(answer.status_code, answer.headers, attempt, remaining)
            if wait is None:
                return wire.read_answer(answer.status_code, answer.content)
            attempt += 1
            time.sleep(wait)


class AsyncClient:
    """The same as ``Client``, to be awaited."""

    def __init__(self, url: str, api_key: str | None = None, timeout: float = 60.0) -> None:
        self.timeout = timeout
        self._http = httpx2.AsyncClient(base_url=url, headers=_headers(api_key))

    async def plan(
        self,
        waypoints: Any,
        *,
        method: str = "auto",
        options: Any = None,
        include: Sequence[str] = ("samples",),
        **given: Unpack[Given],
    ) -> Result:
        """Plan a certified trajectory; see ``Client.plan``."""
        asked = {**given, "method": method, "options": options}
        return Result.of(await self._call(wire.plan_call(waypoints, asked, include)))

    async def compare(
        self,
        waypoints: Any,
        methods: Any = "all",
        *,
        include: Sequence[str] = (),
        **given: Unpack[Given],
    ) -> list[dict[str, Any]]:
        """Return one row per method; see ``Client.compare``."""
        return wire.read_rows(await self._call(wire.compare_call(waypoints, methods, given, include)))

    async def certify(
        self,
        trajectory: Any,
        *,
        limits: Any = None,
        waypoints: Any = None,
        times: Any = None,
        start: Any = None,
        end: Any = None,
    ) -> dict[str, Any]:
        """Return a certificate; see ``Client.certify``."""
        given = {"limits": limits, "waypoints": waypoints, "times": times, "start": start, "end": end}
        certificate: dict[str, Any] = (await self._call(wire.certify_call(trajectory, given)))["certificate"]
        return certificate

    async def retime(
        self,
        trajectory: Any,
        *,
        limits: Any,
        tolerance: float | None = None,
        include: Sequence[str] = ("samples",),
        **given: Unpack[Timing],
    ) -> Result:
        """Return the same path, run through as fast as the limits allow; see ``Client.retime``."""
        asked = {**given, "limits": limits, "tolerance": tolerance}
        return Result.of(await self._call(wire.retime_call(trajectory, asked, include)))

    async def methods(self, id: str | None = None) -> Any:
        """Return the catalogue, or the row of one method."""
        return await self._call(wire.methods_call(id))

    async def close(self) -> None:
        """Close the connections."""
        await self._http.aclose()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    async def _call(self, call: wire.Call) -> Any:
        deadline = time.monotonic() + self.timeout
        attempt = 0
        while True:
            remaining = max(deadline - time.monotonic(), 0.001)
            answer = await self._http.request(
                call.verb, call.path, content=call.body, headers=call.headers, timeout=remaining
            )
            remaining = deadline - time.monotonic()
            wait = wire.wait_before_retry(answer.status_code, answer.headers, attempt, remaining)
            if wait is None:
                return wire.read_answer(answer.status_code, answer.content)
            attempt += 1
            await asyncio.sleep(wait)
