"""The worker: RQ's, but for how it runs a job and how long it bears with a broker that is away.

RQ's loop, list of workers, commands, ``rq info``, ``rq suspend`` and ``rq resume`` are as they
come. A job is run by :class:`worker.run.attempt.Attempts`: RQ would notice a death after minutes,
let a horse outlive its worker, and fail what a stopping worker has in hand.
"""

from __future__ import annotations

import logging
import signal
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from redis.exceptions import RedisError
from rq import Queue, Worker
from rq.exceptions import StopRequested
from rq.worker import WorkerStatus

from worker.broker.patience import OutageLog
from worker.jobs.errors import TransitionRefusedError, UnknownJobError
from worker.jobs.queue import job_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

    from redis import Redis
    from redis.client import Pipeline
    from rq.executions import Execution
    from rq.job import Job

    from worker.run.attempt import Attempts

logger = logging.getLogger(__name__)

TIMEOUT = 15  # seconds without a heartbeat after which the worker is no longer there
_BEAT_INTERVAL = 2.0  # seconds
_LOOK_INTERVAL = 1  # seconds; how late an idle worker notices that it is to stop
_OUTAGE_PAUSE = 0.5  # seconds between two tries at a broker that refuses


class MeshWorker(Worker):
    """One worker: one queue, one job at a time.

    Args:
        attempts: how a job is run.
        connection: of RQ's own, whose replies are bytes.
        keep: called often, to keep up what else belongs to the worker.
    """

    exponential_backoff_factor = 1.0  # a broker that is back is noticed within a second

    def __init__(self, attempts: Attempts, connection: Redis, keep: Callable[[], None]) -> None:
        queue = attempts.queue.rq
        super().__init__(
            [queue], connection=connection, serializer=queue.serializer, worker_ttl=TIMEOUT
        )
        self._attempts = attempts
        self._keep = keep
        self._beaten_at = float("-inf")

    def execute_job(self, job: Job, queue: Queue) -> None:
        """Run an attempt of the job that a message is about; never raises for a broker."""
        self._state = WorkerStatus.BUSY
        execution: Execution | None = None
        with suppress(RedisError):  # for RQ's tools to show; the ledger decides
            execution = self.prepare_execution(job)
            self.prepare_job_execution(job, remove_from_intermediate_queue=True)

        def keep() -> None:
            beaten_at = self._beaten_at
            self.heartbeat()
            if execution is not None and self._beaten_at != beaten_at:
                with suppress(RedisError):
                    self.maintain_heartbeats(job, execution)

        try:
            self._attempts.run(job_of(job.id), keep)
        except RedisError as error:
            logger.error("the broker failed under a job, which is found again: %s", error)
        with suppress(RedisError), self.connection.pipeline() as pipeline:
            self.cleanup_execution(job, pipeline, execution)
            pipeline.delete(job.key)
            pipeline.lrem(queue.intermediate_queue_key, 0, job.id)
            pipeline.execute()
        self.executions.clear()

    def dequeue_job_and_maintain_ttl(
        self, timeout: int | None, max_idle_time: int | None = None
    ) -> tuple[Job, Queue] | None:
        """The next message; None when the worker is to stop."""
        outage = OutageLog()
        while not self._stop_requested:
            try:
                taken = super().dequeue_job_and_maintain_ttl(
                    timeout, max_idle_time or _LOOK_INTERVAL
                )
            except RedisError as error:  # RQ waits for a connection, not for a broker that refuses
                outage.is_away(error)
                time.sleep(_OUTAGE_PAUSE)
                continue
            outage.is_back()
            if taken is not None:
                return taken
            self.check_for_suspension(burst=False)
        return None

    def heartbeat(
        self,
        timeout: int | None = None,  # noqa: ARG002 - the same for all
        pipeline: Pipeline | None = None,
    ) -> None:
        """Say that the worker lives, unless it did so a moment ago."""
        self._keep()
        if pipeline is not None:
            super().heartbeat(TIMEOUT, pipeline)
            return
        if time.monotonic() - self._beaten_at < _BEAT_INTERVAL:
            return
        try:
            if not self.connection.hexists(self.key, "birth"):  # it ran out during an outage
                self.connection.delete(self.key)
                self.register_birth()  # type: ignore[no-untyped-call] # RQ's
                super().set_state(self._state)
            super().heartbeat(TIMEOUT)
        except RedisError:
            if self._stop_requested and self.get_state() != WorkerStatus.BUSY:
                raise StopRequested from None  # RQ would wait for the broker first
            return
        self._beaten_at = time.monotonic()

    def set_state(self, state: str, pipeline: Pipeline | None = None) -> None:
        """Say what the worker does, if that has changed and the broker can be reached."""
        if state != self._state or pipeline is not None:
            with suppress(RedisError):
                super().set_state(state, pipeline)

    def check_for_suspension(self, burst: bool) -> None:
        """Wait while ``rq suspend`` holds; a broker that is away suspends nobody."""
        with suppress(RedisError):
            super().check_for_suspension(burst)

    def run_maintenance_tasks(self) -> None:
        """Tidy RQ's own lists, later if the broker is away."""
        with suppress(RedisError):
            super().run_maintenance_tasks()  # type: ignore[no-untyped-call] # RQ's

    def request_stop(self, signum: int, frame: FrameType | None) -> None:
        """Take no new job. Nothing is interrupted; see :mod:`worker.run.stopping`."""
        self._attempts.stop.note(signum, frame)
        self._stop_requested = True

    def kill_horse(self, sig: signal.Signals = signal.SIGKILL) -> None:  # noqa: ARG002
        """Cancel the job in hand: RQ's command to stop a job asks for it, in another thread."""
        for execution in list(self.executions.values()):
            with suppress(RedisError, TransitionRefusedError, UnknownJobError):
                self._attempts.ledger.cancel(job_of(execution.job_id))

    def teardown(self) -> None:
        """Leave RQ's list of workers, if the broker can be reached."""
        with suppress(RedisError):
            super().teardown()  # type: ignore[no-untyped-call] # RQ's

    def _install_signal_handlers(self) -> None:
        super()._install_signal_handlers()  # type: ignore[no-untyped-call] # RQ's
        self._stop_requested = self._attempts.stop.made  # while the worker was starting

    def _pubsub_exception_handler(self, exc: Exception, *_: Any) -> None:
        if not isinstance(exc, RedisError):
            raise exc
        time.sleep(_BEAT_INTERVAL)  # the loop has said that the broker is away
