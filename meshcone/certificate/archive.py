"""Archives of plain arrays: writing them, and reading one that anybody may have made.

Nothing is unpacked before its size is known, and nothing in it is ever executed: headers are
compared with the bytes there are, and pickles are refused.
"""

from __future__ import annotations

import io
import math
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np

LARGEST_ARCHIVE = 4 << 30  # bytes, unpacked
# Positions hardly shrink: an archive that unpacks to more than this multiple of itself is a
# bomb. A small one may: the leaves of a mesh that lies in a plane are all bounded by one face.
_SMALL_ARCHIVE, _LARGEST_RATIO = 8 << 20, 200
_MOST_ARRAYS = 64
# Level 1 takes a quarter of the time of zlib's default, and of index arrays it leaves as little.
_LEVEL, _PROBE, _WORTHWHILE = 1, 1 << 15, 0.9
# What Python and numpy raise at text that is no header of an array.
_UNPARSABLE = (
    SyntaxError,
    tokenize.TokenError,
    MemoryError,
    RecursionError,
    TypeError,
    LookupError,
    AttributeError,
    OverflowError,
    ValueError,
)
# What zipfile and numpy raise at bytes that are no archive of arrays, or a damaged one.
_UNREADABLE = (
    *_UNPARSABLE,
    OSError,
    EOFError,
    RuntimeError,
    zipfile.BadZipFile,
    zlib.error,
)


class ArchiveError(ValueError):
    """The bytes are not an archive that could be a certificate; the message says why."""


def write_arrays(arrays: Mapping[str, Any]) -> bytes:
    """Write arrays as an ``.npz`` archive, which NumPy reads too.

    The same arrays give the same bytes. Coordinates hardly shrink, and are stored as they are.

    Args:
        arrays: by name; none of objects.
    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, array in arrays.items():
            entry = io.BytesIO()
            np.lib.format.write_array(entry, np.asanyarray(array), allow_pickle=False)
            content = entry.getbuffer()
            archive.writestr(
                zipfile.ZipInfo(f"{name}.npy"), content, _way_of_storing(content), _LEVEL
            )
    return buffer.getvalue()


def _way_of_storing(content: memoryview) -> int:
    """How an entry is to be stored; what its beginning does not gain, the rest will not."""
    beginning = content[:_PROBE]
    shrinks = len(zlib.compress(beginning, _LEVEL)) < _WORTHWHILE * len(beginning)
    return zipfile.ZIP_DEFLATED if shrinks else zipfile.ZIP_STORED


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
        raise ArchiveError("the bytes are not an archive of arrays, or it is damaged") from error


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
        name = _name(entry)
        if name in seen:
            raise ArchiveError(
                f"the archive holds two arrays of the same name, {_shown(entry.filename)}"
            )
        seen.add(name)
        _check_header(archive, entry)
    return {_name(entry): _read(archive, entry) for entry in entries}


def _name(entry: zipfile.ZipInfo) -> str:
    """What the array is called: of a file with the ending and one without it, the same."""
    return entry.filename.removesuffix(".npy")


def _check_header(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> None:
    """Compare what an array's header declares with the bytes there are, before reading them."""
    name = _shown(entry.filename)
    if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ArchiveError(f"{name} is compressed by a method that certificates do not use")
    with archive.open(entry) as file:
        if np.lib.format.read_magic(file) != (1, 0):  # later versions allow headers of 4 GiB
            raise ArchiveError(f"the header of {name} has another version")
        try:
            shape, _, dtype = np.lib.format.read_array_header_1_0(file)
        except _UNPARSABLE as error:
            raise ArchiveError(f"the header of {name} cannot be read") from error
        there = entry.file_size - file.tell()
    if dtype.kind not in "iufU" or min(shape, default=0) < 0:
        raise ArchiveError(f"{name} has a type that certificates do not hold: {dtype.str}")
    if math.prod(shape) * dtype.itemsize != there:
        raise ArchiveError(f"the header of {name} does not match its data")


def _read(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> Any:
    with archive.open(entry) as file:
        return np.lib.format.read_array(file, allow_pickle=False)


def _shown(name: str) -> str:
    """A name that somebody chose, on a line."""
    return f"{name!a:.60}"
