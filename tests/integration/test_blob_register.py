"""A blob goes when nobody needs it, and not before."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

import pytest
from obstore.store import LocalStore
from redis import Redis

from tests.integration.jobs import make_job
from worker.broker.connections import connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.identifiers import new_job_id
from worker.jobs.ledger import Ledger
from worker.jobs.ledger_keys import DOOMED_BLOBS
from worker.jobs.records import Artifact, JobRecord, StoredFile
from worker.storage.blobs import BlobStore
from worker.storage.register import BlobBusyError, BlobRegister


@pytest.fixture
def client(broker: EmbeddedBroker) -> Iterator[Redis]:
    with connect_text(broker.url) as connected:
        yield connected


@pytest.fixture
def register(client: Redis) -> BlobRegister:
    return BlobRegister(client)


@pytest.fixture
def blobs(tmp_path: Path) -> BlobStore:
    return BlobStore(LocalStore(tmp_path))


def job_with(content: bytes, blobs: BlobStore) -> JobRecord:
    file = StoredFile(name="mug.obj", digest=blobs.put(content), size=len(content))
    return make_job().model_copy(update={"source": file, "reference": file})


def finish(ledger: Ledger, job: JobRecord, **artifacts: Artifact) -> None:
    ledger.create(job)
    ledger.succeed(job.id, ledger.begin(job.id), artifacts)


def something() -> bytes:
    return new_job_id().encode()


def test_the_files_of_a_deleted_job_are_removed(
    ledger: Ledger, register: BlobRegister, blobs: BlobStore
) -> None:
    made = something()
    artifact = Artifact(digest=blobs.put(made), media_type="x/y", filename="z", size=36)
    job = job_with(something(), blobs)
    finish(ledger, job, mesh=artifact)

    ledger.delete(job.id)
    register.sweep(blobs)

    assert not blobs.exists(job.source.digest)
    assert not blobs.exists(artifact.digest)


def test_the_files_of_an_expired_job_are_removed(
    ledger: Ledger, register: BlobRegister, blobs: BlobStore
) -> None:
    job = job_with(something(), blobs)
    finish(ledger, job)

    ledger.expire(job.id)
    register.sweep(blobs)

    assert not blobs.exists(job.source.digest)


def test_a_file_that_another_job_has_too_stays_until_both_are_gone(
    ledger: Ledger, register: BlobRegister, blobs: BlobStore
) -> None:
    content = something()
    first, second = job_with(content, blobs), job_with(content, blobs)
    finish(ledger, first)
    finish(ledger, second)

    ledger.delete(first.id)
    register.sweep(blobs)
    assert blobs.exists(second.source.digest)

    ledger.expire(second.id)
    ledger.delete(second.id)
    register.sweep(blobs)
    assert not blobs.exists(second.source.digest)


def test_a_leased_blob_stays_without_a_job(
    ledger: Ledger, register: BlobRegister, blobs: BlobStore
) -> None:
    job = job_with(something(), blobs)
    register.lease([job.source.digest], "somebody", 60)
    finish(ledger, job)

    ledger.delete(job.id)
    register.sweep(blobs)

    assert blobs.exists(job.source.digest)


def test_a_job_needs_its_own_lease_no_longer_once_it_refers_to_the_blob(
    ledger: Ledger, register: BlobRegister, blobs: BlobStore
) -> None:
    job = job_with(something(), blobs)
    register.lease([job.source.digest], job.id)
    finish(ledger, job)

    ledger.delete(job.id)
    register.sweep(blobs)

    assert not blobs.exists(job.source.digest)


def test_what_a_canceled_attempt_has_made_is_removed(
    ledger: Ledger, register: BlobRegister, blobs: BlobStore
) -> None:
    job, made = job_with(something(), blobs), something()
    artifact = Artifact(digest=blobs.put(made), media_type="x/y", filename="z", size=36)
    ledger.create(job)
    attempt = ledger.begin(job.id)
    register.lease([artifact.digest], job.id)
    ledger.cancel(job.id)

    ledger.succeed(job.id, attempt, {"mesh": artifact})
    register.sweep(blobs)

    assert not blobs.exists(artifact.digest)


def test_a_lease_that_has_run_out_keeps_nothing(register: BlobRegister, blobs: BlobStore) -> None:
    digest = blobs.put(something())
    register.lease([digest], "somebody", -1)

    register.sweep(blobs)

    assert not blobs.exists(digest)


def test_a_short_lease_does_not_cut_a_long_one(register: BlobRegister, blobs: BlobStore) -> None:
    digest = blobs.put(something())
    register.lease([digest], "somebody", 60)
    register.lease([digest], "somebody", -1)

    register.sweep(blobs)

    assert blobs.exists(digest)


def test_a_blob_that_is_being_removed_cannot_be_leased(
    client: Redis, register: BlobRegister, monkeypatch: pytest.MonkeyPatch
) -> None:
    digest = hashlib.sha256(something()).hexdigest()
    client.zadd(DOOMED_BLOBS, {digest: 0})
    monkeypatch.setattr("worker.storage.register._PATIENCE", 0.1)

    with pytest.raises(BlobBusyError):
        register.lease([digest], "somebody")

    client.zrem(DOOMED_BLOBS, digest)
    register.lease([digest], "somebody")
