"""Routes: submit jobs and look after them."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Response, status

from service.context import ContextDependency
from service.problems import ProblemError, problem
from service.schemas import JOBS_PATH, Job, JobList, job_path
from service.submission import accept, check_meshes
from service.uploads import LABEL_LENGTH, Submission, read_submission
from worker.identifiers import is_job_id
from worker.job_index import JobFilter
from worker.ledger import UnknownJobError
from worker.records import JobRecord, JobState

router = APIRouter(prefix=JOBS_PATH, tags=["jobs"])

_FILE = {"type": "string", "contentMediaType": "application/octet-stream"}
_SUBMISSION_FORM: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "required": ["source", "reference", "options"],
                    "properties": {
                        "source": {**_FILE, "description": "the mesh to refine"},
                        "reference": {**_FILE, "description": "the mesh to refine it towards"},
                        "options": {
                            "type": "string",
                            "contentMediaType": "application/json",
                            "contentSchema": {"$ref": "#/components/schemas/Options"},
                            "description": "a JSON object; {} for the defaults",
                        },
                        "resources": {
                            "type": "array",
                            "items": _FILE,
                            "description": "files that a .gltf or .obj names: buffers, materials",
                        },
                        "label": {
                            "type": "string",
                            "maxLength": LABEL_LENGTH,
                            "description": "a name to find the job by",
                        },
                    },
                    "additionalProperties": False,
                }
            }
        },
    }
}


def find_job(job_id: str, context: ContextDependency) -> JobRecord:
    """The job a path names, as a dependency.

    Raises:
        ProblemError: there is none.
    """
    if is_job_id(job_id):
        try:
            return context.ledger.get(job_id)
        except UnknownJobError:
            pass
    raise ProblemError(problem("not-found", "there is no such job"))


FoundJob = Annotated[JobRecord, Depends(find_job)]


@router.post(
    "",
    status_code=status.HTTP_202_ACCEPTED,
    response_model=Job,
    openapi_extra=_SUBMISSION_FORM,
    summary="Submit a mesh and its reference",
)
def submit_job(
    submission: Annotated[Submission, Depends(read_submission)],
    context: ContextDependency,
    response: Response,
) -> Job:
    """Queue a refinement of `source` towards `reference`."""
    if submission.size <= context.settings.precheck_bytes:
        check_meshes(submission)
    record = accept(submission, context)
    response.headers["Location"] = job_path(record.id)
    response.headers["Retry-After"] = str(context.settings.retry_after)
    return Job.of(record)


@router.get("", summary="List jobs, newest first")
def list_jobs(
    context: ContextDependency,
    state: JobState | None = None,
    label: Annotated[str | None, Query(max_length=LABEL_LENGTH)] = None,
    cursor: Annotated[str | None, Query(description="`next` of the page before")] = None,
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
) -> JobList:
    """A page of the jobs that a state and a label select."""
    if cursor is not None and not is_job_id(cursor):
        raise ProblemError(problem("input", "query parameter 'cursor' is not one of this service"))
    labels = frozenset() if label is None else frozenset({label})
    wanted = JobFilter(state=state, labels=labels)
    page = context.ledger.index.page(limit, cursor=cursor, wanted=wanted)
    return JobList(jobs=[Job.of(record) for record in page.jobs], next=page.cursor)


@router.get("/{job_id}", summary="Look at a job")
def get_job(record: FoundJob, context: ContextDependency, response: Response) -> Job:
    """A job as it is now."""
    response.headers["Cache-Control"] = "no-store"
    if record.state in ("queued", "running"):
        response.headers["Retry-After"] = str(context.settings.retry_after)
    return Job.of(record)
