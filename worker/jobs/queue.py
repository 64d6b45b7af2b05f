"""The one queue between the front end and the workers. It carries job ids, nothing else.

Jobs wait in lines (:mod:`worker.jobs.lines`) and are released into RQ's queue a few at a time: when
one is lined up, when a worker takes one up, and at every look of the reconciler. A step of a line
or of a release is one script in the broker, so a job is in a line or has a message.

RQ moves a message from the queue to a second list, the *intermediate* one, in one step, so
that it is in a list whatever happens to the worker; with two queues on one worker RQ does
not. What a message means is the ledger's to say: one that comes twice, or too late, finds
its job in another state and is dropped.
"""

from __future__ import annotations

import json
import secrets
import socket
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rq import Queue, worker_registration
from rq.defaults import DEFAULT_WORKER_TTL
from rq.job import Job, JobStatus
from rq.serializers import JSONSerializer
from rq.suspension import is_suspended

from worker.jobs.lines import LINE_UP, LINED_UP, RELEASE, WINDOW

if TYPE_CHECKING:
    from redis import Redis

    from worker.settings import WorkerSettings

TASK = "worker.run.attempt.run"
"""The function that a message names; its one argument is the id of a job."""

_LINED_UP_AT_ONCE = 1000  # jobs; the broker does nothing else meanwhile, for some milliseconds
_FAILURE_TTL = 86_400  # seconds for which `rq requeue` can send again what RQ says has failed
_LONGEST_LIFE = DEFAULT_WORKER_TTL + 60  # seconds; what RQ gives a worker's entry at most


@dataclass(frozen=True)
class Delivery:
    """A message: its own id, and that of the job it is about."""

    id: str
    job_id: str


class JobQueue:
    """RQ's queue, with what we leave to it: order and delivery.

    Messages are JSON: RQ's default, pickle, lets whoever reaches the broker run code.
    Each has an id of its own, so that what becomes of one says nothing of another.
    """

    def __init__(self, settings: WorkerSettings, connection: Redis) -> None:
        self.rq = Queue(settings.queue, connection=connection, serializer=JSONSerializer)
        self._connection = connection
        self._line_up = connection.register_script(LINE_UP)
        self._release = connection.register_script(RELEASE)
        self._lined_up = connection.register_script(LINED_UP)

    def enqueue(self, *job_ids: str) -> None:
        """Have jobs of the ledger run when it is their turn; those that are not queued are left."""
        for start in range(0, len(job_ids), _LINED_UP_AT_ONCE):
            self._line_up([], job_ids[start : start + _LINED_UP_AT_ONCE])
        self.release()

    def release(self) -> None:
        """Send messages of the jobs whose turn it is, as far as there is room. Repeatable."""
        self._release(
            [self.rq.key, self.rq.redis_queues_keys],
            [WINDOW, secrets.token_hex(4), self._message(), Job.redis_job_namespace_prefix],
        )

    def discard(self, delivery: Delivery) -> None:
        """Forget a message that was taken."""
        with self._connection.pipeline() as pipeline:
            pipeline.lrem(self.rq.intermediate_queue_key, 0, delivery.id)
            pipeline.delete(Job.key_for(delivery.id))
            pipeline.execute()

    def forget_started(self, job_id: str) -> None:
        """Forget the messages of a job that RQ shows as being worked on: their worker died."""
        started = self.rq.started_job_registry
        with self._connection.pipeline() as pipeline:
            for message, execution in started.get_job_and_execution_ids(cleanup=False):
                if job_of(message) == job_id:
                    pipeline.zrem(started.key, f"{message}:{execution}")
                    pipeline.delete(Job.key_for(message))
            pipeline.execute()

    def waiting(self) -> set[str]:
        """Ids of the jobs that wait in a line, or whose message waits for a worker."""
        lined_up: list[bytes | str] = self._lined_up([], [])
        return {_delivery(item).job_id for item in [*lined_up, *self._items(self.rq.key)]}

    def taken(self) -> set[Delivery]:
        """Messages some worker has taken and not discarded: for an instant, or for ever."""
        return {_delivery(item) for item in self._items(self.rq.intermediate_queue_key)}

    def is_suspended(self) -> bool:
        """Whether ``rq suspend`` holds: no worker takes a job until ``rq resume``."""
        return bool(is_suspended(self._connection))

    def worker_count(self) -> int:
        """Workers of this queue whose heartbeat has not run out."""
        return sum(self._is_alive(key) for key in self._worker_keys())

    def local_worker_pids(self) -> set[int]:
        """Process ids of those workers that run, or ran until a moment ago, on this machine."""
        keys = filter(self._is_alive, self._worker_keys())
        workers = (self._connection.hmget(key, "pid", "hostname") for key in keys)
        here = socket.gethostname().encode()
        return {int(pid) for pid, host in workers if pid is not None and host == here}

    def forget_dead_workers(self) -> None:
        """Drop those from RQ's list whose heartbeat has run out."""
        worker_registration.clean_worker_registry(self.rq)

    def _message(self) -> str:
        """The fields of a message as RQ keeps them; ``@job`` stands for the job's id."""
        message = self.rq.create_job(
            TASK,
            args=("@job",),
            timeout=-1,  # workers keep time themselves
            result_ttl=0,  # the ledger has the result
            failure_ttl=_FAILURE_TTL,
            description="job @job",
            status=JobStatus.QUEUED,
        )
        message.enqueued_at = message.created_at
        # RQ packs what names function and arguments, and reads it plain as well.
        return json.dumps({**message.to_dict(), "data": message.data.decode()})

    def _is_alive(self, key: str) -> bool:
        # An entry with more time left than it was ever given is from before the broker's clock
        # was set back.
        return bool(0 <= self._connection.pttl(key) <= _LONGEST_LIFE * 1000)

    def _items(self, key: str) -> list[bytes | str]:
        return list(self._connection.lrange(key, 0, -1))

    def _worker_keys(self) -> set[str]:
        return worker_registration.get_keys(queue=self.rq)


def _delivery(item: bytes | str) -> Delivery:
    text = item.decode() if isinstance(item, bytes) else item
    return Delivery(text, job_of(text))


def job_of(message: str) -> str:
    """The id of the job that a message is about, by the message's own."""
    return message.partition("_")[0]
