"""Blobs in a directory of this machine, or one that several machines have mounted."""

from __future__ import annotations

import errno
import os
import re
import secrets
import shutil
import time
from collections.abc import Collection, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

from worker.storage.errors import FULL_DISK, StoreError, StoreFullError
from worker.storage.versions import Version

ROOM_LEFT = 4 * 1024 * 1024
"""Bytes no file is stored in: the embedded broker, beside it, has to write down what happens."""

UNFINISHED_SECONDS = 600
"""How long ago an unfinished file was last written to when its writer counts as dead.

A writer that lives after all finds its file gone and fails; nothing else comes of it.
"""

_SYNCS = 8  # at a time
_CHUNK = 1024 * 1024  # bytes
_PIECE = 256 * 1024  # bytes; what each download holds in memory
_UNFINISHED = "unfinished"
_OLD_UNFINISHED = re.compile(r".*#\d+")  # what versions before this one called them
_SEARCH_INTERVAL = 3600.0  # seconds; they are all over the directory


class Directory:
    """A :class:`worker.storage.places.Place`.

    Its directory is made at once if that can be done, or else by the first write, which says
    why it cannot.
    """

    def __init__(self, root: Path) -> None:
        self._root = root
        with suppress(OSError):
            _make(root)
        self._searched_at = float("-inf")

    def version(self, name: str) -> Version:
        """See :class:`worker.storage.places.Place`."""
        with _plainly():
            found = (self._root / name).stat()
        # Who writes can set the time of that as he likes, but not the time of the change.
        times = f"{found.st_mtime_ns}-{found.st_ctime_ns}"
        return Version(found.st_size, f"{found.st_ino}-{found.st_size}-{times}")

    def write(self, name: str, file: IO[bytes]) -> None:
        """See :class:`worker.storage.places.Place`."""
        target = self._root / name
        part = self._root / _UNFINISHED / f"{target.name}.{secrets.token_hex(4)}"
        with _plainly():
            _make(self._root)
            for folder in (target.parent, part.parent):
                folder.mkdir(exist_ok=True)
            self._require_room(file)
            try:
                with part.open("xb") as out:
                    shutil.copyfileobj(file, out, _CHUNK)
                    out.flush()
                    os.fsync(out.fileno())
                _finish(part, target)
            except BaseException:  # also a time limit or Ctrl-C: no part of a file is left
                part.unlink(missing_ok=True)
                raise

    def settle(self, names: Collection[str]) -> None:
        """See :class:`worker.storage.places.Place`.

        The bytes were synced before they got a name. That is in a folder, which is in others, and
        any of them may have been made a moment ago, by this process or by another.
        """
        folders = {(self._root / name).parent for name in names} | {self._root, self._root.parent}
        # A disk lets several wait for it together.
        with _plainly(), ThreadPoolExecutor(min(_SYNCS, len(folders))) as syncs:
            for synced in [syncs.submit(_sync, folder) for folder in folders]:
                synced.result()

    def stream(self, name: str, part: range | None = None) -> Iterator[bytes]:
        """See :class:`worker.storage.places.Place`."""
        with _plainly():
            file = (self._root / name).open("rb")
        return _pieces(file, part)

    def delete(self, name: str) -> None:
        """See :class:`worker.storage.places.Place`."""
        with _plainly():
            (self._root / name).unlink(missing_ok=True)

    def require_writable(self) -> None:
        """See :class:`worker.storage.places.Place`."""
        with _plainly(), TemporaryFile(dir=self._root, buffering=0) as probe:
            self._require_room(probe)
            probe.write(b"ready")

    def clear_unfinished(self) -> int:
        """See :class:`worker.storage.places.Place`."""
        with _plainly():
            found = _files_in(self._root / _UNFINISHED)
            if time.monotonic() - self._searched_at > _SEARCH_INTERVAL:
                self._searched_at = time.monotonic()
                found += [
                    path
                    for folder in self._root.glob("??")
                    for path in _files_in(folder)
                    if _OLD_UNFINISHED.fullmatch(path.name)
                ]
            return sum(_remove_if_old(path) for path in found)

    def _require_room(self, file: IO[bytes]) -> None:
        size = file.seek(0, os.SEEK_END)
        file.seek(0)
        disk = os.statvfs(self._root)
        if disk.f_bavail * disk.f_frsize < size + ROOM_LEFT:
            raise StoreFullError


@contextmanager
def _plainly() -> Iterator[None]:
    try:
        yield
    except FileNotFoundError:
        raise
    except OSError as error:
        if error.errno in FULL_DISK:
            raise StoreFullError from error
        reason = (error.strerror or "unknown reason").lower()
        raise StoreError(f"the file store cannot be used: {reason}") from error


def _finish(part: Path, target: Path) -> None:
    try:
        part.rename(target)
    except FileNotFoundError:  # housekeeping took it for one that nobody writes any more
        raise StoreError("an unfinished file was removed while it was written; try again") from None


def _pieces(file: IO[bytes], part: range | None) -> Iterator[bytes]:
    with file, _plainly():
        if part is None:
            while piece := file.read(_PIECE):
                yield piece
            return
        file.seek(part.start)
        left = len(part)
        while left and (piece := file.read(min(_PIECE, left))):
            left -= len(piece)
            yield piece


def _make(folder: Path) -> None:
    missing = []
    while not folder.exists():
        missing.append(folder)
        folder = folder.parent
    for each in reversed(missing):
        each.mkdir(exist_ok=True)
    for each in missing:
        _sync(each.parent)


def _sync(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # some file systems have no need
            raise
    finally:
        os.close(handle)


def _files_in(folder: Path) -> list[Path]:
    try:
        return [Path(entry.path) for entry in os.scandir(folder) if entry.is_file()]
    except FileNotFoundError:
        return []


def _remove_if_old(path: Path) -> bool:
    with suppress(FileNotFoundError):  # finished meanwhile
        if time.time() - path.stat().st_mtime > UNFINISHED_SECONDS:
            path.unlink()
            return True
    return False
