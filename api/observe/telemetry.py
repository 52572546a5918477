"""OpenTelemetry, where its SDK is installed and the environment asks for it: FastAPI's own spans, with our attributes.

FastAPI makes the span of a request; its metrics and logs stay off, since ours say more and its logs would quote errors.
"""

import importlib.util
import logging
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from planner import __version__

if TYPE_CHECKING:
    from fastapi.telemetry import TelemetryConfig

log = logging.getLogger("waywright.api")

_OFF: "TelemetryConfig" = {"tracing": False, "metrics": False, "logs": False, "auto_configure": False}


def config(environment: Mapping[str, str] | None = None) -> "TelemetryConfig":
    """Return the argument ``telemetry`` of ``FastAPI``; everything off unless the environment asks for traces."""
    environment = os.environ if environment is None else environment
    if not asked(environment):
        return _OFF
    exporter = make_exporter(environment)
    return (
        _OFF
        if exporter is None
        else {**_OFF, "tracing": True, "operation_spans": False, "tracer_provider": _provider(exporter, environment)}
    )


def asked(environment: Mapping[str, str]) -> bool:
    """Return whether traces are wanted and the SDK is there to make them."""
    chosen = environment.get("OTEL_TRACES_EXPORTER", "").strip().lower()
    if environment.get("OTEL_SDK_DISABLED", "").strip().lower() == "true" or chosen == "none":
        return False
    if not (chosen or environment.get("OTEL_EXPORTER_OTLP_ENDPOINT") or environment.get(_TRACES_ENDPOINT)):
        return False
    if importlib.util.find_spec("opentelemetry") is None or importlib.util.find_spec("opentelemetry.sdk") is None:
        log.warning("traces are asked for, but opentelemetry-sdk is not installed: pip install waywright[otel]")
        return False
    return True


_TRACES_ENDPOINT = "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT"


def make_exporter(environment: Mapping[str, str]) -> Any:
    """Return where spans go: OTLP over HTTP, or the console; None where that cannot be."""
    chosen = environment.get("OTEL_TRACES_EXPORTER", "").strip().lower() or "otlp"
    if chosen == "console":
        import sys

        from opentelemetry.sdk.trace.export import ConsoleSpanExporter

        return ConsoleSpanExporter(out=sys.stderr)
    if chosen != "otlp":
        log.warning("OTEL_TRACES_EXPORTER can be otlp, console or none here; there will be no traces")
        return None
    try:
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
    except ImportError:
        log.warning("traces are asked for, but their exporter is not installed: pip install waywright[otel]")
        return None
    return OTLPSpanExporter()  # reads endpoint, headers and time-out from the environment


def _provider(exporter: Any, environment: Mapping[str, str]) -> Any:
    from opentelemetry.sdk.resources import Resource
    from opentelemetry.sdk.trace import TracerProvider
    from opentelemetry.sdk.trace.export import BatchSpanProcessor

    named = "OTEL_SERVICE_NAME" in environment or "service.name=" in environment.get("OTEL_RESOURCE_ATTRIBUTES", "")
    resource = Resource.create({"service.version": __version__} | ({} if named else {"service.name": "waywright"}))
    provider = TracerProvider(resource=resource)
    provider.add_span_processor(BatchSpanProcessor(exporter))  # sends from a thread of its own, what is left at exit
    return provider
