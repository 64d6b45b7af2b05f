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
from worker.broker.embedded import EmbeddedBroker
from worker.settings import WorkerSettings
from worker.storage.blobs import BlobStore


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
def blobs(bucket: ObjectStore) -> BlobStore:
    return BlobStore.open(WorkerSettings(blob_url=bucket.url))


def objects_in(bucket: ObjectStore) -> list[str]:
    return [each["path"] for each in obstore.list(from_url(bucket.url)).collect()]


def test_equal_contents_are_one_object(blobs: BlobStore, bucket: ObjectStore) -> None:
    digest = blobs.put(b"twice")

    assert blobs.put(b"twice") == digest == hashlib.sha256(b"twice").hexdigest()
    assert blobs.get(digest) == b"twice"
    assert [path for path in objects_in(bucket) if path.endswith(digest)] == [
        f"{digest[:2]}/{digest}"
    ]


def test_a_file_too_large_for_one_request_is_stored_in_parts(blobs: BlobStore) -> None:
    content = bytes(range(256)) * 65_536  # 16 MiB

    digest = blobs.put_file(io.BytesIO(content))

    assert blobs.get(digest) == content


def test_a_deleted_object_is_gone_and_may_be_deleted_again(blobs: BlobStore) -> None:
    digest = blobs.put(b"short-lived")

    for _ in range(2):
        blobs.delete(digest)

    assert not blobs.exists(digest)
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
