"""The directory of a ZIP archive: what is in it, and where (PKWARE's APPNOTE 6.3.10).

Python's own module reads one too. It takes any number of entries before a caller can count them,
and a file of which only one entry changes cannot be written with it.
"""

from __future__ import annotations

import re
import stat
import struct
import unicodedata
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

from meshcone.assets.limits import Limits
from meshcone.errors import InputError
from meshcone.relative_names import inside

# Sections 4.3.7, 4.3.12, 4.3.16, 4.3.14 and 4.3.15 of the note.
LOCAL = struct.Struct("<4s5H3L2H")
ENTRY = struct.Struct("<4s6H3L5H2L")
END = struct.Struct("<4s4H2LH")
_END64 = struct.Struct("<4sQ2H2L4Q")
_LOCATOR = struct.Struct("<4sLQL")
_LOCAL_MARK, _ENTRY_MARK = b"PK\x03\x04", b"PK\x01\x02"
_END_MARK, _END64_MARK, _LOCATOR_MARK = b"PK\x05\x06", b"PK\x06\x06", b"PK\x06\x07"
_ENCRYPTED, _UTF8 = 1, 1 << 11
STORED, DEFLATED = 0, 8
_SMALL = 16 * 1024 * 1024  # bytes that nobody needs protection from
_FULL16, _FULL32 = 0xFFFF, 0xFFFFFFFF
ZIP64_EXTRA, _UNICODE_PATH_EXTRA = 0x0001, 0x7075
_ROOT = "_"  # stands for the folder that an archive is, and begins no drive or scheme
_DRIVE = re.compile(r"[A-Za-z]:")


def is_archive(data: bytes) -> bool:
    """Whether a file is a ZIP archive, an empty one too."""
    return data.startswith((_LOCAL_MARK, _END_MARK))


@dataclass(frozen=True)
class Entry:
    """One file of an archive, or a folder.

    Attributes:
        name: its path, in one spelling.
        is_file: whether it is no folder.
        at: where its record in the directory begins.
        method: how it is compressed.
        crc: of its content.
        packed, size: bytes of its data in the archive, and of its content.
        local: where its header begins; its data come after that.
        start: where its data begin.
    """

    name: str
    is_file: bool
    at: int
    method: int
    crc: int
    packed: int
    size: int
    local: int
    start: int


@dataclass(frozen=True)
class Directory:
    """All that an archive holds.

    Attributes:
        entries: in their order, folders too.
        files: the others, by their paths.
        start: where the directory begins.
        comment: of the archive.
    """

    entries: list[Entry]
    files: dict[str, Entry]
    start: int
    comment: bytes


def read_directory(data: bytes, limits: Limits) -> Directory:
    """Read the directory of an archive, and unpack nothing.

    Raises:
        InputError: it is damaged, or has an entry that is encrypted, is no plain file, lies outside
            the archive's folder, or shares its name or bytes with another.
        LimitError: there are more entries, or their contents are larger, than ``limits`` accept.
    """
    count, start, end, comment = _end_of(data)
    limits.check("archive_files", count, "files in the archive")
    entries: list[Entry] = []
    files: dict[str, Entry] = {}
    at = start
    for _ in range(count):
        entry, at = _entry(data, at, end)
        entries.append(entry)
        if entry.is_file and files.setdefault(entry.name, entry) is not entry:
            raise _damaged(f"two files are called '{entry.name[:200]}'", entry.at)
    if at != end:
        raise _damaged("the directory has more files than the archive says", at)
    total = sum(entry.size for entry in entries)
    limits.check("file_bytes", total, "bytes in the archive, unpacked")
    if total > _SMALL:
        limits.check("archive_ratio", -(-total // len(data)), "times its size, unpacked,")
    # Entries that share bytes multiply them without end.
    spans = sorted((entry.local, entry.start + entry.packed) for entry in entries)
    for (_, one_end), (other_start, _) in pairwise([*spans, (start, end)]):
        if one_end > other_start:
            raise _damaged("two files share the same bytes", other_start)
    return Directory(entries, files, start, comment)


def content_of(data: bytes, entry: Entry) -> bytes:
    """Unpack a file of an archive.

    Raises:
        InputError: it is damaged, or larger than it says.
    """
    called = f"'{entry.name[:200]}' in the archive"
    packed = data[entry.start : entry.start + entry.packed]
    if entry.method == STORED:
        content, whole = packed, True
    else:
        inflating = zlib.decompressobj(-zlib.MAX_WBITS)
        try:
            content = inflating.decompress(packed, entry.size + 1)
        except zlib.error as error:
            raise InputError(f"{called} cannot be unpacked: {error}") from None
        whole = inflating.eof
    if len(content) != entry.size or not whole:
        found = f"{len(content):,}{'' if whole else ' or more'}"
        raise InputError(f"{called} unpacks to {found} bytes, not to {entry.size:,} as it says")
    if zlib.crc32(content) != entry.crc:
        raise InputError(f"{called} is damaged: it has another checksum than the archive says")
    return content


def _end_of(data: bytes) -> tuple[int, int, int, bytes]:
    """Number of entries, start and end of the directory, the archive's comment."""
    at = data.rfind(_END_MARK, max(0, len(data) - END.size - _FULL16))
    if at < 0 or at + END.size > len(data):
        raise InputError("the archive was cut short: it has no directory at its end")
    _, disk, first, here, count, size, offset, length = END.unpack_from(data, at)
    comment = data[at + END.size : at + END.size + length]
    end = at
    if _FULL16 in (disk, first, here, count) or _FULL32 in (size, offset):
        disk, first, here, count, size, offset, end = _end64_of(data, at)
    if disk or first or here != count:
        raise InputError("the archive is one of several parts; expected a whole one")
    start = end - size
    if start != offset or count * ENTRY.size > size:
        raise _damaged("the directory is not where the archive says", at)
    return count, start, end, comment


def _end64_of(data: bytes, before: int) -> tuple[int, int, int, int, int, int, int]:
    at = before - _LOCATOR.size
    if at < 0 or data[at : at + 4] != _LOCATOR_MARK:
        raise _damaged("the archive says that its directory is a ZIP64 one, and has none", before)
    at -= _END64.size
    if at < 0 or data[at : at + 4] != _END64_MARK:
        raise _damaged("the ZIP64 directory is not where the archive says", before)
    _, _, _, _, disk, first, here, count, size, offset = _END64.unpack_from(data, at)
    return disk, first, here, count, size, offset, at


def _entry(data: bytes, at: int, end: int) -> tuple[Entry, int]:
    """An entry, and where the next begins."""
    if at + ENTRY.size > end or data[at : at + 4] != _ENTRY_MARK:
        raise _damaged("the directory has fewer files than the archive says", at)
    fields = ENTRY.unpack_from(data, at)
    flags, method, crc, packed, size = (fields[i] for i in (3, 4, 7, 8, 9))
    lengths, external, local = fields[10:13], fields[15], fields[16]
    name_end = at + ENTRY.size + lengths[0]
    following = name_end + lengths[1] + lengths[2]
    if following > end:
        raise _damaged("a file's name does not end within the directory", at)
    raw = data[at + ENTRY.size : name_end]
    extra = data[name_end : name_end + lengths[1]]
    size, packed, local = _wide(extra, size, packed, local)
    text = _text(raw, flags, extra)
    name, is_file = _path(text, at)
    if flags & _ENCRYPTED:
        raise InputError(f"'{name[:200]}' in the archive is encrypted; expected it readable")
    kind = stat.S_IFMT(external >> 16)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        raise InputError(f"'{name[:200]}' in the archive is a link or a device; expected files")
    is_file = is_file and kind != stat.S_IFDIR
    if is_file and method not in (STORED, DEFLATED):
        words = f"'{name[:200]}' in the archive is compressed by method {method}"
        raise InputError(f"{words}; expected stored or deflated files")
    start = _data_start(data, local, raw)
    if start + packed > end or (method == STORED and packed != size):
        raise _damaged(f"the data of '{name[:200]}' are not where the archive says", at)
    return Entry(name, is_file, at, method, crc, packed, size, local, start), following


def _data_start(data: bytes, local: int, name: bytes) -> int:
    header = data[local : local + LOCAL.size]
    if len(header) < LOCAL.size or header[:4] != _LOCAL_MARK:
        raise _damaged("a file is not where the archive says", local)
    *_, name_length, extra_length = LOCAL.unpack(header)
    if data[local + LOCAL.size : local + LOCAL.size + name_length] != name:
        raise _damaged("a file and the directory have different names for it", local)
    return local + LOCAL.size + int(name_length) + int(extra_length)


def _wide(extra: bytes, size: int, packed: int, local: int) -> tuple[int, int, int]:
    """The numbers that do not fit the record, as the ZIP64 field has them (section 4.5.3)."""
    field = next((body for tag, body in extra_fields(extra) if tag == ZIP64_EXTRA), b"")
    values = [size, packed, local]
    wanted = [i for i, value in enumerate(values) if value == _FULL32]
    for place, i in enumerate(wanted):
        if len(field) >= 8 * (place + 1):
            values[i] = int.from_bytes(field[8 * place : 8 * place + 8], "little")
    return values[0], values[1], values[2]


def extra_fields(extra: bytes) -> Iterator[tuple[int, bytes]]:
    """The extra fields of an entry: what each is, and what it says."""
    at = 0
    while at + 4 <= len(extra):
        tag, length = struct.unpack_from("<2H", extra, at)
        yield tag, extra[at + 4 : at + 4 + length]
        at += 4 + length


def _text(raw: bytes, flags: int, extra: bytes) -> str:
    """A name as its writer meant it: many write UTF-8 and do not say so."""
    for tag, body in extra_fields(extra):
        if tag == _UNICODE_PATH_EXTRA and body[1:5] == struct.pack("<L", zlib.crc32(raw)):
            raw, flags = body[5:], flags | _UTF8
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("utf-8", "replace") if flags & _UTF8 else raw.decode("cp437")


def _path(text: str, at: int) -> tuple[str, bool]:
    """A name in one spelling, and whether it is a file's; that of the root folder is empty."""
    plain = text.replace("\\", "/")
    # A colon is one of a name here, as in "Final: notes.txt", except after the letter of a drive.
    path = inside(f"{_ROOT}/{plain.rstrip('/')}")
    below = (path or "").removeprefix(_ROOT).removeprefix("/")
    if path is None or plain.startswith("/") or ".." in plain.split("/") or _DRIVE.match(below):
        raise InputError(
            f"'{text[:200]}' in the archive is absolute or leads out of its folder",
            place=f"byte {at}",
        )
    is_file = not plain.endswith("/")
    if is_file and not below:
        raise _damaged(f"'{text[:200]}' is no name of a file", at)
    return unicodedata.normalize("NFC", below), is_file


def _damaged(words: str, at: int) -> InputError:
    return InputError(f"the archive is damaged: {words}", place=f"byte {at}")
