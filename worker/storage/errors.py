"""What can go wrong with a stored file."""

from __future__ import annotations

import errno

FULL_DISK = (errno.ENOSPC, errno.EDQUOT)
"""The numbers of an ``OSError`` that says so."""


class StoreError(Exception):
    """The file store cannot be used just now; another try may succeed."""


class StoreFullError(StoreError):
    """The disk of this installation is full."""

    def __init__(self) -> None:
        super().__init__("the disk of the file store is full; work goes on when it has room")


class DamagedFileError(Exception):
    """The store has other bytes under a digest than those it was given, or none any more.

    The damaged file has been set aside: sending the same bytes again heals every job that
    refers to them.
    """

    def __init__(self, digest: str, *, lost: bool) -> None:
        found = (
            "is not in the file store; it was lost, or was damaged and has been set aside"
            if lost
            else "is damaged and has been set aside"
        )
        super().__init__(f"the stored file {found}; send it again")
        self.digest = digest
