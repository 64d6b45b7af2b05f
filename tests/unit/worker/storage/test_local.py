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


@pytest.fixture
def synced(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The paths of what is synced, in order."""
    paths: list[str] = []
    sync = os.fsync

    def noting(handle: int) -> None:
        paths.append(str(Path(f"/proc/self/fd/{handle}").readlink()))
        sync(handle)

    monkeypatch.setattr(os, "fsync", noting)
    return paths


def test_the_bytes_of_a_file_are_synced_before_they_get_their_name(
    directory: Directory, tmp_path: Path, synced: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    rename, seen = Path.rename, []

    def noting(path: Path, target: Path) -> Path:
        seen.append((str(path) in synced, target))
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", noting)

    directory.write(NAME, io.BytesIO(b"v 0 0 0"))

    assert seen == [(True, tmp_path / "blobs" / NAME)]


def test_names_are_settled_by_the_folders_that_have_them_each_of_them_once(
    directory: Directory, tmp_path: Path, synced: list[str]
) -> None:
    names = [NAME, "ab/abccba.1", "cd/cdefab.1"]
    for name in names:
        directory.write(name, io.BytesIO(name.encode()))
    del synced[:]

    directory.settle(names)

    root = tmp_path / "blobs"
    assert sorted(synced) == sorted(map(str, (tmp_path, root, root / "ab", root / "cd")))


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
    for look in (directory.version, directory.stream):
        with pytest.raises(FileNotFoundError):
            look(NAME)
