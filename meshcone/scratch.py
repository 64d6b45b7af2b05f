"""Places for the temporary files of processes that may be killed.

A process that is killed removes nothing. So its parent makes the directory that it works in, and
removes it when the process has ended, however it did. Where the parent is killed too, the next
one finds the directory by its name, and by its lock, which ends with whoever held it: an id in
it could have become another process's. (POSIX)
"""

from __future__ import annotations

import fcntl
import logging
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from meshcone.places import is_folder

logger = logging.getLogger(__name__)

_PREFIX = "meshcone-job-"
_MARK = ".meshcone-scratch"  # a folder of somebody's own may have a name like ours
_TRIES = 10  # what the process had started may write for a moment longer
_PAUSE = 0.1  # seconds


@contextmanager
def scratch() -> Iterator[Path | None]:
    """A directory for one process, removed at the end with all that is in it.

    Returns:
        The directory; None if none can be made, which the process itself is to find out, as it
        may not need one.
    """
    try:
        path, lock = _made(_place())
    except OSError as error:
        logger.warning("no directory for temporary files: %s", error)
        yield None
        return
    try:
        yield path
    finally:
        _remove(path)
        os.close(lock)


def work_in(path: Path | None) -> None:
    """Have this process, and those that it starts, put their temporary files there."""
    if path is not None:
        os.environ["TMPDIR"] = tempfile.tempdir = str(path)


def remove_orphans() -> None:
    """Remove the directories of this user whose owners were killed."""
    for path in _place().glob(f"{_PREFIX}*"):
        with suppress(OSError):  # locked, another user's, or gone
            _remove_orphan(path)


def _place() -> Path:
    # Python finds its own by writing there, and goes elsewhere where a disk is full.
    given = Path(os.environ.get("TMPDIR") or "/tmp")  # noqa: S108
    return given if is_folder(given) else Path(tempfile.gettempdir())


def _made(place: Path) -> tuple[Path, int]:
    """Make a directory and lock it; the lock ends with this process and those it forks."""
    while True:
        path = Path(tempfile.mkdtemp(prefix=_PREFIX, dir=place))
        lock = _opened(path)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX)
            (path / _MARK).touch()
        except FileNotFoundError:  # somebody took it for an orphan before it was locked
            os.close(lock)
        except OSError:
            os.close(lock)
            _remove(path)
            raise
        else:
            return path, lock


def _remove_orphan(path: Path) -> None:
    lock = _opened(path)
    try:
        if os.fstat(lock).st_uid != os.geteuid():
            return
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if (path / _MARK).exists():
            _remove(path)
        else:
            path.rmdir()  # its owner came no further; refused where something is in it
    finally:
        os.close(lock)


def _opened(path: Path) -> int:
    return os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)


def _remove(path: Path) -> None:
    for _ in range(_TRIES):
        shutil.rmtree(path, ignore_errors=True)
        if not path.exists():
            return
        time.sleep(_PAUSE)
    logger.warning("temporary files are left in %s", path)
