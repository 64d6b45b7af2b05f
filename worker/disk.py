"""Whether there is room on the disk."""

from __future__ import annotations

import shutil
from pathlib import Path

from meshcone.errors import InternalError

LEAST_ROOM = 1024 * 1024  # bytes; with less the broker would end again at once


def has_room(directory: Path, room: int = LEAST_ROOM) -> bool:
    """Whether the disk of a directory has so many bytes of room.

    Raises:
        OSError: the directory cannot be looked at.
    """
    return shutil.disk_usage(directory).free >= room


def require_room(directory: Path) -> None:
    """Refuse a disk that is full.

    Raises:
        InternalError: it is.
        OSError: the directory cannot be looked at.
    """
    if not has_room(directory):
        raise InternalError(f"the disk of '{directory}' is full: make room on it")
