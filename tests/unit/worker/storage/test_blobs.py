from __future__ import annotations

import hashlib
import io
import tempfile
from pathlib import Path

import pytest

from worker.settings import WorkerSettings
from worker.storage.blobs import BlobStore


@pytest.fixture
def blobs(tmp_path: Path) -> BlobStore:
    return BlobStore.open(WorkerSettings(data_dir=tmp_path))


def test_a_blob_is_named_by_its_content(blobs: BlobStore) -> None:
    digest = blobs.put(b"v 0 0 0")

    assert digest == hashlib.sha256(b"v 0 0 0").hexdigest()
    assert blobs.get(digest) == b"v 0 0 0"


def test_equal_contents_are_stored_once(blobs: BlobStore, tmp_path: Path) -> None:
    assert blobs.put(b"same") == blobs.put(b"same") == blobs.put_file(io.BytesIO(b"same"))
    assert len([path for path in tmp_path.rglob("*") if path.is_file()]) == 1


def test_a_spooled_upload_is_stored_whole_wherever_it_was_read_to(blobs: BlobStore) -> None:
    content = bytes(range(256)) * 40_000
    with tempfile.SpooledTemporaryFile(max_size=1024) as upload:
        upload.write(content)
        digest = blobs.put_file(upload)

    assert blobs.get(digest) == content


def test_an_empty_file_is_a_blob_too(blobs: BlobStore) -> None:
    assert blobs.get(blobs.put_file(io.BytesIO())) == b""


def test_a_missing_blob_is_not_found(blobs: BlobStore) -> None:
    with pytest.raises(FileNotFoundError):
        blobs.get("0" * 64)
    assert not blobs.exists("0" * 64)


def test_a_deleted_blob_is_gone_and_may_be_deleted_again(blobs: BlobStore) -> None:
    digest = blobs.put(b"gone")

    blobs.delete(digest)
    blobs.delete(digest)

    assert not blobs.exists(digest)


def test_a_store_can_be_named_by_url(tmp_path: Path) -> None:
    blobs = BlobStore.open(WorkerSettings(data_dir=tmp_path, blob_url=f"file://{tmp_path}"))

    assert blobs.get(blobs.put(b"by url")) == b"by url"
