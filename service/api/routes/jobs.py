"""Routes: look after jobs."""

from __future__ import annotations

import base64
import binascii
import uuid
from typing import Annotated, Any

from fastapi import BackgroundTasks, Depends, Query, Response, status

from meshcone.relative_names import NAME_LENGTH
from service.api.context import ContextDependency
from service.api.request_schemas import LABEL_LENGTH
from service.api.routing import Absent, ResourceRouter
from service.api.schemas import JOBS_PATH, Deletion, Job, JobList, ListedJob
from service.api.sender import SenderDependency
from service.api.submission.parts import MAX_LABELS
from service.problems import MEDIA_TYPE, ProblemError, problem
from worker.jobs.errors import TransitionRefusedError, UnknownJobError
from worker.jobs.filters import JobFilter
from worker.jobs.identifiers import is_job_id
from worker.jobs.index import Order
from worker.jobs.records import JobRecord, JobState, Verdict

router = ResourceRouter(prefix=JOBS_PATH, tags=["jobs"])

_CONFLICT: dict[str, Any] = {
    "content": {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}}
}
_CANCELED: dict[int | str, dict[str, Any]] = {
    200: {"description": "the job is canceled"},
    202: {"description": "the job runs, is asked to stop and will end as canceled", "model": Job},
    409: {"description": "the job has succeeded or failed already", **_CONFLICT},
}
_DELETED: dict[int | str, dict[str, Any]] = {
    409: {"description": "the job is queued or running: cancel it first", **_CONFLICT}
}

LabelQuery = Annotated[
    list[Annotated[str, Query(max_length=LABEL_LENGTH)]],
    Query(max_length=MAX_LABELS, description="repeated: jobs that have all of them"),
]

NameQuery = Annotated[
    str,
    Query(
        max_length=NAME_LENGTH,
        description="part of the name of a file that was sent, or of a label, in any case",
    ),
]

ProjectQuery = Annotated[
    str | Absent,
    Query(max_length=63, description="whose jobs; a key without the scope admin has one project's"),
]
OrderQuery = Annotated[
    Order,
    Query(
        description="`failures`: jobs whose gates failed, jobs that failed and jobs that were not "
        "tested come before the others"
    ),
]
CursorQuery = Annotated[str | Absent, Query(description="`next` of the page before")]


def find_job(job_id: str, context: ContextDependency, sender: SenderDependency) -> JobRecord:
    """The job a path names, as a dependency.

    Raises:
        ProblemError: there is none, or none that the sender may know of; both are said in the
            same words after the same work.
    """
    if is_job_id(job_id):
        project = context.ledger.index.project_of(job_id)
        try:
            if project is not None and sender.view in (None, project):
                return context.ledger.get(job_id)
        except UnknownJobError:
            pass
    raise _unknown()


FoundJob = Annotated[JobRecord, Depends(find_job)]


@router.get("", summary="List jobs, newest first")
def list_jobs(
    context: ContextDependency,
    sender: SenderDependency,
    state: JobState | Absent = None,
    label: LabelQuery = [],  # noqa: B006 - the framework copies it
    verdict: Annotated[Verdict | Absent, Query(description="what the gates say")] = None,
    name: NameQuery = "",
    project: ProjectQuery = None,
    order: OrderQuery = "newest",
    cursor: CursorQuery = None,
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
) -> JobList:
    """A page of the jobs that state, labels, verdict and name select.

    They are listed by the time they were sent, so that none moves while pages are turned. In the
    order `failures` a job moves when it ends.
    """
    if project is not None and sender.view not in (None, project):
        return JobList(jobs=[], next=None)
    wanted = JobFilter(
        state=state,
        verdict=verdict,
        labels=frozenset(label),
        name=name,
        project=sender.view or project,
    )
    index = context.ledger.index
    listing = index.page if order == "newest" else index.failures_first
    page = listing(limit, cursor=position_of(cursor, order), wanted=wanted)
    following = None if page.cursor is None else cursor_after(page.cursor)
    return JobList(
        jobs=[ListedJob.of(record, context.settings.result_ttl) for record in page.jobs],
        next=following,
    )


@router.get("/{job_id}", summary="Look at a job")
def get_job(record: FoundJob, context: ContextDependency, response: Response) -> Job:
    """A job as it is now."""
    response.headers["Cache-Control"] = "no-store"
    if not record.has_ended:
        response.headers["Retry-After"] = str(context.settings.retry_after)
    return context.job(record)


@router.post("/{job_id}/cancel", responses=_CANCELED, summary="Cancel a job")
def cancel_job(record: FoundJob, context: ContextDependency, response: Response) -> Job:
    """Cancel a queued job at once, or ask a running one to stop; repeating it does no harm."""
    try:
        state = context.ledger.cancel(record.id)
        now = context.ledger.get(record.id)
    except TransitionRefusedError as refusal:
        raise ProblemError(problem("finished", f"the job has {refusal.state}")) from None
    except UnknownJobError:
        raise _unknown() from None
    if state == "running":
        response.status_code = status.HTTP_202_ACCEPTED
        response.headers["Retry-After"] = str(context.settings.retry_after)
    return context.job(now)


@router.delete("", summary="Delete the jobs of a label")
def delete_jobs(
    context: ContextDependency,
    sender: SenderDependency,
    later: BackgroundTasks,
    label: Annotated[LabelQuery, Query(min_length=1)],
    cursor: CursorQuery = None,
    limit: Annotated[int, Query(ge=1, le=200, description="jobs to look at")] = 200,
) -> Deletion:
    """Remove the jobs that have all of the labels and have ended, a page of them at a time.

    Those that are queued or running stay: cancel them first.
    """
    wanted = JobFilter(labels=frozenset(label), project=sender.view)
    page = context.ledger.index.page(limit, cursor=position_of(cursor), wanted=wanted)
    deleted = not_finished = 0
    for record in page.jobs:
        try:
            later.add_task(context.blobs.remove, context.ledger.delete(record.id))
        except TransitionRefusedError:
            not_finished += 1
        except UnknownJobError:
            continue  # somebody else has deleted it meanwhile
        else:
            deleted += 1
    following = None if page.cursor is None else cursor_after(page.cursor)
    return Deletion(deleted=deleted, not_finished=not_finished, next=following)


@router.delete(
    "/{job_id}",
    status_code=status.HTTP_204_NO_CONTENT,
    responses=_DELETED,
    summary="Delete a job",
)
def delete_job(record: FoundJob, context: ContextDependency, later: BackgroundTasks) -> None:
    """Remove a job that has ended, with the files that no other job has."""
    try:
        unneeded = context.ledger.delete(record.id)
    except TransitionRefusedError as refusal:
        raise ProblemError(
            problem("not-finished", f"the job is {refusal.state}: cancel it first")
        ) from None
    except UnknownJobError:
        raise _unknown() from None
    # A file store can be slow; what is not removed now, housekeeping removes.
    later.add_task(context.blobs.remove, unneeded)


def position_of(cursor: str | None, order: Order = "newest") -> str | None:
    """The place after which a page begins.

    Raises:
        ProblemError: the cursor is not one of this service, or of another order.
    """
    after = None if cursor is None else place_before(cursor)
    if cursor is not None and (after is None or (":" in after) != (order == "failures")):
        raise ProblemError(
            problem("input", "query parameter 'cursor' is not from this list in this order")
        )
    return after


def _unknown() -> ProblemError:
    return ProblemError(problem("not-found", "there is no such job"))


def cursor_after(place: str) -> str:
    """The cursor of the jobs listed after a place, as :class:`JobPage` tells it."""
    rank, _, job_id = place.rpartition(":")
    data = (bytes([int(rank)]) if rank else b"") + uuid.UUID(job_id).bytes
    return base64.urlsafe_b64encode(data).rstrip(b"=").decode()


def place_before(cursor: str) -> str | None:
    """The place a cursor was made of; None if this service did not make it."""
    try:
        data = base64.urlsafe_b64decode(f"{cursor}==")
        job_id = str(uuid.UUID(bytes=data[-16:]))
    except (binascii.Error, ValueError):
        return None
    rank = data[:-16]
    place = f"{rank[0]}:{job_id}" if rank else job_id
    return place if is_job_id(job_id) and cursor_after(place) == cursor else None
