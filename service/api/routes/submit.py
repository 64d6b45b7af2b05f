"""Route: submit a job."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated, Any

import structlog
from fastapi import Depends, Header, Request, Response, status
from redis.exceptions import RedisError
from starlette.concurrency import run_in_threadpool

from service.api.context import Context, ContextDependency
from service.api.routes.events import EventsDependency
from service.api.routing import Absent, ResourceRouter
from service.api.schemas import JOBS_PATH, Job, job_path
from service.api.sender import ClaimDependency, Sender, SenderDependency
from service.api.submission.acceptance import (
    accept,
    check_meshes,
    gather,
    made_before,
    require_signable,
)
from service.api.submission.form import SUBMISSION_FORM
from service.api.submission.parts import SubmittedForm
from service.api.submission.uploads import read_form
from service.problems import ProblemError, problem
from worker.jobs.errors import UnknownJobError
from worker.jobs.idempotency import Claim
from worker.jobs.records import JobRecord

logger = structlog.get_logger(__name__)

router = ResourceRouter(prefix=JOBS_PATH, tags=["jobs"])

LONGEST_WAIT = 30  # seconds; proxies give up on a silent answer after about a minute

_WAIT = re.compile(r'(?:^|,)\s*wait\s*=\s*"?(\d{1,9})"?\s*(?=[,;]|$)', re.IGNORECASE)


def _preferred_wait(
    request: Request,
    _prefer: Annotated[
        str | Absent,
        Header(
            alias="Prefer",
            description=f"`wait=N`: seconds to wait for the job's end, at most {LONGEST_WAIT}",
        ),
    ] = None,
) -> int | None:
    return preferred_wait(request.headers.getlist("Prefer"))  # each field line may have its own


_ANSWERS: dict[int | str, dict[str, Any]] = {
    200: {"description": "the job, which has ended: for `Prefer: wait`", "model": Job},
    202: {
        "description": "the job, which is queued",
        "headers": {
            "Location": {"description": "where the job is", "schema": {"type": "string"}},
            "Retry-After": {
                "description": "seconds after which to look at it",
                "schema": {"type": "integer"},
            },
        },
    },
}


@router.post(
    "",
    status_code=status.HTTP_202_ACCEPTED,
    response_model=Job,
    responses=_ANSWERS,
    openapi_extra=SUBMISSION_FORM,
    summary="Submit a mesh and its reference",
)
async def submit_job(
    claim: ClaimDependency,  # before the form: nothing is read of a request not let in
    form: Annotated[SubmittedForm, Depends(read_form)],
    context: ContextDependency,
    sender: SenderDependency,
    events: EventsDependency,
    response: Response,
    wait: Annotated[int | None, Depends(_preferred_wait)],
) -> Job:
    """Queue a refinement of `source` towards `reference`, or a measurement."""
    record = await _accept(form, claim, sender, context)
    if wait is not None:
        try:
            if await events.wait_for_end(record.id, wait):
                record = await run_in_threadpool(_after_wait, record.id, context)
                response.headers["Preference-Applied"] = f"wait={wait}"
        except RedisError as error:
            # It is accepted; a client that is told otherwise would send it again.
            logger.warning("not waited for", job_id=record.id, reason=str(error))
    response.headers["Location"] = job_path(record.id)
    if record.has_ended:
        response.status_code = status.HTTP_200_OK
    else:
        response.headers["Retry-After"] = str(context.settings.retry_after)
    return context.job(record)


def _after_wait(job_id: str, context: Context) -> JobRecord:
    try:
        return context.ledger.get(job_id)
    except UnknownJobError:
        raise ProblemError(problem("gone", "the job has been deleted meanwhile")) from None


async def _accept(
    form: SubmittedForm, claim: Claim | None, sender: Sender, context: Context
) -> JobRecord:
    require_signable(form.webhook, sender, context)
    submission = await run_in_threadpool(gather, form, sender, context)
    if claim is not None:
        made = await run_in_threadpool(made_before, submission, claim, context)
        if made is not None:
            return made
    if submission.is_complete and submission.size <= context.settings.precheck_bytes:
        await check_meshes(submission, context)
    return await run_in_threadpool(accept, submission, claim, sender, context)


def preferred_wait(headers: Sequence[str]) -> int | None:
    """Seconds a client would wait for the job's end (RFC 7240, section 4.3); None if it named none.

    What cannot be understood is ignored, as the RFC has it.
    """
    match = _WAIT.search(",".join(headers))
    return None if match is None else min(int(match[1]), LONGEST_WAIT)
