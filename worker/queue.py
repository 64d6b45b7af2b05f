"""The one queue between the front end and the workers. It carries job ids, nothing else."""

from __future__ import annotations

import socket
from typing import TYPE_CHECKING

from rq import Queue, Retry, worker_registration
from rq.serializers import JSONSerializer

if TYPE_CHECKING:
    from redis import Redis

    from worker.settings import WorkerSettings

TASK = "worker.task.run"
"""Import path of what a worker calls; the front end never imports it, nor the solver with it."""


class JobQueue:
    """RQ, with what we leave to it: order, delivery and noticing dead workers.

    Messages are JSON: RQ's default, pickle, lets whoever reaches the broker run code.
    """

    def __init__(self, settings: WorkerSettings, connection: Redis) -> None:
        self._settings = settings
        self.rq = Queue(settings.queue, connection=connection, serializer=JSONSerializer)

    def enqueue(self, job_id: str) -> None:
        """Have some worker run a job of the ledger."""
        settings = self._settings
        self.rq.enqueue(
            TASK,
            job_id,
            job_id=job_id,
            job_timeout=settings.job_timeout,
            result_ttl=settings.result_ttl,
            failure_ttl=settings.failure_ttl,
            description=f"refine {job_id}",
            # RQ's count only has to allow as many starts as the ledger does: an attempt
            # that dies before it reaches the ledger uses up one of RQ's alone.
            retry=Retry(max=settings.attempts + 1),
        )

    def worker_count(self) -> int:
        """Workers of this queue whose heartbeat has not run out."""
        return sum(self.rq.connection.exists(key) for key in self._worker_keys())

    def local_worker_pids(self) -> set[int]:
        """Process ids of those workers that run, or ran until a moment ago, on this machine."""
        workers = (self.rq.connection.hmget(key, "pid", "hostname") for key in self._worker_keys())
        here = socket.gethostname().encode()
        return {int(pid) for pid, host in workers if pid is not None and host == here}

    def _worker_keys(self) -> set[str]:
        return worker_registration.get_keys(queue=self.rq)
