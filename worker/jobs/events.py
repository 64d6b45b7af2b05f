"""What happens to a job, as it happens: the stream its transitions write."""

from __future__ import annotations

import json
import re
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from worker.jobs.ledger_keys import job_keys
from worker.jobs.records import FINAL_STATES

if TYPE_CHECKING:
    from redis.asyncio import Redis

BEGINNING = "0"
_IDLE = 10.0  # seconds the broker is asked to wait; less than a connection waits for its answer
_AT_ONCE = 100
_EVENT_ID = re.compile(r"\d{1,18}(-\d{1,18})?", re.ASCII)


@dataclass(frozen=True)
class JobEvent:
    """Something that happened to a job.

    Attributes:
        id: names it among the job's events, in order.
        name: ``state``, ``progress`` or ``cancel``.
        data: a JSON object.
    """

    id: str
    name: str
    data: str

    @property
    def is_last(self) -> bool:
        """Whether nothing can follow it."""
        return self.name == "state" and json.loads(self.data)["state"] in FINAL_STATES


def is_event_id(text: str) -> bool:
    """Whether an event could be named so."""
    return _EVENT_ID.fullmatch(text) is not None


class EventFeed:
    """The events of a ledger's jobs.

    Args:
        client: a connection for an event loop, whose replies are strings.
    """

    def __init__(self, client: Redis) -> None:
        self._client = client

    async def since(self, job_id: str, after: str = BEGINNING) -> list[JobEvent]:
        """The next events of a job that are there already, at most a hundred."""
        return await self._read(job_id, after, None)

    async def follow(
        self, job_id: str, after: str = BEGINNING, *, seconds: float | None = None
    ) -> AsyncIterator[JobEvent | None]:
        """The events of a job until its last, or for some seconds; None where none comes.

        It also ends where the job is deleted or expires meanwhile.
        """
        deadline = None if seconds is None else time.monotonic() + seconds
        while True:
            left = _IDLE if deadline is None else min(_IDLE, deadline - time.monotonic())
            if left <= 0:
                return
            events = await self._read(job_id, after, left)
            for event in events:
                yield event
                if event.is_last:
                    return
                after = event.id
            if not events:
                yield None
                if not await self._client.exists(job_keys(job_id)[1]):
                    return

    async def wait_for_end(self, job_id: str, seconds: float) -> None:
        """Return when a job has ended, or after some seconds."""
        async for _ in self.follow(job_id, seconds=seconds):
            pass

    async def _read(self, job_id: str, after: str, seconds: float | None) -> list[JobEvent]:
        key = job_keys(job_id)[1]
        # The broker takes 0 for "for ever".
        block = None if seconds is None else max(1, round(1000 * seconds))
        found: Any = await self._client.xread({key: after}, count=_AT_ONCE, block=block)
        for _, entries in found:
            return [JobEvent(name, fields["event"], fields["data"]) for name, fields in entries]
        return []
