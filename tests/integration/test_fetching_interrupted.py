"""Fetching that is cut off, canceled, held up or never begun: what becomes of the job."""

from __future__ import annotations

import asyncio

import pytest
from redis import Redis

from tests.integration.file_server import FileServer
from tests.integration.jobs import make_job
from tests.integration.transferring import MUG, Transfer, ended_fetching, remote_job
from tests.integration.waiting import wait_for
from worker.broker.connections import connect_async
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.fetch_accounts import FetchAccounts
from worker.jobs.heartbeats import Heartbeats
from worker.jobs.ledger import Ledger
from worker.jobs.ledger_keys import FETCH_TRIES, FETCHES
from worker.jobs.queue import JobQueue
from worker.jobs.records import JobRecord
from worker.settings import WorkerSettings
from worker.storage.blobs import BlobStore
from worker.storage.errors import StoreFullError
from worker.storage.register import BlobRegister
from worker.transfers.fetching import Fetching
from worker.transfers.settings import TransferSettings
from worker.transfers.sources import Sources
from worker.upkeep.reconciler import Reconciler


@pytest.fixture
def broker(own_broker: EmbeddedBroker) -> EmbeddedBroker:
    """One for each test: what is due in one is fetched in no other."""
    return own_broker


def test_a_job_canceled_while_its_files_come_ends_at_once(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer
) -> None:
    job = remote_job(ledger, server.has("/mug.obj", b"v", endless=True, pause=0.05))
    with transfer():
        wait_for(lambda: server.seen)

        assert ledger.cancel(job.id) == "canceled"

        following = remote_job(ledger, server.has("/next.obj", MUG))
        wait_for(lambda: ended_fetching(redis, following))
    assert ledger.get(job.id).state == "canceled"


def test_files_in_hand_are_left_to_the_next_process_and_the_try_is_not_counted(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer
) -> None:
    job = remote_job(ledger, server.has("/mug.obj", b"v", endless=True, pause=0.05))
    with transfer():
        wait_for(lambda: server.seen)
    assert redis.hget(FETCH_TRIES, job.id) == "0"
    server.has("/mug.obj", MUG)

    with transfer():
        wait_for(lambda: ended_fetching(redis, job))

    assert ledger.get(job.id).state == "queued"


def test_files_in_the_hand_of_a_process_that_died_are_fetched_by_the_next(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer
) -> None:
    job = remote_job(ledger, server.has("/mug.obj", b"v", endless=True, pause=0.05))
    with transfer() as process:
        wait_for(lambda: server.seen)
        process.kill()
    server.has("/mug.obj", MUG)
    redis.zadd(FETCHES, {job.id: 0})  # as when the time it was taken for is over

    with transfer():
        wait_for(lambda: ended_fetching(redis, job))

    assert ledger.get(job.id).state == "queued"


def test_fetching_that_ends_every_process_is_given_up(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer
) -> None:
    job = remote_job(ledger, server.has("/mug.obj", MUG))
    redis.hset(FETCH_TRIES, job.id, 10)  # begun twice as often as it may be tried

    with transfer():
        wait_for(lambda: ended_fetching(redis, job))

    error = ledger.get(job.id).error
    assert error is not None
    assert (error.kind, server.seen) == ("internal", [])


def test_no_message_is_sent_of_a_job_that_still_waits_for_files(
    ledger: Ledger, redis: Redis, queue: JobQueue
) -> None:
    remote_job(ledger, "https://example.org/mug.obj")
    lost = make_job()
    ledger.create(lost)
    reconciler = Reconciler(ledger, queue, Heartbeats(redis, 10.0), 3)

    reconciler.reconcile()
    reconciler.reconcile()

    assert queue.waiting() == {lost.id}


class _NoRoom(Sources):
    """A disk without room for what is fetched."""

    async def complete(self, _record: JobRecord) -> JobRecord:
        raise StoreFullError


def test_a_disk_without_room_is_waited_for_and_is_no_try(
    ledger: Ledger,
    redis: Redis,
    settings: WorkerSettings,
    blobs: BlobStore,
    queue: JobQueue,
    server: FileServer,
) -> None:
    job = remote_job(ledger, server.has("/mug.obj", MUG))
    transfers = TransferSettings(**settings.model_dump(), fetch_attempts=1)

    async def until_it_waits() -> None:
        async with connect_async(settings.required_redis_url()) as client:
            sources = _NoRoom(transfers, blobs, BlobRegister(redis), FetchAccounts(redis))
            fetching = Fetching(client, transfers, ledger=ledger, queue=queue, sources=sources)
            running = asyncio.create_task(fetching.run())
            while redis.hget(FETCH_TRIES, job.id) != "0":
                await asyncio.sleep(0.01)
            fetching.stop()
            await running

    asyncio.run(asyncio.wait_for(until_it_waits(), 60))

    assert ledger.get(job.id).state == "queued"
    assert redis.zscore(FETCHES, job.id) is not None
