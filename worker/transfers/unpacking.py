"""The content of an answer, unpacked as it comes, in bounded pieces."""

from __future__ import annotations

import zlib
from collections.abc import Iterator

from meshcone.errors import InputError
from worker.transfers.errors import PassingError

MEMBERS = 64
"""Members of gzip that an answer may have; each is begun anew, at a cost."""

_PIECE = 256 * 1024  # bytes
_EITHER = zlib.MAX_WBITS | 32  # gzip or zlib, whichever its header says


class Plain:
    """Content that is sent as it is."""

    def unpacked(self, data: bytes) -> Iterator[bytes]:
        """What a piece of the content adds."""
        if data:
            yield data

    def finish(self) -> None:
        """Nothing can be missing that the length of the answer does not tell."""


class Gzip:
    """Content in gzip or zlib: members follow each other (RFC 1952, section 2.2)."""

    def __init__(self) -> None:
        self._member = zlib.decompressobj(_EITHER)
        self._is_begun = False
        self._members = 1
        self._is_empty = True  # the member, so far

    def unpacked(self, data: bytes) -> Iterator[bytes]:
        """What a piece of the content adds, in pieces of a size that does not depend on it.

        Raises:
            InputError: it is not what its header says, or has too many members, or an empty one
                after the first: any number of those would cost time and add nothing.
        """
        try:
            while data:
                if self._member.eof:
                    self._begin_member()
                self._is_begun = True
                piece = self._member.decompress(data, _PIECE)
                if piece:
                    self._is_empty = False
                    yield piece
                if self._member.eof and self._is_empty and self._members > 1:
                    raise InputError("the answer is packed (gzip) with an empty member in it")
                data = self._member.unconsumed_tail or self._member.unused_data
        except zlib.error:
            raise InputError("the answer says that it is packed (gzip), and is not") from None

    def _begin_member(self) -> None:
        if self._members == MEMBERS:
            raise InputError(
                f"the answer is packed (gzip) in more than {MEMBERS} members; serve the file as "
                "it is, or as one"
            )
        self._members += 1
        self._is_empty = True
        self._member = zlib.decompressobj(_EITHER)

    def finish(self) -> None:
        """Require that the last member has ended.

        Raises:
            PassingError: it has not.
        """
        if self._is_begun and not self._member.eof:
            raise PassingError("the answer ended in the middle of its packed content")


def unpacker(encoding: str) -> Plain | Gzip:
    """What unpacks a ``Content-Encoding`` (RFC 9110, section 8.4.1).

    Raises:
        InputError: nothing does.
    """
    if encoding in ("", "identity"):
        return Plain()
    if encoding in ("gzip", "x-gzip", "deflate"):
        return Gzip()
    raise InputError(
        f"the answer is packed as '{encoding[:40]}'; serve the file as it is, or as gzip"
    )
