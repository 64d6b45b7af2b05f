"""Signs of life of the attempts that are running.

RQ notices a dead worker after minutes. Here each worker renews a key that runs out by
itself, and whoever finds a job running without one knows that its attempt is dead.

The broker keeps the moment at which a key runs out. If its clock is set back, a key seems to have
more left than it was ever given: that heartbeat is from the future and counts as none. A worker
that lives gives another within a second. What a key was given stands in it, for another process may
have another timeout.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from typing import TYPE_CHECKING, TypeVar

from worker.jobs.full_broker import WHEN_FULL
from worker.jobs.ledger_keys import job_keys
from worker.jobs.records import AttemptRecord, JobRecord

if TYPE_CHECKING:
    from redis import Redis

_BEAT = f"""{WHEN_FULL}-- KEYS: job, heartbeat. ARGV: attempt, milliseconds
local state = redis.call('HGET', KEYS[1], 'state')
if state ~= 'running' or redis.call('HGET', KEYS[1], 'attempt') ~= ARGV[1] then return 0 end
redis.call('SET', KEYS[2], ARGV[1] .. '/' .. ARGV[2], 'PX', ARGV[2])
if redis.call('HEXISTS', KEYS[1], 'cancel_requested') == 1 then return 2 end
return 1
"""


Attempt = TypeVar("Attempt", JobRecord, AttemptRecord)


class Ownership(IntEnum):
    """What the ledger says to an attempt that gives a sign of life."""

    LOST = 0
    OWNED = 1
    CANCEL_REQUESTED = 2


class Heartbeats:
    """Heartbeats in the broker, each good for a time.

    Args:
        client: a connection whose replies are strings.
        timeout: seconds after which an attempt that gives no sign of life is dead.
    """

    def __init__(self, client: Redis, timeout: float) -> None:
        self._client = client
        self._milliseconds = int(timeout * 1000)
        self._beat = client.register_script(_BEAT)

    def beat(self, job_id: str, attempt: int) -> Ownership:
        """Say that an attempt lives, and learn whether the job is still its own."""
        keys = [job_keys(job_id)[0], _key(job_id)]
        return Ownership(int(self._beat(keys, [attempt, self._milliseconds])))

    def missing(self, records: Sequence[Attempt]) -> list[Attempt]:
        """Those of some running jobs whose attempt has given no sign of life in time."""
        if not records:
            return []
        keys = [_key(record.id) for record in records]
        with self._client.pipeline(transaction=False) as pipeline:
            pipeline.mget(keys)
            for key in keys:
                pipeline.pttl(key)
            beating, *left = pipeline.execute()
        return [
            record
            for record, beat, rest in zip(records, beating, left, strict=True)
            if not _is_alive(record, beat, rest)
        ]


def _is_alive(record: JobRecord | AttemptRecord, beat: str | None, rest: int) -> bool:
    attempt, _, given = (beat or "").partition("/")
    return attempt == str(record.attempt) and rest <= int(given or 0)


def _key(job_id: str) -> str:
    return f"{job_keys(job_id)[0]}:heartbeat"
