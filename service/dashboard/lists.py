"""The first rows of the table, read once for all pages that look at them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field

from fastapi.concurrency import run_in_threadpool
from redis.exceptions import RedisError

from service.dashboard.rows import Row, Rows
from worker.jobs.filters import JobFilter
from worker.jobs.index import Order

SHOWN = 50  # rows, the newest
INTERVAL = 1.0  # seconds between looks
READ_AT_MOST = 8  # lists, in an interval: more filters than these are looked at less often
READ_AT_FIRST = 32  # lists nobody has looked at before, beside those


class UnavailableError(Exception):
    """The broker is unreachable."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A list as it was at a look.

    Attributes:
        rows: by the ids of their jobs and batches, newest first.
        more: place of those after these; None if there are none.
        counts: of the jobs of these labels, by state and verdict, whatever else is filtered.
    """

    rows: Mapping[str, Row]
    more: str | None
    counts: Mapping[str, int]

    def changed_since(self, seen: Snapshot | None) -> list[Row]:
        """The rows that an earlier snapshot has not, or has otherwise."""
        before = {} if seen is None else seen.rows
        return [row for name, row in self.rows.items() if before.get(name) is not row]


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
        table: what they are lists of.
        interval: seconds between two looks at one list.
    """

    def __init__(self, table: Rows, *, interval: float = INTERVAL) -> None:
        self._table = table
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
        page = self._table.page(SHOWN, cursor=None, wanted=wanted, order=followed.order)
        before = {} if last is None else last.rows
        rows: dict[str, Row] = {}
        for entry in page.entries:
            known = before.get(entry.id)
            rows[entry.id] = known if known is not None and known.entry == entry else Row(entry)
        counts = self._table.tally(wanted)
        now = Snapshot(rows, page.cursor, counts)
        if last is not None and list(before) == list(rows) and last.counts == counts:
            return now if now.changed_since(last) else last
        return now
