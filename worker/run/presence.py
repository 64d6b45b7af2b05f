"""A worker's entry among RQ's workers: what readiness, probes and `rq info` look at."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rq import Worker

if TYPE_CHECKING:
    from redis import Redis

    from worker.jobs.queue import JobQueue

BEAT_INTERVAL = 2.0  # seconds
TIMEOUT = 15  # seconds without a beat after which the worker is no longer there


class Presence:
    """Keeps the entry alive. RQ's worker is used for its entry alone: it runs no loop."""

    def __init__(self, queue: JobQueue, connection: Redis) -> None:
        self._connection = connection
        self._worker = Worker(
            [queue.rq], connection=connection, serializer=queue.rq.serializer, worker_ttl=TIMEOUT
        )
        self._beaten_at = float("-inf")

    def beat(self) -> None:
        """Say that the worker lives, unless it did so a moment ago."""
        now = time.monotonic()
        if now - self._beaten_at < BEAT_INTERVAL:
            return
        if not self._connection.exists(self._worker.key):  # at first, or after an outage
            self._worker.register_birth()
        self._worker.heartbeat(TIMEOUT)
        self._beaten_at = now

    def end(self) -> None:
        """Say that the worker is gone."""
        self._worker.register_death()
