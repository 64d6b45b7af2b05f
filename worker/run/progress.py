"""Carries the engine's progress to the ledger."""

from __future__ import annotations

import time
from contextlib import suppress

from redis.exceptions import RedisError

from meshcone.progress import Progress
from worker.jobs.ledger import Ledger
from worker.jobs.records import JobProgress

INTERVAL = 0.25  # seconds; more often than anyone looks, far less often than the engine reports


class ProgressReporter:
    """Writes an attempt's progress to the ledger, at most once per interval and stage.

    Calling it raises what :meth:`Ledger.report_progress` raises: an attempt that no longer
    owns its job is stopped there.
    """

    def __init__(self, ledger: Ledger, job_id: str, attempt: int) -> None:
        self._ledger = ledger
        self._job_id = job_id
        self._attempt = attempt
        self._written_at = -INTERVAL
        self._stage: str | None = None

    def __call__(self, progress: Progress) -> None:
        """Note a moment of the refinement."""
        now = time.monotonic()
        if progress.stage == self._stage and now - self._written_at < INTERVAL:
            return
        self._stage, self._written_at = progress.stage, now
        # A broker that is away, or takes nothing in, costs a line of progress, not the job.
        with suppress(RedisError):
            self._ledger.report_progress(self._job_id, self._attempt, JobProgress.of(progress))
