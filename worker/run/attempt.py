"""One attempt of a job, from its message to the ledger's last word: begin, horse, settle."""

from __future__ import annotations

import logging
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from typing import TYPE_CHECKING

import structlog
from redis.exceptions import RedisError

from meshcone.scratch import remove_orphans, scratch, work_in
from meshcone.settings import load_settings
from meshcone.threads import use_one_thread
from worker.broker.connections import connect_bytes, connect_text
from worker.broker.patience import patiently
from worker.jobs.errors import TooNewError, TransitionRefusedError, UnknownJobError
from worker.jobs.heartbeats import Heartbeats
from worker.jobs.ledger import Ledger
from worker.jobs.queue import JobQueue
from worker.run import tracing
from worker.run.attendance import attend
from worker.run.horse import Horse
from worker.run.memory_watch import MemoryWatch
from worker.run.settlement import DISK_FULL, leave_to_newer_worker, settle
from worker.run.stopping import StopRequest
from worker.settings import WorkerSettings

if TYPE_CHECKING:
    from pathlib import Path

    from worker.jobs.records import JobState
    from worker.run.attendance import Ending

logger = logging.getLogger(__name__)


def run(job_id: str) -> JobState | None:
    """Run the next attempt of a job: the function that messages name.

    RQ's own ``rq worker`` calls it in its horse, as ``rq worker -S rq.serializers.JSONSerializer``.
    Our worker does the same without the horse between (:mod:`worker.run.worker`).

    Returns:
        The job's state afterwards; None if there was nothing to do for it.

    Raises:
        InputError: the environment's settings cannot be used.
        RedisError: the broker cannot be reached; the job is not lost.
    """
    use_one_thread()
    import worker.run.task

    remove_orphans()
    settings = load_settings(WorkerSettings)
    url = settings.required_redis_url()
    client = connect_text(url)
    return Attempts(
        settings,
        ledger=Ledger(client),
        queue=JobQueue(settings, connect_bytes(url)),
        heartbeats=Heartbeats(client, settings.heartbeat_timeout),
        stop=StopRequest(settings.stop_grace),
        work=worker.run.task.run,
    ).run(job_id)


@dataclass(frozen=True)
class Attempts:
    """What a worker needs for one attempt after another.

    Attributes:
        settings: the installation's.
        ledger: the owner of every job's state.
        queue: where a job goes that is to be tried again.
        heartbeats: kept up for the job in hand.
        stop: what ends an attempt early.
        work: what a horse does with a job and an attempt; returns its exit code.
    """

    settings: WorkerSettings
    ledger: Ledger
    queue: JobQueue
    heartbeats: Heartbeats
    stop: StopRequest
    work: Callable[[str, int], int]

    def run(self, job_id: str, keep: Callable[[], None] = lambda: None) -> JobState | None:
        """Begin a job, have a horse work on it, and see to its end.

        Args:
            job_id: the job.
            keep: called every second, for what the worker has to keep up besides.

        Returns:
            The job's state afterwards; None if there was nothing to do for it.

        Raises:
            RedisError: the broker could not be reached, at the beginning or for a minute at the
                end. The reconciler finds the job.
        """
        self.queue.release()  # there is room for a message where this one was
        try:
            attempt = self.ledger.begin(job_id)
        except (TransitionRefusedError, UnknownJobError) as refusal:
            logger.info("message dropped: %s", refusal)  # it came twice, or was canceled
            return None
        except TooNewError as found:
            leave_to_newer_worker(found)
            return None
        began = datetime.now(UTC)
        with structlog.contextvars.bound_contextvars(job_id=job_id, attempt=attempt):
            state = self._see_through(job_id, attempt, keep)
            if tracing.is_wanted():
                with suppress(RedisError, UnknownJobError):
                    tracing.export_attempt(self.ledger.get(job_id), attempt, began)
        return state

    def _see_through(self, job_id: str, attempt: int, keep: Callable[[], None]) -> JobState | None:
        with suppress(RedisError):  # before the fork, which takes a while on a busy machine
            self.heartbeats.beat(job_id, attempt)
        memory = MemoryWatch.start(self.settings.job_memory_bytes)
        with scratch() as place:
            horse = Horse.start(partial(self._work_in, place, job_id, attempt))
            logger.info("attempt runs in process %d", horse.pid)
            ending = attend(
                horse,
                job_id,
                attempt,
                heartbeats=self.heartbeats,
                stop=self.stop,
                time_limit=self.settings.job_timeout,
                keep=keep,
            )
        step = partial(self._settle, job_id, attempt, ending, memory.explains(ending.death))
        try:
            return patiently(step)
        except (TransitionRefusedError, UnknownJobError) as refusal:
            logger.warning("left alone: %s", refusal)
            return None

    def _work_in(self, place: Path | None, job_id: str, attempt: int) -> int:
        work_in(place)
        return self.work(job_id, attempt)

    def _settle(
        self, job_id: str, attempt: int, ending: Ending, was_out_of_memory: bool
    ) -> JobState:
        record = self.ledger.get(job_id)
        if (record.state, record.attempt) != ("running", attempt):
            return record.state  # its horse has settled it
        state = settle(
            self.ledger,
            record,
            ending,
            attempts=self.settings.attempts,
            was_out_of_memory=was_out_of_memory,
        )
        if state is None:
            return record.state
        logger.info("attempt ended, the job is now %s", state)
        # Where the disk is full another attempt would end at once: the reconciler sends that one.
        if state == "queued" and ending.death.code != DISK_FULL:
            self.queue.enqueue(job_id)
        return state
