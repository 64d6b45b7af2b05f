"""Routes: batches of jobs."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import IO, Annotated, Any

import structlog
from fastapi import BackgroundTasks, Depends, Query, Response, status
from redis.exceptions import RedisError
from starlette.concurrency import run_in_threadpool

from meshcone.gates.formats.junit import to_junit
from meshcone.gates.formats.markdown import to_markdown
from meshcone.gates.formats.sarif import to_sarif
from meshcone.gates.results import GateRun
from service.api.batch_results import write_result
from service.api.batch_schemas import BATCHES_PATH, Batch, BatchList, batch_path
from service.api.context import Context, ContextDependency
from service.api.downloads import BYTES
from service.api.routes.jobs import CursorQuery, ProjectQuery, cursor_after, position_of
from service.api.routing import Absent, ResourceRouter
from service.api.schemas import JobList, ListedJob
from service.api.sender import ClaimDependency, SenderDependency
from service.api.submission.batch import accept_batch, read_batch
from service.problems import MEDIA_TYPE, ProblemError, problem
from worker.jobs.batches import BatchCounts, BatchRecord, carry_through
from worker.jobs.errors import TransitionRefusedError, UnknownBatchError, UnknownJobError
from worker.jobs.filters import JobFilter
from worker.jobs.identifiers import is_job_id
from worker.jobs.records import JobState, Verdict

logger = structlog.get_logger(__name__)

router = ResourceRouter(prefix=BATCHES_PATH, tags=["batches"])

_PROBLEM: dict[str, Any] = {
    "content": {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}}
}
_ACCEPTED: dict[int | str, dict[str, Any]] = {
    202: {
        "description": "the batch, whose jobs are queued or will be",
        "headers": {
            "Location": {"description": "where the batch is", "schema": {"type": "string"}},
            "Retry-After": {
                "description": "seconds after which to look at it",
                "schema": {"type": "integer"},
            },
        },
    },
}
_DOCUMENT: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {"application/json": {"schema": {"$ref": "#/components/schemas/BatchRequest"}}},
    }
}
_CANCELED: dict[int | str, dict[str, Any]] = {
    202: {"description": "the batch, whose jobs are canceled or will be"},
    409: {"description": "the batch has finished already", **_PROBLEM},
}
_NOT_FINISHED: dict[int | str, dict[str, Any]] = {
    409: {"description": "some of its jobs have not ended", **_PROBLEM}
}
_LIMIT = Query(ge=1, le=200)


def find_batch(batch_id: str, context: ContextDependency, sender: SenderDependency) -> BatchRecord:
    """The batch a path names, as a dependency.

    Raises:
        ProblemError: there is none, or none that the sender may know of; both are said in the
            same words.
    """
    if is_job_id(batch_id):
        with suppress(UnknownBatchError):
            found = context.batches.get(batch_id)
            if sender.view in (None, found.project):
                return found
    raise _unknown()


FoundBatch = Annotated[BatchRecord, Depends(find_batch)]


def finished_batch(record: FoundBatch) -> BatchRecord:
    """The same, if it has finished.

    Raises:
        ProblemError: it has not.
    """
    if record.finished is None:
        raise ProblemError(problem("not-finished", "some jobs of the batch have not ended"))
    return record


FinishedBatch = Annotated[BatchRecord, Depends(finished_batch)]


@router.post(
    "",
    status_code=status.HTTP_202_ACCEPTED,
    responses=_ACCEPTED,
    openapi_extra=_DOCUMENT,
    summary="Submit a batch of pairs",
)
async def submit_batch(
    claim: ClaimDependency,  # before the document: nothing is read of a request not let in
    document: Annotated[IO[bytes], Depends(read_batch, scope="function")],
    context: ContextDependency,
    sender: SenderDependency,
    response: Response,
    later: BackgroundTasks,
) -> Batch:
    """Queue many jobs at once; files are named by URL or by the hash they were sent under."""
    record = await run_in_threadpool(accept_batch, document, claim, sender, context)
    # Its jobs are entered after the answer; if this process dies, beside a worker.
    later.add_task(carry_through, record.id, context.batches, context.queue)
    response.headers["Location"] = batch_path(record.id)
    response.headers["Retry-After"] = str(context.settings.retry_after)
    return await run_in_threadpool(_accepted, record, context)


@router.get("", summary="List batches, newest first")
def list_batches(
    context: ContextDependency,
    sender: SenderDependency,
    project: ProjectQuery = None,
    cursor: CursorQuery = None,
    limit: Annotated[int, _LIMIT] = 50,
) -> BatchList:
    """A page of the batches, by the time they were sent."""
    if project is not None and sender.view not in (None, project):
        return BatchList(batches=[], next=None)
    page = context.batches.page(limit, cursor=position_of(cursor), project=sender.view or project)
    return BatchList(
        batches=[_shown(record, context) for record in page.batches],
        next=None if page.cursor is None else cursor_after(page.cursor),
    )


@router.get("/{batch_id}", summary="Look at a batch")
def get_batch(record: FoundBatch, context: ContextDependency, response: Response) -> Batch:
    """A batch as it is now, with its jobs by state and by verdict."""
    response.headers["Cache-Control"] = "no-store"
    if record.finished is None:
        response.headers["Retry-After"] = str(context.settings.retry_after)
    return _shown(record, context)


@router.get("/{batch_id}/jobs", summary="List the jobs of a batch")
def list_batch_jobs(
    record: FoundBatch,
    context: ContextDependency,
    state: JobState | Absent = None,
    verdict: Annotated[Verdict | Absent, Query(description="what the gates say")] = None,
    cursor: CursorQuery = None,
    limit: Annotated[int, _LIMIT] = 50,
) -> JobList:
    """A page of the batch's jobs, those of its last pairs first."""
    wanted = JobFilter(state=state, verdict=verdict, batch=record.id)
    page = context.ledger.index.page(limit, cursor=position_of(cursor), wanted=wanted)
    return JobList(
        jobs=[ListedJob.of(job, context.settings.result_ttl) for job in page.jobs],
        next=None if page.cursor is None else cursor_after(page.cursor),
    )


@router.post(
    "/{batch_id}/cancel",
    status_code=status.HTTP_202_ACCEPTED,
    responses=_CANCELED,
    summary="Cancel a batch",
)
def cancel_batch(record: FoundBatch, context: ContextDependency, later: BackgroundTasks) -> Batch:
    """Cancel its queued jobs, and ask those that run to stop; repeating it does no harm."""
    if not context.batches.request_cancel(record.id):
        raise ProblemError(problem("finished", "all jobs of the batch have ended"))
    later.add_task(carry_through, record.id, context.batches, context.queue)
    try:
        return _shown(context.batches.get(record.id), context)
    except UnknownBatchError:
        raise _unknown() from None


@router.delete(
    "/{batch_id}",
    status_code=status.HTTP_204_NO_CONTENT,
    responses=_NOT_FINISHED,
    summary="Delete a batch",
)
def delete_batch(record: FinishedBatch, context: ContextDependency) -> None:
    """Remove a batch that has finished, with its jobs; of their files those no other job has."""
    for job_id in context.batches.job_ids(record.id):
        with suppress(UnknownJobError, TransitionRefusedError):
            context.ledger.delete(job_id)  # housekeeping removes the files
    context.batches.forget(record.id)


@router.get(
    "/{batch_id}/result",
    response_model=GateRun,
    responses=_NOT_FINISHED,
    summary="Every verdict of a batch",
)
async def get_batch_result(record: FinishedBatch, context: ContextDependency) -> Response:
    """What `meshcone gate --json` writes of such a run, in the order of the pairs."""
    return await _written(record, context, _as_json, "application/json")


def _text(media_type: str, description: str) -> dict[int | str, dict[str, Any]]:
    return _file(media_type, description, {**BYTES, "contentMediaType": media_type})


def _file(
    media_type: str, description: str, schema: dict[str, Any]
) -> dict[int | str, dict[str, Any]]:
    content = {media_type: {"schema": schema}}
    return {200: {"description": description, "content": content}, **_NOT_FINISHED}


@router.get(
    "/{batch_id}/junit.xml",
    response_class=Response,
    responses=_text("application/xml", "a test suite for each pair, a test case for each bound"),
)
async def get_batch_junit(record: FinishedBatch, context: ContextDependency) -> Response:
    """The verdicts as JUnit XML."""
    return await _written(record, context, to_junit, "application/xml")


@router.get(
    "/{batch_id}/sarif.json",
    response_class=Response,
    responses=_file("application/sarif+json", "a SARIF 2.1.0 log", {"type": "object"}),
)
async def get_batch_sarif(record: FinishedBatch, context: ContextDependency) -> Response:
    """What did not pass, as SARIF 2.1.0."""
    return await _written(record, context, to_sarif, "application/sarif+json")


@router.get(
    "/{batch_id}/summary.md",
    response_class=Response,
    responses=_text("text/markdown", "the worst pairs, and what they did not pass"),
)
async def get_batch_summary(record: FinishedBatch, context: ContextDependency) -> Response:
    """A summary in GitHub's Markdown, for a pull request."""
    return await _written(record, context, to_markdown, "text/markdown")


async def _written(
    record: BatchRecord, context: Context, written: Callable[[GateRun], bytes], media_type: str
) -> Response:
    return Response(await write_result(record, context, written), media_type=media_type)


def _as_json(run: GateRun) -> bytes:
    return run.model_dump_json().encode()


def _shown(record: BatchRecord, context: Context) -> Batch:
    return Batch.of(record, context.batches.counts(record))


def _accepted(record: BatchRecord, context: Context) -> Batch:
    try:
        return _shown(record, context)
    except RedisError as error:
        # A client that is told of the outage instead would send the batch again.
        logger.warning(
            "batch accepted, its jobs not counted", batch_id=record.id, reason=str(error)
        )
        return Batch.of(record, BatchCounts.of_queued(record.pairs))


def _unknown() -> ProblemError:
    return ProblemError(problem("not-found", "there is no such batch"))
