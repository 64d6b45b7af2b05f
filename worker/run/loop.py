"""What a worker does, over and over: take a message, run its job in a horse, see to its end."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from functools import partial
from typing import TYPE_CHECKING

import structlog
from redis.exceptions import RedisError

from worker.broker.patience import OutageLog, patiently
from worker.jobs.ledger import Ledger, TooNewError, TransitionRefusedError, UnknownJobError
from worker.run import tracing
from worker.run.attendance import Ending, attend
from worker.run.horse import Horse
from worker.run.memory_watch import MemoryWatch
from worker.run.settlement import leave_to_newer_worker, settle

if TYPE_CHECKING:
    from worker.jobs.heartbeats import Heartbeats
    from worker.jobs.queue import Delivery, JobQueue
    from worker.jobs.records import JobRecord
    from worker.run.presence import Presence
    from worker.run.stopping import StopRequest
    from worker.settings import WorkerSettings

logger = logging.getLogger(__name__)

_TAKE_TIMEOUT = 1  # seconds; how late an idle worker notices that it is to stop
_OUTAGE_PAUSE = 0.5  # seconds between two tries to reach the broker


class WorkerLoop:
    """One worker: one queue, one job at a time.

    Args:
        settings: the installation's.
        ledger: the owner of every job's state.
        queue: where the messages come from.
        heartbeats: kept up for the job in hand.
        presence: kept up for the worker.
        stop: looked at between two steps.
        run: what a horse does with a job and an attempt; returns its exit code.
        keep: called often, to keep up what else belongs to the worker.
    """

    def __init__(
        self,
        settings: WorkerSettings,
        *,
        ledger: Ledger,
        queue: JobQueue,
        heartbeats: Heartbeats,
        presence: Presence,
        stop: StopRequest,
        run: Callable[[str, int], int],
        keep: Callable[[], None],
    ) -> None:
        self._settings = settings
        self._ledger = ledger
        self._queue = queue
        self._heartbeats = heartbeats
        self._presence = presence
        self._stop = stop
        self._run = run
        self._keep = keep

    def work(self) -> None:
        """Work until asked to stop; a broker that is away is waited for."""
        outage = OutageLog()
        while not self._stop.made:
            self._keep()
            try:
                self._presence.beat()
                delivery = self._queue.take(_TAKE_TIMEOUT)
                outage.is_back()
                if delivery is not None:
                    self._accept(delivery)
            except RedisError as error:
                outage.is_away(error)
                time.sleep(_OUTAGE_PAUSE)
        with suppress(RedisError):
            self._presence.end()

    def _accept(self, delivery: Delivery) -> None:
        try:
            attempt = self._ledger.begin(delivery.job_id)
        except (TransitionRefusedError, UnknownJobError) as refusal:
            logger.info("message dropped: %s", refusal)  # it came twice, or was canceled
            self._queue.discard(delivery)
            return
        except TooNewError as found:
            leave_to_newer_worker(self._queue, delivery, found)
            return
        # From here on the heartbeat keeps the job, not the message; one that cannot be
        # discarded now is found by the reconciler.
        with suppress(RedisError):
            self._queue.discard(delivery)
        self._attempt(delivery.job_id, attempt)

    def _attempt(self, job_id: str, attempt: int) -> None:
        began = datetime.now(UTC)
        with structlog.contextvars.bound_contextvars(job_id=job_id, attempt=attempt):
            self._see_through(job_id, attempt)
            if tracing.is_wanted():
                with suppress(RedisError, UnknownJobError):
                    tracing.export_attempt(self._ledger.get(job_id), attempt, began)

    def _see_through(self, job_id: str, attempt: int) -> None:
        with suppress(RedisError):  # before the fork, which takes a while on a busy machine
            self._heartbeats.beat(job_id, attempt)
        memory = MemoryWatch.start(self._settings.job_memory_bytes)
        horse = Horse.start(partial(self._run, job_id, attempt))
        logger.info("attempt runs in process %d", horse.pid)
        ending = attend(
            horse,
            job_id,
            attempt,
            heartbeats=self._heartbeats,
            stop=self._stop,
            time_limit=self._settings.job_timeout,
            keep=self._keep_up,
        )
        step = partial(self._settle, job_id, attempt, ending, memory.explains(ending.death))
        try:
            patiently(step)
        except (TransitionRefusedError, UnknownJobError) as refusal:
            logger.warning("left alone: %s", refusal)

    def _settle(self, job_id: str, attempt: int, ending: Ending, was_out_of_memory: bool) -> None:
        record = self._record(job_id, attempt)
        if record is None:
            return
        state = settle(
            self._ledger,
            record,
            ending,
            attempts=self._settings.attempts,
            was_out_of_memory=was_out_of_memory,
        )
        if state is not None:
            logger.info("attempt ended, the job is now %s", state)
        if state == "queued":
            self._queue.enqueue(job_id)

    def _record(self, job_id: str, attempt: int) -> JobRecord | None:
        record = self._ledger.get(job_id)
        return record if (record.state, record.attempt) == ("running", attempt) else None

    def _keep_up(self) -> None:
        self._keep()
        with suppress(RedisError):
            self._presence.beat()
