"""Reading an archive of plain arrays that anybody may have made.

Nothing is unpacked before its size is known, and nothing in it is ever executed: headers are
compared with the bytes there are, and pickles are refused.
"""

from __future__ import annotations

import io
import math
import tokenize
import zipfile
import zlib
from typing import Any

import numpy as np

LARGEST_ARCHIVE = 4 << 30  # bytes, unpacked
# Positions hardly shrink: an archive that unpacks to more than this multiple of itself is a
# bomb. A small one may: the leaves of a mesh that lies in a plane are all bounded by one face.
_SMALL_ARCHIVE, _LARGEST_RATIO = 8 << 20, 200
_MOST_ARRAYS = 64
# What Python's parser raises at text that is no header of an array.
_UNPARSABLE = (SyntaxError, tokenize.TokenError, MemoryError, TypeError, OverflowError, ValueError)
# What zipfile and numpy raise at bytes that are no archive of arrays, or a damaged one.
_UNREADABLE = (
    KeyError,
    ValueError,
    OSError,
    EOFError,
    RuntimeError,
    zipfile.BadZipFile,
    zlib.error,
)


class ArchiveError(ValueError):
    """The bytes are no archive of arrays as a certificate is one; the message says why."""


def read_arrays(data: bytes, most: int = LARGEST_ARCHIVE) -> dict[str, Any]:
    """Read every array of an ``.npz`` archive.

    Args:
        data: the archive.
        most: bytes that it may unpack to.

    Raises:
        ArchiveError: it is none, or one that no certificate is.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return _arrays(archive, min(most, _SMALL_ARCHIVE + _LARGEST_RATIO * len(data)))
    except ArchiveError:
        raise
    except _UNREADABLE as error:
        raise ArchiveError("the bytes are no archive of arrays, or a damaged one") from error


def _arrays(archive: zipfile.ZipFile, most: int) -> dict[str, Any]:
    entries = archive.infolist()
    unpacked = sum(entry.file_size for entry in entries)
    if unpacked > most:
        raise ArchiveError(
            f"the archive unpacks to more than any certificate holds: {unpacked:,} bytes, "
            f"at most {most:,}"
        )
    if len(entries) > _MOST_ARRAYS:
        raise ArchiveError(f"the archive holds {len(entries):,} arrays, at most {_MOST_ARRAYS}")
    seen: set[str] = set()
    for entry in entries:
        if entry.filename in seen:
            raise ArchiveError(
                f"the archive holds two arrays of the same name, {_shown(entry.filename)}"
            )
        seen.add(entry.filename)
        _check_header(archive, entry)
    return {entry.filename.removesuffix(".npy"): _read(archive, entry) for entry in entries}


def _check_header(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> None:
    """Compare what an array's header declares with the bytes there are, before reading them."""
    name = _shown(entry.filename)
    if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ArchiveError(f"{name} is compressed in a way no certificate is")
    with archive.open(entry) as file:
        if np.lib.format.read_magic(file) != (1, 0):  # later versions allow headers of 4 GiB
            raise ArchiveError(f"the header of {name} has another version")
        try:
            shape, _, dtype = np.lib.format.read_array_header_1_0(file)
        except _UNPARSABLE as error:
            raise ArchiveError(f"the header of {name} cannot be read") from error
        there = entry.file_size - file.tell()
    if dtype.kind not in "iufU" or min(shape, default=0) < 0:
        raise ArchiveError(f"{name} is of a type no certificate holds: {dtype.str}")
    if math.prod(shape) * dtype.itemsize != there:
        raise ArchiveError(f"the header of {name} declares other data than there are")


def _read(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> Any:
    with archive.open(entry) as file:
        return np.lib.format.read_array(file, allow_pickle=False)


def _shown(name: str) -> str:
    """A name that somebody chose, on a line."""
    return f"{name!a:.60}"
