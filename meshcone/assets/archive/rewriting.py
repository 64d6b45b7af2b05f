"""An archive with other bytes for one of its files."""

from __future__ import annotations

import struct
import zlib
from dataclasses import replace

from meshcone.assets.archive.directory import (
    DEFLATED,
    END,
    ENTRY,
    LOCAL,
    ZIP64_EXTRA,
    Directory,
    Entry,
    extra_fields,
)
from meshcone.errors import InputError

_DESCRIPTOR = 1 << 3  # sizes come after the data (section 4.3.9)
_LARGEST = 0xFFFFFFFF


def with_content(data: bytes, directory: Directory, name: str, content: bytes) -> bytes:
    """Replace a file's content; what every other entry has in the archive stays as it is.

    Args:
        data: the archive.
        directory: its directory.
        name: the file's path.
        content: what it holds from now on, compressed as before.

    Raises:
        InputError: the archive would be too large for offsets of 32 bits.
    """
    entry = directory.files[name]
    packed = _deflated(content) if entry.method == DEFLATED else content
    if len(data) + len(packed) + ENTRY.size >= _LARGEST:
        raise InputError("the archive would be larger than 4 GB, which cannot be written")
    changed = replace(entry, crc=zlib.crc32(content), packed=len(packed), size=len(content))
    starts = sorted({each.local for each in directory.entries} | {directory.start})
    end = starts[starts.index(entry.local) + 1]
    inside = _local_header(data, changed) + packed
    moved = entry.local + len(inside) - end
    table = bytearray()
    for each in directory.entries:
        found = changed if each is entry else each
        offset = each.local + (moved if each.local > entry.local else 0)
        table += _record(data, found, offset, rewritten=each is entry)
    count, comment = len(directory.entries), directory.comment
    start = directory.start + moved
    tail = END.pack(b"PK\5\6", 0, 0, count, count, len(table), start, len(comment))
    pieces = data[: entry.local], inside, data[end : directory.start], table, tail, comment
    return b"".join(pieces)


def _deflated(content: bytes) -> bytes:
    packing = zlib.compressobj(zlib.Z_DEFAULT_COMPRESSION, zlib.DEFLATED, -zlib.MAX_WBITS)
    return packing.compress(content) + packing.flush()


def _local_header(data: bytes, entry: Entry) -> bytes:
    fields = list(LOCAL.unpack_from(data, entry.local))
    name_end = entry.local + LOCAL.size + fields[9]
    extra = _narrow(data[name_end : name_end + fields[10]])
    fields[2] &= ~_DESCRIPTOR
    fields[6:9] = entry.crc, entry.packed, entry.size
    fields[10] = len(extra)
    return LOCAL.pack(*fields) + data[entry.local + LOCAL.size : name_end] + extra


def _record(data: bytes, entry: Entry, offset: int, *, rewritten: bool) -> bytes:
    """An entry of the directory, with its numbers in 32 bits."""
    fields = list(ENTRY.unpack_from(data, entry.at))
    name_end = entry.at + ENTRY.size + fields[10]
    extra_end = name_end + fields[11]
    comment = data[extra_end : extra_end + fields[12]]
    extra = _narrow(data[name_end:extra_end])
    if rewritten:
        fields[3] &= ~_DESCRIPTOR
    fields[7:10] = entry.crc, entry.packed, entry.size
    fields[11] = len(extra)
    fields[16] = offset
    return ENTRY.pack(*fields) + data[entry.at + ENTRY.size : name_end] + extra + comment


def _narrow(extra: bytes) -> bytes:
    """Extra fields without sizes and offsets of 64 bits, which are written in 32."""
    kept = [(tag, body) for tag, body in extra_fields(extra) if tag != ZIP64_EXTRA]
    if len(kept) == len(list(extra_fields(extra))):
        return extra
    return b"".join(struct.pack("<2H", tag, len(body)) + body for tag, body in kept)
