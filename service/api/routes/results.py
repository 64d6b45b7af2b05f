"""Routes: what a finished job has made."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Annotated, Any

from fastapi import Header, Response, status

from service.api.context import ContextDependency
from service.api.downloads import (
    ConditionsDependency,
    cache_headers,
    file_response,
    file_responses,
)
from service.api.negotiation import preferred
from service.api.routes.jobs import FoundJob
from service.api.routing import Absent, ResourceRouter
from service.api.schemas import JOBS_PATH
from service.problems import MEDIA_TYPE, ProblemError, problem, problem_of
from worker.jobs.records import Artifact, JobRecord

router = ResourceRouter(prefix=JOBS_PATH, tags=["results"])

_PROBLEM = {"content": {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}}}
_NO_RESULT: dict[int | str, dict[str, Any]] = {
    404: {"description": "there is no such job, or it has made no such file", **_PROBLEM},
    409: {"description": "the job has not finished, has failed or was canceled", **_PROBLEM},
    410: {"description": "the job's files have expired", **_PROBLEM},
}
_GLB, _GLTF = "model/gltf-binary", "model/gltf+json"
_REPORT = {
    "anyOf": [
        {"$ref": "#/components/schemas/Report"},
        {"$ref": "#/components/schemas/MeasureReport"},
        {"$ref": "#/components/schemas/AuditReport"},
    ]
}
_DIAGNOSTICS: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "rounds with sizes, residuals and SCS's history; or its table",
        "content": {
            "application/json": {"schema": {"$ref": "#/components/schemas/SolverReport"}},
            "text/csv": {"schema": {"type": "string"}},
        },
    },
    206: {"description": "the part of the table that was asked for", "content": {"text/csv": {}}},
    304: {"description": "the copy named by If-None-Match is current"},
    416: {"description": "the table has no such part", **_PROBLEM},
    **_NO_RESULT,
}


def _file_route(
    tail: str, description: str, *media_types: str, schema: Mapping[str, Any] | None = None
) -> Callable[[Callable[..., Response]], Callable[..., Response]]:
    """Register a route that serves a file."""
    responses = {**file_responses(description, *media_types, schema=schema), **_NO_RESULT}
    return router.get(f"/{{job_id}}/{tail}", response_class=Response, responses=responses)


@_file_route(
    "mesh",
    "the refined mesh, in the source's format",
    "model/obj",
    _GLB,
    _GLTF,
    "model/ply",
    "model/stl",
    "model/off",
)
def get_mesh(
    record: FoundJob, context: ContextDependency, conditions: ConditionsDependency
) -> Response:
    """The refined mesh, in the source's format."""
    return file_response(context.blobs, artifact_of(record, "mesh"), conditions)


@_file_route("report", "the report", "application/json", schema=_REPORT)
def get_report(
    record: FoundJob, context: ContextDependency, conditions: ConditionsDependency
) -> Response:
    """The report: inputs, quality before and after, certificate, timings."""
    return file_response(context.blobs, artifact_of(record, "report"), conditions)


@_file_route("preview.glb", "light copies of the meshes", _GLB)
def get_preview(
    record: FoundJob, context: ContextDependency, conditions: ConditionsDependency
) -> Response:
    """Light copies of input, refined mesh and reference, with the deviation at each vertex."""
    return file_response(context.blobs, artifact_of(record, "preview"), conditions)


@_file_route("heatmap.glb", "the refined mesh, coloured", _GLB)
def get_heatmap(
    record: FoundJob, context: ContextDependency, conditions: ConditionsDependency
) -> Response:
    """The refined mesh coloured by deviation (`COLOR_0`) and by cone tension (`COLOR_1`).

    The numbers are attributes too: `_DEVIATION`, in model units, and `_TENSION`.
    """
    return file_response(context.blobs, artifact_of(record, "heatmap"), conditions)


@_file_route("pictures.png", "views from six sides, in colour", "image/png")
def get_pictures(
    record: FoundJob, context: ContextDependency, conditions: ConditionsDependency
) -> Response:
    """Input, refined mesh and reference in their own colours, each from six sides.

    There are none where neither file has colours, or `quality.appearance` is off.
    """
    return file_response(context.blobs, artifact_of(record, "pictures"), conditions)


@_file_route("thumbnail.webp", "a small picture", "image/webp")
def get_thumbnail(
    record: FoundJob, context: ContextDependency, conditions: ConditionsDependency
) -> Response:
    """The refined mesh, or the source where nothing was refined, on 112 by 112 pixels."""
    return file_response(context.blobs, artifact_of(record, "thumbnail"), conditions)


@_file_route("certificate", "the certificate, a NumPy .npz archive", "application/zip")
def get_certificate(
    record: FoundJob, context: ContextDependency, conditions: ConditionsDependency
) -> Response:
    """The certificate, for `meshcone verify`: a NumPy .npz archive, which is a ZIP file."""
    return file_response(context.blobs, artifact_of(record, "certificate"), conditions)


@_file_route("diagnostics.csv", "the solver's iterations", "text/csv")
def get_diagnostics_table(
    record: FoundJob, context: ContextDependency, conditions: ConditionsDependency
) -> Response:
    """The solver's iterations, one a row."""
    return file_response(context.blobs, artifact_of(record, "diagnostics_csv"), conditions)


@router.get("/{job_id}/diagnostics", response_class=Response, responses=_DIAGNOSTICS)
def get_diagnostics(
    record: FoundJob,
    context: ContextDependency,
    conditions: ConditionsDependency,
    accept: Annotated[str | Absent, Header()] = None,
) -> Response:
    """What the solver did in each round; as a table of iterations for `Accept: text/csv`."""
    table = artifact_of(record, "diagnostics_csv")  # what refined nothing has neither
    if preferred(accept, ("application/json", "text/csv")) == "text/csv":
        answer = file_response(context.blobs, table, conditions)
        answer.headers["Vary"] = "Accept"
        return answer
    report = artifact_of(record, "report")
    tag = f'"{report.digest}-solver"'
    headers = {**cache_headers(tag), "Vary": "Accept"}
    if conditions.has_current(tag):
        return Response(status_code=status.HTTP_304_NOT_MODIFIED, headers=headers)
    try:
        document = json.loads(context.blobs.get(report.digest))
    except FileNotFoundError:
        raise ProblemError(problem("gone", "the file has been removed")) from None
    return Response(json.dumps(document["solver"]), media_type="application/json", headers=headers)


def artifact_of(record: JobRecord, name: str) -> Artifact:
    """A file that a job has made.

    Raises:
        ProblemError: it has made none of that name, or has it no longer.
    """
    if not record.has_ended:
        raise ProblemError(problem("not-finished", f"the job is {record.state}"))
    if record.state != "succeeded":
        error = problem_of(record.error) if record.error else None
        ended = "was canceled" if record.state == "canceled" else "failed"
        raise ProblemError(problem("job-failed", f"the job {ended}", error=error))
    if name not in record.artifacts:
        named = name.removesuffix("_csv")
        raise ProblemError(
            problem("not-found", f"the job has no {named}: {_why_none(record, name)}")
        )
    if record.expired is not None:
        detail = f"the job's files expired at {record.expired:%Y-%m-%dT%H:%M:%SZ}"
        raise ProblemError(problem("gone", detail))
    return record.artifacts[name]


def _why_none(record: JobRecord, name: str) -> str:
    if name == "pictures":
        return "neither file has colours, or comparing them was turned off"
    if name == "thumbnail":
        return "it could not be drawn, or a version that drew none made the job"
    # A record of an earlier version has no mode; it was refined.
    mode = record.options.get("mode")
    if mode == "audit":
        return "it audited and refined nothing"
    return "it measured and refined nothing" if mode == "measure" else "it kept its input"
