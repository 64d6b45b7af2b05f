"""Records in the ledger what a work horse could not record itself."""

from __future__ import annotations

import logging
from datetime import UTC, datetime
from types import TracebackType
from typing import TYPE_CHECKING, Any

from obstore.exceptions import BaseError as BlobStoreError
from redis.exceptions import RedisError
from rq.exceptions import AbandonedJobError

from meshcone.errors import InternalError, SolveTimeoutError
from worker.ledger import Ledger, TransitionRefusedError, UnknownJobError
from worker.records import JobError, JobRecord

if TYPE_CHECKING:
    from rq.job import Job

logger = logging.getLogger(__name__)

TIMEOUT_MESSAGE = "the job took longer than this installation allows (MESHCONE_JOB_TIMEOUT)"

_WORTH_ANOTHER_TRY = (AbandonedJobError, RedisError, BlobStoreError)


def give_up_attempt(ledger: Ledger, record: JobRecord, attempts: int) -> bool:
    """Queue a running job again, or fail it if it was its last attempt.

    Returns:
        Whether it is queued.

    Raises:
        TransitionRefusedError: the job has moved on.
    """
    counted = record.attempt - record.handed_back
    if counted < attempts:
        return ledger.retry(record.id, record.attempt) == "queued"
    error = InternalError(f"the job was interrupted {counted} times; it is not tried again")
    ledger.fail(record.id, record.attempt, JobError.of(error))
    return False


class FailureRecorder:
    """RQ's hooks for jobs that ended badly.

    RQ asks them before it decides on a retry, so they also settle that decision: RQ runs
    the job again if, and only if, the ledger has queued it.
    """

    def __init__(self, ledger: Ledger, attempts: int) -> None:
        self._ledger = ledger
        self._attempts = attempts

    def on_exception(
        self,
        job: Job,
        kind: type[BaseException],
        _error: BaseException,
        _traceback: TracebackType | None,
    ) -> None:
        """An exception left the task, or a job's worker was found dead (RQ's exception handler).

        Not every failure is worth another attempt: a fault in the engine would only repeat.
        """
        if issubclass(kind, _WORTH_ANOTHER_TRY):
            self._give_up_attempt(job)
            return
        # RQ has logged the traceback; the sender is not to see it.
        self._fail(job, InternalError("an unexpected error in the service; it has been logged"))

    def on_killed_horse(self, job: Job, _pid: int, _status: int, _usage: Any) -> None:
        """A work horse was killed, by the kernel for its memory or by RQ for its time."""
        if job.started_at is not None and job.timeout:
            age = (datetime.now(UTC) - job.started_at).total_seconds()
            if age > job.timeout:
                self._fail(
                    job,
                    SolveTimeoutError(TIMEOUT_MESSAGE),
                )
                return
        self._give_up_attempt(job)

    def _give_up_attempt(self, job: Job) -> None:
        record = self._running(job)
        if record is None:
            return
        try:
            queued = give_up_attempt(self._ledger, record, self._attempts)
        except TransitionRefusedError as refusal:
            logger.warning("left alone: %s", refusal)
            queued = False
        if not queued:
            job.retries_left = 0

    def _fail(self, job: Job, error: InternalError | SolveTimeoutError) -> None:
        job.retries_left = 0
        record = self._running(job)
        if record is None:
            return
        try:
            self._ledger.fail(record.id, record.attempt, JobError.of(error))
        except TransitionRefusedError as refusal:
            logger.warning("left alone: %s", refusal)

    def _running(self, job: Job) -> JobRecord | None:
        try:
            record = self._ledger.get(job.id)
        except UnknownJobError:
            job.retries_left = 0
            return None
        # A job that is still queued died on its way to the task: RQ's own retry is right.
        return record if record.state == "running" else None
