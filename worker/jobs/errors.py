"""Why a step of the ledger, or of its batches, is not taken."""

from __future__ import annotations

from typing import Literal

from worker.jobs import step_scripts as steps
from worker.jobs.records import JobState


class UnknownJobError(LookupError):
    """The ledger has no job of that id."""


class TransitionRefusedError(Exception):
    """The job is not in the state, or not at the attempt, that the step starts from."""

    def __init__(self, job_id: str, state: str, attempt: int) -> None:
        super().__init__(f"job {job_id} is {state} at attempt {attempt}")
        self.state = state
        self.attempt = attempt


class CancelRequestedError(Exception):
    """Somebody has asked for the job to be canceled; its attempt is to stop."""


class TooNewError(Exception):
    """The job's options are newer than the worker that would begin it.

    Attributes:
        first: whether no worker has found so before.
    """

    def __init__(self, job_id: str, first: bool) -> None:
        super().__init__(f"job {job_id} has options newer than this worker")
        self.first = first


class QueueFullError(Exception):
    """As many jobs are queued as this installation lets wait."""


class KeyReusedError(Exception):
    """The request's key belongs to a job that was sent with something else."""


class UnknownBatchError(LookupError):
    """There is no batch of that id."""


class StagedJobsLostError(Exception):
    """What was staged has run out: the batch took too long to come."""


def accept(
    job_id: str, answer: int, state: JobState | Literal[""], attempt: int
) -> tuple[JobState, int]:
    """The state and attempt in a step's answer; raised, if it was not taken."""
    if state == "":
        raise UnknownJobError(job_id)
    if answer == steps.TOO_NEW:
        raise TooNewError(job_id, first=bool(attempt))
    if answer != steps.ACCEPTED:
        raise TransitionRefusedError(job_id, state, attempt)
    return state, attempt
