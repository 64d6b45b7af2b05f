"""The lists that open pages look at, and what they cost the broker."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator
from contextlib import AsyncExitStack, aclosing, asynccontextmanager
from pathlib import Path
from typing import Any

import httpx2
import pytest
from redis import Redis

from service.dashboard.lists import (
    READ_AT_FIRST,
    READ_AT_MOST,
    LiveLists,
    Snapshot,
    UnavailableError,
)
from service.dashboard.rows import Rows
from service.stack import Stack
from tests.integration.jobs import make_job
from tests.integration.waiting import wait_for
from worker.broker.connections import connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.batches import Batches
from worker.jobs.filters import EVERYTHING, JobFilter
from worker.jobs.ledger import Ledger
from worker.settings import WorkerSettings

ASKED_AT_A_LOOK = 3  # for the ids of the first jobs, for those after them, and for batches
SILENCE = 60.0  # seconds; longer than any test
FAST = 0.02  # seconds between looks


@pytest.fixture
def own_broker(tmp_path: Path) -> Iterator[EmbeddedBroker]:
    with EmbeddedBroker(tmp_path) as started:
        yield started


@pytest.fixture
def client(own_broker: EmbeddedBroker) -> Iterator[Redis]:
    with connect_text(own_broker.url) as connected:
        yield connected


@pytest.fixture
def jobs(client: Redis) -> Ledger:
    return Ledger(client)


def table(jobs: Ledger, client: Redis) -> Rows:
    return Rows(jobs.index, Batches(client), 0)


def run(scenario: Coroutine[Any, Any, None]) -> None:
    async def bounded() -> None:
        async with asyncio.timeout(120):
            await scenario
            await nobody_is_left()

    asyncio.run(bounded())


async def nobody_is_left() -> None:
    """Return once nothing reads any more, which is so when no page is open."""
    while others := asyncio.all_tasks() - {asyncio.current_task()}:
        await asyncio.wait(others)


def looks(client: Redis) -> int:
    """How often the broker has been asked for a list so far."""
    return questions(client) // ASKED_AT_A_LOOK


def questions(client: Redis) -> int:
    """How many questions that were; an empty list takes one."""
    statistics: dict[str, Any] = client.info("commandstats")
    return int(statistics.get("cmdstat_zrevrangebylex", {}).get("calls", 0))


@asynccontextmanager
async def following(
    lists: LiveLists, wanted: JobFilter = EVERYTHING
) -> AsyncIterator[Callable[[], Coroutine[Any, Any, Snapshot]]]:
    """An open page: call it for what it is told next."""
    async with aclosing(lists.follow(wanted, silence=SILENCE)) as snapshots:

        async def told() -> Snapshot:
            snapshot = await anext(snapshots)
            assert snapshot is not None
            return snapshot

        yield told


def test_a_page_is_told_the_list_and_then_what_changes(jobs: Ledger, client: Redis) -> None:
    first, second = make_job(), make_job()
    jobs.create(first)

    async def scenario() -> None:
        async with following(LiveLists(table(jobs, client), interval=FAST)) as told:
            before = await told()
            jobs.create(second)
            after = await told()

            assert list(before.rows) == [first.id]
            assert set(after.rows) == {first.id, second.id}
            assert [row.entry.id for row in after.changed_since(before)] == [second.id]

    run(scenario())


def test_a_hundred_pages_cost_the_broker_what_one_does(jobs: Ledger, client: Redis) -> None:
    jobs.create(make_job())

    async def scenario() -> None:
        lists = LiveLists(table(jobs, client), interval=FAST)
        async with AsyncExitStack() as pages:
            told = [await pages.enter_async_context(following(lists)) for _ in range(100)]
            for each in told:
                await each()

            # Whatever time that took: it was one look for all of them, or a few.
            assert looks(client) < 100
            before, started = looks(client), time.monotonic()
            await asyncio.sleep(20 * FAST)
            most = (time.monotonic() - started) / FAST + 2
            assert looks(client) - before <= most

    run(scenario())


def test_many_filters_are_read_less_often_and_not_more_at_a_time(
    jobs: Ledger, client: Redis
) -> None:
    interval = 0.1
    wanted = [JobFilter(labels=frozenset({str(number)})) for number in range(100)]
    for number in range(100):
        jobs.create(make_job(str(number)))

    async def scenario() -> None:
        lists = LiveLists(table(jobs, client), interval=interval)
        async with AsyncExitStack() as pages:
            started = time.monotonic()
            told = [await pages.enter_async_context(following(lists, each)) for each in wanted]
            for number, each in enumerate(told):
                assert [row.entry.labels for row in (await each()).rows.values()] == [[str(number)]]
            rounds = (time.monotonic() - started) / interval + 2
            assert looks(client) <= rounds * (READ_AT_MOST + READ_AT_FIRST)

            before, started = looks(client), time.monotonic()
            new = make_job("7")
            jobs.create(new)
            assert new.id in (await told[7]()).rows  # its turn comes, among all the others
            rounds = (time.monotonic() - started) / interval + 2
            assert looks(client) - before <= rounds * READ_AT_MOST

    run(scenario())


def test_nobody_is_asked_once_the_last_page_is_closed(jobs: Ledger, client: Redis) -> None:
    async def scenario() -> None:
        lists = LiveLists(table(jobs, client), interval=FAST)
        async with following(lists) as told:
            await told()
        await nobody_is_left()
        asked = questions(client)
        async with following(lists) as told:  # and a page that comes later is told again
            await told()
        assert questions(client) > asked

    run(scenario())


def test_a_page_that_takes_its_time_is_told_the_newest_and_holds_up_nobody(
    jobs: Ledger, client: Redis
) -> None:
    async def scenario() -> None:
        lists = LiveLists(table(jobs, client), interval=FAST)
        async with following(lists) as slow, following(lists) as quick:
            before = await slow()
            await quick()
            for _ in range(5):
                jobs.create(make_job())
                await quick()

            assert len((await slow()).changed_since(before)) == 5

    run(scenario())


def test_every_page_is_told_that_the_broker_is_away(
    jobs: Ledger, client: Redis, own_broker: EmbeddedBroker
) -> None:
    async def scenario() -> None:
        lists = LiveLists(table(jobs, client), interval=FAST)
        async with following(lists) as first, following(lists) as second:
            await first()
            await second()
            own_broker.stop()
            for told in (first, second):
                with pytest.raises(UnavailableError):
                    await told()

    run(scenario())


def test_open_dashboards_ask_the_broker_once_a_second_together(tmp_path: Path) -> None:
    settings = WorkerSettings(data_dir=tmp_path)
    with (
        Stack(settings, workers=1, log=tmp_path / "log") as stack,
        connect_text(stack.redis_url) as client,
        httpx2.Client(
            base_url=stack.url,
            timeout=60,
            trust_env=False,
            limits=httpx2.Limits(max_connections=60),
        ) as http,
    ):
        pages = [http.build_request("GET", "/dashboard/events") for _ in range(50)]
        streams = [http.send(page, stream=True) for page in pages]
        lines = [stream.iter_lines() for stream in streams]  # kept: a stream ends with them
        for each in lines:
            assert "event: jobs" in each

        before, started = looks(client), time.monotonic()
        wait_for(lambda: looks(client) >= before + 3)
        asked = looks(client) - before
        most = time.monotonic() - started + 2
        for stream in streams:
            stream.close()

    assert asked <= most
