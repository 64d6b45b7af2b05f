"""Removes what has expired: files of old jobs, then their records."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING

from redis.exceptions import OutOfMemoryError

from worker.jobs.errors import TransitionRefusedError, UnknownJobError
from worker.jobs.ledger import Ledger
from worker.jobs.records import FINAL_STATES

if TYPE_CHECKING:
    from worker.jobs.batches import Batches
    from worker.jobs.queue import JobQueue
    from worker.settings import WorkerSettings
    from worker.storage.blobs import BlobStore

logger = logging.getLogger(__name__)

_PLACED_AT_ONCE = 100  # jobs; the broker does nothing else meanwhile, for some milliseconds
_LOOKS = 5  # at so many jobs, each time


class Housekeeper:
    """What an installation forgets, and when. All of it can be interrupted and repeated."""

    def __init__(
        self,
        settings: WorkerSettings,
        *,
        ledger: Ledger,
        batches: Batches,
        queue: JobQueue,
        blobs: BlobStore,
    ) -> None:
        self._settings = settings
        self._ledger = ledger
        self._batches = batches
        self._queue = queue
        self._blobs = blobs

    def tidy(self) -> None:
        """Expire, delete and sweep what is due."""
        self._queue.forget_dead_workers()
        self._place()
        for job_id in self._due():
            try:
                self._ledger.expire(job_id)
            except (TransitionRefusedError, UnknownJobError) as refusal:
                logger.info("not expired: %s", refusal)
        for job_id in self._forgettable():
            try:
                self._ledger.delete(job_id)
            except (TransitionRefusedError, UnknownJobError) as refusal:
                logger.info("not deleted: %s", refusal)
        self._forget_batches()
        removed = self._blobs.sweep()
        if removed:
            logger.info("removed %d files nobody needs", removed)
        unfinished = self._blobs.clear_unfinished()
        if unfinished:
            logger.info("removed %d files that nobody finished writing", unfinished)

    def _place(self) -> None:
        try:
            for _ in range(_LOOKS):
                while self._ledger.index.place_by_project(_PLACED_AT_ONCE):
                    pass  # the first look after an upgrade goes through all jobs
        except OutOfMemoryError as error:  # it takes memory, of which what follows makes some free
            logger.warning("jobs are put in their places later: %s", error)

    def _forget_batches(self) -> None:
        """Forget batches without jobs when those they were sent with would be forgotten."""
        kept = self._settings.result_ttl, self._settings.record_ttl
        if not all(kept):
            return
        for batch in self._batches.jobless(max(0.0, time.time() - sum(kept))):
            self._batches.forget(batch.id)

    def _due(self) -> list[str]:
        if not self._settings.result_ttl:
            return []
        return [
            job_id
            for state in FINAL_STATES
            for job_id in self._ledger.index.in_state_for(state, self._settings.result_ttl)
        ]

    def _forgettable(self) -> list[str]:
        if not self._settings.record_ttl:
            return []
        return self._ledger.index.in_state_for("expired", self._settings.record_ttl)
