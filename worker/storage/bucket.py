"""Blobs in a bucket."""

from __future__ import annotations

import logging
import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from datetime import timedelta
from typing import IO, TYPE_CHECKING, Self

import obstore
from obstore.exceptions import BaseError as ObstoreError
from obstore.store import from_url

from worker.storage.errors import StoreError
from worker.storage.versions import Version

if TYPE_CHECKING:
    from obstore import BytesStream, GetOptions
    from obstore.store import ObjectStore, RetryConfig

logger = logging.getLogger(__name__)

_CHUNK = 1024 * 1024  # bytes
_PART = 5 * 1024 * 1024  # bytes; the least that S3 takes as a part
_PROBE = "ready"  # an object that is written to see whether any can be
_PIECE = 256 * 1024  # bytes; what each download holds in memory
# By default a request that fails is repeated for three minutes and more. Its time limits, of 5 s
# and 30 s, stay: options given here would replace all those of the environment.
_RETRIES: RetryConfig = {"max_retries": 4, "retry_timeout": timedelta(seconds=45)}


class Bucket:
    """A :class:`worker.storage.places.Place`.

    Build one in the process that uses it: its threads do not survive a fork.
    """

    def __init__(self, store: ObjectStore, hasty: ObjectStore) -> None:
        self._store = store
        self._hasty = hasty  # the same bucket, where a request that fails is not repeated

    @classmethod
    def open(cls, url: str) -> Self:
        """The bucket of a URL such as s3://bucket/prefix."""
        return cls(
            from_url(url, retry_config=_RETRIES), from_url(url, retry_config={"max_retries": 0})
        )

    def version(self, name: str) -> Version:
        """See :class:`worker.storage.places.Place`."""
        with _plainly():
            found = obstore.head(self._store, name)
        changed = found["last_modified"].isoformat()
        return Version(found["size"], f"{found['e_tag']}-{found['size']}-{changed}")

    def write(self, name: str, file: IO[bytes]) -> None:
        """See :class:`worker.storage.places.Place`."""
        size = file.seek(0, os.SEEK_END)
        file.seek(0)
        with _plainly():
            # What is there under the name may be replaced: it is the same, or damaged.
            if size <= _PART:
                obstore.put(self._store, name, file.read(), use_multipart=False)
                return
            obstore.put(
                self._store,
                name,
                iter(lambda: file.read(_CHUNK), b""),
                chunk_size=_PART,
                # By default 12 parts are held at one time: a whole upload of 60 MB.
                max_concurrency=1,
            )

    def settle(self, names: Collection[str]) -> None:
        """Nothing is left to do: a bucket answers when it has written."""

    def stream(self, name: str, part: range | None = None) -> Iterator[bytes]:
        """See :class:`worker.storage.places.Place`."""
        options: GetOptions | None = None if part is None else {"range": (part.start, part.stop)}
        with _plainly():
            found = obstore.get(self._store, name, options=options)
        return _pieces(found.stream(min_chunk_size=_PIECE))

    def delete(self, name: str) -> None:
        """See :class:`worker.storage.places.Place`."""
        with _plainly(), suppress(FileNotFoundError):
            obstore.delete(self._store, name)

    def require_writable(self) -> None:
        """See :class:`worker.storage.places.Place`."""
        with _plainly():
            obstore.put(self._hasty, _PROBE, b"ready", use_multipart=False)

    def clear_unfinished(self) -> int:
        """Nothing: the client cannot list unfinished uploads; a rule of the bucket can."""
        return 0


@contextmanager
def _plainly() -> Iterator[None]:
    try:
        yield
    except FileNotFoundError:
        raise
    except (ObstoreError, OSError) as error:
        logger.error("the file store cannot be used: %s", error)
        raise StoreError("the file store cannot be reached; try again later") from error


def _pieces(stream: BytesStream) -> Iterator[bytes]:
    with _plainly():
        for piece in stream:
            yield bytes(piece)
