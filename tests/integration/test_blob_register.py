"""A blob goes when nobody needs it, and not before."""

from __future__ import annotations

import hashlib
import io
import threading
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest
from redis import Redis

from meshcone.files import MeshFile
from tests.integration.jobs import make_job, stored_job
from worker.broker.connections import connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.batches import Batches, BatchRecord
from worker.jobs.identifiers import new_job_id
from worker.jobs.ledger import Ledger
from worker.jobs.ledger_keys import BLOB_GENERATIONS, BLOB_REFERENCES, DOOMED_BLOBS
from worker.jobs.records import Artifact, JobRecord, StoredFile
from worker.storage.blobs import BlobStore
from worker.storage.errors import StoreError
from worker.storage.local import Directory
from worker.storage.register import BlobRegister


@pytest.fixture
def client(broker: EmbeddedBroker) -> Iterator[Redis]:
    with connect_text(broker.url) as connected:
        yield connected


@pytest.fixture
def register(client: Redis) -> BlobRegister:
    return BlobRegister(client)


@pytest.fixture
def blobs(tmp_path: Path, register: BlobRegister) -> BlobStore:
    return BlobStore(Directory(tmp_path), register)


def job_with(content: bytes, blobs: BlobStore) -> JobRecord:
    return stored_job(blobs, MeshFile("mug.obj", content))


def finish(ledger: Ledger, job: JobRecord, **artifacts: Artifact) -> None:
    ledger.create(job)
    ledger.succeed(job.id, ledger.begin(job.id), artifacts)


def something() -> bytes:
    return new_job_id().encode()


def test_the_files_of_a_deleted_job_are_removed(ledger: Ledger, blobs: BlobStore) -> None:
    job = job_with(something(), blobs)
    digest = blobs.put(something(), job.id)
    finish(ledger, job, mesh=Artifact(digest=digest, media_type="x/y", filename="z", size=36))

    ledger.delete(job.id)
    blobs.sweep()

    assert not blobs.exists(job.source.digest)
    assert not blobs.exists(digest)


def test_deleting_a_job_tells_its_own_files_that_nobody_needs_any_more(
    ledger: Ledger, blobs: BlobStore, tmp_path: Path
) -> None:
    shared = something()
    other, job = job_with(shared, blobs), job_with(shared, blobs)
    own = blobs.put(something(), job.id)
    finish(ledger, other)
    finish(ledger, job, mesh=Artifact(digest=own, media_type="x/y", filename="z", size=36))
    unneeded = job_with(something(), blobs)
    finish(ledger, unneeded)
    ledger.expire(unneeded.id)
    before = files_in(tmp_path)

    names = ledger.delete(job.id)
    blobs.remove(names)

    assert [name.partition(".")[0] for name in names] == [own]
    assert before - files_in(tmp_path) == set(names)


def test_the_files_of_an_expired_job_are_removed(ledger: Ledger, blobs: BlobStore) -> None:
    job = job_with(something(), blobs)
    finish(ledger, job)

    ledger.expire(job.id)
    blobs.sweep()

    assert not blobs.exists(job.source.digest)


def test_a_file_that_another_job_has_too_stays_until_both_are_gone(
    ledger: Ledger, blobs: BlobStore
) -> None:
    content = something()
    first, second = job_with(content, blobs), job_with(content, blobs)
    finish(ledger, first)
    finish(ledger, second)

    ledger.delete(first.id)
    blobs.sweep()
    assert blobs.exists(second.source.digest)

    ledger.expire(second.id)
    ledger.delete(second.id)
    blobs.sweep()
    assert not blobs.exists(second.source.digest)


def test_a_leased_blob_stays_without_a_job(
    ledger: Ledger, register: BlobRegister, blobs: BlobStore
) -> None:
    job = job_with(something(), blobs)
    register.lease([job.source.digest], "somebody", 60)
    finish(ledger, job)

    ledger.delete(job.id)
    blobs.sweep()

    assert blobs.exists(job.source.digest)


def test_what_a_canceled_attempt_has_made_is_removed(ledger: Ledger, blobs: BlobStore) -> None:
    job = job_with(something(), blobs)
    ledger.create(job)
    attempt = ledger.begin(job.id)
    digest = blobs.put(something(), job.id)
    artifact = Artifact(digest=digest, media_type="x/y", filename="z", size=36)
    ledger.cancel(job.id)

    ledger.succeed(job.id, attempt, {"mesh": artifact})
    blobs.sweep()

    assert not blobs.exists(digest)


def test_a_lease_that_has_run_out_keeps_nothing(register: BlobRegister, blobs: BlobStore) -> None:
    content = something()
    digest = hashlib.sha256(content).hexdigest()
    register.lease([digest], "somebody", -1)
    blobs.put_file(io.BytesIO(content), digest)

    blobs.sweep()

    assert not blobs.exists(digest)


def test_the_files_of_a_batch_stay_until_its_jobs_are_entered_however_late(
    redis: Redis, register: BlobRegister, blobs: BlobStore
) -> None:
    content, batches = something(), Batches(redis)
    digest = hashlib.sha256(content).hexdigest()
    batch = BatchRecord(id=new_job_id(), created=datetime.now(UTC), pairs=1)
    file = StoredFile(name="mug.obj", digest=digest, size=len(content))
    job = make_job().model_copy(update={"batch": batch.id, "source": file, "reference": None})
    register.lease([digest], batch.id, -1)  # as when nobody could enter a job for an hour
    blobs.put_file(io.BytesIO(content), digest)
    batches.stage(batch.id, [job])
    batches.commit(batch, capacity=1000)  # of a queue that other tests left jobs in

    blobs.sweep()
    batches.carry_on(batch.id)
    redis.zadd("meshcone:blobs:leases", {f"{digest}/{batch.id}": 1})  # another hour later
    blobs.sweep()

    assert redis.zscore("meshcone:blobs:leases", f"{digest}/{batch.id}") is None
    assert blobs.exists(digest)


def test_a_short_lease_does_not_cut_a_long_one(register: BlobRegister, blobs: BlobStore) -> None:
    digest = blobs.put(something(), "somebody")
    register.lease([digest], "somebody", -1)

    blobs.sweep()

    assert blobs.exists(digest)


def test_a_blob_that_has_another_name_by_now_is_not_set_aside_again(
    register: BlobRegister, blobs: BlobStore
) -> None:
    digest = blobs.put(something(), "somebody")
    [first] = register.names_of([digest])
    assert first is not None

    assert register.set_aside(digest, first)
    [second] = register.names_of([digest])

    assert second not in (None, first)
    assert not register.set_aside(digest, first)
    assert register.names_of([digest]) == [second]


class StallingDirectory(Directory):
    """A store whose removals take effect when the test says so."""

    def __init__(self, root: Path) -> None:
        super().__init__(root)
        self.asked = threading.Event()
        self.go_on = threading.Event()

    def delete(self, name: str) -> None:
        self.asked.set()
        assert self.go_on.wait(60)
        super().delete(name)


def test_a_removal_that_comes_late_harms_nobody_who_stored_the_same_again(
    ledger: Ledger, register: BlobRegister, tmp_path: Path
) -> None:
    stalling = StallingDirectory(tmp_path)
    slow, other = BlobStore(stalling, register), BlobStore(Directory(tmp_path), register)
    content = something()
    job = job_with(content, other)
    finish(ledger, job)
    sweeping = threading.Thread(target=slow.remove, args=[ledger.delete(job.id)])
    sweeping.start()
    assert stalling.asked.wait(60)

    other.sweep()  # another takes over from the one that stalls
    again = job_with(content, other)
    ledger.create(again)
    stalling.go_on.set()
    sweeping.join()

    assert other.get(again.source.digest) == content


def test_a_blob_of_an_earlier_version_is_read_and_removed(
    client: Redis, ledger: Ledger, register: BlobRegister, blobs: BlobStore, tmp_path: Path
) -> None:
    content = something()
    job = job_with(content, blobs)
    digest = job.source.digest
    finish(ledger, job)
    # Earlier versions stored a blob under its digest alone.
    name = f"{digest}.{client.hget(BLOB_GENERATIONS, digest)}"
    client.hdel(BLOB_GENERATIONS, digest)
    (tmp_path / digest[:2] / name).rename(tmp_path / digest[:2] / digest)

    assert blobs.get(digest) == content
    register.lease([digest], "somebody", -1)
    assert blobs.get(digest) == content
    ledger.delete(job.id)
    blobs.sweep()
    assert digest not in files_in(tmp_path)
    assert not client.hexists(BLOB_REFERENCES, digest)


def files_in(directory: Path) -> set[str]:
    return {path.name for path in directory.rglob("*") if path.is_file()}


class RefusingDirectory(Directory):
    """A store that does not remove one name."""

    refused = ""

    def delete(self, name: str) -> None:
        if self.refused and self.refused in name:
            raise StoreError("the file store cannot be used: input/output error")
        super().delete(name)


def test_a_name_that_cannot_be_removed_keeps_no_other_and_is_tried_again(
    client: Redis, ledger: Ledger, register: BlobRegister, tmp_path: Path
) -> None:
    directory = RefusingDirectory(tmp_path)
    blobs = BlobStore(directory, register)
    job = job_with(something(), blobs)
    other = blobs.put(something(), job.id)
    finish(ledger, job, mesh=Artifact(digest=other, media_type="x/y", filename="z", size=36))
    directory.refused = job.source.digest

    blobs.remove(ledger.delete(job.id))

    [left] = files_in(tmp_path)
    assert left.startswith(job.source.digest)
    assert client.zscore(DOOMED_BLOBS, left) is not None
    directory.refused = ""
    blobs.remove([left])
    assert files_in(tmp_path) == set()
