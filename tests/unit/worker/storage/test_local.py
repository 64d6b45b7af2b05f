"""A directory as the place of blobs."""

from __future__ import annotations

import errno
import io
import os
from pathlib import Path

import pytest

from worker.storage.errors import StoreError, StoreFullError
from worker.storage.local import UNFINISHED_SECONDS, Directory

NAME = "ab/abcdef.1"


@pytest.fixture
def directory(tmp_path: Path) -> Directory:
    return Directory(tmp_path / "blobs")


def test_what_is_written_is_synced_with_its_folders_before_it_counts(
    directory: Directory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[str] = []
    sync = os.fsync

    def noting(handle: int) -> None:
        synced.append(str(Path(f"/proc/self/fd/{handle}").readlink()))
        sync(handle)

    monkeypatch.setattr(os, "fsync", noting)

    directory.write(NAME, io.BytesIO(b"v 0 0 0"))

    root = tmp_path / "blobs"
    part = next(place for place in synced if place.startswith(str(root / "unfinished/")))
    # The bytes before they get their name, and then the folder that has the name.
    assert synced.index(part) < len(synced) - 1 - synced[::-1].index(str(root / "ab"))
    assert {str(root), str(tmp_path)} <= set(synced)


def test_a_write_that_fails_leaves_nothing(
    directory: Directory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_handle: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)

    with pytest.raises(StoreFullError, match="full"):
        directory.write(NAME, io.BytesIO(b"v 0 0 0"))

    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


def test_another_fault_of_the_disk_is_said_without_a_path(
    directory: Directory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(_handle: int) -> None:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(os, "fsync", broken)

    with pytest.raises(StoreError, match="input/output error") as caught:
        directory.write(NAME, io.BytesIO(b"v 0 0 0"))
    assert str(tmp_path) not in str(caught.value)


def test_what_a_dead_writer_left_is_removed_once_it_is_old(
    directory: Directory, tmp_path: Path
) -> None:
    directory.write(NAME, io.BytesIO(b"kept"))
    unfinished = tmp_path / "blobs/unfinished"
    old, new = unfinished / "abc.1.2", unfinished / "abc.1.3"
    of_an_earlier_version = tmp_path / "blobs/ab/abcdef#1"
    for path in (old, new, of_an_earlier_version):
        path.write_bytes(b"half")
    long_ago = old.stat().st_mtime - UNFINISHED_SECONDS - 1
    for path in (old, of_an_earlier_version):
        os.utime(path, (long_ago, long_ago))

    assert directory.clear_unfinished() == 2
    assert not old.exists()
    assert not of_an_earlier_version.exists()
    assert new.exists()
    assert b"".join(directory.stream(NAME)) == b"kept"


def test_a_change_of_a_file_is_another_version_whatever_its_times_say(
    directory: Directory, tmp_path: Path
) -> None:
    directory.write(NAME, io.BytesIO(b"one"))
    path = tmp_path / "blobs" / NAME
    before, times = directory.version(NAME), path.stat()

    path.write_bytes(b"two")
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))

    assert directory.version(NAME) != before


def test_what_is_not_there_is_not_found_and_may_be_removed_again(directory: Directory) -> None:
    directory.delete(NAME)
    for look in (directory.version, directory.stream, directory.settle):
        with pytest.raises(FileNotFoundError):
            look(NAME)
