"""Files by their content: a blob is named by the SHA-256 of its bytes."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from contextlib import suppress
from typing import IO, TYPE_CHECKING, Self

import obstore
from obstore.exceptions import AlreadyExistsError
from obstore.store import LocalStore, from_url

if TYPE_CHECKING:
    from obstore import GetOptions
    from obstore.store import ObjectStore

    from worker.settings import WorkerSettings


_CHUNK = 1024 * 1024  # bytes
_PART = 5 * 1024 * 1024  # bytes; the least that S3 takes as a part
_PIECE = 256 * 1024  # bytes; what each download holds in memory


class BlobStore:
    """Bytes in a directory or a bucket.

    Equal contents are stored once. A blob is complete as soon as it can be seen.
    Build one in the process that uses it: the store's threads do not survive a fork.
    """

    def __init__(self, store: ObjectStore) -> None:
        self._store = store

    @classmethod
    def open(cls, settings: WorkerSettings) -> Self:
        """The store an installation is configured with."""
        if settings.blob_url is not None:
            return cls(from_url(settings.blob_url))
        return cls(LocalStore(settings.data_dir / "blobs", mkdir=True))

    def put(self, data: bytes) -> str:
        """Store bytes and return their digest, in hexadecimal digits."""
        digest = hashlib.sha256(data).hexdigest()
        with suppress(AlreadyExistsError):
            obstore.put(self._store, _path(digest), data, mode="create", use_multipart=False)
        return digest

    def put_file(self, file: IO[bytes]) -> str:
        """Store an open file's whole content, without holding it in memory; return its digest."""
        name = digest_of(file)
        if not self.exists(name):  # a put in parts cannot ask for "create", but may repeat itself
            file.seek(0)
            obstore.put(
                self._store,
                _path(name),
                iter(lambda: file.read(_CHUNK), b""),
                chunk_size=_PART,
                # By default 12 parts are held at one time: a whole upload of 60 MB.
                max_concurrency=1,
            )
        return name

    def get(self, digest: str) -> bytes:
        """The bytes of a digest.

        Raises:
            FileNotFoundError: there is no such blob.
        """
        return bytes(obstore.get(self._store, _path(digest)).bytes())

    def chunks(self, digest: str, part: range | None = None) -> Iterator[bytes]:
        """The bytes of a digest, or those at the positions of ``part``, in pieces.

        Raises:
            FileNotFoundError: there is no such blob; said at once, not by the iterator.
        """
        options: GetOptions | None = None if part is None else {"range": (part.start, part.stop)}
        found = obstore.get(self._store, _path(digest), options=options)
        return (bytes(piece) for piece in found.stream(min_chunk_size=_PIECE))

    def size(self, digest: str) -> int:
        """How many bytes a blob has.

        Raises:
            FileNotFoundError: there is no such blob.
        """
        return obstore.head(self._store, _path(digest))["size"]

    def exists(self, digest: str) -> bool:
        """Whether there is such a blob."""
        try:
            self.size(digest)
        except FileNotFoundError:
            return False
        return True

    def delete(self, digest: str) -> None:
        """Remove a blob, if it is there."""
        with suppress(FileNotFoundError):
            obstore.delete(self._store, _path(digest))


def digest_of(file: IO[bytes]) -> str:
    """SHA-256 of an open file's whole content, in hexadecimal digits."""
    file.seek(0)
    found = hashlib.sha256()
    while chunk := file.read(_CHUNK):
        found.update(chunk)
    return found.hexdigest()


def _path(digest: str) -> str:
    # Two digits spread the blobs over 256 directories; a single huge one is slow to list.
    return f"{digest[:2]}/{digest}"
