"""Objects of buckets that the installation lets jobs name."""

from __future__ import annotations

import os
from datetime import timedelta
from functools import lru_cache
from typing import IO, TYPE_CHECKING

import obstore
from obstore.exceptions import BaseError as ObstoreError
from obstore.exceptions import PermissionDeniedError, UnauthenticatedError
from obstore.store import from_url

from meshcone.errors import InputError
from worker.transfers.errors import PassingError
from worker.transfers.places import host_of, object_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from obstore.store import ObjectStore, RetryConfig

    from worker.transfers.budget import Budget

_PART = 5 * 1024 * 1024  # bytes; the least that S3 takes as a part
_PIECE = 256 * 1024  # bytes
# What fails is tried again by whoever asked, after longer pauses.
_RETRIES: RetryConfig = {"max_retries": 1, "retry_timeout": timedelta(seconds=20)}


class Buckets:
    """Fetches and puts objects below some prefixes.

    Credentials are those of the S3 client's own variables.

    Args:
        allowed: the prefixes, such as ``s3://bucket/incoming``.
    """

    def __init__(self, allowed: Sequence[str]) -> None:
        self._allowed = allowed

    async def fetch(self, url: str, into: IO[bytes], budget: Budget) -> None:
        """Write an object into a file; raises what :meth:`worker.transfers.web.Web.fetch` does."""
        prefix, key = object_of(url, "the URL", self._allowed, "MESHCONE_FETCH_BUCKETS")
        where = host_of(url)
        try:
            found = await obstore.get_async(_store(prefix), key)
            budget.require(found.meta["size"])
            async for piece in found.stream(min_chunk_size=_PIECE):
                budget.spend(len(piece))
                into.write(piece)
        except FileNotFoundError:
            raise InputError(f"{where} has no such object; look at its key") from None
        except (PermissionDeniedError, UnauthenticatedError):
            raise InputError(f"{where} does not let this installation read the object") from None
        except ObstoreError as error:
            raise PassingError(f"{where} cannot be read: {type(error).__name__}") from None

    async def put(self, url: str, content: IO[bytes], media_type: str) -> None:
        """Make a file an object, in place of any that is there.

        Raises:
            InputError: it may not be put there. A
                :class:`~worker.transfers.errors.PassingError` if that may change by itself.
        """
        prefix, key = object_of(url, "the URL", self._allowed, "MESHCONE_OUTPUT_BUCKETS")
        where = host_of(url)
        size = content.seek(0, os.SEEK_END)
        content.seek(0)
        try:
            await obstore.put_async(
                _store(prefix),
                key,
                content,
                attributes={"Content-Type": media_type},
                use_multipart=size > _PART,
                chunk_size=_PART,
                max_concurrency=1,  # by default 12 parts are held at one time
            )
        except (PermissionDeniedError, UnauthenticatedError):
            raise InputError(f"{where} does not let this installation put the object") from None
        except (ObstoreError, FileNotFoundError) as error:
            raise PassingError(f"{where} cannot be written: {type(error).__name__}") from None


@lru_cache(maxsize=64)
def _store(prefix: str) -> ObjectStore:
    return from_url(prefix, retry_config=_RETRIES)
