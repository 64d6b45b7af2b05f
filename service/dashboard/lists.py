"""The newest jobs as pages show them, read once for all pages that look at them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from fastapi.concurrency import run_in_threadpool
from redis.exceptions import RedisError

from service.api.schemas import ListedJob
from worker.jobs.index import JobFilter, JobIndex, Order

SHOWN = 50  # jobs, the newest
INTERVAL = 1.0  # seconds between looks
READ_AT_MOST = 8  # lists, in an interval: more filters than these are looked at less often
READ_AT_FIRST = 32  # lists nobody has looked at before, beside those

# What a row of the table is made of: a seventh of a job.
_ROW: dict[str, Any] = {
    **dict.fromkeys(
        ("id", "state", "labels", "project", "created", "mode", "progress", "verdict", "expired"),
        True,
    ),
    "source": {"name"},
    "reference": {"name"},
    "error": {"detail"},
    "links": {"thumbnail"},
    "summary": {
        "outcome": True,
        "radius": True,
        "worst": True,
        "metrics": {"point_to_surface.max"},
    },
}


class UnavailableError(Exception):
    """The broker is unreachable."""


@dataclass(frozen=True, eq=False)
class Row:
    """A job of a list; the same object as long as nothing of the job changes."""

    job: ListedJob

    @cached_property
    def shown(self) -> dict[str, Any]:
        """What a page is told of it."""
        return self.job.model_dump(mode="json", include=_ROW)


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A list as it was at a look.

    Attributes:
        rows: by the ids of their jobs, newest first.
        more: place of the jobs after these; None if there are none.
        counts: of the jobs of these labels, by state and verdict, whatever else is filtered.
    """

    rows: Mapping[str, Row]
    more: str | None
    counts: Mapping[str, int]

    def changed_since(self, seen: Snapshot | None) -> list[Row]:
        """The rows that an earlier snapshot has not, or has otherwise."""
        before = {} if seen is None else seen.rows
        return [row for job_id, row in self.rows.items() if before.get(job_id) is not row]


@dataclass(eq=False)
class _List:
    wanted: JobFilter
    order: Order
    followers: int = 0
    looked_at: float | None = None
    snapshot: Snapshot | None = None
    failed: bool = False
    changed: asyncio.Event = field(default_factory=asyncio.Event)

    def tell(self) -> None:
        """Wake everybody who waits for a change."""
        self.changed.set()
        self.changed = asyncio.Event()


class LiveLists:
    """Reads each list that is followed, one after the other, however many follow it.

    What this asks of the broker depends on neither how many pages are open nor how many
    different filters they have: with many, each is read less often.

    Args:
        index: of the ledger's jobs.
        result_ttl: seconds the files of a job that has ended are kept; 0 for ever.
        interval: seconds between two looks at one list.
    """

    def __init__(self, index: JobIndex, result_ttl: int, *, interval: float = INTERVAL) -> None:
        self._index = index
        self._result_ttl = result_ttl
        self._interval = interval
        self._lists: dict[tuple[JobFilter, Order], _List] = {}
        self._arrived = asyncio.Event()
        self._poller: asyncio.Task[None] | None = None

    async def follow(
        self, wanted: JobFilter, *, silence: float, order: Order = "newest"
    ) -> AsyncGenerator[Snapshot | None]:
        """A list as it is, and again at each change; None after some seconds without one.

        Whoever takes long between two of them is given the newest, not all.

        Raises:
            UnavailableError: the broker is unreachable.
        """
        key = wanted, order
        followed = self._lists.setdefault(key, _List(wanted, order))
        followed.followers += 1
        self._arrived.set()
        if self._poller is None or self._poller.done():
            self._poller = asyncio.create_task(self._poll())
        seen: Snapshot | None = None
        try:
            while True:
                changed = followed.changed
                if followed.failed:
                    raise UnavailableError
                if followed.snapshot is not seen:
                    seen = followed.snapshot
                    yield seen
                    continue
                try:
                    await asyncio.wait_for(changed.wait(), silence)
                except TimeoutError:
                    yield None
        finally:
            followed.followers -= 1
            if followed.followers == 0 and self._lists.get(key) is followed:
                del self._lists[key]

    async def _poll(self) -> None:
        """Look at lists as long as somebody follows one."""
        clock = asyncio.get_running_loop().time
        try:
            while self._lists:
                until = clock() + self._interval
                known = [each for each in self._lists.values() if each.looked_at is not None]
                known.sort(key=lambda each: each.looked_at or 0.0)
                for each in known[:READ_AT_MOST]:
                    await self._look_at(each, clock())
                new = READ_AT_FIRST
                while True:
                    self._arrived.clear()
                    for each in [each for each in self._lists.values() if each.looked_at is None]:
                        if new > 0:
                            new -= 1
                            await self._look_at(each, clock())
                    if (left := until - clock()) <= 0:
                        break
                    with suppress(TimeoutError):
                        await asyncio.wait_for(self._arrived.wait(), left)
        finally:
            for each in self._lists.values():
                each.failed = True
                each.tell()
            self._lists.clear()

    async def _look_at(self, followed: _List, now: float) -> None:
        if followed.followers == 0:  # the last of them has gone since
            return
        followed.looked_at = now
        try:
            snapshot = await run_in_threadpool(self._read, followed)
        except RedisError:
            followed.failed = True
            key = followed.wanted, followed.order
            if self._lists.get(key) is followed:  # who comes now, tries anew
                del self._lists[key]
            followed.tell()
            return
        if snapshot is not followed.snapshot:
            followed.snapshot = snapshot
            followed.tell()

    def _read(self, followed: _List) -> Snapshot:
        """The list as it is: the last snapshot itself if nothing has changed."""
        wanted, last = followed.wanted, followed.snapshot
        listing = self._index.page if followed.order == "newest" else self._index.failures_first
        page = listing(SHOWN, wanted=wanted)
        before = {} if last is None else last.rows
        rows: dict[str, Row] = {}
        for record in page.jobs:
            job, known = ListedJob.of(record, self._result_ttl), before.get(record.id)
            rows[record.id] = known if known is not None and known.job == job else Row(job)
        counts = self._index.tally(wanted.labels, wanted.project)
        now = Snapshot(rows, page.cursor, counts)
        if last is not None and list(before) == list(rows) and last.counts == counts:
            return now if now.changed_since(last) else last
        return now
