"""Routes: what a finished job has made."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Annotated, Any
from urllib.parse import quote

from fastapi import APIRouter, Header, Response, status

from service.context import Context, ContextDependency
from service.jobs import FoundJob
from service.problems import MEDIA_TYPE, ProblemError, problem, problem_of
from service.schemas import JOBS_PATH
from worker.records import Artifact, JobRecord

router = APIRouter(prefix=JOBS_PATH, tags=["results"])

IfNoneMatch = Annotated[str | None, Header()]

_ANY_FILE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "the refined mesh, in the source's format",
        "content": {"application/octet-stream": {"schema": {"type": "string"}}},
    },
    304: {"description": "the copy named by If-None-Match is current"},
}
_JSON: dict[int | str, dict[str, Any]] = {
    200: {"content": {"application/json": {"schema": {"type": "object"}}}}
}
_CERTIFICATE: dict[int | str, dict[str, Any]] = {
    200: {"content": {"application/zip": {"schema": {"type": "string"}}}},
    304: {"description": "the copy named by If-None-Match is current"},
    404: {
        "description": "there is no certificate: nothing was refined, or the input was kept",
        "content": {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}},
    },
}
_PREVIEW: dict[int | str, dict[str, Any]] = {
    200: {"content": {"model/gltf-binary": {"schema": {"type": "string"}}}},
    304: {"description": "the copy named by If-None-Match is current"},
}
_CSV: dict[int | str, dict[str, Any]] = {
    200: {"content": {"text/csv": {"schema": {"type": "string"}}}}
}


@router.get("/{job_id}/mesh", response_class=Response, responses=_ANY_FILE)
def get_mesh(
    record: FoundJob, context: ContextDependency, if_none_match: IfNoneMatch = None
) -> Response:
    """The refined mesh, in the source's format."""
    return _file(context, _artifact(record, "mesh"), if_none_match)


@router.get("/{job_id}/report", response_class=Response, responses=_JSON)
def get_report(
    record: FoundJob, context: ContextDependency, if_none_match: IfNoneMatch = None
) -> Response:
    """The report: inputs, quality before and after, certificate, timings."""
    return _file(context, _artifact(record, "report"), if_none_match)


@router.get("/{job_id}/preview.glb", response_class=Response, responses=_PREVIEW)
def get_preview(
    record: FoundJob, context: ContextDependency, if_none_match: IfNoneMatch = None
) -> Response:
    """Light copies of input, refined mesh and reference, with the deviation at each vertex."""
    return _file(context, _artifact(record, "preview"), if_none_match)


@router.get("/{job_id}/certificate", response_class=Response, responses=_CERTIFICATE)
def get_certificate(
    record: FoundJob, context: ContextDependency, if_none_match: IfNoneMatch = None
) -> Response:
    """The certificate, for `meshcone verify`: a NumPy .npz archive, which is a ZIP file."""
    return _file(context, _artifact(record, "certificate"), if_none_match)


@router.get("/{job_id}/diagnostics", response_class=Response, responses=_JSON)
def get_diagnostics(
    record: FoundJob, context: ContextDependency, accept: Annotated[str | None, Header()] = None
) -> Response:
    """What the solver did in each round; as a table of iterations for `Accept: text/csv`."""
    if accept is not None and accept.strip().startswith("text/csv"):
        return get_diagnostics_table(record, context)
    _artifact(record, "diagnostics_csv")  # what refined nothing has neither
    report = json.loads(context.blobs.get(_artifact(record, "report").digest))
    return Response(json.dumps(report["solver"]), media_type="application/json")


@router.get("/{job_id}/diagnostics.csv", response_class=Response, responses=_CSV)
def get_diagnostics_table(record: FoundJob, context: ContextDependency) -> Response:
    """The solver's iterations, one a row."""
    return _file(context, _artifact(record, "diagnostics_csv"), None)


def _artifact(record: JobRecord, name: str) -> Artifact:
    if record.state in ("queued", "running"):
        raise ProblemError(problem("not-finished", f"the job is {record.state}"))
    if record.state != "succeeded":
        error = problem_of(record.error) if record.error else None
        raise ProblemError(problem("job-failed", f"the job {_ended(record)}", error=error))
    if name not in record.artifacts:
        named = name.removesuffix("_csv")
        raise ProblemError(problem("not-found", f"the job has no {named}: {_why_none(record)}"))
    return record.artifacts[name]


def _why_none(record: JobRecord) -> str:
    # A record of an earlier version has no mode; it was refined.
    measured = record.options.get("mode") == "measure"
    return "it measured and refined nothing" if measured else "it kept its input"


def _ended(record: JobRecord) -> str:
    return "was canceled" if record.state == "canceled" else "failed"


def _file(context: Context, artifact: Artifact, if_none_match: str | None) -> Response:
    headers: Mapping[str, str] = {
        "ETag": f'"{artifact.digest}"',
        "Cache-Control": "private, no-cache",  # keep it, but ask: the job can be deleted
        "Content-Disposition": _attachment(artifact.filename),
    }
    if if_none_match is not None and artifact.digest in if_none_match:
        return Response(status_code=status.HTTP_304_NOT_MODIFIED, headers=headers)
    content = context.blobs.get(artifact.digest)
    return Response(content, headers=headers, media_type=artifact.media_type)


def _attachment(filename: str) -> str:
    """Content-Disposition of a download (RFC 6266, section 4.3)."""
    plain = "".join(
        character if character.isascii() and character not in '"\\%' else "_"
        for character in filename
    )
    return f"attachment; filename=\"{plain}\"; filename*=UTF-8''{quote(filename, safe='')}"
