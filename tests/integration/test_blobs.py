"""Files by their content, in a directory of this machine."""

from __future__ import annotations

import hashlib
import io
import logging
import tempfile
import threading
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import IO

import pytest

from worker.broker.connections import connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.identifiers import new_job_id
from worker.settings import WorkerSettings
from worker.storage.blobs import BlobStore
from worker.storage.errors import DamagedFileError
from worker.storage.local import Directory
from worker.storage.register import BlobRegister

HOLDER = "test"


@pytest.fixture
def register(broker: EmbeddedBroker) -> Iterator[BlobRegister]:
    with connect_text(broker.url) as client:
        yield BlobRegister(client)


@pytest.fixture
def blobs(register: BlobRegister, tmp_path: Path) -> BlobStore:
    return BlobStore.open(WorkerSettings(data_dir=tmp_path), register)


@pytest.fixture
def content() -> bytes:
    """Bytes that no other test stores: all of them share a broker."""
    return new_job_id().encode()


def stored_file(tmp_path: Path, digest: str) -> Path:
    [path] = [path for path in tmp_path.rglob("*") if path.name.startswith(digest)]
    return path


def test_a_blob_is_known_by_its_content(blobs: BlobStore, content: bytes) -> None:
    digest = blobs.put(content, HOLDER)

    assert digest == hashlib.sha256(content).hexdigest()
    assert blobs.get(digest) == content


def test_equal_contents_are_stored_once(blobs: BlobStore, content: bytes, tmp_path: Path) -> None:
    digest = blobs.put(content, HOLDER)

    assert blobs.put(content, "another") == digest
    assert not blobs.put_file(io.BytesIO(content), digest)
    assert len([path for path in tmp_path.rglob("*") if path.is_file()]) == 1


def test_a_spooled_upload_is_stored_whole_wherever_it_was_read_to(
    blobs: BlobStore, register: BlobRegister, content: bytes
) -> None:
    large = content * 200_000
    digest = hashlib.sha256(large).hexdigest()
    register.lease([digest], HOLDER)
    with tempfile.SpooledTemporaryFile(max_size=1024) as upload:
        upload.write(large)
        assert blobs.put_file(upload, digest)

    assert blobs.get(digest) == large
    assert b"".join(blobs.chunks(digest, range(5, 600_000))) == large[5:600_000]


class _WaitsForAnother(Directory):
    """Writes nothing before two write."""

    def __init__(self, root: Path) -> None:
        super().__init__(root)
        self._two = threading.Barrier(2, timeout=60)

    def write(self, name: str, file: IO[bytes]) -> None:
        self._two.wait()
        super().write(name, file)


def test_files_that_are_stored_together_are_written_side_by_side(
    register: BlobRegister, content: bytes, tmp_path: Path
) -> None:
    blobs = BlobStore(_WaitsForAnother(tmp_path), register)

    digests = blobs.put_all([content + b"1", content + b"2", content + b"1"], HOLDER)

    assert [blobs.get(digest)[-1:] for digest in digests] == [b"1", b"2", b"1"]


class _NotesWhatIsSettled(Directory):
    def __init__(self, root: Path) -> None:
        super().__init__(root)
        self.settled: list[set[str]] = []

    def settle(self, names: Collection[str]) -> None:
        super().settle(names)
        self.settled.append(set(names))


def test_files_that_are_stored_together_are_settled_together_and_once(
    register: BlobRegister, content: bytes, tmp_path: Path
) -> None:
    place = _NotesWhatIsSettled(tmp_path)
    blobs = BlobStore(place, register)

    blobs.put_all([content, content + b"1"], HOLDER)
    blobs.put_all([content, content + b"1"], HOLDER)

    [names] = place.settled
    assert len(names) == 2


def test_a_file_that_another_process_has_written_is_settled_before_it_counts(
    register: BlobRegister, content: bytes, tmp_path: Path
) -> None:
    digest = BlobStore(Directory(tmp_path), register).put(content, HOLDER)
    place = _NotesWhatIsSettled(tmp_path)

    assert not BlobStore(place, register).put_file(io.BytesIO(content), digest)

    [[name]] = place.settled
    assert digest in name


def test_of_files_stored_together_one_that_cannot_be_is_said(
    blobs: BlobStore, register: BlobRegister, content: bytes
) -> None:
    held = hashlib.sha256(content).hexdigest()
    register.lease([held], HOLDER)

    with pytest.raises(FileNotFoundError):
        blobs.put_files({held: io.BytesIO(content), "f" * 64: io.BytesIO(b"nobody's")})


def test_an_empty_file_is_a_blob_too(blobs: BlobStore) -> None:
    assert blobs.get(blobs.put(b"", HOLDER)) == b""


def test_what_nobody_has_asked_to_keep_is_not_found_and_not_stored(blobs: BlobStore) -> None:
    unknown = hashlib.sha256(new_job_id().encode()).hexdigest()

    with pytest.raises(FileNotFoundError):
        blobs.get(unknown)
    with pytest.raises(FileNotFoundError):
        blobs.put_file(io.BytesIO(), unknown)
    assert not blobs.exists(unknown)


@pytest.mark.parametrize("damage", [b"", b"x", b"something else of another length"])
def test_a_damaged_blob_is_set_aside_and_healed_by_the_same_content(
    blobs: BlobStore,
    content: bytes,
    damage: bytes,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
) -> None:
    digest = blobs.put(content, HOLDER)
    stored_file(tmp_path, digest).write_bytes(damage)

    with caplog.at_level(logging.ERROR), pytest.raises(DamagedFileError, match="set aside"):
        blobs.get(digest)
    assert "is damaged; it is set aside" in caplog.text
    assert not blobs.exists(digest)
    assert stored_file(tmp_path, digest).read_bytes() == damage

    blobs.put(content, HOLDER)
    assert blobs.get(digest) == content


def test_a_download_of_a_damaged_blob_says_so_before_its_first_byte(
    blobs: BlobStore, content: bytes, tmp_path: Path
) -> None:
    digest = blobs.put(content, HOLDER)
    assert b"".join(blobs.chunks(digest)) == content
    path = stored_file(tmp_path, digest)
    path.write_bytes(bytes(reversed(path.read_bytes())))

    with pytest.raises(DamagedFileError):
        blobs.chunks(digest, range(2))


def test_storing_again_what_is_damaged_heals_it(
    blobs: BlobStore, content: bytes, tmp_path: Path
) -> None:
    digest = blobs.put(content, HOLDER)
    stored_file(tmp_path, digest).write_bytes(b"flipped")

    blobs.put(content, "another")

    assert blobs.get(digest) == content


def test_a_lost_blob_is_said_and_healed_by_the_same_content(
    blobs: BlobStore, content: bytes, tmp_path: Path
) -> None:
    digest = blobs.put(content, HOLDER)
    stored_file(tmp_path, digest).unlink()

    with pytest.raises(DamagedFileError, match="lost"):
        blobs.get(digest)
    blobs.put(content, HOLDER)

    assert blobs.get(digest) == content


def test_a_store_can_be_named_by_url(register: BlobRegister, tmp_path: Path) -> None:
    settings = WorkerSettings(data_dir=tmp_path, blob_url=f"file://{tmp_path}/apart")
    blobs = BlobStore.open(settings, register)
    content = new_job_id().encode()

    assert blobs.get(blobs.put(content, HOLDER)) == content
    assert any((tmp_path / "apart").iterdir())
