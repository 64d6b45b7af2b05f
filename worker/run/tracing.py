"""A job's part of the trace that its submission belongs to (OpenTelemetry).

The API writes the trace's context into the job's record. Once an attempt has ended, the
worker tells of it: not the horse, which may reach nothing but broker and files, and may be
killed at any moment. Nothing is sent unless OTEL_EXPORTER_OTLP_ENDPOINT, or the variable for
traces alone, says where to.
"""

from __future__ import annotations

import logging
import os
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from opentelemetry import propagate, trace
from opentelemetry.trace import Status, StatusCode

if TYPE_CHECKING:
    from opentelemetry.trace import TracerProvider

    from worker.jobs.records import JobRecord

logger = logging.getLogger(__name__)

_ENDPOINTS = ("OTEL_EXPORTER_OTLP_ENDPOINT", "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT")
_EXPORT_TIMEOUT = 3.0  # seconds; the next job waits for it
_NANOSECONDS = 1_000_000_000


def current_context() -> dict[str, str]:
    """The fields of W3C Trace Context that carry the current span on; none if there is none."""
    carrier: dict[str, str] = {}
    propagate.inject(carrier)
    return carrier


def is_wanted() -> bool:
    """Whether the environment says where spans are to be sent."""
    disabled = os.environ.get("OTEL_SDK_DISABLED", "").lower() == "true"
    return not disabled and any(os.environ.get(name) for name in _ENDPOINTS)


def export_attempt(record: JobRecord, attempt: int, began: datetime) -> None:
    """Send the spans of an attempt that has ended; without the ``otel`` extra, say so.

    Nobody there to receive them is a line in the log, and no more.

    Args:
        record: the job as the attempt left it.
        attempt: its number.
        began: when it began.
    """
    try:
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
    except ImportError:
        logger.warning("traces are wanted but cannot be sent: install meshcone[otel]")
        return
    name = os.environ.get("OTEL_SERVICE_NAME", "meshcone-worker")
    # One for each attempt: its thread must have ended before the next horse is forked.
    provider = TracerProvider(
        resource=Resource.create({"service.name": name}), shutdown_on_exit=False
    )
    provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter(timeout=_EXPORT_TIMEOUT)))
    write_spans(provider, record, attempt, began)
    provider.shutdown()


def write_spans(provider: TracerProvider, record: JobRecord, attempt: int, began: datetime) -> None:
    """Write a span of the attempt and, before the first one, one of how long the job waited."""
    parent = propagate.extract(record.context)
    tracer = provider.get_tracer("meshcone")
    attributes: dict[str, str | int | float] = {
        "meshcone.job.id": record.id,
        "meshcone.job.attempt": attempt,
    }
    if attempt == 1:
        waiting = tracer.start_span(
            "queued", context=parent, start_time=_nanoseconds(record.created), attributes=attributes
        )
        waiting.end(_nanoseconds(began))
    span = tracer.start_span(
        "attempt",
        context=parent,
        kind=trace.SpanKind.CONSUMER,
        start_time=_nanoseconds(began),
        attributes={
            **attributes,
            "meshcone.job.state": record.state,
            **{f"meshcone.seconds.{stage}": value for stage, value in record.timings.items()},
        },
    )
    if record.error is not None:
        span.set_attribute("error.type", record.error.kind)
        span.set_status(Status(StatusCode.ERROR, record.error.message))
    span.end(_nanoseconds(record.finished or datetime.now(UTC)))


def _nanoseconds(moment: datetime) -> int:
    return int(moment.timestamp() * _NANOSECONDS)
