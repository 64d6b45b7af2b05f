"""Records in the ledger how an attempt ended that could not do so itself."""

from __future__ import annotations

import logging
import os
import signal
from typing import TYPE_CHECKING

from meshcone.errors import (
    CrashError,
    InternalError,
    MeshConeError,
    OutOfMemoryError,
    SolveTimeoutError,
)
from worker.jobs.errors import TooNewError
from worker.jobs.ledger import Ledger
from worker.jobs.records import AttemptRecord, JobError, JobRecord, JobState
from worker.run.attendance import Cause, Ending

if TYPE_CHECKING:
    from worker.run.horse import Death

logger = logging.getLogger(__name__)

DISK_FULL = os.EX_CANTCREAT
"""A horse's exit code where its files find no room."""

TIMEOUT_MESSAGE = "the job took longer than this installation allows (MESHCONE_JOB_TIMEOUT)"
MEMORY_MESSAGE = "the job needs more memory than this installation allows"


def settle(
    ledger: Ledger, record: JobRecord, ending: Ending, *, attempts: int, was_out_of_memory: bool
) -> JobState | None:
    """Take the ledger's step that follows from how a horse ended.

    Args:
        ledger: where the job is.
        record: the job, running at the attempt that ended.
        ending: how it ended.
        attempts: how often a job is started at most.
        was_out_of_memory: whether a lack of memory is the likely cause of a death.

    Returns:
        The job's state after it; None if the horse, or somebody else, has settled it.

    Raises:
        TransitionRefusedError, UnknownJobError: the job has moved on.
    """
    if ending.cause is Cause.LOST:
        return None
    if ending.cause is Cause.CANCELED:
        ledger.end_canceled(record.id, record.attempt)
        return "canceled"
    if ending.cause is Cause.STOPPED:
        return ledger.hand_back(record.id, record.attempt)
    if ending.cause is Cause.OVERTIME:
        return _fail(ledger, record, SolveTimeoutError(TIMEOUT_MESSAGE))
    if ending.death.code == os.EX_OK:
        return None
    if ending.death.code == DISK_FULL:
        logger.warning(
            "job %s waits: the disk of the file store or of temporary files is full", record.id
        )
        return ledger.hand_back(record.id, record.attempt)
    if ending.death.signal == signal.SIGXCPU:  # see worker.run.sandbox
        return _fail(ledger, record, SolveTimeoutError(TIMEOUT_MESSAGE))
    logger.warning("the horse of job %s died: %s", record.id, _words(ending.death))
    return give_up_attempt(ledger, record, attempts, _reason(ending.death, was_out_of_memory))


def leave_to_newer_worker(found: TooNewError) -> None:
    """Leave a job, which stays queued, to a worker that knows its options.

    Its message is not sent on: this worker would take it again at once. The reconciler finds
    the job without one and sends another, so it is offered every few seconds. The log says so
    at the first time only.
    """
    level = logging.WARNING if found.first else logging.DEBUG
    logger.log(level, "%s; it waits for a newer one: upgrade the workers", found)


def give_up_attempt(
    ledger: Ledger, record: JobRecord | AttemptRecord, attempts: int, reason: MeshConeError
) -> JobState:
    """Queue a running job again, or fail it for a reason if that was its last attempt.

    Raises:
        TransitionRefusedError, UnknownJobError: the job has moved on.
    """
    if record.attempt - record.handed_back < attempts:
        return ledger.retry(record.id, record.attempt)
    return _fail(ledger, record, reason)


def lost_worker(record: JobRecord | AttemptRecord) -> CrashError:
    """The reason where nothing is left that could give one."""
    return CrashError(f"the job's worker died {_times(record)}; it is not tried again")


def _reason(death: Death, was_out_of_memory: bool) -> MeshConeError:
    if was_out_of_memory:
        return OutOfMemoryError(f"{MEMORY_MESSAGE}; its process {_words(death)}")
    if death.code == os.EX_TEMPFAIL:
        return InternalError("broker or file store failed during every attempt of the job")
    return CrashError(f"the process of the job {_words(death)} in its last attempt")


def _words(death: Death) -> str:
    if death.signal is not None:
        return f"was ended by {death.signal.name}"
    return f"exited with code {death.code}"


def _times(record: JobRecord | AttemptRecord) -> str:
    times = record.attempt - record.handed_back
    return "during its only attempt" if times == 1 else f"in each of {times} attempts"


def _fail(ledger: Ledger, record: JobRecord | AttemptRecord, reason: MeshConeError) -> JobState:
    return ledger.fail(record.id, record.attempt, JobError.of(reason))
