"""Routes: what a job was sent, to have again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import PurePosixPath
from typing import Annotated, Any

from fastapi import Path, Response

from service.api.context import Context, ContextDependency
from service.api.downloads import (
    Conditions,
    ConditionsDependency,
    file_response,
    file_responses,
)
from service.api.routes.jobs import FoundJob
from service.api.routing import ResourceRouter
from service.api.schemas import JOBS_PATH
from service.problems import MEDIA_TYPE, ProblemError, problem
from worker.jobs.records import Artifact, JobFile, JobRecord, RemoteFile

router = ResourceRouter(prefix=JOBS_PATH, tags=["inputs"])

MEDIA_TYPES = {
    ".obj": "model/obj",
    ".glb": "model/gltf-binary",
    ".gltf": "model/gltf+json",
    ".ply": "model/ply",
    ".stl": "model/stl",
    ".off": "model/off",
}
"""Those of meshes, by suffix; what else was sent is a file of any kind."""

_ANY = "application/octet-stream"
_PROBLEM = {"content": {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}}}
_NO_FILE: dict[int | str, dict[str, Any]] = {
    404: {"description": "there is no such job, or no such file was sent with it", **_PROBLEM},
    410: {"description": "the job's files have expired", **_PROBLEM},
}
_MESH = {**file_responses("the mesh, as it was sent", *MEDIA_TYPES.values(), _ANY), **_NO_FILE}
_RESOURCE = {**file_responses("the file, as it was sent", _ANY), **_NO_FILE}

FileName = Annotated[str, Path(description="the file's name, with the folders it has in it")]


def _route(
    tail: str, responses: dict[int | str, dict[str, Any]]
) -> Callable[[Callable[..., Response]], Callable[..., Response]]:
    return router.get(f"/{{job_id}}/{tail}", response_class=Response, responses=responses)


@_route("source", _MESH)
def get_source(
    record: FoundJob, context: ContextDependency, conditions: ConditionsDependency
) -> Response:
    """The source, byte for byte as it was sent."""
    return _again(record, record.source, context, conditions)


@_route("reference", _MESH)
def get_reference(
    record: FoundJob, context: ContextDependency, conditions: ConditionsDependency
) -> Response:
    """The reference, byte for byte as it was sent."""
    if record.reference is None:
        raise ProblemError(problem("not-found", "the job was sent without a reference"))
    return _again(record, record.reference, context, conditions)


@_route("source_resources/{name:path}", _RESOURCE)
def get_source_resource(
    name: FileName, record: FoundJob, context: ContextDependency, conditions: ConditionsDependency
) -> Response:
    """A file that only the source names."""
    return _again(record, _named(name, record.source_resources), context, conditions)


@_route("reference_resources/{name:path}", _RESOURCE)
def get_reference_resource(
    name: FileName, record: FoundJob, context: ContextDependency, conditions: ConditionsDependency
) -> Response:
    """A file that only the reference names."""
    return _again(record, _named(name, record.reference_resources), context, conditions)


@_route("resources/{name:path}", _RESOURCE)
def get_resource(
    name: FileName, record: FoundJob, context: ContextDependency, conditions: ConditionsDependency
) -> Response:
    """A file that both meshes may name."""
    return _again(record, _named(name, record.resources), context, conditions)


def _named(name: str, files: tuple[JobFile, ...]) -> JobFile:
    for file in files:
        if file.name == name:
            return file
    raise ProblemError(problem("not-found", "no file of this name was sent with the job"))


def _again(record: JobRecord, file: JobFile, context: Context, conditions: Conditions) -> Response:
    if record.expired is not None:
        detail = f"the job's files expired at {record.expired:%Y-%m-%dT%H:%M:%SZ}"
        raise ProblemError(problem("gone", detail))
    if isinstance(file, RemoteFile):
        raise ProblemError(problem("not-found", "the file has not been fetched"))
    path = PurePosixPath(file.name)
    is_mesh = file is record.source or file is record.reference
    media_type = MEDIA_TYPES.get(path.suffix.lower(), _ANY) if is_mesh else _ANY
    sent = Artifact(digest=file.digest, media_type=media_type, filename=path.name, size=file.size)
    return file_response(context.blobs, sent, conditions)
