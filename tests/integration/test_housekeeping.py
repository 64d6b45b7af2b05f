"""What an installation forgets."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from redis import Redis

from tests.integration.jobs import make_job
from worker.broker.connections import connect_bytes, connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.batches import Batches, BatchRecord
from worker.jobs.errors import UnknownBatchError, UnknownJobError
from worker.jobs.identifiers import earliest_id
from worker.jobs.ledger import Ledger
from worker.jobs.queue import JobQueue
from worker.jobs.records import JobRecord
from worker.settings import WorkerSettings
from worker.storage.blobs import BlobStore
from worker.storage.register import BlobRegister
from worker.upkeep.housekeeping import Housekeeper

Keep = Callable[..., Housekeeper]


@pytest.fixture
def connection(broker: EmbeddedBroker) -> Iterator[Redis]:
    with connect_text(broker.url) as opened:
        yield opened


@pytest.fixture
def blobs(connection: Redis, tmp_path: Path) -> BlobStore:
    return BlobStore.open(WorkerSettings(data_dir=tmp_path), BlobRegister(connection))


@pytest.fixture
def keep(
    broker: EmbeddedBroker, connection: Redis, blobs: BlobStore, tmp_path: Path
) -> Iterator[Keep]:
    with connect_bytes(broker.url) as raw:

        def start(**times: int) -> Housekeeper:
            settings = WorkerSettings(data_dir=tmp_path, **times)
            return Housekeeper(
                settings,
                ledger=Ledger(connection),
                batches=Batches(connection),
                queue=JobQueue(settings, raw),
                blobs=blobs,
            )

        yield start


@pytest.fixture
def ended_job(ledger: Ledger, connection: Redis, blobs: BlobStore) -> JobRecord:
    """A job that ended long ago, and whose one file is there."""
    job = make_job()
    content = job.id.encode()
    digest = blobs.put(content, job.id)
    file = job.source.model_copy(update={"digest": digest, "size": len(content)})
    record = job.model_copy(update={"source": file, "reference": file})
    ledger.create(record)
    ledger.cancel(record.id)
    age(connection, "canceled", record.id)
    return record


def age(connection: Redis, state: str, job_id: str) -> None:
    """Have a job be in its state since 1970."""
    assert connection.zadd(f"meshcone:since:{state}", {job_id: 0}, xx=True, ch=True) == 1


def test_an_old_job_expires_and_its_files_go(
    keep: Keep, ledger: Ledger, blobs: BlobStore, ended_job: JobRecord
) -> None:
    keep(result_ttl=3600).tidy()

    assert ledger.get(ended_job.id).expired is not None
    assert not blobs.exists(ended_job.source.digest)


def test_an_old_job_is_kept_where_nothing_expires(
    keep: Keep, ledger: Ledger, blobs: BlobStore, ended_job: JobRecord
) -> None:
    keep(result_ttl=0).tidy()

    assert ledger.get(ended_job.id).expired is None
    assert blobs.exists(ended_job.source.digest)


def test_a_file_another_job_refers_to_stays(
    keep: Keep, ledger: Ledger, blobs: BlobStore, ended_job: JobRecord
) -> None:
    other = make_job().model_copy(
        update={"source": ended_job.source, "reference": ended_job.source}
    )
    ledger.create(other)

    keep(result_ttl=3600).tidy()

    assert ledger.get(ended_job.id).expired is not None
    assert blobs.exists(ended_job.source.digest)


def test_a_record_that_expired_long_ago_is_forgotten(
    keep: Keep, ledger: Ledger, connection: Redis, ended_job: JobRecord
) -> None:
    keep(result_ttl=3600).tidy()
    age(connection, "expired", ended_job.id)

    keep(result_ttl=3600, record_ttl=3600).tidy()

    with pytest.raises(UnknownJobError):
        ledger.get(ended_job.id)


def test_a_batch_that_was_canceled_before_any_job_was_entered_is_forgotten_after_the_same_time(
    keep: Keep, connection: Redis
) -> None:
    batches, created = Batches(connection), datetime.now(UTC) - timedelta(hours=2)
    batch = BatchRecord(id=earliest_id(created.timestamp()), created=created, pairs=1)
    batches.stage(batch.id, [make_job().model_copy(update={"batch": batch.id})])
    batches.commit(batch, capacity=1000)
    batches.request_cancel(batch.id)
    batches.carry_on(batch.id)
    keeper = keep(result_ttl=600, record_ttl=600)

    keeper.tidy()
    assert batches.get(batch.id).finished is not None
    connection.hset(f"meshcone:batch:{batch.id}", "finished", created.timestamp())
    keep(result_ttl=600, record_ttl=0).tidy()
    assert batches.get(batch.id).dropped == 1
    keeper.tidy()

    with pytest.raises(UnknownBatchError):
        batches.get(batch.id)
    assert connection.keys(f"*{batch.id}*") == []


def test_times_that_reach_back_before_1970_end_nothing(keep: Keep) -> None:
    keep(result_ttl=100 * 365 * 86_400, record_ttl=86_400).tidy()
