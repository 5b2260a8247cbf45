"""Traces of what a mission goes through, for OpenTelemetry where that is installed (`pip install stillroom[tracing]`) and set up; else nothing."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

try:
    from opentelemetry import trace as _installed
except ImportError:
    _installed = None  # type: ignore[assignment]

WHERE = ("OTEL_EXPORTER_OTLP_ENDPOINT", "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT")
"""OpenTelemetry's own settings: without one nothing is sent."""
trace: ModuleType | None = _installed if any(os.environ.get(name) for name in WHERE) else None
"""None where spans would go nowhere: each takes its time all the same."""


@contextmanager
def span(name: str, **attributes: str | int) -> Iterator[None]:
    """Part of the span around it. An exception that passes through is part of it, too, without what it says: that may be of a home."""
    if trace is None:
        yield
        return
    tracer = trace.get_tracer("stillroom")
    named = {f"stillroom.{key}": value for key, value in attributes.items()}
    with tracer.start_as_current_span(
        name, attributes=named, record_exception=False, set_status_on_exception=False
    ) as one:
        try:
            yield
        except Exception as error:
            one.set_status(trace.Status(trace.StatusCode.ERROR, type(error).__name__))
            raise


def configure() -> None:
    """Sends spans by OTLP, where that is set up; once for each process."""
    if trace is None:
        return
    try:
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
    except ImportError:
        return
    provider = TracerProvider(resource=Resource.create({"service.name": "stillroom"}))
    provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter()))
    trace.set_tracer_provider(provider)
