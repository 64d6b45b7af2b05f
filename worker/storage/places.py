"""Where the bytes of blobs are: what a directory and a bucket have in common."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import IO, TYPE_CHECKING, Protocol
from urllib.parse import unquote, urlsplit

from worker.storage.bucket import Bucket
from worker.storage.local import Directory
from worker.storage.versions import Version

if TYPE_CHECKING:
    from worker.settings import WorkerSettings


class Place(Protocol):
    """Bytes by name; a name has two digits, a slash and more.

    What is written cannot be seen before it is complete, and survives a loss of power as soon as
    it is settled. Every method raises :class:`StoreError` where the place
    cannot be used, and those that read raise ``FileNotFoundError`` where nothing has the name.
    """

    def version(self, name: str) -> Version:
        """What is there."""

    def write(self, name: str, file: IO[bytes]) -> None:
        """Put an open file's whole content there, without holding it in memory."""

    def settle(self, names: Collection[str]) -> None:
        """Have what can be seen there, whoever wrote it, survive a loss of power."""

    def stream(self, name: str, part: range | None = None) -> Iterator[bytes]:
        """What is there, or at the positions of ``part``, in pieces; looked for at once."""

    def delete(self, name: str) -> None:
        """Remove what is there, if anything is."""

    def require_writable(self) -> None:
        """Try at once whether something can be written; no name of a blob is used for it."""

    def clear_unfinished(self) -> int:
        """Remove what writers that died have left, and return how many files that was."""


def open_place(settings: WorkerSettings) -> Place:
    """The place an installation is configured with."""
    directory = store_directory(settings)
    if directory is not None:
        return Directory(directory)
    assert settings.blob_url is not None  # noqa: S101 - else it would be a directory
    return Bucket.open(settings.blob_url)


def store_directory(settings: WorkerSettings) -> Path | None:
    """Where the files are, if that is a directory of this machine."""
    url = settings.blob_url
    if url is None:
        return settings.data_dir / "blobs"
    return Path(unquote(urlsplit(url).path)) if url.startswith("file://") else None
