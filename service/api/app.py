"""The HTTP application."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from importlib.metadata import version
from typing import Any

from fastapi import APIRouter, FastAPI
from pydantic import BaseModel
from pydantic.json_schema import JsonSchemaMode

from meshcone.options import Options
from meshcone.program.diagnostics import SolverReport
from meshcone.report.report import AuditReport, MeasureReport, Report
from meshcone.settings import load_settings
from service import problems
from service.access.auth import Authentication, KeyRing, describe_security
from service.api.batch_schemas import BatchRequest
from service.api.context import open_context
from service.api.middleware.body_limit import BodyLimit
from service.api.middleware.compression import Compression
from service.api.middleware.cross_origin import CrossOrigin
from service.api.middleware.headers import SecurityHeaders
from service.api.middleware.lingering import Lingering
from service.api.middleware.request_log import PROBES, RequestLog
from service.api.request_schemas import JobRequest
from service.api.routes import (
    batches,
    blobs,
    events,
    health,
    inputs,
    jobs,
    metrics,
    results,
    submit,
)
from service.settings import ServiceSettings
from worker.broker.connections import connect_async
from worker.jobs.events import EventFeed

DESCRIPTION = """\
Send a mesh and its reference; get the mesh refined by a second-order cone program, the proof \
that the answer is optimal, and a report.

Every error is `application/problem+json` (RFC 9457) with a stable `type`."""

_SPARE = 16  # connections to the broker, beside one for each client's
_REFERENCE = "#/components/schemas/{model}"
_MODELS: dict[type[BaseModel], JsonSchemaMode] = {
    Options: "validation",
    JobRequest: "validation",
    BatchRequest: "validation",
    Report: "serialization",
    MeasureReport: "serialization",
    AuditReport: "serialization",
    SolverReport: "serialization",
}


class Application(FastAPI):
    """FastAPI, with the schemas of what no route has as a parameter or answer of its own."""

    def openapi(self) -> dict[str, Any]:
        """The description, with options, which a form carries, and reports, which are files."""
        document = super().openapi()
        for model, mode in _MODELS.items():
            schema = model.model_json_schema(mode=mode, ref_template=_REFERENCE)
            definitions = schema.pop("$defs", {})
            document["components"]["schemas"].update({**definitions, model.__name__: schema})
        describe_security(document)
        return document


def create_app(
    settings: ServiceSettings | None = None,
    *,
    keys_required: bool = True,
    pages: APIRouter | None = None,
) -> FastAPI:
    """Build the application; it connects to the broker when it starts, not before.

    Args:
        settings: those of the environment, if None.
        keys_required: whether every request needs an API key. False is for an address that
            only this machine reaches.
        pages: routes to add to the API's.

    Raises:
        InputError: the environment's settings cannot be used.
    """
    settings = settings or load_settings(ServiceSettings)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        with open_context(settings) as context:
            # A client's connection follows a job, or has its key looked up: one at a time.
            connections = settings.max_connections + _SPARE
            async with connect_async(settings.required_redis_url(), connections) as client:
                app.state.context = context
                app.state.key_ring = KeyRing(client, settings)
                app.state.events = events.Events(EventFeed(client), settings.event_streams)
                yield

    app = Application(
        title="MeshCone",
        version=version("meshcone"),
        description=DESCRIPTION,
        lifespan=lifespan,
        telemetry={
            "auto_configure": True,  # sends spans if OTEL_EXPORTER_OTLP_ENDPOINT says where to
            "metrics": False,  # service.api.routes.metrics has better ones
            "logs": False,
            "operation_spans": False,
            "exclude": lambda scope: scope["path"] in PROBES,
        },
        redirect_slashes=False,  # to a URL with the scheme and host of behind a proxy
        docs_url=None,  # that page loads its scripts from another site; ours does not
        redoc_url=None,
        generate_unique_id_function=lambda route: route.name,
        responses={
            "default": {
                "description": "a problem",
                "content": {
                    problems.MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}
                },
            }
        },
    )
    app.state.settings = settings
    for module in (submit, jobs, events, inputs, results, batches, blobs):
        app.include_router(module.router)
    app.include_router(health.router)
    app.include_router(metrics.router)
    if pages is not None:
        app.include_router(pages)
    problems.install_handlers(app)
    app.add_middleware(Compression)
    app.add_middleware(BodyLimit, limit=settings.max_upload_bytes)
    app.add_middleware(
        Authentication, keys_required=keys_required, origins=frozenset(settings.origins)
    )
    app.add_middleware(Lingering)
    if settings.origins:
        app.add_middleware(CrossOrigin, origins=settings.origins)
    app.add_middleware(RequestLog)
    app.add_middleware(SecurityHeaders)
    return app
