"""The files of an installation in a bucket instead of a directory."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterator
from pathlib import Path

import obstore
import pytest
from obstore.store import from_url

from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
from tests.integration.object_store import ObjectStore, object_store
from worker.broker.connections import connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.settings import WorkerSettings
from worker.storage.blobs import BlobStore
from worker.storage.errors import DamagedFileError
from worker.storage.register import BlobRegister


@pytest.fixture(scope="module")
def server() -> Iterator[ObjectStore]:
    with object_store() as started:
        yield started


@pytest.fixture
def bucket(server: ObjectStore, monkeypatch: pytest.MonkeyPatch) -> ObjectStore:
    """The bucket, for this process and those it starts."""
    for name, value in server.environment.items():
        monkeypatch.setenv(name, value)
    return server


@pytest.fixture
def register(broker: EmbeddedBroker) -> Iterator[BlobRegister]:
    with connect_text(broker.url) as client:
        yield BlobRegister(client)


@pytest.fixture
def blobs(bucket: ObjectStore, register: BlobRegister) -> BlobStore:
    return BlobStore.open(WorkerSettings(blob_url=bucket.url), register)


def objects_in(bucket: ObjectStore) -> list[str]:
    return [each["path"] for each in obstore.list(from_url(bucket.url)).collect()]


def test_equal_contents_are_one_object(blobs: BlobStore, bucket: ObjectStore) -> None:
    digest = blobs.put(b"twice", "one")

    assert blobs.put(b"twice", "two") == digest == hashlib.sha256(b"twice").hexdigest()
    assert blobs.get(digest) == b"twice"
    [path] = [path for path in objects_in(bucket) if digest in path]
    assert path.startswith(f"{digest[:2]}/{digest}.")


def test_a_file_too_large_for_one_request_is_stored_in_parts(blobs: BlobStore) -> None:
    content = bytes(range(256)) * 65_536  # 16 MiB

    digest = blobs.put(content, "test")

    assert blobs.get(digest) == content


def test_a_damaged_object_is_set_aside_and_healed(blobs: BlobStore, bucket: ObjectStore) -> None:
    digest = blobs.put(b"sound", "test")
    [path] = [path for path in objects_in(bucket) if digest in path]
    obstore.put(from_url(bucket.url), path, b"other")

    with pytest.raises(DamagedFileError):
        blobs.chunks(digest)
    blobs.put(b"sound", "test")

    assert b"".join(blobs.chunks(digest)) == b"sound"


def test_a_removed_object_is_gone_and_may_be_removed_again(
    blobs: BlobStore, register: BlobRegister, bucket: ObjectStore
) -> None:
    content = b"short-lived"
    digest = hashlib.sha256(content).hexdigest()
    register.lease([digest], "test", -1)
    blobs.put_file(io.BytesIO(content), digest)
    [name] = [path.rpartition("/")[2] for path in objects_in(bucket) if digest in path]

    blobs.sweep()
    blobs.remove([name])

    assert not any(digest in path for path in objects_in(bucket))
    with pytest.raises(FileNotFoundError):
        blobs.get(digest)


def test_apis_and_workers_on_several_hosts_share_broker_and_bucket_alone(
    bucket: ObjectStore,
    broker: EmbeddedBroker,
    tmp_path: Path,
    rough_ball: MeshFile,
    ball: MeshFile,
) -> None:
    def host(name: str, *, workers: int) -> Stack:
        settings = WorkerSettings(
            redis_url=broker.url,
            blob_url=bucket.url,
            data_dir=tmp_path / name,
            queue="several-hosts",
        )
        return Stack(settings, workers=workers, log=tmp_path / f"{name}.log")

    with (
        host("works", workers=2) as working,
        host("listens", workers=0) as listening,
        Client(listening.url) as sender,
        Client(working.url) as other,
    ):
        jobs = [sender.submit(rough_ball, ball).id for _ in range(3)]

        for job_id in jobs:
            assert sender.wait(job_id).state == "succeeded"
            assert sender.mesh(job_id) == other.mesh(job_id)

    assert not any((tmp_path / name).exists() for name in ("works", "listens"))
