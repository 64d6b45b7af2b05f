"""The broker is at its memory limit: nothing comes in, and there is a way back."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

import pytest
from redis import Redis
from redis.exceptions import OutOfMemoryError

from meshcone.progress import Progress
from service.access.quotas import Pace, RateLimiter
from tests.integration.jobs import make_job
from worker.broker.connections import connect_async
from worker.broker.embedded import EmbeddedBroker
from worker.broker.patience import patiently
from worker.jobs.batches import Batches, BatchRecord, carry_through
from worker.jobs.errors import UnknownJobError
from worker.jobs.heartbeats import Heartbeats, Ownership
from worker.jobs.identifiers import new_job_id
from worker.jobs.ledger import Ledger
from worker.jobs.queue import JobQueue
from worker.jobs.records import JobError
from worker.run.progress import ProgressReporter
from worker.settings import WorkerSettings
from worker.storage.blobs import BlobStore
from worker.storage.register import BlobRegister
from worker.upkeep.housekeeping import Housekeeper
from worker.upkeep.main import Turn


@pytest.fixture
def broker(own_broker: EmbeddedBroker) -> EmbeddedBroker:
    return own_broker


@contextmanager
def full(redis: Redis) -> Iterator[None]:
    redis.config_set("maxmemory", 1)
    try:
        yield
    finally:
        redis.config_set("maxmemory", 0)


def begun(ledger: Ledger) -> str:
    job = make_job()
    ledger.create(job)
    ledger.begin(job.id)
    return job.id


def test_no_job_comes_in(redis: Redis, ledger: Ledger) -> None:
    with full(redis), pytest.raises(OutOfMemoryError):
        ledger.create(make_job())


def test_a_running_job_goes_on_without_its_progress(redis: Redis, ledger: Ledger) -> None:
    job_id = begun(ledger)

    with full(redis):
        ProgressReporter(ledger, job_id, 1)(Progress("solve", 0, 1, 0.5))

    assert ledger.get(job_id).state == "running"


def test_a_running_job_gives_signs_of_life_and_ends(redis: Redis, ledger: Ledger) -> None:
    job_id = begun(ledger)

    with full(redis):
        assert Heartbeats(redis, 10).beat(job_id, 1) is Ownership.OWNED
        ledger.fail(job_id, 1, JobError(kind="input", message="no mesh"))

    assert ledger.get(job_id).state == "failed"


def test_a_running_job_leases_and_stores_its_results(redis: Redis, tmp_path: Path) -> None:
    register = BlobRegister(redis, when_full=True)
    blobs = BlobStore.open(WorkerSettings(data_dir=tmp_path), register)

    with full(redis):
        [digest] = blobs.put_all([b"result"], new_job_id())

    assert blobs.get(digest) == b"result"


def test_no_file_of_a_sender_comes_in(redis: Redis, tmp_path: Path) -> None:
    blobs = BlobStore.open(WorkerSettings(data_dir=tmp_path), BlobRegister(redis))

    with full(redis), pytest.raises(OutOfMemoryError):
        blobs.put_all([b"upload"], new_job_id())


def test_jobs_are_canceled_expired_and_deleted(redis: Redis, ledger: Ledger) -> None:
    job = make_job()
    ledger.create(job)

    with full(redis):
        ledger.cancel(job.id)
        ledger.expire(job.id)
        ledger.delete(job.id)

    with pytest.raises(UnknownJobError):
        ledger.get(job.id)


def test_an_attempt_that_was_asked_to_stop_ends(redis: Redis, ledger: Ledger) -> None:
    job_id = begun(ledger)

    with full(redis):
        ledger.cancel(job_id)
        ledger.end_canceled(job_id, 1)

    assert ledger.get(job_id).state == "canceled"


def test_a_batch_is_canceled(redis: Redis, batches: Batches, queue: JobQueue) -> None:
    batch = BatchRecord(id=new_job_id(), created=datetime.now(UTC), pairs=1)
    batches.stage(batch.id, [make_job().model_copy(update={"batch": batch.id})])
    batches.commit(batch, capacity=1)

    with full(redis):
        batches.request_cancel(batch.id)
        carry_through(batch.id, batches, queue)

    assert batches.get(batch.id).dropped == 1


def test_what_is_old_goes(
    redis: Redis,
    ledger: Ledger,
    batches: Batches,
    queue: JobQueue,
    blobs: BlobStore,
    tmp_path: Path,
) -> None:
    job = make_job()
    ledger.create(job)
    ledger.cancel(job.id)
    redis.zadd("meshcone:since:canceled", {job.id: 0})
    settings = WorkerSettings(data_dir=tmp_path, result_ttl=3600)
    keeper = Housekeeper(settings, ledger=ledger, batches=batches, queue=queue, blobs=blobs)

    with full(redis):
        keeper.tidy()

    assert ledger.get(job.id).expired is not None


def test_somebody_has_the_turn_to_keep_house(redis: Redis) -> None:
    first, second = Turn(redis, "turn", 5), Turn(redis, "turn", 5)

    with full(redis):
        assert (first.is_ours(), second.is_ours(), first.is_ours()) == (True, False, True)


def test_a_request_that_may_delete_is_paced_and_let_in(
    redis: Redis, broker: EmbeddedBroker
) -> None:
    async def take() -> Pace | None:
        async with connect_async(broker.url) as client:
            return await RateLimiter(client).take("key", 600)

    with full(redis):
        pace = asyncio.run(take())

    assert pace is not None
    assert pace.allowed


def test_a_step_waits_until_there_is_room(redis: Redis) -> None:
    redis.config_set("maxmemory", 1)
    tries = []

    def step() -> bool:
        tries.append(None)
        if len(tries) == 2:
            redis.config_set("maxmemory", 0)
        return bool(redis.set("key", "value"))

    assert patiently(step)
    assert len(tries) == 2
